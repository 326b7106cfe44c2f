"""The world in a browser, without a browser."""

import time

from pydrake.geometry import Meshcat, MeshcatParams
import pytest

from drake_affetto.common.errors import InputError
from drake_affetto.scene.view import view_model
from drake_affetto.scene.world import WorldConfig


@pytest.fixture(scope="module")
def meshcat():
    return Meshcat(MeshcatParams(host="localhost", port=None))


def test_it_shows_the_world_once_and_tells_where(meshcat, capsys):
    posture = {"neck_yaw": 0.72}
    left = view_model(
        WorldConfig(default_posture=posture),
        meshcat=meshcat,
        loop_once=True,
        frames=True,
    )
    assert meshcat.web_url() in capsys.readouterr().out
    assert left["neck_yaw"] == pytest.approx(0.72, abs=0.01)
    assert len(left) == 22
    for path in ("visual/affetto/chest", "visual/drum/head", "visual/mirror"):
        assert meshcat.HasPath(path)
    assert meshcat.HasPath("collision/affetto/right_hand")
    # The controls are gone with it.
    assert meshcat.GetSliderNames() == []


def test_it_ends_when_its_time_is_up(meshcat):
    begin = time.monotonic()
    view_model(WorldConfig(), meshcat=meshcat, time_limit=0.2)
    assert 0.2 <= time.monotonic() - begin < 10


def test_bad_settings_are_told_before_anything_is_shown():
    with pytest.raises(InputError, match="time limit is -1"):
        view_model(WorldConfig(), time_limit=-1.0)
    with pytest.raises(InputError, match="no joint 'tail'"):
        view_model(WorldConfig(default_posture={"tail": 0.0}))
