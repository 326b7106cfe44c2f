"""The DMP as a system: it plays what the mathematics roll out."""

import numpy as np
from pydrake.systems.analysis import Simulator
import pytest

from drake_affetto.errors import InputError
from drake_affetto.motion.dmp import Dmp, DmpConfig
from drake_affetto.motion.dmp_source import DmpSource

N, K = 3, 15
START = np.array([0.1, -0.2, 1.5])


@pytest.fixture(scope="module")
def theta():
    return np.random.default_rng(0).normal(0.0, 30.0, N * K)


@pytest.fixture
def source():
    return DmpSource(Dmp(DmpConfig(n_basis=K)), N, start_posture=START)


def prepare(source, theta, start_time):
    context = source.CreateDefaultContext()
    source.set_start_posture(context, START)
    source.get_policy_parameters_input_port().FixValue(context, theta)
    source.get_start_time_input_port().FixValue(context, [start_time])
    return context, Simulator(source, context)


def desired(source, context):
    return source.get_desired_state_output_port().Eval(context)


@pytest.mark.parametrize("start_time", [np.inf, 1e6])
def test_before_its_time_it_rests_at_the_start(source, theta, start_time):
    context, simulator = prepare(source, theta, start_time)
    simulator.AdvanceTo(1.0)
    np.testing.assert_array_equal(desired(source, context)[:N], START)
    np.testing.assert_array_equal(desired(source, context)[N:], np.zeros(N))
    assert source.get_phase(context) == 1.0


@pytest.mark.parametrize("start_time", [0.0, 0.1, 0.7])
def test_the_steps_are_the_rollout(source, theta, start_time):
    context, simulator = prepare(source, theta, start_time)
    rollout = source.dmp.rollout(theta, START, 0.005)
    for k in (1, 2, 100, 399, 600):
        # As the product that the events' own times are.
        simulator.AdvanceTo(0.005 * (round(start_time / 0.005) + k))
        state = desired(source, context)
        np.testing.assert_allclose(state[:N], rollout.q[k], atol=1e-9)
        np.testing.assert_allclose(state[N:], rollout.q_dot[k], atol=1e-8)


def test_afterwards_it_comes_to_rest_at_the_start(source, theta):
    context, simulator = prepare(source, theta, 0.0)
    simulator.AdvanceTo(7.0)
    np.testing.assert_allclose(desired(source, context)[:N], START, atol=1e-6)
    assert source.get_phase(context) == pytest.approx(0.0, abs=1e-9)


def test_new_parameters_on_the_way_do_not_make_it_jump(source, theta):
    context, simulator = prepare(source, theta, 0.0)
    simulator.AdvanceTo(1.0)
    before = desired(source, context)
    port = source.get_policy_parameters_input_port()
    port.FixValue(context, -theta)
    simulator.AdvanceTo(1.005)
    step = desired(source, context)[:N] - before[:N]
    assert np.abs(step - 0.005 * before[N:]).max() < 5e-3


def test_a_context_set_back_plays_the_same_again(source, theta):
    context, simulator = prepare(source, theta, 0.2)
    runs = []
    for _ in range(2):
        context.SetTime(0.0)
        source.set_start_posture(context, START)
        simulator.Initialize()
        simulator.AdvanceTo(1.5)
        runs.append(desired(source, context))
    np.testing.assert_array_equal(runs[0], runs[1])
    assert np.abs(runs[0][:N] - START).max() > 1e-3


def test_the_duration_is_a_parameter(source, theta):
    context, simulator = prepare(source, theta, 0.0)
    source.set_duration(context, 1.5)
    assert source.get_duration(context) == 1.5
    simulator.AdvanceTo(0.75)
    assert source.get_phase(context) == pytest.approx(0.5, abs=1e-9)


@pytest.mark.parametrize("q", [[0.0], [0.0, np.nan, 0.0]])
def test_a_bad_posture_is_named(source, q):
    context = source.CreateDefaultContext()
    with pytest.raises(InputError, match="start_posture"):
        source.set_start_posture(context, q)
