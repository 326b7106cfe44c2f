"""The controller as a system, and the robot's body held by it."""

import numpy as np
from pydrake.multibody.plant import AddMultibodyPlant, MultibodyPlantConfig
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.primitives import ConstantVectorSource, VectorLogSink
import pytest

from drake_affetto.common.errors import InputError
from drake_affetto.control.pidf import (
    ControlParameters,
    JointGains,
    PidfGains,
    load_control,
    pidf_update,
)
from drake_affetto.control.pidf_controller import PidfConfig, PidfController
from drake_affetto.pneumatics.driver import (
    AddPneumaticDriver,
    PneumaticDriver,
)
from drake_affetto.pneumatics.parameters import JointActuator
from drake_affetto.scene.world import (
    ACTIVE_JOINTS,
    WorldConfig,
    add_world,
    joint_limits,
    robot_instance,
    set_posture,
    weld_inactive,
)

N = 2
GAINS = PidfGains(kP=[5e5, 6e5], kI=[3e5, 2e5], kD=[2e4, 3e4], kF=[5e-6, 4e-6])


def fixed(*, offset=True, **options):
    """A controller with its inputs fixed, and its context."""
    dut = PidfController(GAINS, **options)
    context = dut.CreateDefaultContext()
    fix(dut, context, offset=np.zeros(N) if offset else None)
    return dut, context


def fix(dut, context, desired=0.0, state=0.0, pressure=4e5, offset=None):
    for port, value in (
        (dut.get_desired_state_input_port(), desired),
        (dut.get_estimated_state_input_port(), state),
        (dut.get_chamber_pressure_input_port(), pressure),
    ):
        port.FixValue(context, np.broadcast_to(value, 2 * N).astype(float))
    if offset is not None:
        dut.get_equilibrium_offset_input_port().FixValue(context, offset)


def test_ports_are_those_of_the_design():
    dut, _ = fixed()
    assert {
        dut.get_input_port(i).get_name(): dut.get_input_port(i).size()
        for i in range(dut.num_input_ports())
    } == {
        "desired_state": 2 * N,
        "estimated_state": 2 * N,
        "chamber_pressure": 2 * N,
        "equilibrium_offset": N,
    }
    assert dut.get_valve_opening_output_port().size() == N
    assert dut.get_pid_output_output_port().get_name() == "pid_output"
    assert not dut.HasAnyDirectFeedthrough()


def test_updates_are_those_of_the_law_and_held_in_between():
    dut, context = fixed(integral_deadband=0.002)
    random = np.random.default_rng(0)
    integral, demand, opening = np.zeros(N), np.zeros(N), np.zeros(N)
    simulator = Simulator(dut, context)
    for k in range(6):
        desired = random.uniform(-0.3, 0.3, 2 * N)
        state = random.uniform(-0.3, 0.3, 2 * N)
        pressure = random.uniform(3e5, 5e5, 2 * N)
        offset = random.uniform(-1e4, 1e4, N)
        fix(dut, context, desired, state, pressure, offset)
        simulator.AdvanceTo(0.005 * k + 0.001)
        pidf_update(
            0.005,
            GAINS.to_array(),
            300e3,
            550e3,
            0.002,
            desired,
            state,
            pressure,
            offset,
            integral,
            demand,
            opening,
        )
        # Whatever comes in until the next update has no effect.
        fix(dut, context, 1.0, -1.0, 1e5, 5e5 * np.ones(N))
        simulator.AdvanceTo(0.005 * k + 0.004)
        found = dut.get_valve_opening_output_port().Eval(context)
        np.testing.assert_array_equal(found, opening)
        found = dut.get_pid_output_output_port().Eval(context)
        np.testing.assert_array_equal(found, demand)


def test_offset_is_zero_where_it_is_not_connected():
    values = []
    for offset in (True, False):
        dut, context = fixed(offset=offset)
        fix(dut, context, desired=0.1)
        Simulator(dut, context).AdvanceTo(0.02)
        values.append(dut.get_pid_output_output_port().Eval(context))
    np.testing.assert_array_equal(*values)


def test_offset_takes_the_place_of_the_integral():
    # What the controller asks for at rest, asked for without integral.
    dut, context = fixed()
    fix(dut, context, desired=np.array([0.05, -0.02, 0.0, 0.0]))
    Simulator(dut, context).AdvanceTo(1.0)
    equilibrium = dut.get_pid_output_output_port().Eval(context)
    assert np.all(np.abs(equilibrium) > 1e3)
    dut, context = fixed()
    dut.set_gains(context, GAINS.scaled(0.2))
    fix(dut, context, offset=equilibrium)
    Simulator(dut, context).AdvanceTo(0.02)
    np.testing.assert_allclose(
        dut.get_pid_output_output_port().Eval(context), equilibrium
    )


def test_gains_belong_to_the_context():
    dut, context = fixed()
    soft = GAINS.scaled(0.2)
    dut.set_gains(context, soft)
    np.testing.assert_array_equal(dut.get_gains(context).kP, soft.kP)
    fresh = dut.CreateDefaultContext()
    np.testing.assert_array_equal(dut.get_gains(fresh).kP, GAINS.kP)
    with pytest.raises(InputError, match="gains"):
        dut.set_gains(context, PidfGains([1.0], [1.0], [1.0], [1.0]))


def test_context_can_be_used_again_after_a_reset():
    dut, context = fixed()

    def trial():
        dut.reset(context)
        context.SetTime(0.0)
        fix(dut, context, desired=0.1)
        Simulator(dut, context).AdvanceTo(0.1)
        return dut.get_pid_output_output_port().Eval(context)

    first = trial()
    np.testing.assert_array_equal(trial(), first)
    dut.reset(context)
    assert not np.any(dut.get_valve_opening_output_port().Eval(context))


def test_integral_can_be_set_in_pressure():
    dut, context = fixed()
    dut.set_integral(context, [2e4, -1e4])
    Simulator(dut, context).AdvanceTo(0.001)
    np.testing.assert_allclose(
        dut.get_pid_output_output_port().Eval(context), [2e4, -1e4]
    )


def test_arguments_that_do_not_fit_are_named():
    with pytest.raises(InputError, match="period"):
        PidfController(GAINS, period=0.0)
    with pytest.raises(InputError, match="integral_limit"):
        PidfController(GAINS, integral_limit=-1.0)
    with pytest.raises(InputError, match=r"here\.period"):
        PidfConfig(period=3.0).check("here")


class Body:
    """The robot's body, its actuators and controllers."""

    def __init__(self):
        builder = DiagramBuilder()
        self.plant, _ = AddMultibodyPlant(
            MultibodyPlantConfig(
                time_step=0.001, discrete_contact_approximation="lagged"
            ),
            builder,
        )
        plant = self.plant
        add_world(plant, WorldConfig())
        weld_inactive(plant, ACTIVE_JOINTS)
        plant.Finalize()
        self.lower, self.upper = joint_limits(plant, ACTIVE_JOINTS)
        n = self.n = len(ACTIVE_JOINTS)
        joints = {name: JointActuator() for name in ACTIVE_JOINTS}
        self.systems = AddPneumaticDriver(
            PneumaticDriver(joints, control=PidfConfig()),
            plant,
            robot_instance(plant),
            builder,
        )
        self.reference = builder.AddSystem(
            ConstantVectorSource(np.zeros(2 * n))
        )
        self.log = builder.AddSystem(VectorLogSink(2 * n, 0.01))
        self.pressure_log = builder.AddSystem(VectorLogSink(2 * n, 0.01))
        controller = self.systems.controller
        for source, target in (
            (
                self.reference.get_output_port(),
                controller.get_desired_state_input_port(),
            ),
            (
                self.systems.joint_state.get_output_port(),
                self.log.get_input_port(),
            ),
            (
                self.systems.actuation.get_chamber_pressure_output_port(),
                self.pressure_log.get_input_port(),
            ),
        ):
            builder.Connect(source, target)
        self.diagram = builder.Build()

    def hold(self, start, desired, seconds):
        """Angles (n, N) and pressures (2n, N) at 100 Hz."""
        context = self.diagram.CreateDefaultContext()
        plant_context = self.plant.GetMyMutableContextFromRoot(context)
        set_posture(
            self.plant,
            plant_context,
            dict(zip(ACTIVE_JOINTS, map(float, start), strict=True)),
        )
        self.reference.get_mutable_source_value(
            self.reference.GetMyMutableContextFromRoot(context)
        ).set_value(np.concatenate([desired, np.zeros(self.n)]))
        self.systems.hold_posture(self.diagram, context)
        Simulator(self.diagram, context).AdvanceTo(seconds)
        return (
            self.log.FindLog(context).data()[: self.n],
            self.pressure_log.FindLog(context).data(),
        )


@pytest.fixture(scope="module")
def body():
    return Body()


@pytest.mark.parametrize("share", [0.35, 0.6])
def test_arm_holds_against_gravity_without_a_limit_cycle(body, share):
    posture = body.lower + share * (body.upper - body.lower)
    angles, pressures = body.hold(posture, posture, 6.0)
    error = np.degrees(np.abs(angles - posture[:, None]))
    assert np.all(np.max(error, axis=1) < 1.0)
    spread = np.std(angles[:, 300:], axis=1) / (body.upper - body.lower)
    assert np.all(spread < 0.005)
    # The arm's mean pressures stay where the underlap pins them; the waist,
    # which sways within the spread above, lets a little air in and out.
    mean = 0.5 * (pressures[: body.n] + pressures[body.n :])
    moved = np.abs(mean[:, -1] - mean[:, 0])
    waist = [name.startswith("waist") for name in ACTIVE_JOINTS]
    assert np.max(moved[np.logical_not(waist)]) < 30e3
    assert np.max(moved[waist]) < 80e3


def test_arm_reaches_another_posture_and_rests_there(body):
    span = body.upper - body.lower
    start, goal = body.lower + 0.5 * span, body.lower + 0.6 * span
    angles, _ = body.hold(start, goal, 8.0)
    rest = angles[:, 600:]
    error = np.degrees(np.abs(rest.mean(axis=1) - goal))
    assert np.all(error < 2.5)
    assert np.all(rest.std(axis=1) / span < 0.005)


def test_default_gains_name_every_active_joint():
    assert set(ACTIVE_JOINTS) <= set(load_control().gains)


def test_two_controllers_stand_in_one_diagram():
    """Of joints that no file of this repository knows."""
    builder = DiagramBuilder()
    parameters = ControlParameters(
        gains={"knee": JointGains(), "leg": JointGains()}
    )
    state = builder.AddSystem(ConstantVectorSource(np.zeros(2)))
    pressure = builder.AddSystem(ConstantVectorSource(np.full(2, 4e5)))
    for name in ("left", "right"):
        system = PidfController.AddToBuilder(
            builder=builder,
            joint_names=["hip" if name == "left" else "knee"],
            estimated_state=state.get_output_port(),
            chamber_pressure=pressure.get_output_port(),
            config=PidfConfig(parameters),
            actuator_classes={"hip": "leg"},
            name=name,
        )
        assert system.get_valve_opening_output_port().size() == 1
    diagram = builder.Build()
    assert diagram.GetSubsystemByName("right") is system
