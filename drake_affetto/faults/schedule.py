"""What the faults of a trial do at one time: plain arrays.

Everything random is drawn from the trial's seed, the number of the fault in
its list and the time, so that a trial's faults are the same however it is
simulated.
"""

from collections.abc import Iterator, Sequence
import dataclasses
import math

import numpy as np

from drake_affetto.common.typing import Array
from drake_affetto.faults.config import Fault
from drake_affetto.pneumatics.conditions import CONDITION_ROWS, Condition
from drake_affetto.sensing.readings import FAULT_ROWS, ReadingFault

SUPPLY_FALL = 0.2
"""Time constant with which a supply falls and returns, s: a tank of a few
liters behind a hose [est]."""

CAMERA_SIZE = 5
"""Entries of `FaultSchedule.camera`: frozen, hidden share, angle of what hides
[rad], radius of a second marker [times], where it lies (0 to 1)."""

TICK_SIZE = 2
"""Entries of `FaultSchedule.ticks`: dropped, delay [s]."""


@dataclasses.dataclass(frozen=True)
class FaultSchedule:
    """The faults of one trial.

    Attributes:
        faults: The faults.
        joints: Names of the n joints, in the order of all vectors.
        seed: Seed of the trial.
        begin: Time at which the trial begins, s; infinite: not yet.
    """

    faults: Sequence[Fault] = ()
    joints: Sequence[str] = ()
    seed: int = 0
    begin: float = math.inf

    def active(
        self, time: float, movement: float, *places: str
    ) -> Iterator[tuple[int, Fault, float]]:
        """Number, fault and age [s] of those that act at `time`.

        Args:
            time: Time, s.
            movement: Time at which the movement begins, s.
            places: Places whose faults are meant.
        """
        for number, fault in enumerate(self.faults):
            onset, end = fault.span(self.begin, movement)
            if onset <= time + 1e-9 < end and fault.place in places:
                yield number, fault, time - onset

    def rng(self, number: int, *more: int) -> np.random.Generator:
        """The source of what is random in the fault of that number.

        Args:
            number: Number of the fault in the list.
            more: Further numbers that tell draws of it apart.
        """
        return np.random.default_rng([self.seed, 0xFA017, number, *more])

    def sign(self, number: int) -> float:
        """-1 or 1, the same throughout the trial.

        Args:
            number: Number of the fault in the list.
        """
        return float(self.rng(number).choice((-1.0, 1.0)))

    def readings(
        self, time: float, movement: float, tick: int, zeros: Array
    ) -> Array:
        """What is wrong with the sensors, (FAULT_ROWS, 3n).

        Args:
            time: Time of the sample, s.
            movement: Time at which the movement begins, s.
            tick: Number of the sample, for what is drawn anew for each.
            zeros: What angle sensors without a signal read (n,), rad.
        """
        n = len(self.joints)
        effect = np.zeros((FAULT_ROWS, 3 * n))
        effect[ReadingFault.FORCED] = np.nan
        for i, fault, _ in self.active(time, movement, "joint", "chamber"):
            c = self._channel(fault)
            if fault.kind == "joint_dropouts":
                if self.rng(i, 1, tick).uniform() < fault.size:
                    effect[ReadingFault.FORCED, c] = zeros[c]
            elif fault.kind == "joint_noise":
                noise = self.rng(i, 1, tick).standard_normal()
                effect[ReadingFault.ADDED, c] += fault.size * noise
            elif fault.kind in ("joint_stuck", "pressure_stuck"):
                effect[ReadingFault.STUCK, c + n * (fault.channel != "")] = 1.0
            elif fault.kind == "joint_offset":
                effect[ReadingFault.ADDED, c] += self.sign(i) * fault.size
            elif fault.kind == "pressure_offset":
                effect[ReadingFault.ADDED, n + c] += self.sign(i) * fault.size
        return effect

    def valves(
        self, time: float, movement: float, exhaust: Array, gauge: float
    ) -> tuple[Array, float]:
        """The valves' and chambers' condition, (CONDITION_ROWS, 2n), and what
        the supply lacks, Pa.

        Args:
            time: Time, s.
            movement: Time at which the movement begins, s.
            exhaust: Conductance of the exhausts (n,), m³/(s Pa).
            gauge: Pressure of the supply above the atmosphere, Pa.
        """
        n = len(self.joints)
        effect = np.zeros((CONDITION_ROWS, 2 * n))
        effect[Condition.LAG] = 1.0
        for _, fault, _ in self.active(time, movement, "chamber"):
            c = self._channel(fault)
            if fault.kind == "valve_stuck_open":
                effect[Condition.FORCED, c] = 1.0
                effect[Condition.SPOOL, c] = fault.size
            elif fault.kind == "valve_stuck_closed":
                effect[Condition.FORCED, c] = 2.0
            elif fault.kind == "valve_sluggish":
                effect[Condition.LAG, c] *= fault.size
            elif fault.kind == "chamber_leak":
                effect[Condition.LEAK, c] += fault.size * exhaust[c % n]
        lost = 0.0
        for fault in self.faults:
            if fault.place != "supply":
                continue
            onset, end = fault.span(self.begin, movement)
            if time < onset:
                continue
            # It falls, and comes back, with the tank's own time.
            level = -math.expm1((onset - min(time, end)) / SUPPLY_FALL)
            level *= math.exp(-max(time - end, 0.0) / SUPPLY_FALL)
            lost += level * gauge * fault.size
        return effect, -min(lost, gauge)

    def ticks(self, time: float, movement: float, tick: int) -> Array:
        """Whether this tick's command is lost, and how late it comes, (2,).

        Args:
            time: Time, s.
            movement: When the movement begins, s.
            tick: Number of the tick.
        """
        effect = np.zeros(TICK_SIZE)
        for i, fault, _ in self.active(time, movement, "ticks"):
            if fault.kind == "ticks_late":
                effect[1] += fault.size
            elif self.rng(i, 1, tick).uniform() < fault.size:
                effect[0] = 1.0
        return effect

    def camera(self, time: float, movement: float) -> Array:
        """What stands before the camera, and whether it is frozen, (5,).

        Args:
            time: Time, s.
            movement: When the movement begins, s.
        """
        effect = np.zeros(CAMERA_SIZE)
        for i, fault, _ in self.active(time, movement, "camera"):
            drawn = float(self.rng(i).uniform())
            if fault.kind == "camera_frozen":
                effect[0] = 1.0
            elif fault.kind == "marker_hidden":
                effect[1:3] = fault.size, 2.0 * math.pi * drawn
            elif fault.kind == "second_marker":
                effect[3:5] = fault.size, drawn
        return effect

    def acts_on(self, *places: str) -> bool:
        """Whether any fault of the trial is of these places.

        Args:
            places: Names of places of faults.
        """
        return any(fault.place in places for fault in self.faults)

    def _channel(self, fault: Fault) -> int:
        """Number of its joint, or of its chamber in [p_a; p_b]."""
        n = len(self.joints)
        return list(self.joints).index(fault.joint) + n * (fault.channel == "b")
