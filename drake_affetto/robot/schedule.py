"""An absolute schedule of ticks in real time, and how well it was kept."""

from collections.abc import Callable
import dataclasses
import time

LATE = 5e-3
"""Delay from which a tick counts as late, s."""
STALL = 0.1
"""Delay from which the schedule begins anew, s."""


@dataclasses.dataclass
class Schedule:
    """Ticks at start + k · period.

    A late tick does not shift those after it, so that the mean rate is right.
    Only after a long stall the schedule begins anew: what was missed is not
    made up for by a burst.

    Attributes:
        period: Time between two ticks, s.
        clock: Returns the time, s.
        ticks: Number of ticks so far.
        late: How many of them were late.
        stalls: How often the schedule began anew.
        longest_delay: Of a tick, s.
        begin: Time of the first tick, s.
        deadline: Time of the next tick, s.
        last: When the last tick was, s.
    """

    period: float
    clock: Callable[[], float] = time.monotonic
    ticks: int = 0
    late: int = 0
    stalls: int = 0
    longest_delay: float = 0.0
    begin: float = 0.0
    deadline: float = 0.0
    last: float = 0.0
    _base: float = 0.0
    _since_base: int = 0

    def start(self) -> None:
        """Makes the first tick one period from now."""
        self.begin = self._base = self.clock()
        self._since_base = 1
        self.deadline = self._base + self.period

    def remaining(self) -> float:
        """Time until the next tick, s; negative if it is late."""
        return self.deadline - self.clock()

    def tick(self) -> float:
        """Notes that the tick is now; returns how late it is, s.

        A delay of more than `STALL` is that of a stall.
        """
        now = self.last = self.clock()
        delay = now - self.deadline
        self.ticks += 1
        self.late += delay > LATE
        self.longest_delay = max(self.longest_delay, delay)
        if delay > STALL:
            self.stalls += 1
            self._base, self._since_base = now, 0
        # A product: sums of the period would drift.
        self._since_base += 1
        self.deadline = self._base + self._since_base * self.period
        return delay

    def rate(self) -> float:
        """Mean rate of the ticks so far, Hz."""
        span = self.last - self.begin
        return self.ticks / span if span > 0.0 else 0.0
