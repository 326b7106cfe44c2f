"""What carries the controller's commands to the valves, tick by tick."""

import numpy as np
from pydrake.systems.framework import (
    Context,
    DiagramBuilder,
    DiscreteValues,
    LeafSystem,
    OutputPort,
)

from drake_affetto.common.errors import require_range
from drake_affetto.common.systems import input_port, output_port

# The longest delay that the queue holds, s; see `config.KINDS`.
_LONGEST = 0.5


class CommandLink(LeafSystem):
    """Hands commands on; some come late, and some never.

    .. pydrake_system::

        name: CommandLink
        input_ports:
        - command
        - ticks
        output_ports:
        - carried_command
        - tick_time

    - command (n): valve openings as the controller has them.
    - ticks (2): whether this tick's command is lost, and its delay, s.
    - carried_command (n): the latest command that has come.
    - tick_time (1): when that was computed, s: its time stamp.

    Both outputs are state, updated every `period`, `lag` after the controller:
    without faults the valves find the command that they would find without
    this link.
    """

    _COMMAND, _TICKS = 0, 1

    def __init__(self, n: int, period: float = 0.005, lag: float = 0.0):
        """Declares ports and state.

        Args:
            n: Number of joints.
            period: Time between two ticks, s.
            lag: Time by which a command is handed on later, s.

        Raises:
            InputError: For a period or a lag that does not fit.
        """
        super().__init__()
        require_range("period", period, 1e-4, 1.0)
        require_range("lag", lag, 0.0, period)
        self._n = n
        self._rows = int(np.ceil(_LONGEST / period)) + 2
        self.DeclareVectorInputPort("command", n)
        self.DeclareVectorInputPort("ticks", 2)
        self._command_index = self.DeclareDiscreteState(n)
        self._stamp_index = self.DeclareDiscreteState(1)
        # Commands under way: arrival (infinite: none), stamp, openings.
        empty = np.zeros((self._rows, 2 + n))
        empty[:, 0] = np.inf
        self._queue_index = self.DeclareDiscreteState(empty.ravel())
        self.DeclareStateOutputPort("carried_command", self._command_index)
        self.DeclareStateOutputPort("tick_time", self._stamp_index)
        self.DeclarePeriodicDiscreteUpdateEvent(period, lag, self._update)

    @staticmethod
    def AddToBuilder(
        *,
        builder: DiagramBuilder,
        command: OutputPort,
        ticks: OutputPort,
        period: float,
        lag: float,
        name: str = "command_link",
    ) -> "CommandLink":
        """Adds a link that hands `command` on.

        Args:
            ticks: The fault source's output of that name.
            period: Period of the controller, s.
            lag: Time from a tick to its command, s.
        """
        link = CommandLink(command.size(), period, lag)
        builder.AddNamedSystem(name, link)
        builder.Connect(command, link.get_command_input_port())
        builder.Connect(ticks, link.get_ticks_input_port())
        return link

    get_command_input_port = input_port("Valve openings (n).")
    get_ticks_input_port = input_port("Lost (1 or 0), and delay, s (2).")
    get_carried_command_output_port = output_port("The latest command (n).")
    get_tick_time_output_port = output_port("Its time stamp (1), s.")

    def _update(self, context: Context, values: DiscreteValues) -> None:
        now = context.get_time()
        command = self.EvalVectorInput(context, self._COMMAND).value()
        lost, delay = self.EvalVectorInput(context, self._TICKS).value()
        queue = values.get_mutable_value(self._queue_index)
        rows = queue.reshape(self._rows, 2 + self._n)
        waiting = np.isfinite(rows[:, 0])
        if not lost and delay == 0.0 and not waiting.any():
            # As it mostly is.
            values.get_mutable_value(self._command_index)[:] = command
            values.get_mutable_value(self._stamp_index)[:] = now
            return
        if not lost:
            free = int(np.argmin(waiting))
            rows[free, 0] = now + delay
            rows[free, 1] = now
            rows[free, 2:] = command
        come = rows[:, 0] <= now + 1e-9
        if not come.any():
            return
        stamps = np.where(come, rows[:, 1], -np.inf)
        latest = rows[int(np.argmax(stamps))]
        stamp = values.get_mutable_value(self._stamp_index)
        if latest[1] > stamp[0]:
            values.get_mutable_value(self._command_index)[:] = latest[2:]
            stamp[:] = latest[1]
        rows[come, 0] = np.inf
