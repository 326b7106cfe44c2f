"""A scenario is checked against its models before anything is built of it."""

import dataclasses
import shutil

import pytest

from drake_affetto.common.errors import InputError
from drake_affetto.common.resources import models_dir
from drake_affetto.scene.world import FramePose, WorldConfig
from drake_affetto.station import model_check
from drake_affetto.station.drum_region import DrumRegion
from drake_affetto.station.model_check import check_models, check_models_once
from drake_affetto.station.scenario import Scenario, load_scenario
from drake_affetto.station.station import AffettoStation

FAULTS = {
    "yaw_joint": {"yaw_joint": "right_elbow_flexion"},
    "drum_region": {"drum_region": DrumRegion(x=[0.2, 3.0])},
    "world.frames": {"world": WorldConfig(frames={"pond": FramePose()})},
}


@pytest.mark.parametrize("field", FAULTS)
def test_a_fault_is_told_without_a_station_and_by_one(field):
    scenario = dataclasses.replace(load_scenario("drumming"), **FAULTS[field])
    with pytest.raises(InputError, match=f"^mine.*{field}"):
        check_models(scenario, "mine")
    with pytest.raises(InputError, match=field):
        AffettoStation(scenario)


def test_the_models_are_read_again_when_a_file_has_changed(
    tmp_path, monkeypatch
):
    drum = tmp_path / "drum.sdf"
    shutil.copy(models_dir() / "sdf" / "drum.sdf", drum)
    scenario = Scenario(world=WorldConfig(drum=str(drum)))
    asked = []
    monkeypatch.setattr(
        model_check, "check_models", lambda *args: asked.append(1)
    )
    for _ in range(3):
        check_models_once(scenario, "mine")
    assert len(asked) == 1
    drum.write_text(drum.read_text() + "\n")
    check_models_once(scenario, "mine")
    assert len(asked) == 2
    check_models_once(dataclasses.replace(scenario, yaw_joint="x"), "mine")
    assert len(asked) == 3
    # What no model has to fit is no reason.
    skill = dataclasses.replace(scenario.skill, alpha=0.5)
    check_models_once(dataclasses.replace(scenario, skill=skill), "mine")
    assert len(asked) == 3


def test_what_does_not_fit_is_never_taken_as_known():
    scenario = dataclasses.replace(load_scenario("drumming"), yaw_joint="knee")
    for _ in range(2):
        with pytest.raises(InputError, match="yaw_joint"):
            check_models_once(scenario, "mine")
