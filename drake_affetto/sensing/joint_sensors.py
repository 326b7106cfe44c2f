"""The sensors of all joints as a system."""

from collections.abc import Sequence
from typing import Any

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
from drake_affetto.common.systems import input_port, output_port
from drake_affetto.common.typing import Array
from drake_affetto.sensing.readings import (
    FAULT_ROWS,
    NOISE_ROWS,
    SensorParameters,
    memory_size,
    noise_block,
    read_sensors,
)


class JointSensors(LeafSystem):
    """Angles and pressures as the robot's own software knows them.

    .. pydrake_system::

        name: JointSensors
        input_ports:
        - joint_state
        - true_pressure
        - faults (if `faulty`)
        output_ports:
        - estimated_state
        - chamber_pressure

    - `joint_state` (2n): [q; q̇], rad and rad/s; only the angles are read.
    - `true_pressure` (2n): [p_a; p_b], Pa.
    - `faults` (9n): what is wrong with the readings, see `ReadingFault`.
    - `estimated_state` (2n): [q; q̇], filtered angles and their differences.
    - `chamber_pressure` (2n): [p_a; p_b] as read, Pa.

    Both outputs are state, and cost no call into Python to be read. A sample
    is taken every `period`, `lead` before the time it is of. A discrete plant
    has by then been left as it is at that time, and whoever reads at that time
    finds the sample there.

    The seed of the noise is a numeric parameter. Noise depends on seed and
    time alone.
    """

    # Indices of the input ports, in the order of their declaration.
    _STATE, _PRESSURE, _FAULTS = 0, 1, 2

    def __init__(
        self,
        parameters: SensorParameters,
        joint_names: Sequence[str],
        q_lower: ArrayLike,
        q_upper: ArrayLike,
        *,
        period: float = 0.005,
        lead: float = 0.0,
        faulty: bool = False,
    ):
        """Declares ports, state and the periodic samples.

        Args:
            parameters: Parameters of the sensors.
            joint_names: Names of the n joints, in the order of the ports.
            q_lower: Their lower limits (n,), rad.
            q_upper: Their upper limits (n,), rad.
            period: Time between two samples, s.
            lead: Time by which a sample is taken earlier, s; less than the
                plant's step.
            faulty: Whether there is an input for faults of the sensors.

        Raises:
            InputError: For arguments that do not fit.
        """
        super().__init__()
        parameters.check("sensors")
        require_range("period", period, 1e-4, 1.0)
        require(
            0.0 <= lead < period, "lead", lead, "at least 0, below the period"
        )
        n = len(joint_names)
        self._n = n
        self._period = float(period)
        self._scales = parameters.scales(joint_names, q_lower, q_upper)
        self._filter = parameters.filter_rows(self._period)
        # Noise of the samples about the last one, after its seed and block.
        self._noise: tuple[tuple[int, int], Array] = ((-1, -1), np.zeros(0))

        self._seed_index = int(
            self.DeclareNumericParameter(BasicVector(np.zeros(1)))
        )
        self.DeclareVectorInputPort("joint_state", 2 * n)
        self.DeclareVectorInputPort("true_pressure", 2 * n)
        self._raw_index = None
        if faulty:
            self.DeclareVectorInputPort("faults", FAULT_ROWS * 3 * n)
        self._estimate_index = self.DeclareDiscreteState(2 * n)
        self._reading_index = self.DeclareDiscreteState(2 * n)
        self._memory_index = self.DeclareDiscreteState(
            memory_size(n, self._filter.shape[1] - 1)
        )
        if faulty:
            self._raw_index = self.DeclareDiscreteState(3 * n)
        self.DeclareStateOutputPort("estimated_state", self._estimate_index)
        self.DeclareStateOutputPort("chamber_pressure", self._reading_index)
        self.DeclarePeriodicDiscreteUpdateEvent(
            period_sec=self._period,
            offset_sec=(self._period - lead) if lead else 0.0,
            update=self._update,
        )

    @staticmethod
    def AddToBuilder(
        *,
        builder: DiagramBuilder,
        joint_state: OutputPort,
        true_pressure: OutputPort,
        parameters: SensorParameters,
        joint_names: Sequence[str],
        limits: tuple[ArrayLike, ArrayLike],
        period: float = 0.005,
        lead: float = 0.0,
        faulty: bool = False,
        name: str = "joint_sensors",
    ) -> "JointSensors":
        """Adds the sensors of the named joints, wired to what they read.

        For the other arguments, and what is raised, see the class.

        Args:
            builder: Builder of the Diagram.
            joint_state: [q; q̇] (2n) of the plant, rad and rad/s.
            true_pressure: [p_a; p_b] (2n) of the chambers, Pa.
            limits: q_lower and q_upper.
            name: Name of the system.
            parameters: Resolution, noise and filter of the sensors.
            joint_names: Names of the n joints.
            period: Time between two samples, s.
            lead: Time by which a sample is taken early, s.
            faulty: Whether the sensors have inputs for faults.
        """
        sensors = JointSensors(
            parameters,
            joint_names,
            *limits,
            period=period,
            lead=lead,
            faulty=faulty,
        )
        builder.AddNamedSystem(name, sensors)
        builder.Connect(joint_state, sensors.get_joint_state_input_port())
        builder.Connect(true_pressure, sensors.get_true_pressure_input_port())
        return sensors

    get_joint_state_input_port = input_port("[q; q̇] (2n), rad and rad/s.")
    get_true_pressure_input_port = input_port("[p_a; p_b] (2n), Pa.")
    get_faults_input_port = input_port("What is wrong (9n), `ReadingFault`.")
    get_estimated_state_output_port = output_port(
        "[q; q̇] (2n) of the robot's software, rad and rad/s."
    )
    get_chamber_pressure_output_port = output_port(
        "[p_a; p_b] (2n) as read, Pa."
    )

    def seed(self, context: Context) -> int:
        """The seed of the noise in this context."""
        return int(context.get_numeric_parameter(self._seed_index)[0])

    def set_seed(self, context: Context, seed: int) -> None:
        """Sets the seed of the noise (an integer from 0 on)."""
        context.get_mutable_numeric_parameter(self._seed_index).SetFromVector(
            np.array([float(seed)])
        )

    def reset(
        self, context: Context, joint_state: ArrayLike, pressure: ArrayLike
    ) -> None:
        """Puts a robot at rest before the sensors, until the next sample.

        Args:
            context: This system's context.
            joint_state: [q; q̇] (2n), rad and rad/s.
            pressure: [p_a; p_b] (2n), Pa.
        """
        context.SetDiscreteState(self._estimate_index, np.array(joint_state))
        context.SetDiscreteState(self._reading_index, np.array(pressure))
        memory = context.get_discrete_state(self._memory_index)
        context.SetDiscreteState(self._memory_index, np.zeros(memory.size()))

    def _update(self, context: Context, discrete_state: DiscreteValues) -> None:
        sample = round(context.get_time() / self._period)
        block, row = divmod(sample, NOISE_ROWS)
        key = (self.seed(context), block)
        if self._noise[0] != key:
            self._noise = (key, noise_block(*key, 3 * self._n))
        # Views of the inputs: a port's `Eval` would copy.
        read = self.EvalVectorInput
        mutable = discrete_state.get_mutable_value
        wrong: tuple[Any, ...] = ()
        if self._raw_index is not None:
            wrong = (
                read(context, self._FAULTS).value(),
                mutable(self._raw_index),
            )
        read_sensors(
            self._period,
            self._scales,
            self._filter,
            self._noise[1],
            row,
            read(context, self._STATE).value(),
            read(context, self._PRESSURE).value(),
            mutable(self._estimate_index),
            mutable(self._reading_index),
            mutable(self._memory_index),
            *wrong,
        )
