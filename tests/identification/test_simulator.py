"""Simulated logs, on synthetic robots whose parameters are known."""

import numpy as np
import pytest

from drake_affetto.identification.simulator import JointSimulator
from support.robot_bench import make_log


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
