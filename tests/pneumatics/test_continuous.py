"""The continuous twin, and the discrete actuators against it."""

from hypothesis import given, settings
from hypothesis import strategies as st
import numpy as np
from pydrake.autodiffutils import (
    AutoDiffXd,
    ExtractGradient,
    InitializeAutoDiff,
)
from pydrake.symbolic import Expression, MakeVectorVariable
from pydrake.systems.analysis import (
    ApplySimulatorConfig,
    Simulator,
    SimulatorConfig,
)
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.primitives import TrajectorySource, VectorLogSink
from pydrake.trajectories import PiecewisePolynomial
import pytest

from drake_affetto.common.errors import InputError
from drake_affetto.pneumatics.chamber import FLOW_MODE, REGULATOR_MODE, Row
from drake_affetto.pneumatics.continuous import (
    ContinuousPneumaticActuation,
    ContinuousPneumaticActuation_,
)
from drake_affetto.pneumatics.parameters import resting_pressure
from support.actuator_bench import Actuators, make_parameters


def integrate(array, mode, times, commands, angle, start):
    """Pressures of the twin at 1 ms under held commands on a given path."""
    builder = DiagramBuilder()
    dut = builder.AddSystem(ContinuousPneumaticActuation(array, mode=mode))
    valve = builder.AddSystem(
        TrajectorySource(PiecewisePolynomial.ZeroOrderHold(times, commands))
    )
    path = builder.AddSystem(TrajectorySource(angle, 1))
    builder.Connect(valve.get_output_port(), dut.get_command_input_port())
    builder.Connect(
        path.get_output_port(), dut.get_estimated_state_input_port()
    )
    sink = builder.AddSystem(VectorLogSink(2, 0.001))
    builder.Connect(
        dut.get_chamber_pressure_output_port(), sink.get_input_port()
    )
    diagram = builder.Build()
    simulator = Simulator(diagram)
    ApplySimulatorConfig(
        SimulatorConfig(
            integration_scheme="runge_kutta3",
            max_step_size=0.0005,
            use_error_control=False,
        ),
        simulator,
    )
    context = simulator.get_mutable_context()
    dut.set_pressures(
        dut.GetMyMutableContextFromRoot(context),
        start[0],
        start[1],
        [float(angle.value(0.0)[0, 0])],
    )
    simulator.AdvanceTo(times[-1])
    return sink.FindLog(context).data()


@settings(max_examples=6, deadline=None)
@given(
    seed=st.integers(0, 2**32 - 1),
    n=st.floats(1.0, 1.4),
    underlap=st.floats(-0.05, 0.05),
    mode=st.sampled_from(["flow", "regulator"]),
)
def test_discrete_actuators_follow_the_twin(seed, n, underlap, mode):
    random = np.random.default_rng(seed)
    array = make_parameters(
        exponent=n,
        underlap=underlap,
        leak_conductance=random.uniform(0, 1e-11),
        area_ratio=0.9,
        valve_lag=random.uniform(0.005, 0.03),
    )
    times = np.linspace(0.0, 0.4, 9)
    if mode == "flow":
        commands = random.uniform(-1, 1, (1, times.size))
    else:
        commands = random.uniform(1.2e5, 6.4e5, (2, times.size))
    knots = np.linspace(0.0, 0.4, 5)
    angle = PiecewisePolynomial.CubicShapePreserving(
        knots, random.uniform(-0.8, 0.8, (1, knots.size)), True
    )
    start = random.uniform(1.2e5, 6.4e5, 2)
    reference = integrate(array, mode, times, commands, angle, start)

    actuators = Actuators(
        array,
        start,
        mode=FLOW_MODE if mode == "flow" else REGULATOR_MODE,
        look_ahead=1.0,
    )
    found = [actuators.pressure.copy()]
    for k in range(reference.shape[1] - 1):
        t = 0.001 * k
        held = commands[:, np.searchsorted(times, t + 1e-9, side="right") - 1]
        q = float(angle.value(t)[0, 0])
        v = float(angle.EvalDerivative(t)[0, 0])
        found.append(actuators.step(held, q, v))
    error = np.abs(np.array(found).T - reference)
    assert np.max(error / reference) < 5e-3


def test_derivatives_are_those_of_finite_differences():
    array = make_parameters(n=1, leak_conductance=5e-12)
    dut = ContinuousPneumaticActuation(array)
    context = dut.CreateDefaultContext()
    dut.get_command_input_port().FixValue(context, [0.3])
    dut.get_estimated_state_input_port().FixValue(context, [0.1, 0.5])
    dut.set_pressures(context, 4e5, 3e5, [0.1])
    state = context.get_continuous_state_vector().CopyToVector()

    smooth = dut.ToAutoDiffXd()
    autodiff = smooth.CreateDefaultContext()
    autodiff.SetContinuousState(InitializeAutoDiff(state).ravel())
    smooth.get_command_input_port().FixValue(autodiff, [AutoDiffXd(0.3)])
    smooth.get_estimated_state_input_port().FixValue(
        autodiff, [AutoDiffXd(0.1), AutoDiffXd(0.5)]
    )
    gradient = ExtractGradient(
        smooth.EvalTimeDerivatives(autodiff).CopyToVector()
    )

    for i, size in enumerate(np.maximum(np.abs(state), 1e-3)):
        columns = []
        for sign in (-1, 1):
            moved = state.copy()
            moved[i] += sign * 1e-6 * size
            context.SetContinuousState(moved)
            columns.append(dut.EvalTimeDerivatives(context).CopyToVector())
        numerical = (columns[1] - columns[0]) / (2e-6 * size)
        np.testing.assert_allclose(
            gradient[:, i],
            numerical,
            rtol=1e-4,
            atol=1e-6 * np.max(np.abs(numerical)) + 1e-9,
        )


def test_twin_is_a_template_over_all_scalars():
    assert ContinuousPneumaticActuation is ContinuousPneumaticActuation_[float]
    dut = ContinuousPneumaticActuation(make_parameters(n=2), mode="regulator")
    assert not dut.HasAnyDirectFeedthrough()
    copy = dut.ToAutoDiffXd()
    assert isinstance(copy, ContinuousPneumaticActuation_[AutoDiffXd])
    assert copy.GetInputPort("pressure_command").size() == 4


@pytest.mark.parametrize("mode", ["flow", "regulator"])
def test_an_expression_evaluates_to_the_same_derivatives(mode):
    """All that AutoDiffXd can, but for being differentiated by Drake."""
    random = np.random.default_rng(3)
    plain = ContinuousPneumaticActuation(
        make_parameters(n=2, leak_conductance=5e-12), mode=mode
    )
    symbolic = plain.ToSymbolic()
    variables = MakeVectorVariable(12, "x")
    context = plain.CreateDefaultContext()
    other = symbolic.CreateDefaultContext()
    other.SetContinuousState([Expression(x) for x in variables])
    command = [0.3, -0.6] if mode == "flow" else [2e5, 3e5, 4e5, 5e5]
    for dut, each, wrap in (
        (plain, context, float),
        (symbolic, other, Expression),
    ):
        dut.get_command_input_port().FixValue(each, [*map(wrap, command)])
        state = [*map(wrap, (0.1, -0.2, 0.5, -1.0))]
        dut.get_estimated_state_input_port().FixValue(each, state)
    rates = symbolic.EvalTimeDerivatives(other).CopyToVector()
    for _ in range(10):
        plain.set_pressures(context, *random.uniform(1.1e5, 6.5e5, (2, 2)))
        plain.set_strokes(context, random.uniform(-1, 1, 2))
        x = context.get_continuous_state_vector().CopyToVector()
        values = dict(zip(variables, x, strict=True))
        expected = plain.EvalTimeDerivatives(context).CopyToVector()
        found = [rate.Evaluate(values) for rate in rates]
        np.testing.assert_allclose(found, expected, rtol=1e-9)


def test_by_default_the_air_is_at_rest_in_the_middle_of_the_range():
    array = make_parameters(q=(-0.4, 1.0), leak_conductance=5e-12)
    dut = ContinuousPneumaticActuation(array)
    context = dut.CreateDefaultContext()
    dut.get_command_input_port().FixValue(context, [0.0])
    dut.get_estimated_state_input_port().FixValue(context, [0.3, 0.0])
    rest = resting_pressure(array)[0]
    pressure = dut.get_chamber_pressure_output_port().Eval(context)
    np.testing.assert_allclose(pressure, [rest, rest])
    rate = dut.EvalTimeDerivatives(context).CopyToVector()
    np.testing.assert_allclose(rate[:2], 0.0, atol=1e-3)


def test_twin_needs_a_lag():
    array = make_parameters()
    array[Row.VALVE_LAG] = 0.0
    with pytest.raises(InputError, match="valve lag"):
        ContinuousPneumaticActuation(array)
