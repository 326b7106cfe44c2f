"""Single trials on the real station: what each leaves and depends on."""

import gc
import weakref

import numpy as np
import pytest

from drake_affetto.experiments.episode import TrialRunner
from drake_affetto.station.scenario import load_scenario

XY = np.array([0.235, -0.09])


class Constant:
    """A skill that always plays the same movement."""

    def __init__(self, theta):
        self.theta = theta

    def predict(self, X):
        return np.tile(self.theta, (len(X), 1))


@pytest.fixture(scope="module")
def runner():
    return TrialRunner(load_scenario("drumming"))


@pytest.fixture(scope="module")
def lesson(runner):
    return runner.teach(XY, seed=1)


def test_looking_centers_the_marker(runner):
    look = runner.gaze(XY, seed=0)
    assert look.found
    assert look.duration < 2.5
    x_img, _, found = runner.port("camera.blob")
    assert found == 1.0
    assert abs(x_img - 0.5) < 0.015
    y_img, yaw = look.task_parameter
    assert 0.0 < y_img < 1.0
    # The joint is where τ says, but for the noise and what still moves.
    state = runner.port("affetto.estimated_state")
    assert abs(state[2] - yaw) < np.radians(1.5)


def test_a_drum_out_of_sight_is_a_failed_trial_not_a_wrong_parameter(runner):
    look = runner.gaze(np.array([0.54, 0.34]), seed=0)
    assert not look.found
    np.testing.assert_array_equal(look.task_parameter, [0.0, 0.0])


def test_a_lesson_is_within_a_persons_strength(runner, lesson):
    teaching = runner.scenario.teaching
    assert 1.0 < lesson.max_pull <= teaching.max_force + 1e-9
    assert lesson.t[-1] == pytest.approx(teaching.duration, abs=0.011)
    assert np.all(np.diff(lesson.t) > 0)
    assert lesson.q.shape == (len(lesson.t), 8)
    assert lesson.theta.shape == (120,)
    # The arm was moved, and what was encoded is what was recorded.
    assert np.ptp(lesson.q, axis=0).max() > 0.2
    rollout = runner.dmp.rollout(lesson.theta, lesson.q[0], 0.01)
    n = min(len(rollout.q), len(lesson.q))
    error = rollout.q[:n] - lesson.q[:n]
    assert np.sqrt(np.mean(error**2)) < 0.03


def test_a_replay_sounds_and_its_miss_does_not(runner, lesson):
    taps = runner.tap_prototypes()
    hit = runner.strike(XY, lesson.theta, seed=2)
    assert hit.contact_force[:, 0].max() > 0.3
    assert runner.reward(hit, taps) > 0.15
    miss = runner.strike(XY + [0.0, 0.25], lesson.theta, seed=2)
    assert miss.contact_force[:, 0].max() == 0.0
    assert runner.reward(miss, taps) < 0.15


def test_a_trial_does_not_depend_on_the_one_before(runner, lesson):
    first = runner.strike(XY, lesson.theta, seed=3)
    runner.teach(XY + [0.02, 0.03], seed=5)
    runner.gaze(XY - [0.02, 0.03], seed=6)
    again = runner.strike(XY, lesson.theta, seed=3)
    np.testing.assert_array_equal(first.joint_state, again.joint_state)
    np.testing.assert_array_equal(first.contact_force, again.contact_force)
    np.testing.assert_array_equal(first.sound, again.sound)


def test_the_whole_chain_looks_then_drums(runner, lesson):
    look, recording = runner.drum(XY, Constant(lesson.theta), seed=4)
    assert look.found
    assert recording is not None
    # The same movement as the replay, but for what the gaze left behind.
    replay = runner.strike(XY, lesson.theta, seed=4)
    n = min(len(recording.joint_t), len(replay.joint_t))
    error = recording.joint_state[:n, :8] - replay.joint_state[:n, :8]
    assert np.degrees(np.abs(error)).max() < 5.0
    assert recording.contact_force[:, 0].max() > 0.3


def test_a_runner_goes_with_its_last_reference():
    """With the contexts that it has kept."""
    one = TrialRunner(load_scenario("drumming"))
    one.look(np.array([0.235, -0.09]), 1)
    left = [weakref.ref(each) for each in (one, one.station, one.diagram)]
    del one
    gc.collect()
    assert [each() for each in left] == [None] * 3
