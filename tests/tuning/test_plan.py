"""The plan of a tuning study."""

import pytest

from drake_affetto.common.errors import InputError
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


@pytest.mark.parametrize(
    ("excursion", "told"),
    [
        ("knee: [0.0, 1.0]", "excursions.knee is .*expected one of the active"),
        ("neck_yaw: [0.0, 1.0]", "excursions.neck_yaw is .*of the active"),
        ("waist_yaw: [0.0, 5.0]", "excursions.waist_yaw is .*the limits"),
        ("waist_yaw: [0.2, 0.3]", "excursions.waist_yaw is .*start posture"),
    ],
)
def test_excursions_of_other_joints_are_refused_with_the_plan(
    tmp_path, excursion, told
):
    path = tmp_path / "mine.yaml"
    path.write_text(f"excursions: {{{excursion}}}")
    with pytest.raises(InputError, match=told) as caught:
        load_plan(None, tuning=str(path))
    assert "mine.yaml" in str(caught.value)
