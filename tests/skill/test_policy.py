"""The policy in a diagram: it predicts once, when the gaze has settled."""

import numpy as np
from numpy.testing import assert_allclose
from pydrake.systems.analysis import Simulator
import pytest

from drake_affetto.common.errors import InputError
from drake_affetto.skill import ElmRegressor
from drake_affetto.skill.policy import SkillPolicy, SkillPolicyConfig

F = 6
RANDOM = np.random.default_rng(0)
TASKS = RANDOM.uniform(size=(20, 2))
SKILL = ElmRegressor(random_state=0).fit(TASKS, RANDOM.normal(size=(20, F)))
TAU = np.array([0.3, 0.8])


@pytest.fixture
def waiting():
    """A policy with a skill, and a simulator; the gaze has not settled."""
    policy = SkillPolicy(F, config=SkillPolicyConfig(delay=0.2))
    simulator = Simulator(policy)
    context = simulator.get_mutable_context()
    policy.set_regressor(context, SKILL)
    see(policy, context, TAU, 0.0)
    return policy, context, simulator


def see(policy, context, tau, settled):
    policy.get_task_parameter_input_port().FixValue(context, tau)
    policy.get_settled_input_port().FixValue(context, [settled])


def outputs(policy, context):
    return (
        policy.GetOutputPort("policy_parameters").Eval(context),
        policy.GetOutputPort("start_time").Eval(context)[0],
    )


def test_ports():
    policy = SkillPolicy(F, num_task_parameters=3)
    assert policy.GetInputPort("task_parameter").size() == 3
    assert policy.GetInputPort("settled").size() == 1
    assert policy.GetOutputPort("policy_parameters").size() == F
    assert policy.GetOutputPort("start_time").size() == 1
    assert not policy.HasAnyDirectFeedthrough()
    assert policy.get_start_time_output_port().get_name() == "start_time"
    assert policy.get_policy_parameters_output_port().size() == F


def test_waits_until_settled(waiting):
    policy, context, simulator = waiting
    # A τ that is not yet one is none of its business.
    see(policy, context, [np.nan, 0.0], 0.0)
    simulator.AdvanceTo(0.5)
    theta, start = outputs(policy, context)
    assert_allclose(theta, 0.0)
    assert start == np.inf
    assert not policy.is_latched(context)


def test_predicts_when_settled_and_starts_after_the_delay(waiting):
    policy, context, simulator = waiting
    simulator.AdvanceTo(0.5)
    see(policy, context, TAU, 1.0)
    simulator.AdvanceTo(0.6)
    theta, start = outputs(policy, context)
    assert_allclose(theta, SKILL.predict(TAU[None])[0])
    assert start == pytest.approx(0.7)
    assert policy.is_latched(context)


def test_predicts_once(waiting):
    policy, context, simulator = waiting
    see(policy, context, TAU, 1.0)
    simulator.AdvanceTo(0.1)
    known = outputs(policy, context)
    for tau, settled in (([0.9, 0.1], 1.0), ([0.9, 0.1], 0.0), (TAU, 1.0)):
        see(policy, context, tau, settled)
        simulator.AdvanceTo(context.get_time() + 0.1)
        theta, start = outputs(policy, context)
        assert_allclose(theta, known[0])
        assert start == known[1]


def test_reset_and_new_regressor_wait_anew(waiting):
    policy, context, simulator = waiting
    see(policy, context, TAU, 1.0)
    simulator.AdvanceTo(0.1)
    policy.reset(context)
    assert outputs(policy, context)[1] == np.inf
    simulator.AdvanceTo(0.3)
    assert outputs(policy, context)[1] == pytest.approx(0.3, abs=0.01)
    policy.set_regressor(context, SKILL)
    assert not policy.is_latched(context)


def test_plays_given_parameters(waiting):
    policy, context, simulator = waiting
    policy.set_policy_parameters(context, np.arange(F), 1.5)
    see(policy, context, TAU, 1.0)
    simulator.AdvanceTo(0.2)
    theta, start = outputs(policy, context)
    assert_allclose(theta, np.arange(F))
    assert start == 1.5


def test_contexts_have_their_own_skill(waiting):
    policy, context, _ = waiting
    copy = context.Clone()
    other = ElmRegressor(random_state=5).fit(TASKS, np.ones((20, F)))
    policy.set_regressor(copy, other)
    for each, skill in ((context, SKILL), (copy, other)):
        see(policy, each, TAU, 1.0)
        Simulator(policy, each).AdvanceTo(0.1)
        assert_allclose(outputs(policy, each)[0], skill.predict(TAU[None])[0])


def test_anything_that_predicts_will_do(waiting):
    class Constant:
        def predict(self, X):
            assert X.shape == (1, 2)
            return np.full((1, F), X[0, 0])

    policy, context, simulator = waiting
    policy.set_regressor(context, Constant())
    see(policy, context, TAU, 1.0)
    simulator.AdvanceTo(0.1)
    assert_allclose(outputs(policy, context)[0], TAU[0])


def test_settled_without_a_task_parameter_is_an_error(waiting):
    policy, context, simulator = waiting
    see(policy, context, [0.1, np.nan], 1.0)
    with pytest.raises(InputError, match="task_parameter"):
        simulator.AdvanceTo(0.1)


def test_settled_without_a_skill_is_an_error():
    policy = SkillPolicy(F)
    simulator = Simulator(policy)
    see(policy, simulator.get_mutable_context(), TAU, 1.0)
    with pytest.raises(InputError, match="no skill"):
        simulator.AdvanceTo(0.1)


@pytest.mark.parametrize("predicted", [np.ones((1, F + 1)), [[np.nan] * F]])
def test_a_skill_of_another_kind_is_an_error(waiting, predicted):
    class Wrong:
        def predict(self, X):
            return predicted

    policy, context, simulator = waiting
    policy.set_regressor(context, Wrong())
    see(policy, context, TAU, 1.0)
    with pytest.raises(InputError, match="predicted theta"):
        simulator.AdvanceTo(0.1)


def test_bad_input_is_named(waiting):
    policy, context, _ = waiting
    with pytest.raises(InputError, match="theta"):
        policy.set_policy_parameters(context, np.ones(F - 1), 0.0)
    with pytest.raises(InputError, match="theta"):
        policy.set_policy_parameters(context, np.full(F, np.nan), 0.0)
    with pytest.raises(InputError, match="start_time"):
        policy.set_policy_parameters(context, np.ones(F), np.nan)
    with pytest.raises(InputError, match="regressor"):
        policy.set_regressor(context, 3.0)
    with pytest.raises(InputError, match="num_parameters"):
        SkillPolicy(0)
    with pytest.raises(InputError, match=r"skill\.delay"):
        SkillPolicyConfig(delay=-1.0).check("skill")
    with pytest.raises(InputError, match=r"skill\.update_period"):
        SkillPolicyConfig(update_period=0.0).check("skill")
