"""The policy as a system: it predicts once, and says when to start."""

import numpy as np
from pydrake.systems.analysis import Simulator
import pytest

from drake_affetto.errors import InputError
from drake_affetto.skill.elm import ElmRegressor
from drake_affetto.skill.policy import SkillPolicy, SkillPolicyConfig

F = 6
TAU = np.array([0.4, -0.1])


@pytest.fixture(scope="module")
def regressor():
    rng = np.random.default_rng(0)
    X = rng.uniform(size=(20, 2))
    return ElmRegressor(random_state=0).fit(X, rng.normal(size=(20, F)))


@pytest.fixture
def policy():
    return SkillPolicy(F, config=SkillPolicyConfig(delay=0.1))


def prepare(policy, tau, settled):
    context = policy.CreateDefaultContext()
    policy.get_task_parameter_input_port().FixValue(context, tau)
    policy.get_settled_input_port().FixValue(context, [settled])
    return context, Simulator(policy, context)


def outputs(policy, context):
    return (
        policy.get_policy_parameters_output_port().Eval(context),
        policy.get_start_time_output_port().Eval(context)[0],
    )


def test_it_waits_until_the_gaze_has_settled(policy, regressor):
    context, simulator = prepare(policy, TAU, 0.0)
    policy.set_regressor(context, regressor)
    simulator.AdvanceTo(0.5)
    theta, start = outputs(policy, context)
    np.testing.assert_array_equal(theta, np.zeros(F))
    assert start == np.inf
    assert not policy.is_latched(context)


def test_it_predicts_once_and_keeps_it(policy, regressor):
    context, simulator = prepare(policy, TAU, 0.0)
    policy.set_regressor(context, regressor)
    simulator.AdvanceTo(0.2)
    policy.get_settled_input_port().FixValue(context, [1.0])
    simulator.AdvanceTo(0.3)
    theta, start = outputs(policy, context)
    np.testing.assert_allclose(theta, regressor.predict(TAU[None])[0])
    assert 0.3 <= start <= 0.305 + 1e-9
    policy.get_task_parameter_input_port().FixValue(context, [0.9, 0.3])
    simulator.AdvanceTo(0.6)
    again, start_again = outputs(policy, context)
    np.testing.assert_array_equal(again, theta)
    assert start_again == start


def test_reset_makes_it_predict_anew(policy, regressor):
    context, simulator = prepare(policy, TAU, 1.0)
    policy.set_regressor(context, regressor)
    simulator.AdvanceTo(0.1)
    policy.get_task_parameter_input_port().FixValue(context, [0.9, 0.3])
    policy.reset(context)
    simulator.AdvanceTo(0.2)
    theta, _ = outputs(policy, context)
    expected = regressor.predict(np.array([[0.9, 0.3]]))[0]
    np.testing.assert_allclose(theta, expected)


def test_given_parameters_are_played_whatever_is_seen(policy):
    context, simulator = prepare(policy, [np.nan, np.nan], 1.0)
    policy.set_policy_parameters(context, np.arange(F), 0.7)
    simulator.AdvanceTo(0.2)
    theta, start = outputs(policy, context)
    np.testing.assert_array_equal(theta, np.arange(F))
    assert start == 0.7


def test_contexts_share_the_skill_but_not_what_was_predicted(policy, regressor):
    context, simulator = prepare(policy, TAU, 1.0)
    policy.set_regressor(context, regressor)
    copy = context.Clone()
    simulator.AdvanceTo(0.1)
    assert policy.is_latched(context)
    assert not policy.is_latched(copy)


def test_without_a_skill_it_says_so(policy):
    _, simulator = prepare(policy, TAU, 1.0)
    with pytest.raises(InputError, match="no skill to predict with"):
        simulator.AdvanceTo(0.1)


def test_a_parameter_that_is_not_a_number_is_never_used(policy, regressor):
    context, simulator = prepare(policy, [np.nan, 0.0], 1.0)
    policy.set_regressor(context, regressor)
    with pytest.raises(InputError, match="task_parameter"):
        simulator.AdvanceTo(0.1)


@pytest.mark.parametrize(
    ("theta", "start"),
    [
        (np.zeros(F + 1), 0.0),
        (np.full(F, np.nan), 0.0),
        (np.zeros(F), np.inf),
    ],
)
def test_bad_parameters_are_refused(policy, theta, start):
    context = policy.CreateDefaultContext()
    with pytest.raises(InputError):
        policy.set_policy_parameters(context, theta, start)
