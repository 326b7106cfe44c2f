"""The plan of a tuning study."""

from drake_affetto.station.scenario import load_scenario
from drake_affetto.tuning.plan import GAINS, load_plan, parameter_names


def test_without_joints_all_active_ones_are_tuned():
    joints = load_scenario("drumming").active_joints
    assert load_plan(None).joints == tuple(joints)
    # In the order of the scenario, however they were named.
    few = [joints[3], joints[0]]
    assert load_plan(few).joints == (joints[0], joints[3])
    assert load_plan(few) == load_plan(few[::-1])


def test_parameters_are_named_joint_by_joint():
    names = parameter_names(["a", "b"])
    assert names == [f"{joint}.{gain}" for joint in "ab" for gain in GAINS]
