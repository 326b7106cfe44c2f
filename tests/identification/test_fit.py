"""The fit, on synthetic robots whose parameters are known, and on Affetto."""

import dataclasses
from pathlib import Path

import numpy as np
import pytest

from drake_affetto.common.errors import InputError
from drake_affetto.identification.fit import FitState, fit_logs
from drake_affetto.identification.problem import JointProblem
from drake_affetto.identification.simulator import JointSimulator
from drake_affetto.pneumatics.parameters import load_parameters
from drake_affetto.robot.log import read_log
from support.robot_bench import CONTROLLER, make_log

LOGS = Path(__file__).parents[2].parent / "shared/data/affetto-logs"


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


@pytest.mark.skipif(not LOGS.is_dir(), reason="the robot's logs are not here")
def test_the_real_robot_is_predicted_from_other_runs():
    supply = load_parameters()
    joint = CONTROLLER.joints[5]
    problem = JointProblem(
        joint=joint,
        controller=CONTROLLER,
        supply=supply,
        actuator=supply.classes[joint.actuator],
    )
    seen, unseen = (
        read_log(LOGS / f"motion_{i:03d}.csv", 5, CONTROLLER) for i in (0, 4)
    )
    # One log and two stages suffice for the errors asked for.
    state = fit_logs(problem, [seen], stages=2)
    simulator = JointSimulator(problem)
    delay = simulator.estimate_start_delay(state.values, unseen)
    rms = simulator.run(state.values, unseen, start_delay=delay).rms(unseen)
    assert rms[0] < 3.0
    assert np.all(rms[1:] < 12.0)
