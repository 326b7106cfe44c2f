"""The study of the plant's step: its differences, and one real pair."""

import numpy as np
import pytest

from drake_affetto.common.errors import InputError
from drake_affetto.experiments.step_convergence import (
    Arrival,
    StepOutcome,
    difference,
    run_step_convergence,
    run_step_trial,
)
from drake_affetto.experiments.trials import scenario_entry
from drake_affetto.runner import InProcessExecutor, TrialExecutor, TrialStore


def outcome(reward=0.5, time=0.6, x=0.2, force=3.0, pressure=3e5):
    return StepOutcome(
        reward=reward,
        success=reward > 0.15,
        arrival=None if time is None else Arrival(time, [x, 0.0]),
        peak_force=force,
        pressure=[pressure, pressure],
        tracking=0.01,
    )


def test_the_same_outcomes_do_not_differ():
    outcomes = [outcome(), outcome(reward=0.1, time=None, force=0.0)]
    found = difference(0.001, outcomes, outcomes)
    assert found.agreement == 1.0
    assert (found.trials, found.hits) == (2, 1)
    for name in ("time", "place", "peak_force", "pressure", "reward"):
        assert getattr(found, name) == (0.0, 0.0), name


def test_differences_are_those_of_their_quantities():
    reference = [outcome() for _ in range(5)]
    moved = [
        outcome(0.5 - 0.1 * k, 0.6 + 0.001 * k, 0.2 + 0.002 * k, 3 + 0.3 * k)
        for k in range(5)
    ]
    found = difference(0.001, moved, reference)
    assert found.agreement == pytest.approx(0.8)
    assert found.reward[0] == pytest.approx(0.2)
    assert found.time[0] == pytest.approx(0.002)
    assert found.place[0] == pytest.approx(0.004)
    assert found.peak_force[0] == pytest.approx(0.2)
    assert found.time[0] < found.time[1] < 0.004


def test_a_hit_against_a_miss_counts_for_the_judgment_alone():
    found = difference(
        0.001,
        [outcome(), outcome(0.01, None, force=0.0)],
        [outcome(), outcome()],
    )
    assert found.agreement == 0.5
    assert found.time == found.peak_force == (0.0, 0.0)
    nothing = difference(0.001, [outcome(time=None)], [outcome()])
    assert np.isnan(nothing.time[0])


def test_all_steps_play_the_same_movements(tmp_path):
    """Two real strikes at two steps, judged the same and close together."""
    asked = []

    def remember(spec):
        asked.append(spec)
        return run_step_trial(spec)

    with (
        TrialStore(tmp_path / "trials.sqlite") as store,
        TrialExecutor(
            remember, store, executor=InProcessExecutor(), quiet=True
        ) as executor,
    ):
        (found,) = run_step_convergence(executor, [0.005, 0.0025], trials=2)
        strikes = [s for s in asked if s["kind"] == "strike"]
        # Nothing is run twice.
        run_step_convergence(executor, [0.005, 0.0025], trials=2)
        assert len(asked) == 12 + 4
    assert {s["time_step"] for s in strikes} == {0.005, 0.0025}
    coarse, fine = (
        [s for s in strikes if s["time_step"] == step]
        for step in (0.005, 0.0025)
    )
    for a, b in zip(coarse, fine, strict=True):
        np.testing.assert_array_equal(a["theta"], b["theta"])
        assert (a["xy"], a["seed"]) == (b["xy"], b["seed"])
    assert not np.array_equal(coarse[0]["theta"], coarse[1]["theta"])
    # The step has an effect, and a small one.
    assert 0.0 < found.tracking[0] < np.radians(0.1)
    assert 0.0 < found.pressure[0] < 2e3


def test_a_step_that_is_too_long_is_refused(tmp_path):
    spec = {
        "kind": "strike",
        "scenario": scenario_entry("drumming"),
        "time_step": 0.01,
        "xy": [0.2, -0.1],
        "seed": 0,
    }
    with pytest.raises(InputError, match=r"time_step is 0\.01.* to 0\.005"):
        run_step_trial(spec)
