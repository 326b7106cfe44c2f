"""A file, those that it names, and those that these name."""

import pytest

from drake_affetto.common.errors import InputError
from drake_affetto.common.named_files import named_files


def names(*paths):
    return [path.name for path, _ in named_files(paths)]


def test_files_are_followed_to_the_last(tmp_path):
    for name, text in (
        ("scene.dmd.yaml", "directives:\n- add_model:\n    file: robot.urdf\n"),
        ("robot.urdf", '<mesh filename="meshes/arm.obj"/>'),
        ("drum.sdf", "<uri> meshes/arm.obj </uri><uri>meshes/a.gltf</uri>"),
        ("meshes/arm.obj", "mtllib arm.mtl\nv 0 0 0\n"),
        ("meshes/arm.mtl", "newmtl a\nmap_Kd -s 1 1 1 skin.png\n"),
        ("meshes/skin.png", "pixels"),
        ("meshes/a.gltf", '{"buffers": [{"uri": "a.bin"}]}'),
        ("meshes/a.bin", "numbers"),
        ("meshes/unused.obj", "v 1 1 1"),
    ):
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_text(text)
    assert names(tmp_path / "scene.dmd.yaml", tmp_path / "drum.sdf") == [
        "scene.dmd.yaml",
        "drum.sdf",
        "robot.urdf",
        "arm.obj",
        "a.gltf",
        "arm.mtl",
        "a.bin",
        "skin.png",
    ]


def test_the_packages_own_models_are_followed():
    found = names("package://drake_affetto/scenes/drumming.dmd.yaml")
    assert {"affetto.sdf", "table.sdf", "room.sdf", "right_hand.obj"} < set(
        found
    )
    assert len(found) == len(set(found))


def test_names_that_lead_nowhere_are_left_to_who_parses(tmp_path):
    model = tmp_path / "a.sdf"
    model.write_text("<uri>model://other/b.sdf</uri><uri>none.obj</uri>")
    assert names(model) == ["a.sdf"]
    with pytest.raises(InputError, match="no such file"):
        names(tmp_path / "none.sdf")


def test_files_that_name_each_other_end(tmp_path):
    (tmp_path / "a.sdf").write_text("<uri>b.sdf</uri>")
    (tmp_path / "b.sdf").write_text("<uri>a.sdf</uri>")
    assert names(tmp_path / "a.sdf") == ["a.sdf", "b.sdf"]
