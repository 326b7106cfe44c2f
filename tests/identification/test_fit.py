"""Identification: on invented robots, whose truth is known, and on Affetto."""

import dataclasses
from pathlib import Path

from hypothesis import given
from hypothesis import strategies as st
import numpy as np
import pytest

from drake_affetto.common.errors import InputError
from drake_affetto.identification.fit import (
    FitState,
    JointProblem,
    JointSimulator,
    estimate_uncertainty,
    fit_logs,
    profile_fit,
)
from drake_affetto.pneumatics.parameters import load_parameters
from drake_affetto.robot.log import read_log
from support.robot_bench import STACK, make_log, make_problem, true_values

LOGS = Path(__file__).parents[2].parent / "shared/data/affetto-logs"


@pytest.fixture(scope="module")
def problem():
    return make_problem()


@pytest.fixture(scope="module")
def truth(problem):
    return true_values(problem)


@pytest.fixture(scope="module")
def log(problem, truth):
    return make_log(problem, truth, seed=1)


@given(fraction=st.floats(0.0, 1.0), index=st.integers(0, 21))
def test_scales_of_the_parameters_are_invertible(fraction, index):
    parameter = make_problem().parameters()[index]
    value = parameter.decode(fraction)
    assert parameter.lower * (1 - 1e-12) <= value or parameter.lower < 0
    assert parameter.encode(value) == pytest.approx(fraction, abs=1e-9)
    inside = min(max(fraction, 1e-4), 1 - 1e-4)
    numerical = (
        parameter.decode(inside + 1e-6) - parameter.decode(inside - 1e-6)
    ) / 2e-6
    assert parameter.slope(inside) == pytest.approx(numerical, rel=1e-4)


def test_start_lies_within_the_bounds(problem):
    for parameter in problem.parameters():
        assert parameter.lower < parameter.start < parameter.upper


def test_a_robot_predicts_itself(problem, truth, log):
    simulated = JointSimulator(problem).run(truth, log)
    # But for the rounding of the angle that its controller reads.
    assert np.all(simulated.rms(log) < 1e-9)
    assert np.ptp(simulated.q) > 20.0


def test_open_loop_takes_the_logged_commands(problem, truth, log):
    simulated = JointSimulator(problem).run(truth, log, closed_loop=False)
    np.testing.assert_array_equal(simulated.c_a, log.c_a)
    assert np.all(simulated.rms(log) < 1e-9)


def test_a_finer_step_changes_little(problem, truth, log):
    simulator = JointSimulator(problem)
    coarse = simulator.run(truth, log)
    fine = simulator.run(truth, log, time_step=0.0005)
    assert np.sqrt(np.mean((coarse.q - fine.q) ** 2)) < 0.5
    assert np.sqrt(np.mean((coarse.p_a - fine.p_a) ** 2)) < 2.0


@pytest.mark.parametrize("delay", [0.06, 0.1, 0.125])
def test_start_delay_is_found_in_the_first_second(problem, truth, delay):
    log = make_log(problem, truth, seed=2, start_delay=delay)
    # Later rows are not read.
    log.q[31:] = 50.0
    simulator = JointSimulator(problem)
    assert simulator.estimate_start_delay(truth, log) == pytest.approx(
        delay, abs=0.002
    )


def test_a_fit_predicts_a_log_it_has_not_seen(problem, truth, log):
    unseen = make_log(problem, truth, seed=5, start_delay=0.075)
    simulator = JointSimulator(problem)
    begin = problem.start()
    before = simulator.run(
        begin,
        unseen,
        start_delay=simulator.estimate_start_delay(begin, unseen),
    ).rms(unseen)
    seen: list[tuple[int, float]] = []
    stages = []
    state = fit_logs(
        problem,
        [log],
        stages=3,
        on_evaluation=lambda stage, cost: seen.append((stage, cost)),
        on_stage=stages.append,
    )
    assert [s.stage for s in stages] == [1, 2, 3]
    assert {stage for stage, _ in seen} == {0, 1, 2}
    after = simulator.run(
        state.values,
        unseen,
        start_delay=simulator.estimate_start_delay(state.values, unseen),
    ).rms(unseen)
    assert before[0] > 2.0
    assert after[0] < 1.5
    assert np.all(after[1:] < 5.0)
    # Friction at large is what a log shows best.
    friction = state.values["coulomb_torque"] + state.values["dwell_torque"]
    assert friction == pytest.approx(0.17, rel=0.35)


def test_a_fit_goes_on_where_it_stopped(problem, log):
    short = dataclasses.replace(
        log,
        **{
            f.name: getattr(log, f.name)[:75]
            for f in dataclasses.fields(log)
            if isinstance(getattr(log, f.name), np.ndarray)
        },
    )
    stages: list[FitState] = []
    whole = fit_logs(problem, [short], stages=2, on_stage=stages.append)
    resumed = fit_logs(problem, [short], state=stages[0], stages=2)
    assert resumed == whole
    with pytest.raises(InputError, match="no log"):
        fit_logs(problem, [])


def test_uncertainty_knows_what_a_log_does_not_show(problem, truth, log):
    delay = JointSimulator(problem).estimate_start_delay(truth, log)
    noisy = dataclasses.replace(
        log, q=log.q + 0.3 * np.random.default_rng(0).normal(size=log.q.size)
    )
    state = FitState(values=dict(truth), start_delays={log.name: delay})
    found = estimate_uncertainty(problem, [noisy], state)
    assert found.determined["viscous_friction"]
    assert 0.0 < found.std["viscous_friction"] < truth["viscous_friction"]
    # The lower stop does not matter to a joint that never touches it after
    # the start; a long way before the dwell fades is no more than a guess.
    worst = max(found.std, key=lambda k: found.std[k] / abs(truth[k] or 1.0))
    assert found.std[worst] > 0.2 * abs(truth[worst] or 1.0)


def test_profile_refits_all_others(problem, truth, log, monkeypatch):
    monkeypatch.setattr(
        "drake_affetto.identification.fit.PROFILED",
        ("viscous_friction",),
    )
    noisy = dataclasses.replace(
        log, q=log.q + 0.3 * np.random.default_rng(0).normal(size=log.q.size)
    )
    state = FitState(values=dict(truth), start_delays={log.name: 0.09})
    profiled = profile_fit(problem, [noisy], state)
    half, double = profiled.profile["viscous_friction"]
    assert half > 1.05
    assert double > 1.05
    # Profiled once, it is not done again.
    assert profile_fit(problem, [noisy], profiled) == profiled


@pytest.mark.skipif(not LOGS.is_dir(), reason="the robot's logs are not here")
def test_the_real_robot_is_predicted_from_other_runs():
    supply = load_parameters()
    joint = STACK.joints[5]
    problem = JointProblem(
        joint=joint,
        stack=STACK,
        supply=supply,
        actuator=supply.classes[joint.actuator],
    )
    seen, unseen = (
        read_log(LOGS / f"motion_{i:03d}.csv", 5, STACK) for i in (0, 4)
    )
    # One log and two stages suffice for the errors asked for.
    state = fit_logs(problem, [seen], stages=2)
    simulator = JointSimulator(problem)
    delay = simulator.estimate_start_delay(state.values, unseen)
    rms = simulator.run(state.values, unseen, start_delay=delay).rms(unseen)
    assert rms[0] < 3.0
    assert np.all(rms[1:] < 12.0)
