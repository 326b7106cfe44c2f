"""Pneumatics for a model of any plant, as a driver that a scenario names.

A driver is what stands between a command and the joints of a model: here
valves, chambers and friction, and if wanted the PIDF controllers. Scenarios of
Drake's kind name it by its tag among their `model_drivers`:

    model_drivers:
      arm: !PneumaticDriver
        joints:
          shoulder: {actuator: shoulder}
          elbow: {actuator: elbow, override: {dead_time: 0.005}}
        control:
          parameters: !ControlParameters
            gains:
              shoulder: {kP: 5.0e5, kI: 3.0e5, kD: 2.5e4, kF: 1.5e-5}
              elbow: {kP: 5.0e5, kI: 3.0e5, kD: 2.5e4, kF: 1.5e-5}
"""

from collections.abc import Callable, Mapping
import dataclasses
from typing import Any

from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import ModelInstanceIndex
from pydrake.systems.framework import (
    Context,
    Diagram,
    DiagramBuilder,
    LeafSystem,
    OutputPort,
)

from drake_affetto.common.errors import InputError, require
from drake_affetto.common.typing import Array
from drake_affetto.control.continuous_pidf import ContinuousPidfController
from drake_affetto.control.pidf import load_control
from drake_affetto.control.pidf_controller import (
    PidfConfig,
    PidfController,
    connect_feedback,
)
from drake_affetto.pneumatics.actuation import (
    PneumaticActuation,
    PneumaticActuationConfig,
    add_actuation,
)
from drake_affetto.pneumatics.continuous import ContinuousPneumaticActuation
from drake_affetto.pneumatics.equilibrium import (
    opening_for_torque,
    pressures_for_torque,
)
from drake_affetto.pneumatics.parameters import (
    JointActuator,
    PneumaticParameters,
    load_parameters,
    resting_pressure,
)
from drake_affetto.scene.joint_state import make_joint_state
from drake_affetto.scene.joints import (
    JointSelection,
    find_joint,
    joint_names,
    select_joints,
)

# Joints, and the ports of [q; q̇] and of [p_a; p_b], to both ports as read.
Sense = Callable[
    [JointSelection, OutputPort, OutputPort], tuple[OutputPort, OutputPort]
]

# The controller's command, to the command that reaches the valves.
Carry = Callable[[OutputPort], OutputPort]


@dataclasses.dataclass
class PneumaticDriver:
    """Pneumatic actuators of a model's joints, controlled or not.

    Attributes:
        joints: Joint -> its actuator, in the order of the ports. Joints that
            say nothing of it (`elbow: {}`) have what `pneumatics.parameters`
            say. By default the model's joints that these name.
        pneumatics: Mode, and parameters of supply and actuator classes: as
            values (tag `!PneumaticParameters`), as a file, and with overlays
            as `affetto identify` writes them. By default Affetto's.
        control: The PIDF controllers: period, and gains by joint or by
            actuator class, as values (tag `!ControlParameters`) or as a file.
            None: the command is an input of the diagram.
    """

    joints: dict[str, JointActuator] = dataclasses.field(default_factory=dict)
    pneumatics: PneumaticActuationConfig = dataclasses.field(
        default_factory=PneumaticActuationConfig
    )
    control: PidfConfig | None = None

    def check(self, where: str) -> None:
        """Raises InputError naming the first field that does not fit."""
        self.pneumatics.check(f"{where}.pneumatics")
        if self.control is not None:
            self.control.check(f"{where}.control")
            require(
                self.pneumatics.mode == "flow",
                f"{where}.pneumatics.mode",
                self.pneumatics.mode,
                "'flow' where the valves are controlled by PIDF (Eq. 7)",
            )


@dataclasses.dataclass(frozen=True)
class PneumaticSystems:
    """What a driver has added to a diagram.

    Attributes:
        plant: The plant that it drives.
        joints: The joints and their order.
        joint_state: System with the output [q; q̇] (2n) of the joints.
        actuation: `PneumaticActuation`, or its continuous version in a
            continuous plant.
        controller: `PidfController`, or its continuous version, or None.
        estimated_state: Port of [q; q̇] (2n), as read.
        chamber_pressure: Port of [p_a; p_b] (2n), as read.
    """

    plant: MultibodyPlant
    joints: JointSelection
    joint_state: LeafSystem
    actuation: Any
    controller: Any
    estimated_state: OutputPort
    chamber_pressure: OutputPort

    def hold_posture(self, diagram: Diagram, context: Context) -> Array:
        """Makes the joints rest where they are.

        The pressures, about those of the valves' rest, carry gravity, and the
        controller's integral asks for just these.

        Args:
            diagram: The diagram that was built with the systems.
            context: Its context.

        Returns:
            Pressure differences p_a - p_b (n), Pa.
        """
        actuation = diagram.GetMutableSubsystemContext(self.actuation, context)
        p_a, p_b = pressures_for_torque(
            self.actuation.get_parameters(actuation),
            self._holding_torque(diagram, context),
        )
        self.actuation.set_pressures(actuation, p_a, p_b)
        if self.controller is not None:
            controller = diagram.GetMutableSubsystemContext(
                self.controller, context
            )
            if isinstance(self.controller, PidfController):
                self.controller.reset(controller, p_a - p_b)
            self.controller.set_integral(controller, p_a - p_b)
        return p_a - p_b

    def find_equilibrium(self, diagram: Diagram, context: Context) -> Array:
        """Puts the valves and chambers at rest where the joints are.

        Unlike `hold_posture` this is an operating point of the open loop, in
        flow mode: under the constant openings that are returned the chambers
        keep their pressures, which carry gravity.

        Args:
            diagram: The diagram that was built with the systems.
            context: Its context.

        Returns:
            Valve openings v⁺ (n).

        Raises:
            InputError: In regulator mode.
        """
        command = self.actuation.get_command_input_port().get_name()
        require(command == "valve_opening", "command", command, "valve_opening")
        actuation = diagram.GetMutableSubsystemContext(self.actuation, context)
        parameters = self.actuation.get_parameters(actuation)
        opening = opening_for_torque(
            parameters, self._holding_torque(diagram, context)
        )
        self.actuation.set_pressures(
            actuation,
            resting_pressure(parameters, opening),
            resting_pressure(parameters, -opening),
        )
        if isinstance(self.actuation, ContinuousPneumaticActuation):
            self.actuation.set_strokes(actuation, opening)
        return opening

    def _holding_torque(self, diagram: Diagram, context: Context) -> Array:
        """Torques (n) [N m] that hold the joints against gravity."""
        gravity = self.plant.CalcGravityGeneralizedForces(
            diagram.GetSubsystemContext(self.plant, context)
        )
        model = self.plant.GetVelocitiesFromArray(
            self.joints.model_instance, gravity
        )
        return -model[self.joints.velocities]


def AddPneumaticDriver(
    config: PneumaticDriver,
    plant: MultibodyPlant,
    model_instance: ModelInstanceIndex,
    builder: DiagramBuilder,
    sense: Sense | None = None,
    longest_delay: float = 0.0,
    carry: Carry | None = None,
) -> PneumaticSystems:
    """Adds a model's pneumatics, for a diagram that has the command itself.

    It is `ApplyPneumaticDriver`, which names arguments, outputs and errors, but
    for the inputs: they are left to be connected. And sensors may stand between
    the joints and whoever reads them: `sense` adds them, given the joints and
    the ports of their true state and chamber pressure, and returns the ports of
    both as read. `longest_delay` is the most, s, that a trial adds to a dead
    time. `carry` adds what carries the controller's commands to the valves; the
    actuators then have inputs for faults, which are left to be connected too.

    Args:
        model_instance: The model's instance in the plant.
    """
    model = plant.GetModelInstanceName(model_instance)
    config.check(model)
    parameters = _driver_parameters(config, plant, model_instance)
    joints = select_joints(plant, list(parameters.joints), model_instance)
    state = builder.AddNamedSystem(
        f"{model}.joint_state", make_joint_state(joints, plant.time_step())
    )
    builder.Connect(
        plant.get_state_output_port(model_instance), state.get_input_port()
    )
    true_state = state.get_output_port()
    actuation = _add_actuation(
        config.pneumatics,
        parameters,
        plant,
        joints,
        builder,
        true_state,
        longest_delay,
        carry is not None,
    )
    read = true_state, actuation.get_chamber_pressure_output_port()
    if sense is not None:
        read = sense(joints, *read)
    for port, name in zip(
        read, ("estimated_state", "chamber_pressure"), strict=True
    ):
        builder.ExportOutput(port, f"{model}.{name}")
    outputs = [
        actuation.GetOutputPort(name)
        for name in ("actuation", "mass_flow")
        if actuation.HasOutputPort(name)
    ]
    controller = None
    if config.control is not None:
        controller = _add_controller(
            config.control,
            parameters,
            plant,
            model,
            builder,
            *read,
        )
        opening = controller.get_valve_opening_output_port()
        builder.Connect(
            opening if carry is None else carry(opening),
            actuation.get_command_input_port(),
        )
        outputs += [opening, controller.get_pid_output_output_port()]
    for port in outputs:
        builder.ExportOutput(port, f"{model}.{port.get_name()}")
    return PneumaticSystems(plant, joints, state, actuation, controller, *read)


def ApplyPneumaticDriver(
    config: PneumaticDriver,
    plant: MultibodyPlant,
    model_instance: ModelInstanceIndex,
    builder: DiagramBuilder,
) -> PneumaticSystems:
    """Adds a model's pneumatics and exports their ports as `{model}.{port}`.

    With n joints, in the order of `config.joints`:

    - inputs, without a controller: `valve_opening` (n) in [-1, 1], or
      `pressure_command` (2n), Pa absolute, whichever the mode has;
    - inputs, with it: `desired_state` (2n), rad and rad/s, and
      `equilibrium_offset` (n), Pa, which need not be connected;
    - outputs: `estimated_state` (2n), `actuation` (n), N m,
      `chamber_pressure` (2n), Pa absolute, `mass_flow` (2n), kg/s (not of the
      continuous version), and of a controller `valve_opening` (n) and
      `pid_output` (n), Pa.

    With a continuous plant (time step 0) the continuous versions are taken:
    without dry friction, dead time and sampling, but for all of Drake's scalar
    types.

    For a prismatic joint read m for rad and N for N m; its torque constant is
    the piston's area.

    Args:
        config: The driver.
        plant: Finalized plant in `builder`, discrete or continuous.
        model_instance: The model whose joints are driven.
        builder: Builder of the diagram.

    Returns:
        The systems that were added.

    Raises:
        InputError: For a joint or class that is not known, a joint without
            limits or actuator, joints that have a driver already, or another
            field that does not fit.
    """
    systems = AddPneumaticDriver(config, plant, model_instance, builder)
    if systems.controller is None:
        inputs = [systems.actuation.get_command_input_port()]
    else:
        inputs = [
            systems.controller.get_desired_state_input_port(),
            systems.controller.get_equilibrium_offset_input_port(),
        ]
    model = plant.GetModelInstanceName(model_instance)
    for port in inputs:
        builder.ExportInput(port, f"{model}.{port.get_name()}")
    return systems


def ApplyDriverConfig(
    driver_config: PneumaticDriver,
    model_instance_name: str,
    sim_plant: MultibodyPlant,
    models_from_directives: Mapping[str, Any],
    lcms: Any,
    builder: DiagramBuilder,
) -> None:
    """`ApplyPneumaticDriver` as `pydrake.manipulation.ApplyDriverConfigs` asks.

    That function finds this one by its name beside the config's class, and
    gives it the arguments that Drake's own drivers need.
    """
    ApplyPneumaticDriver(
        driver_config,
        sim_plant,
        sim_plant.GetModelInstanceByName(model_instance_name),
        builder,
    )


def _driver_parameters(
    config: PneumaticDriver,
    plant: MultibodyPlant,
    model_instance: ModelInstanceIndex,
) -> PneumaticParameters:
    """The parameters with exactly the driven joints, in their order."""
    pneumatics = config.pneumatics
    known = load_parameters(pneumatics.parameters, pneumatics.overlays)
    model = plant.GetModelInstanceName(model_instance)
    names = list(config.joints) or [
        name
        for name in joint_names(plant, model_instance)
        if name in known.joints
    ]
    if not names:
        raise InputError(
            f"{model}.joints are not given, and the parameters name none of "
            "its joints, expected one of "
            f"{', '.join(joint_names(plant, model_instance))}"
        )
    joints = {}
    for name in names:
        find_joint(plant, model_instance, name)
        joints[name] = config.joints.get(name, JointActuator())
        if not joints[name].actuator and name in known.joints:
            usual = known.joints[name]
            joints[name] = JointActuator(
                usual.actuator, usual.override | joints[name].override
            )
    parameters = dataclasses.replace(known, joints=joints)
    parameters.check(model)
    return parameters


def _add_actuation(
    config: PneumaticActuationConfig,
    parameters: PneumaticParameters,
    plant: MultibodyPlant,
    joints: JointSelection,
    builder: DiagramBuilder,
    estimated_state: OutputPort,
    longest_delay: float,
    faulty: bool,
) -> Any:
    name = f"{plant.GetModelInstanceName(joints.model_instance)}.pneumatics"
    if plant.time_step() == 0.0:
        return add_actuation(
            builder,
            plant,
            joints,
            estimated_state,
            ContinuousPneumaticActuation(parameters, joints, mode=config.mode),
            name,
        )
    return PneumaticActuation.AddToBuilder(
        builder=builder,
        plant=plant,
        joints=joints,
        estimated_state=estimated_state,
        config=dataclasses.replace(config, parameters=parameters, overlays=[]),
        longest_delay=longest_delay,
        faulty=faulty,
        name=name,
    )


def _add_controller(
    config: PidfConfig,
    parameters: PneumaticParameters,
    plant: MultibodyPlant,
    model: str,
    builder: DiagramBuilder,
    estimated_state: OutputPort,
    chamber_pressure: OutputPort,
) -> Any:
    name = f"{model}.controller"
    names = list(parameters.joints)
    classes = {key: each.actuator for key, each in parameters.joints.items()}
    if plant.time_step() == 0.0:
        control = load_control(config.parameters, config.overlays)
        controller = ContinuousPidfController(
            control.for_joints(names, classes), **control.limits()
        )
        builder.AddNamedSystem(name, controller)
        connect_feedback(builder, controller, estimated_state, chamber_pressure)
        return controller
    return PidfController.AddToBuilder(
        builder=builder,
        joint_names=names,
        estimated_state=estimated_state,
        chamber_pressure=chamber_pressure,
        config=config,
        actuator_classes=classes,
        name=name,
    )
