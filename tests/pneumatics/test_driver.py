"""Pneumatics for robots that are not Affetto."""

import dataclasses

import numpy as np
from pydrake.common.yaml import yaml_load_typed
from pydrake.manipulation import ApplyDriverConfigs, ZeroForceDriver
from pydrake.multibody.parsing import Parser
from pydrake.multibody.plant import AddMultibodyPlantSceneGraph
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.lcm import LcmBuses
import pytest

from drake_affetto.common.errors import InputError
from drake_affetto.control.pidf import ControlParameters, JointGains
from drake_affetto.control.pidf_controller import PidfConfig
from drake_affetto.pneumatics.actuation import PneumaticActuationConfig
from drake_affetto.pneumatics.chamber import Row
from drake_affetto.pneumatics.driver import (
    ApplyPneumaticDriver,
    PneumaticDriver,
)
from drake_affetto.pneumatics.parameters import (
    ActuatorClass,
    JointActuator,
    PneumaticParameters,
    load_parameters,
)
from support.two_link_arm import GAINS, add_plant, build, driver

ONE_JOINT = """<sdf version="1.9"><model name="{name}"><link name="rod">
<inertial><pose>0 0 -0.1 0 0 0</pose><mass>0.3</mass><inertia><ixx>1e-3</ixx>
<iyy>1e-3</iyy><izz>1e-4</izz></inertia></inertial></link>
<joint name="elbow" type="revolute"><parent>world</parent><child>rod</child>
<axis><xyz>0 1 0</xyz>{limit}<dynamics><damping>0.05</damping></dynamics>
</axis></joint></model></sdf>"""
LIMIT = "<limit><lower>-1</lower><upper>1</upper></limit>"


def ports(diagram):
    inputs = [
        diagram.get_input_port(i) for i in range(diagram.num_input_ports())
    ]
    outputs = [
        diagram.get_output_port(i) for i in range(diagram.num_output_ports())
    ]
    return (
        {p.get_name(): p.size() for p in inputs},
        {p.get_name(): p.size() for p in outputs},
    )


def test_a_one_joint_arm_closes_its_loop_in_eleven_lines():
    builder = DiagramBuilder()
    plant, _ = AddMultibodyPlantSceneGraph(builder, time_step=0.001)
    text = ONE_JOINT.format(name="arm", limit=LIMIT)
    (arm,) = Parser(plant).AddModelsFromString(text, "sdf")
    plant.Finalize()
    control = PidfConfig(ControlParameters(gains={"elbow": GAINS}))
    config = PneumaticDriver({"elbow": JointActuator("elbow")}, control=control)
    ApplyPneumaticDriver(config, plant, arm, builder)
    simulator = Simulator(builder.Build())
    arm, context = simulator.get_system(), simulator.get_mutable_context()
    arm.GetInputPort("arm.desired_state").FixValue(context, [0.5, 0.0])
    simulator.AdvanceTo(3.0)
    q = arm.GetOutputPort("arm.estimated_state").Eval(context)[0]
    assert q == pytest.approx(0.5, abs=0.03)


def test_ports_of_the_diagram_are_the_model_s():
    outputs = {
        "two_link_arm.estimated_state": 4,
        "two_link_arm.actuation": 2,
        "two_link_arm.chamber_pressure": 4,
        "two_link_arm.mass_flow": 4,
    }
    diagram, systems = build(driver(control=False))
    assert ports(diagram) == ({"two_link_arm.valve_opening": 2}, outputs)
    assert systems.controller is None
    regulator = PneumaticActuationConfig(mode="regulator")
    diagram, _ = build(driver(control=False, pneumatics=regulator))
    assert ports(diagram) == ({"two_link_arm.pressure_command": 4}, outputs)
    diagram, _ = build(driver())
    assert ports(diagram) == (
        {
            "two_link_arm.desired_state": 4,
            "two_link_arm.equilibrium_offset": 2,
        },
        {
            **outputs,
            "two_link_arm.valve_opening": 2,
            "two_link_arm.pid_output": 2,
        },
    )


def test_the_arm_rests_in_its_posture_and_reaches_another():
    diagram, systems = build(driver())
    context = diagram.CreateDefaultContext()
    plant = systems.plant
    own = plant.GetMyMutableContextFromRoot(context)
    start, goal = np.array([0.3, 0.6]), np.array([0.8, 1.2])
    plant.SetPositions(own, start)
    systems.hold_posture(diagram, context)
    desired = diagram.GetInputPort("two_link_arm.desired_state")
    state = diagram.GetOutputPort("two_link_arm.estimated_state")
    simulator = Simulator(diagram, context)
    for posture, until, near in ((start, 0.5, 3e-3), (goal, 4.0, 0.03)):
        desired.FixValue(context, [*posture, 0.0, 0.0])
        simulator.AdvanceTo(until)
        q = state.Eval(context)[:2]
        np.testing.assert_allclose(q, posture, atol=near)


def test_two_models_of_one_plant_have_drivers_of_their_own():
    builder = DiagramBuilder()
    plant, arms = add_plant(builder, models=2)
    for arm in arms:
        ApplyPneumaticDriver(driver(control=False), plant, arm, builder)
    diagram = builder.Build()
    context = diagram.CreateDefaultContext()
    for name, opening in (("two_link_arm", 0.5), ("two_link_arm_1", -0.5)):
        port = diagram.GetInputPort(f"{name}.valve_opening")
        port.FixValue(context, [0.0, opening])
    Simulator(diagram, context).AdvanceTo(0.2)
    torque = [
        diagram.GetOutputPort(f"{name}.actuation").Eval(context)[1]
        for name in ("two_link_arm", "two_link_arm_1")
    ]
    assert torque[0] > 0.2 > -0.2 > torque[1]


def array_of(config):
    """Names and parameter array of a driver of the arm."""
    diagram, systems = build(config)
    context = systems.actuation.GetMyContextFromRoot(
        diagram.CreateDefaultContext()
    )
    return systems.joints.names, systems.actuation.get_parameters(context)


def test_parameters_come_by_class_by_joint_by_path_and_from_a_fit(tmp_path):
    names, usual = array_of(driver(control=False))
    known = load_parameters().classes
    assert names == ("shoulder", "elbow")
    assert usual[Row.K_A].tolist() == [
        known[name].torque_constant for name in names
    ]
    # The chambers reach from one limit of the joint to the other.
    assert usual[Row.Q_LOWER].tolist() == [-1.0, 0.0]
    assert usual[Row.Q_UPPER].tolist() == [1.5, 2.2]
    _, own = array_of(driver(control=False, override={"dead_time": 0.004}))
    assert own[Row.DEAD_TIME].tolist() == [0.004] * 2
    # As `affetto identify` writes it.
    fit = tmp_path / "actuator.yaml"
    fit.write_text("classes:\n  elbow:\n    dead_volume: 2.0e-5\n")
    overlaid = PneumaticActuationConfig(overlays=[str(fit)])
    _, fitted = array_of(driver(control=False, pneumatics=overlaid))
    assert fitted[Row.V_A].tolist() == [usual[Row.V_A, 0], 2e-5]
    # A file of another robot, which names the joints itself: in the order of
    # the model, if the driver names none.
    file = tmp_path / "pneumatics.yaml"
    file.write_text(
        "classes: {big: {torque_constant: 9.0e-6}}\n"
        "joints: {elbow: {actuator: big}, wing: {actuator: big},\n"
        "  shoulder: {actuator: big, override: {torque_constant: 1.0e-5}}}\n"
    )
    by_path = PneumaticActuationConfig(parameters=str(file))
    names, array = array_of(PneumaticDriver(pneumatics=by_path))
    assert names == ("shoulder", "elbow")
    assert array[Row.K_A].tolist() == [1e-5, 9e-6]
    names, array = array_of(
        PneumaticDriver(
            {"elbow": JointActuator(override={"dead_time": 0.0})}, by_path
        )
    )
    assert names == ("elbow",)
    assert array[[Row.K_A, Row.DEAD_TIME], 0].tolist() == [9e-6, 0.0]


def test_gains_come_by_joint_before_class():
    gains = {"elbow": GAINS, "shoulder": JointGains(kP=2e5)}
    config = PneumaticDriver(
        joints={name: JointActuator("elbow") for name in ("shoulder", "elbow")},
        control=PidfConfig(ControlParameters(gains=gains)),
    )
    diagram, systems = build(config)
    context = systems.controller.GetMyContextFromRoot(
        diagram.CreateDefaultContext()
    )
    found = systems.controller.get_gains(context)
    assert found.kP.tolist() == [2e5, 1e6]
    del gains["shoulder"]
    diagram, systems = build(config)
    context = diagram.CreateDefaultContext()
    found = systems.controller.get_gains(
        systems.controller.GetMyContextFromRoot(context)
    )
    assert found.kP.tolist() == [1e6, 1e6]


@dataclasses.dataclass
class Scenario:
    """As in Drake's hardware_sim."""

    model_drivers: dict[str, PneumaticDriver | ZeroForceDriver] = (
        dataclasses.field(default_factory=dict)
    )


SCENARIO = """
model_drivers:
  two_link_arm: !PneumaticDriver
    joints:
      elbow: {actuator: large}
      shoulder: {actuator: large, override: {dead_time: 0.0}}
    pneumatics:
      parameters: !PneumaticParameters
        classes:
          large: {torque_constant: 8.0e-6}
    control:
      period: 0.002
      parameters: !ControlParameters
        gains:
          large: {kP: 1.0e6, kI: 1.5e6, kD: 4.0e4, kF: 4.0e-6}
  two_link_arm_1: !ZeroForceDriver {}
"""


def test_a_scenario_names_it_by_tag_and_drake_applies_it():
    scenario = yaml_load_typed(schema=Scenario, data=SCENARIO)
    config = scenario.model_drivers["two_link_arm"]
    assert config == PneumaticDriver(
        joints={
            "elbow": JointActuator("large"),
            "shoulder": JointActuator("large", {"dead_time": 0.0}),
        },
        pneumatics=PneumaticActuationConfig(
            parameters=PneumaticParameters(
                classes={"large": ActuatorClass(torque_constant=8e-6)}
            )
        ),
        control=PidfConfig(
            ControlParameters(gains={"large": GAINS}), period=0.002
        ),
    )
    builder = DiagramBuilder()
    plant, _ = add_plant(builder, models=2)
    ApplyDriverConfigs(
        driver_configs=scenario.model_drivers,
        sim_plant=plant,
        models_from_directives=[],
        lcm_buses=LcmBuses(),
        builder=builder,
    )
    diagram = builder.Build()
    context = diagram.CreateDefaultContext()
    desired = diagram.GetInputPort("two_link_arm.desired_state")
    desired.FixValue(context, [0.9, 0.4, 0.0, 0.0])
    Simulator(diagram, context).AdvanceTo(2.0)
    q = diagram.GetOutputPort("two_link_arm.estimated_state").Eval(context)[:2]
    # The driver's order, not the model's.
    np.testing.assert_allclose(q, [0.9, 0.4], atol=0.1)


NO_LIMITS = ONE_JOINT.format(name="free", limit="")


@pytest.mark.parametrize(
    ("config", "message"),
    [
        (
            PneumaticDriver({"knee": JointActuator("elbow")}),
            "model two_link_arm has no joint 'knee'; known are shoulder, elbow",
        ),
        (
            PneumaticDriver({"elbow": JointActuator("leg")}),
            r"two_link_arm\.joints\.elbow\.actuator is 'leg', expected one of",
        ),
        (
            PneumaticDriver({"elbow": JointActuator("elbow", {"mass": 1.0})}),
            r"two_link_arm\.joints\.elbow\.override is 'mass', expected one of",
        ),
        (
            PneumaticDriver(),
            r"two_link_arm\.joints are not given, .* shoulder, elbow",
        ),
        (
            PneumaticDriver(
                {"elbow": JointActuator("elbow")}, control=PidfConfig()
            ),
            "no gains for joint 'elbow' or its class 'elbow'; known: .*waist",
        ),
        (
            driver(pneumatics=PneumaticActuationConfig(mode="regulator")),
            r"two_link_arm\.pneumatics\.mode is 'regulator', expected 'flow'",
        ),
        (
            driver(pneumatics=PneumaticActuationConfig(parameters="none.yaml")),
            "no such file: none.yaml",
        ),
    ],
)
def test_what_does_not_fit_is_named_in_one_line(config, message):
    with pytest.raises(InputError, match=message) as raised:
        build(config)
    assert "\n" not in str(raised.value)


def test_a_joint_without_limits_is_named():
    builder = DiagramBuilder()
    plant, _ = AddMultibodyPlantSceneGraph(builder, time_step=0.001)
    (model,) = Parser(plant).AddModelsFromString(NO_LIMITS, "sdf")
    plant.Finalize()
    config = PneumaticDriver({"elbow": JointActuator("elbow")})
    with pytest.raises(
        InputError, match=r"range of joint elbow is \[-inf, inf\], expected"
    ):
        ApplyPneumaticDriver(config, plant, model, builder)


def test_two_drivers_on_one_joint_are_refused():
    builder = DiagramBuilder()
    plant, (arm,) = add_plant(builder)
    ApplyPneumaticDriver(driver(), plant, arm, builder)
    second = PneumaticDriver({"elbow": JointActuator("elbow")})
    with pytest.raises(
        InputError, match="joints elbow of model two_link_arm have a driver"
    ):
        ApplyPneumaticDriver(second, plant, arm, builder)


SMOOTH = {"coulomb_torque": 0.0, "breakaway_torque": 0.0, "dead_time": 0.0}


def test_a_continuous_plant_gets_the_same_actuators_in_continuous_time():
    config = driver(override=SMOOTH)
    config.control.period = 0.0005
    angles = []
    for time_step in (0.0005, 0.0):
        diagram, systems = build(config, time_step)
        log = []
        context = diagram.CreateDefaultContext()
        systems.hold_posture(diagram, context)
        desired = diagram.GetInputPort("two_link_arm.desired_state")
        desired.FixValue(context, [0.5, 0.8, 0.0, 0.0])
        state = diagram.GetOutputPort("two_link_arm.estimated_state")
        simulator = Simulator(diagram, context)
        for time in np.linspace(0.05, 0.6, 12):
            simulator.AdvanceTo(time)
            log.append(state.Eval(context)[:2])
        angles.append(log)
    discrete, continuous = np.array(angles)
    assert np.ptp(continuous[:, 0]) > 0.3
    np.testing.assert_allclose(discrete, continuous, atol=0.01)


def test_an_equilibrium_is_one_of_the_open_loop():
    diagram, systems = build(driver(control=False, override=SMOOTH), 0.0)
    context = diagram.CreateDefaultContext()
    plant = systems.plant
    plant.SetPositions(plant.GetMyMutableContextFromRoot(context), [0.4, 0.9])
    opening = systems.find_equilibrium(diagram, context)
    port = diagram.GetInputPort("two_link_arm.valve_opening")
    port.FixValue(context, opening)
    rate = diagram.EvalTimeDerivatives(context).CopyToVector()
    q_ddot, p_dot = rate[2:4], rate[4:8]
    np.testing.assert_allclose(q_ddot, 0.0, atol=1e-6)
    np.testing.assert_allclose(p_dot, 0.0, atol=1e-2)


def test_pressure_regulators_have_no_openings_to_be_held():
    regulator = PneumaticActuationConfig(mode="regulator")
    diagram, systems = build(driver(control=False, pneumatics=regulator))
    with pytest.raises(InputError, match="pressure_command"):
        systems.find_equilibrium(diagram, diagram.CreateDefaultContext())


def test_joints_without_a_driver_get_no_torque():
    config = PneumaticDriver({"elbow": JointActuator("elbow")})
    diagram, systems = build(config)
    context = diagram.CreateDefaultContext()
    systems.actuation.set_pressures(
        systems.actuation.GetMyMutableContextFromRoot(context), 6e5, 2e5
    )
    torque = diagram.GetOutputPort("two_link_arm.actuation").Eval(context)
    applied = systems.plant.get_actuation_input_port(
        systems.joints.model_instance
    ).Eval(systems.plant.GetMyContextFromRoot(context))
    assert applied.tolist() == [0.0, torque[0]]
    assert torque[0] > 1.0


def test_the_discrete_arm_stays_at_the_equilibrium():
    diagram, systems = build(driver(control=False))
    plant = systems.plant
    context = diagram.CreateDefaultContext()
    plant.SetPositions(plant.GetMyMutableContextFromRoot(context), [0.4, 0.9])
    opening = systems.find_equilibrium(diagram, context)
    port = diagram.GetInputPort("two_link_arm.valve_opening")
    port.FixValue(context, opening)
    Simulator(diagram, context).AdvanceTo(1.0)
    state = diagram.GetOutputPort("two_link_arm.estimated_state").Eval(context)
    np.testing.assert_allclose(state, [0.4, 0.9, 0.0, 0.0], atol=5e-3)


def test_a_piston_drives_a_prismatic_joint():
    text = ONE_JOINT.format(name="lift", limit=LIMIT)
    text = text.replace("revolute", "prismatic").replace("0 1 0", "0 0 1")
    builder = DiagramBuilder()
    plant, _ = AddMultibodyPlantSceneGraph(builder, time_step=0.001)
    (model,) = Parser(plant).AddModelsFromString(text, "sdf")
    plant.Finalize()
    piston = ActuatorClass(torque_constant=3e-4, dead_volume=1e-4)  # m², m³
    parameters = PneumaticParameters(
        classes={"piston": piston}, joints={"elbow": JointActuator("piston")}
    )
    regulator = PneumaticActuationConfig("regulator", parameters)
    config = PneumaticDriver(pneumatics=regulator)
    ApplyPneumaticDriver(config, plant, model, builder)
    simulator = Simulator(builder.Build())
    lift, context = simulator.get_system(), simulator.get_context()
    command = lift.GetInputPort("lift.pressure_command")
    moved = []
    for pressure in ([5e5, 1.1e5], [1.1e5, 5e5]):
        command.FixValue(context, pressure)
        simulator.AdvanceTo(context.get_time() + 3.0)
        q = lift.GetOutputPort("lift.estimated_state").Eval(context)[0]
        p = lift.GetOutputPort("lift.chamber_pressure").Eval(context) - 101.3e3
        force = lift.GetOutputPort("lift.actuation").Eval(context)[0]
        # N from Pa and m², but for the friction.
        assert force == pytest.approx(3e-4 * (p[0] - 0.95 * p[1]), abs=0.16)
        moved.append(q)
    # Up, then down: slowly, for a liter flows through the valves of a joint.
    assert moved[0] > 0.05 > -0.05 > moved[1]
