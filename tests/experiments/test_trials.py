"""Kinds of trial: one look and many strikes stand for whole trials."""

import weakref

import numpy as np
import pytest

from drake_affetto.common.errors import InputError
from drake_affetto.experiments import trials
from drake_affetto.experiments.recordings import GazeOutcome
from drake_affetto.experiments.results import trial as results
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
    yield trials.runner("drumming")
    trials._RUNNERS.clear()


@pytest.fixture(scope="module")
def demonstration():
    return trials.run_task(trials.demonstration("drumming", XY, 1))


def test_a_look_and_a_strike_are_what_the_whole_chain_is(runner, demonstration):
    result, arrays = demonstration
    assert result["success"]
    # Not the demonstration's own: a strike repeats just what that sounded like.
    prototypes = runner.tap_prototypes()
    whole, _ = trials.run_task(
        trials.drumming(
            "drumming", XY, 4, Constant(arrays["theta"]), prototypes
        )
    )
    seen, _ = trials.run_task(trials.look("drumming", XY, 4))
    assert seen["found"]
    assert seen["tau"] == whole["tau"]
    struck, more = trials.run_task(
        trials.strike("drumming", XY, 4, arrays["theta"], prototypes)
    )
    # But for what the turn of the gaze has left behind in the body.
    assert struck["success"] == whole["success"]
    assert struck["reward"] == pytest.approx(whole["reward"], abs=0.1)
    assert struck["impulse"] == pytest.approx(whole["impulse"], rel=0.15)
    trace = more["reward_over_time"]
    assert trace.max() == pytest.approx(struck["reward"], abs=1e-4)


def test_variability_reaches_the_teacher(demonstration):
    _, arrays = demonstration
    same, other = (
        trials.run_task(trials.demonstration("drumming", XY, 1, factor))[1]
        for factor in (1.0, 0.0)
    )
    np.testing.assert_array_equal(same["theta"], arrays["theta"])
    assert np.abs(other["theta"] - arrays["theta"]).max() > 0.1


def test_what_is_no_trial_is_an_error():
    with pytest.raises(InputError, match="'dance'"):
        trials.run_task({"kind": "dance"})


def test_seeds_differ_and_stay():
    seeds = {
        trials.trial_seed(a, b, c)
        for a in range(6)
        for b in range(6)
        for c in range(6)
    }
    assert len(seeds) == 216
    assert all(0 <= seed < 2**31 for seed in seeds)
    assert trials.trial_seed(3, 1, 4) == trials.trial_seed(3, 1, 4)


def test_a_smaller_workspace_lies_in_the_middle():
    scenario = load_scenario("drumming")
    whole, half = (
        trials.draw_positions(scenario, 64, np.random.default_rng(0), share)
        for share in (1.0, 0.5)
    )
    middle = scenario.drum_region.middle
    np.testing.assert_allclose(half - middle, 0.5 * (whole - middle))


def test_the_fake_world_offers_what_the_real_one_does(demonstration):
    """What studies are planned with in tests has the true results' fields."""
    real, arrays = demonstration
    fake, fakes = fake_world.run(trials.demonstration("drumming", XY, 1))
    assert set(fake) == set(real)
    assert set(fakes) == set(arrays)
    spec = trials.look("drumming", XY, 2)
    assert set(fake_world.run(spec)[0]) == set(trials.run_task(spec)[0])
    spec = trials.strike(
        "drumming", XY, 2, arrays["theta"], arrays["prototype"][None]
    )
    for ours, theirs in zip(
        fake_world.run(spec), trials.run_task(spec), strict=True
    ):
        assert set(ours) == set(theirs)


def test_a_trial_is_known_by_all_that_determines_it(tmp_path):
    """By the content of the files that a scenario names, for instance."""
    gains = tmp_path / "gains.yaml"
    mine = tmp_path / "mine.yaml"

    def key(scenario, overlay):
        gains.write_text(f"gains: {{waist_yaw: {overlay}}}\n")
        mine.write_text(f"extends: drumming\n{scenario}\n")
        return trial_key(trials.look(str(mine), XY, 1))

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


def test_a_trial_has_one_key_from_wherever_it_is_asked_for(
    tmp_path, monkeypatch
):
    (tmp_path / "c.yaml").write_text("extends: drumming\n")
    (tmp_path / "below").mkdir()
    (tmp_path / "link.yaml").symlink_to("c.yaml")
    keys = set()
    for folder, name in (
        (".", "c.yaml"),
        (".", "./c.yaml"),
        (".", str(tmp_path / "c.yaml")),
        (".", "link.yaml"),
        ("below", "../c.yaml"),
    ):
        monkeypatch.chdir(tmp_path / folder)
        keys.add(trial_key(trials.look(name, XY, 1)))
    # It is the package's own scenario, and one content is one trial.
    keys.add(trial_key(trials.look("drumming", XY, 1)))
    assert len(keys) == 1


def test_a_living_process_does_not_keep_what_a_file_held_before(
    tmp_path, monkeypatch
):
    """Neither a notebook's runner nor that of a Dask worker."""
    built = []

    class Runner:
        def __init__(self, scenario):
            built.append(scenario.settling_duration)

        def place_mirror(self, pose):
            assert pose is None

        def look(self, xy, seed):
            return GazeOutcome(True, np.zeros(2), built[-1])

    monkeypatch.setattr(trials, "TrialRunner", Runner)
    mine = tmp_path / "mine.yaml"

    def write(duration):
        mine.write_text(f"extends: drumming\nsettling_duration: {duration}\n")

    write(1.25)
    first = trials.look(str(mine), XY, 1)
    assert trials.run_trial(first).duration == 1.25
    assert trials.run_trial(first).duration == 1.25
    assert built == [1.25]
    write(1.5)
    second = trials.look(str(mine), XY, 1)
    assert trial_key(first) != trial_key(second)
    # A task in flight still gets what it was planned with ...
    assert trials.run_trial(first).duration == 1.25
    # ... the new one what is there now ...
    assert trials.run_trial(second).duration == 1.5
    assert built == [1.25, 1.5]
    # ... and a worker that has never had the first content says so.
    with pytest.raises(InputError, match=r"not the one .* other values"):
        trials.run_trial(first)
    mine.unlink()
    assert trials.run_trial(second).duration == 1.5
    third = dict(second, scenario=dict(second["scenario"], values="0" * 16))
    with pytest.raises(InputError, match="no such scenario file"):
        trials.run_trial(third)


def test_a_scenario_that_changes_while_it_is_read_gives_no_trial(
    tmp_path, monkeypatch
):
    mine = tmp_path / "mine.yaml"
    mine.write_text("extends: drumming\n")

    def edited(scenario):
        mine.write_text("extends: drumming\nsettling_duration: 1.5\n")
        return "built of nobody knows what"

    monkeypatch.setattr(trials, "TrialRunner", edited)
    spec = trials.look(str(mine), XY, 1)
    monkeypatch.setattr(trials, "_RUNNERS", {})
    with pytest.raises(InputError, match="not the one of the trial"):
        trials.run_trial(spec)
    assert trials._RUNNERS == {}


def test_a_study_of_many_bodies_keeps_few_runners(tmp_path, monkeypatch):
    """Not one more while another is built: each has its renderers."""
    alive: weakref.WeakSet = weakref.WeakSet()
    counts = []

    class Runner:
        def __init__(self, scenario):
            alive.add(self)
            counts.append(len(alive))

    monkeypatch.setattr(trials, "TrialRunner", Runner)
    monkeypatch.setattr(trials, "_RUNNERS", {})
    for number in range(8):
        path = tmp_path / f"body_{number}.yaml"
        path.write_text(f"extends: drumming\nsettling_duration: 1.{number}\n")
        assert trials.runner(str(path)) is trials.runner(str(path))
    assert len(counts) == 8
    assert max(counts) == trials.MOST_RUNNERS


def test_runners_can_be_handed_in():
    """For trials that are watched, for instance."""

    class Watched:
        def place_mirror(self, pose):
            assert pose is None

        def look(self, xy, seed):
            return GazeOutcome(True, np.array([0.25, seed]), 1.5)

    found = trials.run_trial(
        trials.look("drumming", XY, 3), {"drumming": Watched()}
    )
    assert found == results.GazeResult(True, [0.25, 3.0], 1.5)


def test_positions_fill_the_region_and_depend_on_the_seed():
    scenario = load_scenario("drumming")
    region = scenario.drum_region
    for count in (1, 5, 12):
        first = trials.draw_positions(scenario, count, np.random.default_rng(1))
        assert first.shape == (count, 2)
        assert np.all(region.contains(first))
        again = trials.draw_positions(scenario, count, np.random.default_rng(1))
        np.testing.assert_array_equal(first, again)
        other = trials.draw_positions(scenario, count, np.random.default_rng(2))
        assert not np.array_equal(first, other)
    # Spread: each quarter about the middle has some of 12.
    cells = (first > region.middle) @ [1, 2]
    assert set(cells.tolist()) == {0, 1, 2, 3}
