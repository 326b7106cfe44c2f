"""The actuation system: ports, state, a plant in the loop."""

import numpy as np
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import (
    RevoluteJoint,
    RotationalInertia,
    SpatialInertia,
)
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.primitives import ConstantVectorSource, VectorLogSink
import pytest

from drake_affetto.common.errors import InputError
from drake_affetto.pneumatics.actuation import (
    PneumaticActuation,
    PneumaticActuationConfig,
)
from drake_affetto.pneumatics.chamber import Row
from drake_affetto.pneumatics.equilibrium import pressures_for_torque
from drake_affetto.pneumatics.parameters import (
    chamber_volumes,
    load_parameters,
    resting_pressure,
)
from support.actuator_bench import (
    Actuators,
    closed,
    make_parameters,
)

N = 3


def fixed(mode="flow", n=N, **fields):
    """A system with its inputs fixed at zero, and its context."""
    dut = PneumaticActuation(make_parameters(n, **fields), mode=mode)
    context = dut.CreateDefaultContext()
    size = n if mode == "flow" else 2 * n
    value = 0.0 if mode == "flow" else 3e5
    dut.get_command_input_port().FixValue(context, np.full(size, value))
    dut.get_estimated_state_input_port().FixValue(context, np.zeros(2 * n))
    return dut, context


def advance(dut, context, seconds):
    simulator = Simulator(dut, context)
    simulator.AdvanceTo(context.get_time() + seconds)


def test_ports_are_those_of_the_design():
    dut, _ = fixed()
    assert [
        dut.get_input_port(i).get_name() for i in range(dut.num_input_ports())
    ] == ["valve_opening", "estimated_state"]
    assert {
        dut.get_output_port(i).get_name(): dut.get_output_port(i).size()
        for i in range(dut.num_output_ports())
    } == {"actuation": N, "chamber_pressure": 2 * N, "mass_flow": 2 * N}
    assert dut.GetInputPort("estimated_state").size() == 2 * N
    assert not dut.HasAnyDirectFeedthrough()
    dut, _ = fixed("regulator")
    assert dut.GetInputPort("pressure_command").size() == 2 * N


def test_updates_are_those_of_the_kernel():
    dut, context = fixed(coulomb_torque=0.05, breakaway_torque=0.08)
    array = dut.get_parameters(context)
    random = np.random.default_rng(1)
    dut.set_pressures(context, [2e5, 3e5, 4e5], 2.5e5)
    kernel = Actuators(
        array, [2e5, 3e5, 4e5, 2.5e5, 2.5e5, 2.5e5], max_dead_time=0.0
    )
    simulator = Simulator(dut, context)
    for k in range(20):
        command = random.uniform(-1, 1, N)
        state = random.uniform(-0.5, 0.5, 2 * N)
        dut.get_command_input_port().FixValue(context, command)
        dut.get_estimated_state_input_port().FixValue(context, state)
        simulator.AdvanceTo(0.001 * (k + 1))
        kernel.step(command, state[:N], state[N:])
        for name, expected in (
            ("chamber_pressure", kernel.pressure),
            ("actuation", kernel.torque),
            ("mass_flow", kernel.mass_flow),
        ):
            found = dut.GetOutputPort(name).Eval(context)
            np.testing.assert_array_equal(found, expected)


def test_valves_fill_one_chamber_and_empty_the_other():
    dut, context = fixed(n=1, coulomb_torque=0.02, breakaway_torque=0.02)
    dut.get_command_input_port().FixValue(context, [1.0])
    advance(dut, context, 0.03)
    into = dut.get_mass_flow_output_port().Eval(context)
    assert into[0] > 0.0 > into[1]
    advance(dut, context, 3.0)
    p = dut.get_chamber_pressure_output_port().Eval(context)
    np.testing.assert_allclose(p, [659.3e3, 101.3e3], rtol=1e-3)
    torque = dut.get_actuation_output_port().Eval(context)
    assert torque[0] == pytest.approx(5e-6 * 558e3, rel=2e-2)


def test_regulator_holds_the_commanded_pressures():
    dut, context = fixed("regulator", n=2, leak_conductance=1e-12)
    command = np.array([2e5, 5e5, 3e5, 4e5])
    dut.get_command_input_port().FixValue(context, command)
    advance(dut, context, 2.0)
    p = dut.get_chamber_pressure_output_port().Eval(context)
    np.testing.assert_allclose(p, command, atol=2e3)


def test_valves_at_rest_settle_at_the_resting_pressure():
    dut, context = fixed(n=1, leak_conductance=5e-12)
    dut.set_pressures(context, 2e5, 6e5)
    advance(dut, context, 60.0)
    rest = resting_pressure(dut.get_parameters(context))[0]
    p = dut.get_chamber_pressure_output_port().Eval(context)
    np.testing.assert_allclose(p, [rest, rest], rtol=1e-3)


def test_default_actuators_rest_at_the_robots_mean_pressure():
    parameters = load_parameters()
    names = list(parameters.joints)
    n = len(names)
    array = parameters.for_joints(names, np.full(n, -0.5), np.full(n, 1.0))
    gauge = resting_pressure(array) - parameters.atmospheric_pressure
    np.testing.assert_allclose(gauge, 400e3, atol=10e3)


def test_context_can_be_used_again_after_a_reset():
    dut, context = fixed(coulomb_torque=0.05, breakaway_torque=0.08)

    def trial():
        dut.set_pressures(context, 3e5, 4e5)
        context.SetTime(0.0)
        dut.get_command_input_port().FixValue(context, [0.5, -0.3, 0.1])
        dut.get_estimated_state_input_port().FixValue(
            context, [0.1, 0.2, 0.3, 0.5, -0.5, 0.0]
        )
        advance(dut, context, 0.1)
        return dut.get_actuation_output_port().Eval(context)

    first = trial()
    np.testing.assert_array_equal(trial(), first)
    dut.reset(context)
    advance(dut, context, 0.05)
    np.testing.assert_array_equal(trial(), first)
    # Outputs are copies: what was read does not change under the reader.
    assert first is not dut.get_actuation_output_port().Eval(context)


def test_torque_is_known_before_the_first_update():
    dut, context = fixed(n=1, area_ratio=0.9)
    dut.set_pressures(context, 4e5, 3e5)
    expected = 5e-6 * (4e5 - 101.3e3) - 4.5e-6 * (3e5 - 101.3e3)
    torque = dut.get_actuation_output_port().Eval(context)
    assert torque[0] == pytest.approx(expected)


def test_parameters_of_the_context_count():
    dut, context = fixed(n=1)
    other = dut.get_parameters(context)
    other[Row.C_LEAK] = 1e-9
    dut.set_parameters(context, other)
    np.testing.assert_array_equal(dut.get_parameters(context), other)
    dut.set_pressures(context, 5e5, 5e5)
    advance(dut, context, 0.2)
    leaking = dut.get_chamber_pressure_output_port().Eval(context)[0]
    fresh = dut.CreateDefaultContext()
    assert dut.get_parameters(fresh)[Row.C_LEAK] == 0.0
    assert leaking < 4e5
    other[Row.DEAD_TIME] = 1.0
    with pytest.raises(InputError, match="dead time"):
        dut.set_parameters(context, other)
    with pytest.raises(InputError, match="shape"):
        dut.set_parameters(context, other[:, [0, 0]])


def test_arguments_that_do_not_fit_are_named():
    array = make_parameters()
    with pytest.raises(InputError, match="mode is 'fast'"):
        PneumaticActuation(array, mode="fast")
    with pytest.raises(InputError, match="time_step"):
        PneumaticActuation(array, time_step=0.0)
    with pytest.raises(InputError, match="parameters"):
        PneumaticActuation(array[:3])
    dut, context = fixed()
    with pytest.raises(InputError, match="p_b"):
        dut.set_pressures(context, 3e5, [1e5, -1.0, 1e5])
    with pytest.raises(InputError, match=r"here\.mode"):
        PneumaticActuationConfig(mode="x").check("here")


class Arm:
    """One joint on the actuation system, without gravity."""

    def __init__(self, array, inertia, *, time_step=0.001, sampled=True):
        builder = DiagramBuilder()
        self.plant = builder.AddSystem(MultibodyPlant(time_step))
        self.plant.SetUseSampledOutputPorts(sampled)
        link = self.plant.AddRigidBody(
            "link",
            SpatialInertia.MakeFromCentralInertia(
                1.0, [0, 0, 0], RotationalInertia(*[inertia] * 3)
            ),
        )
        joint = self.plant.AddJoint(
            RevoluteJoint(
                "joint",
                self.plant.world_frame(),
                link.body_frame(),
                [0, 1, 0],
                0.0,
            )
        )
        self.plant.AddJointActuator("joint", joint)
        self.plant.Finalize()
        self.actuation = builder.AddSystem(
            PneumaticActuation(
                array,
                time_step=time_step,
                look_ahead=0.0 if sampled else 1.0,
            )
        )
        valve = builder.AddSystem(ConstantVectorSource([0.0]))
        builder.Connect(
            valve.get_output_port(), self.actuation.get_command_input_port()
        )
        builder.Connect(
            self.plant.get_state_output_port(),
            self.actuation.get_estimated_state_input_port(),
        )
        builder.Connect(
            self.actuation.get_actuation_output_port(),
            self.plant.get_actuation_input_port(),
        )
        self.sinks = []
        for port in (
            self.plant.get_state_output_port(),
            self.actuation.get_chamber_pressure_output_port(),
        ):
            sink = builder.AddSystem(VectorLogSink(port.size(), time_step))
            builder.Connect(port, sink.get_input_port())
            self.sinks.append(sink)
        self.diagram = builder.Build()

    def swing(self, angle, pressure, seconds):
        """Lets go at `angle`; returns states (2, N) and pressures (2, N)."""
        context = self.diagram.CreateDefaultContext()
        self.plant.SetPositions(
            self.plant.GetMyMutableContextFromRoot(context), [angle]
        )
        self.actuation.set_pressures(
            self.actuation.GetMyMutableContextFromRoot(context),
            pressure,
            pressure,
        )
        Simulator(self.diagram, context).AdvanceTo(seconds)
        return [s.FindLog(context).data() for s in self.sinks]


@pytest.mark.parametrize("sampled", [True, False])
@pytest.mark.parametrize("inertia", [1e-3, 1e-2])
def test_closed_chambers_and_plant_keep_their_energy(inertia, sampled):
    # An undamped joint between two closed chambers swings for ever: neither
    # the coupling of the two systems nor the step puts energy in.
    array = closed(make_parameters())
    states, pressures = Arm(array, inertia, sampled=sampled).swing(
        0.5, 5e5, 10.0
    )
    swing = np.abs(states[0])
    first, last = swing[:2000].max(), swing[-2000:].max()
    assert last <= first * (1 + 1e-3)
    if sampled:
        assert last >= first * (1 - 1e-3)
        # The polytropic law at the plant's own angles, to 1e-4.
        volumes = np.array(chamber_volumes(array, states[0])).reshape(2, -1)
        invariant = pressures * volumes**1.2
        start = invariant[:, :1]
        np.testing.assert_allclose(
            invariant, np.broadcast_to(start, invariant.shape), rtol=1e-4
        )


@pytest.mark.parametrize("time_step", [0.001, 0.002])
def test_friction_brings_the_plant_to_rest_and_holds_it(time_step):
    array = closed(make_parameters(coulomb_torque=0.1, breakaway_torque=0.15))
    states, _ = Arm(array, 1e-3, time_step=time_step).swing(0.5, 5e5, 4.0)
    settled = states[:, states.shape[1] // 2 :]
    assert np.max(np.abs(settled[1])) < 1e-6
    assert np.ptp(settled[0]) < 1e-8
    # It came to rest away from the middle: friction holds a torque.
    assert abs(settled[0, -1]) > 0.01


def test_stiction_holds_while_the_pressure_difference_moves_by_60_kpa():
    # The real joints stay put while it moves by 60 to 90 kPa.
    parameters = load_parameters()
    array = parameters.for_joints(["left_elbow_flexion"], [0.0], [2.27])
    dut = PneumaticActuation(array, mode="regulator")
    context = dut.CreateDefaultContext()
    q, v, inertia, h = 1.0, 0.0, 2.5e-3, 0.001
    middle = 5e5
    dut.set_pressures(context, *pressures_for_torque(array, 0.0, middle))
    p0 = dut.get_chamber_pressure_output_port().Eval(context)
    simulator = Simulator(dut, context)
    moved = {}
    for swing in (30e3, 60e3):
        low = high = q
        for k in range(4000):
            shift = 0.5 * swing * np.sin(2 * np.pi * 0.5 * k * h)
            dut.get_command_input_port().FixValue(
                context, p0 + np.array([shift, -shift])
            )
            torque = dut.get_actuation_output_port().Eval(context)[0]
            v = (v + h / inertia * torque) / (1 + h / inertia * 0.1)
            q += h * v
            dut.get_estimated_state_input_port().FixValue(context, [q, v])
            simulator.AdvanceTo(context.get_time() + h)
            low, high = min(low, q), max(high, q)
        moved[swing] = np.degrees(high - low)
    # Δp swings by ±30 and by ±60 kPa about the balance.
    assert moved[30e3] < 0.3
    assert moved[60e3] > 3.0
