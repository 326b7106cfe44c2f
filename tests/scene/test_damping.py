"""Viscous friction that a scenario changes."""

import dataclasses

import pytest

from drake_affetto.common.errors import InputError
from drake_affetto.scene.damping import set_joint_damping
from drake_affetto.scene.world import get_joint
from drake_affetto.station.scenario import load_scenario
from drake_affetto.station.station import AffettoStation


def test_a_scenario_changes_the_friction_of_the_joints_that_it_names():
    scenario = load_scenario("drumming")
    usual = AffettoStation(scenario).plant
    changed = AffettoStation(
        dataclasses.replace(
            scenario, joint_damping={"right_elbow_flexion": 0.05}
        )
    ).plant
    for name in scenario.active_joints:
        damping = get_joint(changed, name).default_damping()
        if name == "right_elbow_flexion":
            assert damping == 0.05
        else:
            assert damping == get_joint(usual, name).default_damping()


def test_joints_and_values_that_cannot_be_are_named():
    plant = AffettoStation(load_scenario("drumming")).plant
    with pytest.raises(InputError, match="knee"):
        set_joint_damping(plant, {"knee": 0.1})
    with pytest.raises(InputError, match=r"joint_damping\.waist_yaw is -1"):
        set_joint_damping(plant, {"waist_yaw": -1.0})
