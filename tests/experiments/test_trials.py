"""Kinds of trial: one look and many strikes stand for whole trials."""

import numpy as np
import pytest

from drake_affetto.common.errors import InputError
from drake_affetto.experiments import trials as tasks
from drake_affetto.experiments.episode import TrialRunner
from drake_affetto.runner.store import trial_key
from drake_affetto.station.scenario import load_scenario
from support import fake_world

XY = [0.235, -0.09]


class Constant:
    """A skill that always plays the same movement."""

    def __init__(self, theta):
        self.theta = theta

    def predict(self, X):
        return np.tile(self.theta, (len(X), 1))


@pytest.fixture(scope="module", autouse=True)
def runner():
    made = TrialRunner(load_scenario("drumming"))
    tasks.set_runner("drumming", made)
    yield made
    tasks._RUNNERS.clear()


@pytest.fixture(scope="module")
def lesson():
    return tasks.run_task(tasks.demonstration("drumming", XY, 1))


def test_a_look_and_a_strike_are_what_the_whole_chain_is(runner, lesson):
    result, arrays = lesson
    assert result["success"]
    # Not the lesson's own: a strike repeats just what that sounded like.
    prototypes = runner.taps()
    whole, _ = tasks.run_task(
        tasks.drumming("drumming", XY, 4, Constant(arrays["theta"]), prototypes)
    )
    seen, _ = tasks.run_task(tasks.look("drumming", XY, 4))
    assert seen["found"]
    assert seen["tau"] == whole["tau"]
    struck, more = tasks.run_task(
        tasks.strike("drumming", XY, 4, arrays["theta"], prototypes)
    )
    # But for what the turn of the gaze has left behind in the body.
    assert struck["success"] == whole["success"]
    assert struck["reward"] == pytest.approx(whole["reward"], abs=0.1)
    assert struck["impulse"] == pytest.approx(whole["impulse"], rel=0.15)
    course = more["reward_over_time"]
    assert course.max() == pytest.approx(struck["reward"], abs=1e-4)


def test_variability_reaches_the_teacher(lesson):
    _, arrays = lesson
    same, other = (
        tasks.run_task(tasks.demonstration("drumming", XY, 1, factor))[1]
        for factor in (1.0, 0.0)
    )
    np.testing.assert_array_equal(same["theta"], arrays["theta"])
    assert np.abs(other["theta"] - arrays["theta"]).max() > 0.1


def test_what_is_no_trial_is_an_error():
    with pytest.raises(InputError, match="'dance'"):
        tasks.run_task({"kind": "dance"})


def test_seeds_differ_and_stay():
    seeds = {
        tasks.trial_seed(a, b, c)
        for a in range(6)
        for b in range(6)
        for c in range(6)
    }
    assert len(seeds) == 216
    assert all(0 <= seed < 2**31 for seed in seeds)
    assert tasks.trial_seed(3, 1, 4) == tasks.trial_seed(3, 1, 4)


def test_a_smaller_workspace_lies_in_the_middle():
    scenario = load_scenario("drumming")
    whole, half = (
        tasks.draw_positions(scenario, 64, np.random.default_rng(0), share)
        for share in (1.0, 0.5)
    )
    middle = np.array([scenario.drum_region.x, scenario.drum_region.y]).mean(1)
    np.testing.assert_allclose(half - middle, 0.5 * (whole - middle))


def test_the_fake_world_offers_what_the_real_one_does(lesson):
    """What studies are planned with in tests has the true results' fields."""
    real, arrays = lesson
    fake, fakes = fake_world.run(tasks.demonstration("drumming", XY, 1))
    assert set(fake) == set(real)
    assert set(fakes) == set(arrays)
    spec = tasks.look("drumming", XY, 2)
    assert set(fake_world.run(spec)[0]) == set(tasks.run_task(spec)[0])
    spec = tasks.strike(
        "drumming", XY, 2, arrays["theta"], arrays["prototype"][None]
    )
    for ours, theirs in zip(
        fake_world.run(spec), tasks.run_task(spec), strict=True
    ):
        assert set(ours) == set(theirs)


def test_a_trial_is_known_by_all_that_determines_it(tmp_path):
    """By the content of the files that a scenario names, for instance."""
    gains = tmp_path / "gains.yaml"
    mine = tmp_path / "mine.yaml"

    def key(scenario, overlay):
        tasks._fingerprint.cache_clear()
        gains.write_text(f"gains: {{waist_yaw: {overlay}}}\n")
        mine.write_text(f"extends: drumming\n{scenario}\n")
        return trial_key(tasks.look(str(mine), XY, 1))

    control = f"control: {{overlays: [{gains}]}}"
    one = "{kP: 1.0e+6, kI: 1.0e+5, kD: 1.0e+4, kF: 4.0e-6}"
    two = "{kP: 2.0e+6, kI: 1.0e+5, kD: 1.0e+4, kF: 4.0e-6}"
    first = key(control, one)
    assert key(control, one) == first
    assert key(control, two) != first
    assert key(f"{control}\ngaze: {{tolerance: 0.02}}", one) != first
    # How a skill is learned is no part of a trial: it is given the outcome.
    learning = "skill: {n_hidden: 30}\ntransfer: {mapping: similarity}"
    assert key(f"{control}\n{learning}", one) == first
    tasks._fingerprint.cache_clear()
