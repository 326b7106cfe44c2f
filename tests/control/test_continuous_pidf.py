"""The law in continuous time, against the sampled one."""

from hypothesis import given, settings
from hypothesis import strategies as st
import numpy as np
from pydrake.autodiffutils import AutoDiffXd, InitializeAutoDiff
from pydrake.symbolic import Expression
import pytest

from drake_affetto.common.errors import InputError
from drake_affetto.control.continuous_pidf import (
    ContinuousPidfController,
    ContinuousPidfController_,
)
from drake_affetto.control.pidf import PidfGains, pidf_update

N = 2
GAINS = PidfGains(kP=[5e5, 6e5], kI=[3e5, 0.0], kD=[2e4, 3e4], kF=[5e-6, 4e-6])
LIMITS = {
    "integral_limit": 1e5,
    "difference_limit": 3e5,
    "integral_deadband": 0.01,
}


def fix(dut, context, desired, state, pressure, offset=None):
    dut.get_desired_state_input_port().FixValue(context, desired)
    dut.get_estimated_state_input_port().FixValue(context, state)
    dut.get_chamber_pressure_input_port().FixValue(context, pressure)
    if offset is not None:
        dut.get_equilibrium_offset_input_port().FixValue(context, offset)


@settings(max_examples=60, deadline=None)
@given(seed=st.integers(0, 2**32 - 1), scale=st.sampled_from([0.02, 0.3, 2.0]))
def test_outputs_and_integral_are_those_of_a_short_period(seed, scale):
    random = np.random.default_rng(seed)
    desired, state = random.normal(0.0, scale, (2, 2 * N))
    pressure = random.uniform(1e5, 6e5, 2 * N)
    offset = random.normal(0.0, 1e5, N)
    integral = np.array([random.uniform(-0.3, 0.3), 0.0])
    dut = ContinuousPidfController(GAINS, **LIMITS)
    context = dut.CreateDefaultContext()
    context.SetContinuousState(integral)
    fix(dut, context, desired, state, pressure, offset)
    rate = dut.EvalTimeDerivatives(context).CopyToVector()
    h = 1e-9
    after, demand, opening = integral.copy(), np.zeros(N), np.zeros(N)
    pidf_update(
        h,
        GAINS.to_array(),
        *LIMITS.values(),
        desired,
        state,
        pressure,
        offset,
        after,
        demand,
        opening,
    )
    np.testing.assert_allclose(
        dut.get_valve_opening_output_port().Eval(context), opening, atol=1e-6
    )
    np.testing.assert_allclose(
        dut.get_pid_output_output_port().Eval(context), demand, atol=1.0
    )
    np.testing.assert_allclose((after - integral) / h, rate, atol=1e-6)


def test_integral_waits_at_its_limit_and_comes_back_from_it():
    dut = ContinuousPidfController(GAINS, **LIMITS)
    context = dut.CreateDefaultContext()
    full = LIMITS["integral_limit"] / GAINS.kI[0]
    context.SetContinuousState([1.001 * full, 0.0])
    for error, expected in ((0.02, 0.0), (-0.02, -0.01)):
        fix(dut, context, [error, 0, 0, 0], np.zeros(4), [4e5] * 4)
        rate = dut.EvalTimeDerivatives(context).CopyToVector()
        assert rate == pytest.approx([expected, 0.0])


def test_integral_can_be_set_in_pressure():
    dut = ContinuousPidfController(GAINS)
    context = dut.CreateDefaultContext()
    dut.set_integral(context, [6e4, 6e4])
    fix(dut, context, np.zeros(4), np.zeros(4), np.full(4, 4e5))
    demand = dut.get_pid_output_output_port().Eval(context)
    assert demand == pytest.approx([6e4, 0.0])


def test_derivatives_by_the_gains_are_those_of_the_law():
    dut = ContinuousPidfController(GAINS).ToAutoDiffXd()
    assert isinstance(dut, ContinuousPidfController_[AutoDiffXd])
    context = dut.CreateDefaultContext()
    fix(dut, context, [0.1, 0.2, 0.3, 0.4], np.zeros(4), [4e5] * 4)
    seeds = InitializeAutoDiff(GAINS.to_array().ravel()).reshape(4, N)
    dut.set_gains(context, seeds)
    u = dut.get_pid_output_output_port().Eval(context)
    # du/d[kP, kP, kI, kI, kD, kD, kF, kF] of the first joint: e, ∫e, ė.
    np.testing.assert_allclose(u[0].derivatives(), [0.1, 0, 0, 0, 0.3, 0, 0, 0])


def test_an_expression_evaluates_to_the_same():
    values = {"desired": 0.3, "state": 0.1, "pressure": 3.5e5}
    plain = ContinuousPidfController(GAINS, **LIMITS)
    symbolic = plain.ToSymbolic()
    found = []
    for dut, wrap in ((plain, float), (symbolic, Expression)):
        context = dut.CreateDefaultContext()
        fix(
            dut,
            context,
            [wrap(values["desired"])] * 4,
            [wrap(values["state"])] * 4,
            [wrap(values["pressure"] + 1e4 * i) for i in range(4)],
        )
        found.append(
            [
                *dut.get_valve_opening_output_port().Eval(context),
                *dut.EvalTimeDerivatives(context).CopyToVector(),
            ]
        )
    evaluated = [each.Evaluate() for each in found[1]]
    assert evaluated == pytest.approx(found[0])


def test_limits_that_do_not_fit_are_named():
    with pytest.raises(InputError, match="integral_limit"):
        ContinuousPidfController(GAINS, integral_limit=-1.0)
