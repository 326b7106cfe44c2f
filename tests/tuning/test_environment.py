"""The robot under its default and its hand-tuned gains."""

import numpy as np
import pytest

from drake_affetto.control.pidf import load_control
from drake_affetto.station.scenario import load_scenario
from drake_affetto.tuning.config import REST, TRAINING
from drake_affetto.tuning.costs import rest_std
from drake_affetto.tuning.environment import environment
from drake_affetto.tuning.plan import START_FILE, load_plan


@pytest.mark.slow
def test_the_default_gains_beat_the_hand_tuned_ones_and_rest():
    plan = load_plan(None)
    robot = environment(plan)
    reference = robot.reference(TRAINING)
    tuned, start = (
        control.for_joints(robot.names)
        for control in (load_control(), load_control(START_FILE))
    )
    after, before = (
        robot.costs(reference, robot.rollout(reference, gains))
        for gains in (tuned, start)
    )
    assert after.mean() < 0.7 * before.mean()
    # Both joints of the elbow trade a little of it for less effort.
    assert np.sum(after.tracking < before.tracking) >= 6
    assert after.tracking.mean() < 0.7 * before.tracking.mean()
    # No limit cycle in any of several postures.
    rest = robot.reference(REST)
    q = robot.rollout(rest, tuned).q
    swing = rest_std(q, rest.rest, robot.tuning.sample_rate) / robot.span
    assert np.all(swing < 0.005)


def test_the_tuned_gains_are_the_default():
    """The study's start is not what the robot runs with."""
    joints = load_scenario("drumming").active_joints
    tuned = load_control().for_joints(joints).to_array()
    start = load_control(START_FILE).for_joints(joints).to_array()
    assert np.all(np.any(tuned != start, axis=0))
