"""Prediction intervals, on invented robots whose truth is known."""

import dataclasses

import numpy as np
import pytest

from drake_affetto.common.errors import InputError
from drake_affetto.identification import bands
from drake_affetto.identification.bands import (
    CONFIDENCE,
    Band,
    calibrate_bands,
    calibrate_loop,
    fit_members,
    further_quantile,
)
from drake_affetto.identification.fit import FitState
from drake_affetto.identification.prediction import predict
from drake_affetto.identification.simulator import JointSimulator, Simulated
from support.robot_bench import make_log


def test_a_further_quantile_stays_below_as_often_as_is_said():
    rng = np.random.default_rng(0)
    below = []
    for _ in range(4000):
        draws = np.exp(rng.normal(0.3, 0.4, (7, 3)))
        below.append(draws[6] <= further_quantile(draws[:6]))
    assert np.mean(below) == pytest.approx(CONFIDENCE, abs=0.02)


def course(log, q):
    """A simulation that is `log` but for its angle."""
    return Simulated(log.t, q, log.p_a, log.p_b, log.c_a, log.c_b)


def invented(log, rng, number, members):
    """A log, and predictions of it by members that all are a little wrong.

    Errors are larger where the members differ more: in the log's second half.
    """
    level = np.where(log.t > 0.5 * log.t[-1], 4.0, 0.5)
    truth = 50.0 + 20.0 * np.sin(log.t + number)
    measured = truth + level * rng.standard_normal()
    measured += 0.2 * level * rng.standard_normal(log.t.size)
    own = dataclasses.replace(log, name=f"log_{number}", q=measured)
    return own, {
        f"log_{k}": course(own, truth + 0.45 * level * rng.standard_normal())
        for k in range(members)
    }


def test_bands_cover_what_was_not_seen_and_are_wide_where_it_is_doubtful(log):
    rng = np.random.default_rng(1)
    shares, widths = [], []
    for _ in range(40):
        pairs = [invented(log, rng, k, 6) for k in range(6)]
        scale = calibrate_loop(
            [each for each, _ in pairs],
            {each.name: members for each, members in pairs},
        )
        fresh, members = invented(log, rng, 9, 6)
        band = scale.band(members["log_0"], list(members.values()))
        shares.append(band.coverage(fresh)[0])
        width = (band.upper - band.lower)[:, 0]
        widths.append(width[-1] / width[35])
    assert 0.9 < np.mean(shares) < 1.0
    assert np.median(widths) > 2.0


def test_an_exact_model_gives_a_narrow_band(log):
    own = dataclasses.replace(log, name="a")
    other = dataclasses.replace(log, name="b")
    exact = {"a": course(log, log.q), "b": course(log, log.q)}
    scale = calibrate_loop([own, other], {"a": exact, "b": exact})
    band = scale.band(exact["a"], list(exact.values()))
    assert np.all(band.upper - band.lower < 0.1)
    assert np.all(band.coverage(log) == 1.0)


def test_bands_of_a_robot_that_differs_from_run_to_run(
    problem, truth, monkeypatch
):
    monkeypatch.setattr(bands, "_MEMBER_EVALUATIONS", 2)
    rng = np.random.default_rng(3)

    def run_of(seed):
        """A log of the robot as it is on that day, with sensors' noise."""
        values = dict(truth)
        for name in ("coulomb_torque", "viscous_friction", "load_constant"):
            values[name] *= rng.uniform(0.85, 1.15)
        one = make_log(problem, values, seconds=3.0, seed=seed)
        return dataclasses.replace(
            one,
            name=f"run_{seed}",
            q=np.clip(one.q + 0.2 * rng.standard_normal(one.q.size), 0, 100),
            p_a=one.p_a + 0.5 * rng.standard_normal(one.q.size),
            p_b=one.p_b + 0.5 * rng.standard_normal(one.q.size),
        )

    logs = [run_of(seed) for seed in range(6)]
    delays = {each.name: 0.09 for each in logs}
    begin = FitState(values=dict(truth), start_delays=delays)
    reached = []
    state = fit_members(problem, logs, begin, on_member=reached.append)
    assert [len(each.members) for each in reached] == [1, 2, 3, 4, 5, 6]
    # Where it was interrupted it goes on.
    assert fit_members(problem, logs, reached[4]).members == state.members
    simulator = JointSimulator(problem)
    scales = calibrate_bands(simulator, logs, state)
    unseen = [
        predict(simulator, state, run_of(seed), scales) for seed in range(7, 13)
    ]
    for loop in ("closed", "open"):
        shares = [each.bands[loop].coverage(each.log) for each in unseen]
        assert np.all(np.mean(shares, axis=0) > 0.9)
        half = unseen[0].bands[loop].half_width(unseen[0].log)
        assert 0.2 < half[0] < 20.0
    # The open loop drifts, and its bands know it.
    closed, opened = (
        unseen[0].bands[loop].half_width(unseen[0].log)[0]
        for loop in ("closed", "open")
    )
    assert opened > closed
    assert 0.05 < unseen[0].drift_per_kpa < 20.0


def test_a_single_log_has_no_bands(problem, truth, log):
    state = FitState(values=dict(truth), start_delays={log.name: 0.09})
    simulator = JointSimulator(problem)
    assert fit_members(problem, [log], state) == state
    assert calibrate_bands(simulator, [log], state) == {}
    assert predict(simulator, state, log).bands == {}
    with pytest.raises(
        InputError, match="logs is '1 logs', expected at least two"
    ):
        calibrate_loop([log], {})


def test_coverage_counts_the_judged_rows_only(log):
    measured = np.stack([log.q, log.p_a, log.p_b], axis=1)
    early = (log.t < 1.0)[:, None]
    lower = np.where(early, measured + 1.0, measured - 1.0)
    assert np.all(Band(lower, measured + 2.0).coverage(log) == 1.0)
    assert Band(lower, measured + 2.0).half_width(log).tolist() == [1.5] * 3
