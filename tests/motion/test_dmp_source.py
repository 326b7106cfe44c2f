"""The movement primitive in a diagram."""

import numpy as np
from numpy.testing import assert_allclose
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.primitives import LogVectorOutput
import pytest

from drake_affetto.common.errors import InputError
from drake_affetto.motion import Dmp, DmpConfig
from drake_affetto.motion.dmp_source import DmpSource

N = 3
START = np.array([0.4, -0.2, 1.0])
THETA = 20.0 * np.random.default_rng(0).normal(size=15 * N)


@pytest.fixture
def played():
    """A source, its context with both inputs fixed, and a simulator."""
    source = DmpSource(Dmp(), N)
    simulator = Simulator(source)
    context = simulator.get_mutable_context()
    source.set_start_posture(context, START)
    source.get_policy_parameters_input_port().FixValue(context, THETA)
    source.get_start_time_input_port().FixValue(context, [0.1])
    return source, context, simulator


def state(source, context):
    return source.get_desired_state_output_port().Eval(context)


def test_ports():
    source = DmpSource(Dmp(DmpConfig(n_basis=4)), N)
    assert source.GetInputPort("policy_parameters").size() == 4 * N
    assert source.GetInputPort("start_time").size() == 1
    assert source.GetOutputPort("desired_state").size() == 2 * N
    assert not source.HasAnyDirectFeedthrough()


def test_holds_still_and_then_plays_the_rollout():
    builder = DiagramBuilder()
    source = DmpSource.AddToBuilder(builder=builder, dmp=Dmp(), num_joints=N)
    logger = LogVectorOutput(
        source.get_desired_state_output_port(), builder, 0.005
    )
    diagram = builder.Build()
    simulator = Simulator(diagram)
    context = source.GetMyMutableContextFromRoot(
        simulator.get_mutable_context()
    )
    source.set_start_posture(context, START)
    source.get_policy_parameters_input_port().FixValue(context, THETA)
    source.get_start_time_input_port().FixValue(context, [0.1])
    simulator.AdvanceTo(4.0)
    log = logger.FindLog(simulator.get_context())
    seen = log.data().T
    before = log.sample_times() < 0.1 - 1e-6
    assert_allclose(seen[before], np.tile([*START, 0, 0, 0], (20, 1)))
    known = Dmp().rollout(THETA, START, length=3.9)
    after = seen[~before][: len(known.t)]
    assert_allclose(after[:, :N], known.q[: len(after)], atol=1e-9)
    assert_allclose(after[:, N:], known.q_dot[: len(after)], atol=1e-9)


def test_returns_and_rests(played):
    source, context, simulator = played
    simulator.AdvanceTo(7.0)
    assert source.get_phase(context) == 0.0
    assert_allclose(state(source, context)[:N], START, atol=1e-8)
    assert_allclose(state(source, context)[N:], 0.0, atol=1e-7)


@pytest.mark.parametrize("never", [np.inf, 1e300, np.nan])
def test_waits_for_ever(played, never):
    source, context, simulator = played
    source.get_start_time_input_port().FixValue(context, [never])
    simulator.AdvanceTo(0.5)
    assert source.get_phase(context) == 1.0
    assert_allclose(state(source, context), [*START, 0, 0, 0])


def test_start_between_updates_waits_for_the_next(played):
    source, context, simulator = played
    source.get_start_time_input_port().FixValue(context, [0.0071])
    simulator.AdvanceTo(0.0151)
    # Updates at 0.010 and 0.015 are the first two steps.
    known = Dmp().rollout(THETA, START, length=0.01)
    assert_allclose(state(source, context)[:N], known.q[2], atol=1e-12)


def test_duration_is_of_the_context(played):
    source, context, simulator = played
    source.set_duration(context, 1.2)
    assert source.get_duration(context) == 1.2
    simulator.AdvanceTo(0.1 + 0.8)
    known = Dmp().rollout(THETA, START, duration=1.2, length=0.8)
    assert_allclose(state(source, context)[:N], known.q[-1], atol=1e-9)


def test_new_parameters_on_the_way_do_not_jump(played):
    source, context, simulator = played
    simulator.AdvanceTo(1.0)
    before = state(source, context)
    source.get_policy_parameters_input_port().FixValue(context, -5 * THETA)
    assert_allclose(state(source, context), before)
    simulator.AdvanceTo(1.005)
    change = state(source, context) - before
    assert np.abs(change[:N]).max() < 0.02
    # From here on it is the movement of the new parameters.
    dmp, phase = Dmp(), source.get_phase(context)
    _, q, _ = dmp.step(
        phase,
        state(source, context)[:N],
        state(source, context)[N:],
        -5 * THETA,
        START,
        0.005,
    )
    simulator.AdvanceTo(1.01)
    assert_allclose(state(source, context)[:N], q, atol=1e-12)


def test_a_second_start_plays_again(played):
    source, context, simulator = played
    simulator.AdvanceTo(6.0)
    source.get_start_time_input_port().FixValue(context, [6.5])
    simulator.AdvanceTo(7.5)
    known = Dmp().rollout(THETA, START, length=1.0)
    assert_allclose(state(source, context)[:N], known.q[-1], atol=1e-6)


def test_contexts_do_not_share_anything(played):
    source, context, simulator = played
    simulator.AdvanceTo(1.0)
    fresh = source.CreateDefaultContext()
    assert source.get_phase(fresh) == 1.0
    assert_allclose(state(source, fresh), 0.0)
    other = source.CreateDefaultContext()
    source.set_start_posture(other, -START)
    assert_allclose(source.get_start_posture(context), START)
    assert_allclose(state(source, other)[:N], -START)


def test_the_same_system_again_gives_the_same(played):
    source, context, simulator = played
    simulator.AdvanceTo(1.0)
    first = state(source, context)
    context.SetTime(0.0)
    source.set_start_posture(context, START)
    simulator.Initialize()
    simulator.AdvanceTo(1.0)
    assert_allclose(state(source, context), first)


def test_bad_input_is_named(played):
    source, context, _ = played
    with pytest.raises(InputError, match="start_posture"):
        source.set_start_posture(context, np.zeros(N + 1))
    with pytest.raises(InputError, match="start_posture"):
        source.set_start_posture(context, [0.0, np.nan, 0.0])
    with pytest.raises(InputError, match="duration"):
        source.set_duration(context, 0.0)
    with pytest.raises(InputError, match="num_joints"):
        DmpSource(Dmp(), 0)
    with pytest.raises(InputError, match="update_period"):
        DmpSource(Dmp(), N, update_period=0.0)
