"""Frames and bodies are found by their scoped names, or named in an error."""

import pytest

from drake_affetto.common.errors import InputError
from drake_affetto.scene.parts import find_body, find_frame


def test_a_frame_is_found_with_and_without_its_model(scene):
    for name in ("affetto::eye_camera", "eye_camera"):
        assert find_frame(scene.plant, name).name() == "eye_camera"
    assert find_body(scene.plant, "table::table_top").name() == "table_top"


@pytest.mark.parametrize(
    "name", ["nose", "affetto::nose", "cat::nose", "", "::"]
)
def test_a_frame_that_is_not_there_is_named_with_its_field(scene, name):
    with pytest.raises(InputError) as caught:
        find_frame(scene.plant, name, "camera.frame")
    assert str(caught.value).startswith(
        f"camera.frame is {name!r}, expected one"
    )
    with pytest.raises(InputError, match=r"part is .*expected a body"):
        find_body(scene.plant, name, "part")


def test_a_name_that_several_models_have_is_refused(scene):
    # Each model has a frame for itself.
    with pytest.raises(InputError, match="'__model__', expected one frame"):
        find_frame(scene.plant, "__model__")
