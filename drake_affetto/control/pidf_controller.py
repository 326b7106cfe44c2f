"""The PIDF controller as a system."""

from collections.abc import Mapping, Sequence
import dataclasses

import numpy as np
from numpy.typing import ArrayLike
from pydrake.systems.framework import (
    BasicVector,
    Context,
    DiagramBuilder,
    DiscreteValues,
    LeafSystem,
    OutputPort,
)

from drake_affetto.common.errors import require, require_range
from drake_affetto.common.fields import file_name, file_names
from drake_affetto.common.systems import input_port, output_port
from drake_affetto.control.pidf import (
    DEFAULT_FILE,
    ControlParameters,
    PidfGains,
    load_control,
    pidf_update,
)


@dataclasses.dataclass
class PidfConfig:
    """How the joint controllers of a scenario are made.

    Attributes:
        parameters: `ControlParameters`, or a YAML file of them.
        overlays: YAML files that change some of them.
        period: Period of the updates, s.
        gravity_share: Share of gravity that the demand compensates beforehand,
            from the robot's model of itself; 0: none.
    """

    parameters: str | ControlParameters = file_name(DEFAULT_FILE)
    overlays: list[str] = file_names()
    period: float = 0.005
    gravity_share: float = 0.0

    def check(self, where: str) -> None:
        """Raises InputError naming the first field that cannot be."""
        require_range(f"{where}.period", self.period, 1e-4, 0.1)
        require_range(f"{where}.gravity_share", self.gravity_share, 0.0, 1.0)


class PidfController(LeafSystem):
    """PIDF control of `n` joints at a fixed rate, valves held in between.

    .. pydrake_system::

        name: PidfController
        input_ports:
        - desired_state
        - estimated_state
        - chamber_pressure
        - equilibrium_offset (optional)
        output_ports:
        - valve_opening
        - pid_output

    - `desired_state` (2n): [q_des; q̇_des], rad and rad/s.
    - `estimated_state` (2n): [q; q̇].
    - `chamber_pressure` (2n): [p_a; p_b], Pa.
    - `equilibrium_offset` (n): u_eq added to the demand, Pa; 0 if the port is
      not connected.
    - `valve_opening` (n): v⁺ in [-1, 1].
    - `pid_output` (n): the demanded pressure difference u, the offset in it,
      Pa. Read while the robot holds a posture at rest it is the u_eq with
      which the posture can be held without integral.

    Both outputs are state. The gains are a numeric parameter of the context
    (`set_gains`).
    """

    # Indices of the input ports, in the order of their declaration.
    _DESIRED, _STATE, _PRESSURE, _OFFSET = range(4)

    def __init__(
        self,
        gains: PidfGains,
        *,
        period: float = 0.005,
        integral_limit: float = 300e3,
        difference_limit: float = 550e3,
        integral_deadband: float = 0.0,
    ):
        """Declares ports, state and the periodic update.

        Args:
            gains: gains of the n joints.
            period: of the updates, s.
            integral_limit: greatest part of u from the integral, Pa.
            difference_limit: greatest magnitude of u, Pa.
            integral_deadband: error that is not integrated, rad.

        Raises:
            InputError: for arguments that do not fit.
        """
        super().__init__()
        PidfConfig(period=period).check("PidfController")
        require_range("integral_limit", integral_limit, 0.0)
        require_range("difference_limit", difference_limit, 0.0)
        require_range("integral_deadband", integral_deadband, 0.0)
        n = gains.kP.size
        self._n = n
        self._period = float(period)
        self._limits = (
            float(integral_limit),
            float(difference_limit),
            float(integral_deadband),
        )
        self._gains_index = int(
            self.DeclareNumericParameter(BasicVector(gains.to_array().ravel()))
        )
        self.DeclareVectorInputPort("desired_state", 2 * n)
        self.DeclareVectorInputPort("estimated_state", 2 * n)
        self.DeclareVectorInputPort("chamber_pressure", 2 * n)
        self._offset_port = self.DeclareVectorInputPort("equilibrium_offset", n)
        self._no_offset = np.zeros(n)
        self._integral_index = self.DeclareDiscreteState(n)
        self._demand_index = self.DeclareDiscreteState(n)
        self._opening_index = self.DeclareDiscreteState(n)
        self.DeclareStateOutputPort("valve_opening", self._opening_index)
        self.DeclareStateOutputPort("pid_output", self._demand_index)
        self.DeclarePeriodicDiscreteUpdateEvent(
            period_sec=self._period, offset_sec=0.0, update=self._update
        )

    @staticmethod
    def AddToBuilder(
        *,
        builder: DiagramBuilder,
        joint_names: Sequence[str],
        estimated_state: OutputPort,
        chamber_pressure: OutputPort,
        config: PidfConfig | None = None,
        actuator_classes: Mapping[str, str] | None = None,
        name: str = "pidf_controller",
    ) -> "PidfController":
        """Adds the controller of the named joints to `builder`.

        The inputs `desired_state` and `equilibrium_offset` are left to be
        connected.

        Args:
            builder: Builder of the Diagram.
            joint_names: Names of the joints, in the order of the ports.
            estimated_state: [q; q̇] (2n), rad and rad/s.
            chamber_pressure: [p_a; p_b] (2n), Pa.
            config: Period and parameters.
            actuator_classes: Joint -> its actuator class, whose gains a joint
                has that the parameters do not name.
            name: Name of the system.

        Raises:
            InputError: If the configuration does not fit.
        """
        config = config or PidfConfig()
        config.check(name)
        parameters = load_control(config.parameters, config.overlays)
        system = PidfController(
            parameters.for_joints(joint_names, actuator_classes),
            period=config.period,
            **parameters.limits(),
        )
        builder.AddNamedSystem(name, system)
        connect_feedback(builder, system, estimated_state, chamber_pressure)
        return system

    get_desired_state_input_port = input_port(
        "[q_des; q̇_des] (2n), rad and rad/s."
    )
    get_estimated_state_input_port = input_port("[q; q̇] (2n), rad and rad/s.")
    get_chamber_pressure_input_port = input_port("[p_a; p_b] (2n), Pa.")
    get_equilibrium_offset_input_port = input_port("u_eq (n), Pa.")
    get_valve_opening_output_port = output_port("v⁺ (n) in [-1, 1].")
    get_pid_output_output_port = output_port("u (n), Pa.")

    @property
    def num_joints(self) -> int:
        """Number of joints n."""
        return self._n

    @property
    def period(self) -> float:
        """Update period, s."""
        return self._period

    def get_gains(self, context: Context) -> PidfGains:
        """The gains in `context`."""
        vector = context.get_numeric_parameter(self._gains_index)
        return PidfGains.from_array(vector.CopyToVector().reshape(4, self._n))

    def set_gains(self, context: Context, gains: PidfGains) -> None:
        """Changes the gains; the integral is kept where kI stays above 0.

        Args:
            gains: Gains of all joints.

        Raises:
            InputError: for the gains of another number of joints.
        """
        require(
            gains.kP.shape == (self._n,),
            "gains",
            gains.kP.size,
            f"gains of {self._n} joints",
        )
        vector = context.get_mutable_numeric_parameter(self._gains_index)
        vector.SetFromVector(gains.to_array().ravel())

    def reset(self, context: Context, demand: ArrayLike = 0.0) -> None:
        """Clears the integral and closes the valves.

        Args:
            context: this system's context.
            demand: what `pid_output` shows until the next update, Pa.
        """
        zeros = np.zeros(self._n)
        context.SetDiscreteState(self._integral_index, zeros)
        context.SetDiscreteState(
            self._demand_index, np.broadcast_to(np.asarray(demand), zeros.shape)
        )
        context.SetDiscreteState(self._opening_index, zeros)

    def set_integral(self, context: Context, pressure: ArrayLike) -> None:
        """Sets the integral so that it asks for `pressure` (n), Pa.

        Started so, a controller takes a posture over without a sag. Joints
        without kI are left at 0.
        """
        k_i = self.get_gains(context).kI
        share = np.broadcast_to(np.asarray(pressure, dtype=float), (self._n,))
        integral = np.divide(share, k_i, out=np.zeros(self._n), where=k_i > 0.0)
        context.SetDiscreteState(self._integral_index, integral)

    def _update(self, context: Context, discrete_state: DiscreteValues) -> None:
        # Views of the inputs: a port's `Eval` would copy.
        read = self.EvalVectorInput
        mutable = discrete_state.get_mutable_value
        offset = self._no_offset
        if self._offset_port.HasValue(context):
            offset = read(context, self._OFFSET).value()
        pidf_update(
            self._period,
            context.get_numeric_parameter(self._gains_index).value(),
            *self._limits,
            read(context, self._DESIRED).value(),
            read(context, self._STATE).value(),
            read(context, self._PRESSURE).value(),
            offset,
            mutable(self._integral_index),
            mutable(self._demand_index),
            mutable(self._opening_index),
        )


def connect_feedback(
    builder: DiagramBuilder,
    controller: LeafSystem,
    estimated_state: OutputPort,
    chamber_pressure: OutputPort,
) -> None:
    """Connects what a controller measures, whatever its time."""
    builder.Connect(estimated_state, controller.GetInputPort("estimated_state"))
    builder.Connect(
        chamber_pressure, controller.GetInputPort("chamber_pressure")
    )
