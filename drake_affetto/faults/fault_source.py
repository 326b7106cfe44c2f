"""The system that knows a trial's faults and hands them to their places."""

from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from pydrake.common.value import Value
from pydrake.systems.framework import BasicVector, Context, LeafSystem

from drake_affetto.common.systems import input_port, output_port
from drake_affetto.common.typing import Array
from drake_affetto.faults.schedule import (
    CAMERA_SIZE,
    TICK_SIZE,
    FaultSchedule,
)
from drake_affetto.pneumatics.conditions import CONDITION_ROWS, Condition
from drake_affetto.sensing.readings import FAULT_ROWS, ReadingFault


class FaultSource(LeafSystem):
    """What is wrong now, for each place in the diagram.

    .. pydrake_system::

        name: FaultSource
        input_ports:
        - start_time
        output_ports:
        - readings
        - valve_conditions
        - ticks
        - camera

    - start_time (1): when the movement begins, s; infinite: not yet.
    - readings (9n): for `JointSensors`, see `sensing.readings.ReadingFault`.
    - valve_conditions (8n + 1): for `PneumaticActuation`, see
      `pneumatics.conditions.Condition`; and what the supply lacks, Pa.
    - ticks (2): for `CommandLink`: whether a command is lost, and how late it
      comes, s.
    - camera (5): for `CameraFaults`, see `schedule.CAMERA_SIZE`.

    The trial's `FaultSchedule` is an abstract parameter of the context. There
    is no state.
    """

    def __init__(
        self,
        q_lower: ArrayLike,
        exhaust: ArrayLike,
        gauge: float,
        period: float = 0.005,
    ):
        """Declares the ports.

        Args:
            q_lower: What an angle sensor without a signal reads (n,), rad.
            exhaust: Conductance of the exhausts (n,), m³/(s Pa).
            gauge: Pressure of the supply above the atmosphere, Pa.
            period: Time between two samples, and two ticks, s.
        """
        super().__init__()
        self._zeros = np.array(q_lower, dtype=float)
        self._exhaust = np.array(exhaust, dtype=float)
        self._gauge = float(gauge)
        self._period = float(period)
        n = self._zeros.size
        self._schedule_index = self.DeclareAbstractParameter(
            Value[object](FaultSchedule())
        )
        self._start_port = self.DeclareVectorInputPort("start_time", 1)
        well = np.zeros((FAULT_ROWS, 3 * n))
        well[ReadingFault.FORCED] = np.nan
        self._well_readings = well.ravel()
        valves = np.zeros((CONDITION_ROWS, 2 * n))
        valves[Condition.LAG] = 1.0
        self._well_valves = np.append(valves.ravel(), 0.0)
        depends = {
            self.time_ticket(),
            self.all_parameters_ticket(),
            self.input_port_ticket(self._start_port.get_index()),
        }
        for name, size, calc in (
            ("readings", FAULT_ROWS * 3 * n, self._calc_readings),
            ("valve_conditions", CONDITION_ROWS * 2 * n + 1, self._calc_valves),
            ("ticks", TICK_SIZE, self._calc_ticks),
            ("camera", CAMERA_SIZE, self._calc_camera),
        ):
            self.DeclareVectorOutputPort(name, size, calc, depends)

    get_start_time_input_port = input_port("When the movement begins (1), s.")
    get_readings_output_port = output_port("For the joints' sensors (9n).")
    get_valve_conditions_output_port = output_port("For the valves (8n + 1).")
    get_ticks_output_port = output_port("For the commands (2).")
    get_camera_output_port = output_port("For the camera (5).")

    def schedule(self, context: Context) -> FaultSchedule:
        """The faults of the trial in this context."""
        value: Any = context.get_abstract_parameter(self._schedule_index)
        found: FaultSchedule = value.get_value()
        return found

    def set_schedule(self, context: Context, schedule: FaultSchedule) -> None:
        """Sets the faults of the trial.

        Args:
            schedule: The faults of the trial.
        """
        context.get_mutable_abstract_parameter(self._schedule_index).set_value(
            schedule
        )

    def movement(self, context: Context) -> float:
        """When the trial's movement begins, s; infinite: not yet."""
        return float(self.EvalVectorInput(context, 0).value()[0])

    def _tick(self, context: Context) -> int:
        return round(context.get_time() / self._period)

    def _calc_readings(self, context: Context, output: BasicVector) -> None:
        schedule = self.schedule(context)
        values: Array = self._well_readings
        if schedule.acts_on("joint", "chamber"):
            values = schedule.readings(
                context.get_time(),
                self.movement(context),
                self._tick(context),
                self._zeros,
            ).ravel()
        output.SetFromVector(values)

    def _calc_valves(self, context: Context, output: BasicVector) -> None:
        schedule = self.schedule(context)
        values: Array = self._well_valves
        if schedule.acts_on("chamber", "supply"):
            valves, supply = schedule.valves(
                context.get_time(),
                self.movement(context),
                self._exhaust,
                self._gauge,
            )
            values = np.append(valves.ravel(), supply)
        output.SetFromVector(values)

    def _calc_ticks(self, context: Context, output: BasicVector) -> None:
        values = self.schedule(context).ticks(
            context.get_time(), self.movement(context), self._tick(context)
        )
        output.SetFromVector(values)

    def _calc_camera(self, context: Context, output: BasicVector) -> None:
        values = self.schedule(context).camera(
            context.get_time(), self.movement(context)
        )
        output.SetFromVector(values)
