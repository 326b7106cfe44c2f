"""The actuators as a system: valve commands in, joint torques out."""

import dataclasses
from typing import Any, TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray
from pydrake.multibody.plant import MultibodyPlant
from pydrake.systems.framework import (
    BasicVector,
    Context,
    DiagramBuilder,
    DiscreteValues,
    LeafSystem,
    OutputPort,
)
from pydrake.systems.primitives import MatrixGain

from drake_affetto.common.errors import (
    InputError,
    require,
    require_array,
    require_range,
)
from drake_affetto.common.fields import file_name, file_names
from drake_affetto.common.systems import input_port, output_port
from drake_affetto.pneumatics.chamber import (
    FLOW_MODE,
    REGULATOR_MODE,
    line_slots,
    memory_size,
    step_joints,
)
from drake_affetto.pneumatics.conditions import CONDITION_ROWS
from drake_affetto.pneumatics.equilibrium import chamber_torque
from drake_affetto.pneumatics.parameters import (
    DEFAULT_FILE,
    Joints,
    PneumaticParameters,
    largest_dead_time,
    load_parameters,
    parameter_array,
    resting_pressure,
)
from drake_affetto.pneumatics.variation import (
    ActuatorVariation,
    supply_change,
)
from drake_affetto.scene.joints import JointSelection

Actuation = TypeVar("Actuation", bound=LeafSystem)

_MODES = {"flow": FLOW_MODE, "regulator": REGULATOR_MODE}


@dataclasses.dataclass
class PneumaticActuationConfig:
    """How the actuators of a scenario are made.

    Attributes:
        mode: "flow" (the command is the valves' opening) or "regulator" (it
            is a pressure set-point for each chamber).
        parameters: `PneumaticParameters`, or a YAML file of them.
        overlays: YAML files that change some of them, for instance a fit.
        look_ahead: Steps by which the joint state that the update reads lags
            behind the one the torque will act on. 0 for a MultibodyPlant of
            this step, with or without sampled output ports.
    """

    mode: str = "flow"
    parameters: str | PneumaticParameters = file_name(DEFAULT_FILE)
    overlays: list[str] = file_names()
    look_ahead: float = 0.0

    def check(self, where: str) -> None:
        """Raises InputError naming the first field that cannot be."""
        require(
            self.mode in _MODES,
            f"{where}.mode",
            self.mode,
            "'flow' or 'regulator'",
        )
        require_range(f"{where}.look_ahead", self.look_ahead, 0.0, 2.0)


class PneumaticActuation(LeafSystem):
    """Valves, chambers and dry friction of `n` joints, one compiled update.

    .. pydrake_system::

        name: PneumaticActuation
        input_ports:
        - valve_opening (in flow mode)
        - pressure_command (in regulator mode)
        - estimated_state
        - valve_conditions (if `faulty`)
        - valve_action (if `faulty`)
        output_ports:
        - actuation
        - chamber_pressure
        - mass_flow

    - `valve_opening` (n): v⁺ in [-1, 1], positive fills chamber a and empties
      chamber b (v⁻ = -v⁺); clipped.
    - `pressure_command` (2n): set-points [p_a; p_b], Pa absolute.
    - `estimated_state` (2n): [q; q̇], rad and rad/s.
    - `valve_conditions` (8n + 1): what is wrong with valves and chambers, see
      `conditions.Condition`, and what the supply has above its parameter, Pa.
    - `valve_action` (1): `conditions.NO_ACTION`, `VENT` or `REST`, above any
      command.
    - `actuation` (n): torque on the joint, N m: of both chambers, minus
      Coulomb and Stribeck friction. Viscous friction is the plant's damping.
    - `chamber_pressure` (2n): [p_a; p_b], Pa absolute.
    - `mass_flow` (2n): mean flow into each chamber over the last step, kg/s;
      negative while it vents.

    All outputs are state, advanced every `time_step`, halfway between two
    steps of the plant: an update reads the joints as one step has left them,
    and its torque is the next one's. Reading them costs no call into Python.
    The parameter array of `chamber.Row` is a numeric parameter of the context,
    so that actuators can be varied without building a new diagram
    (`set_parameters`). What one trial makes of it is another one (`vary`).
    """

    # Indices of the input ports, in the order of their declaration.
    _COMMAND, _STATE, _CONDITIONS, _ACTION = range(4)

    def __init__(
        self,
        parameters: PneumaticParameters | NDArray[np.float64],
        joints: Joints | None = None,
        *,
        mode: str = "flow",
        time_step: float = 0.001,
        look_ahead: float = 0.0,
        max_dead_time: float | None = None,
        faulty: bool = False,
    ):
        """Declares ports, state and the periodic update.

        Args:
            parameters: of the actuators of `joints`; or the (ROWS, n) array
                of `parameters.parameter_array`.
            joints: the n joints with their limits, from `select_joints`.
            mode: "flow" or "regulator".
            time_step: update period, s; the plant's.
            look_ahead: see `PneumaticActuationConfig`.
            max_dead_time: longest dead time that parameters set later may
                have, s; by default the longest among `parameters`.
            faulty: whether there are inputs for faults and for an action above
                the command.

        Raises:
            InputError: for arguments that do not fit.
        """
        super().__init__()
        config = PneumaticActuationConfig(mode=mode, look_ahead=look_ahead)
        config.check("PneumaticActuation")
        require_range("time_step", time_step, 1e-6, 0.01)
        array = parameter_array(parameters, joints)
        self.parameters = array.copy()
        self._n = array.shape[1]
        self._shape = array.shape
        self._mode = _MODES[mode]
        self._time_step = float(time_step)
        self._look_ahead = float(look_ahead)
        if max_dead_time is None:
            max_dead_time = largest_dead_time(array)
        self._slots = line_slots(self._time_step, max_dead_time)
        n = self._n

        # The array is kept flat, in column order of no consequence outside.
        self._parameter_index = int(
            self.DeclareNumericParameter(BasicVector(array.ravel()))
        )
        # As the trial has drawn them, and how its supply breathes.
        self._trial_index = int(
            self.DeclareNumericParameter(BasicVector(array.ravel()))
        )
        self._breath_index = int(
            self.DeclareNumericParameter(BasicVector(np.zeros(4)))
        )
        if self._mode == FLOW_MODE:
            self.DeclareVectorInputPort("valve_opening", n)
        else:
            self.DeclareVectorInputPort("pressure_command", 2 * n)
        self.DeclareVectorInputPort("estimated_state", 2 * n)
        self._faulty = faulty
        if faulty:
            self.DeclareVectorInputPort(
                "valve_conditions", CONDITION_ROWS * 2 * n + 1
            )
            self.DeclareVectorInputPort("valve_action", 1)

        rest = resting_pressure(array)
        pressure = np.concatenate([rest, rest])
        self._pressure_index = self.DeclareDiscreteState(pressure)
        self._torque_index = self.DeclareDiscreteState(
            chamber_torque(array, pressure)
        )
        self._flow_index = self.DeclareDiscreteState(2 * n)
        self._memory_index = self.DeclareDiscreteState(
            memory_size(n, self._time_step, max_dead_time)
        )
        self.DeclareStateOutputPort("actuation", self._torque_index)
        self.DeclareStateOutputPort("chamber_pressure", self._pressure_index)
        self.DeclareStateOutputPort("mass_flow", self._flow_index)
        self.DeclarePeriodicDiscreteUpdateEvent(
            period_sec=self._time_step,
            offset_sec=0.5 * self._time_step,
            update=self._update,
        )

    @staticmethod
    def AddToBuilder(
        *,
        builder: DiagramBuilder,
        plant: MultibodyPlant,
        joints: JointSelection,
        estimated_state: OutputPort,
        config: PneumaticActuationConfig | None = None,
        longest_delay: float = 0.0,
        faulty: bool = False,
        name: str = "pneumatic_actuation",
    ) -> "PneumaticActuation":
        """Adds the actuators of `joints`, whose torques drive `plant`.

        The input of the command is left to be connected.

        Args:
            builder: Builder of the Diagram.
            plant: Plant in `builder`, discrete; its step is the actuators'.
            joints: From `select_joints`.
            estimated_state: [q; q̇] (2n) of the joints, rad and rad/s.
            config: Mode and parameters.
            longest_delay: The most that a trial adds to a dead time, s.
            faulty: Whether there are inputs for faults.
            name: Name of the system.

        Raises:
            InputError: If the configuration does not fit, or the joints are
                driven already.
        """
        config = config or PneumaticActuationConfig()
        config.check(name)
        array = parameter_array(
            load_parameters(config.parameters, config.overlays), joints
        )
        system = PneumaticActuation(
            array,
            mode=config.mode,
            time_step=plant.time_step(),
            look_ahead=config.look_ahead,
            max_dead_time=largest_dead_time(array) + longest_delay,
            faulty=faulty,
        )
        return add_actuation(
            builder, plant, joints, estimated_state, system, name
        )

    get_command_input_port = input_port(
        "`valve_opening` or `pressure_command`, whichever the mode has.",
        index=_COMMAND,
    )
    get_estimated_state_input_port = input_port("[q; q̇] (2n), rad and rad/s.")
    get_valve_conditions_input_port = input_port("What is wrong (8n + 1).")
    get_valve_action_input_port = input_port("What is above the command (1).")
    get_actuation_output_port = output_port("Torque on each joint (n), N m.")
    get_chamber_pressure_output_port = output_port(
        "[p_a; p_b] (2n), Pa absolute."
    )
    get_mass_flow_output_port = output_port(
        "Flow into each chamber (2n), kg/s."
    )

    @property
    def num_joints(self) -> int:
        """Number of joints n."""
        return self._n

    @property
    def time_step(self) -> float:
        """Update period, s."""
        return self._time_step

    def get_parameters(self, context: Context) -> NDArray[np.float64]:
        """A copy of the (ROWS, n) parameter array."""
        vector = context.get_numeric_parameter(self._parameter_index)
        return vector.CopyToVector().reshape(self._shape)

    def set_parameters(
        self, context: Context, parameters: NDArray[np.float64]
    ) -> None:
        """Changes the actuators; nothing of a trial's draw is left.

        Args:
            parameters: Array with the rows of `chamber.Row`, a column each
                joint.

        Raises:
            InputError: for another shape, or a dead time longer than the one
                that the system was built for.
        """
        array = np.array(parameters, dtype=float)
        require(
            array.shape == self._shape,
            "parameters",
            array.shape,
            f"an array of shape {self._shape}",
        )
        longest = largest_dead_time(array)
        require(
            line_slots(self._time_step, longest) <= self._slots,
            "dead time",
            longest,
            f"at most {(self._slots - 2) * self._time_step:g} s",
        )
        for index in (self._parameter_index, self._trial_index):
            vector = context.get_mutable_numeric_parameter(index)
            vector.SetFromVector(array.ravel())
        vector = context.get_mutable_numeric_parameter(self._breath_index)
        vector.SetFromVector(np.zeros(4))

    def vary(
        self, context: Context, variation: ActuatorVariation, seed: int
    ) -> None:
        """Draws the actuators and the supply of a trial.

        Whatever an earlier trial has drawn is forgotten.

        Args:
            context: this system's context.
            variation: how much they differ.
            seed: of the trial.
        """
        drawn, breath = variation.draw(
            self.get_parameters(context),
            np.random.default_rng([seed, 0xAC70A]),
        )
        for index, value in (
            (self._trial_index, drawn.ravel()),
            (self._breath_index, breath),
        ):
            vector = context.get_mutable_numeric_parameter(index)
            vector.SetFromVector(value)

    def set_pressures(
        self, context: Context, p_a: ArrayLike, p_b: ArrayLike
    ) -> None:
        """Resets the whole state with the given pressures in the chambers.

        Valves are at rest, nothing is under way in the lines, the air has
        ambient temperature and friction holds no torque. Volumes are those of
        the joint angles at the next update: call it after placing the robot.

        Args:
            context: this system's context.
            p_a: pressures of chambers a (n, or one for all), Pa absolute.
            p_b: those of chambers b.

        Raises:
            InputError: for pressures that are not positive or do not fit.
        """
        n = self._n
        pressure = np.empty(2 * n)
        for part, name, value in (
            (pressure[:n], "p_a", p_a),
            (pressure[n:], "p_b", p_b),
        ):
            given = np.asarray(value, dtype=float)
            if given.shape in ((), (1,)):
                given = np.full(n, given)
            part[:] = require_array(name, given, (n,), positive=True)
        torque = chamber_torque(self.get_parameters(context), pressure)
        context.SetDiscreteState(self._pressure_index, pressure)
        context.SetDiscreteState(self._torque_index, torque)
        context.SetDiscreteState(self._flow_index, np.zeros(2 * n))
        memory = context.get_discrete_state(self._memory_index)
        context.SetDiscreteState(self._memory_index, np.zeros(memory.size()))

    def reset(self, context: Context) -> None:
        """Resets the whole state at the pressures of the valves' rest."""
        rest = resting_pressure(self.get_parameters(context))
        self.set_pressures(context, rest, rest)

    def _update(self, context: Context, discrete_state: DiscreteValues) -> None:
        mutable = discrete_state.get_mutable_value
        change = supply_change(
            context.get_numeric_parameter(self._breath_index).value(),
            context.get_time(),
        )
        wrong: tuple[Any, ...] = ()
        if self._faulty:
            conditions = self.EvalVectorInput(context, self._CONDITIONS).value()
            action = self.EvalVectorInput(context, self._ACTION).value()
            change += conditions[-1]
            wrong = (int(action[0]), conditions[:-1])
        step_joints(
            self._time_step,
            self._mode,
            self._look_ahead,
            context.get_numeric_parameter(self._trial_index).value(),
            # Views: a port's `Eval` would copy.
            self.EvalVectorInput(context, self._COMMAND).value(),
            self.EvalVectorInput(context, self._STATE).value(),
            mutable(self._pressure_index),
            mutable(self._torque_index),
            mutable(self._flow_index),
            mutable(self._memory_index),
            change,
            *wrong,
        )


def add_actuation(
    builder: DiagramBuilder,
    plant: MultibodyPlant,
    joints: JointSelection,
    estimated_state: OutputPort,
    system: Actuation,
    name: str,
) -> Actuation:
    """Adds actuators to `builder`, wired to the plant that they drive.

    Args:
        builder: Builder of the Diagram.
        plant: Plant in `builder`.
        joints: The n joints, of one model.
        estimated_state: [q; q̇] (2n) of the joints.
        system: Actuators of the joints.
        name: Name of the system; `{name}_spread` puts the torques in the
            plant's order.

    Raises:
        InputError: If the joints are driven already.
    """
    driven = plant.get_actuation_input_port(joints.model_instance)
    model = plant.GetModelInstanceName(joints.model_instance)
    if builder.IsConnectedOrExported(driven):
        raise InputError(
            f"joints {', '.join(joints.names)} of model {model} have a driver "
            "already, expected one driver a model"
        )
    builder.AddNamedSystem(name, system)
    spread = builder.AddNamedSystem(
        f"{name}_spread", MatrixGain(D=joints.actuation_matrix)
    )
    builder.Connect(estimated_state, system.get_estimated_state_input_port())
    builder.Connect(system.get_actuation_output_port(), spread.get_input_port())
    builder.Connect(spread.get_output_port(), driven)
    return system
