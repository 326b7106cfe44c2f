"""Scatter, lag and depth of replays, the robot's variation on and off."""

import numpy as np
import pytest

from drake_affetto.experiments.episode import TrialRunner
from drake_affetto.experiments.repeatability import (
    best_lag,
    measure_repeatability,
    replay_depth,
)
from drake_affetto.station.scenario import load_scenario

XY = np.array([0.25, -0.1])


@pytest.fixture(scope="module")
def trials():
    return TrialRunner(load_scenario("drumming"))


@pytest.fixture(scope="module")
def repeated(trials):
    theta = trials.teach(XY, 3).theta
    return measure_repeatability(trials, XY, theta, range(20))


def test_lag_is_the_shift_of_a_shifted_course():
    t = 0.01 * np.arange(400)
    late = np.sin(2.0 * (t - 0.23))
    assert best_lag(t, np.sin(2.0 * t), late[None]) == pytest.approx(0.23)


def test_repeats_scatter_as_a_real_robots_do(repeated):
    scatter = dict(zip(repeated.joints, 100.0 * repeated.scatter, strict=True))
    # The real robot's joints have 0.5 to 1.5 %. Here the yaw, which hardly
    # moves in a stroke, sticks and repeats better than that; the elevation, of
    # a short range and with the whole arm on it, worse.
    assert 0.03 < scatter.pop("waist_yaw") < 0.5
    assert 0.5 < scatter.pop("right_shoulder_elevation") < 3.0
    assert 0.35 < min(scatter.values()) < max(scatter.values()) < 1.6
    assert np.median(list(scatter.values())) > 0.5


def test_without_variation_a_command_gives_one_movement():
    scenario = load_scenario("drumming")
    scenario.variation.enabled = False
    trials = TrialRunner(scenario)
    theta = trials.teach(XY, 3).theta
    result = measure_repeatability(trials, XY, theta, range(2))
    assert not result.scatter.any()


def test_same_seed_gives_the_same_movement(trials):
    theta = np.zeros(trials.station.num_joints * trials.dmp.n_basis)
    one, again, other = (trials.strike(XY, theta, s) for s in (5, 5, 6))
    np.testing.assert_array_equal(one.true_state, again.true_state)
    assert np.abs(one.true_state - other.true_state).max() > 1e-4


def test_palm_path_starts_where_the_palm_is(trials):
    theta = np.zeros(trials.station.num_joints * trials.dmp.n_basis)
    recording = trials.strike(XY, theta, 0)
    plant = trials.station.plant
    context = plant.GetMyContextFromRoot(trials.context)
    p_W = plant.GetFrameByName("right_palm").CalcPoseInWorld(context)
    np.testing.assert_allclose(
        trials.palm_path(recording.true_state[-1:])[0],
        p_W.translation(),
        atol=1e-3,
    )


def test_free_replays_go_as_deep_as_the_taught_path(trials):
    places = [
        (0.21, -0.2),
        (0.21, -0.02),
        (0.26, -0.14),
        (0.31, -0.02),
        (0.34, 0.02),
    ]
    depths = [replay_depth(trials, xy, k) for k, xy in enumerate(places)]
    assert np.median(np.abs(depths)) < 0.005
    # 10 mm are wanted; over the whole region up to 16 mm were measured.
    assert np.abs(depths).max() < 0.016
