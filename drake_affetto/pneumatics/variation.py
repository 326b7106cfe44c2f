"""How actuators and their air supply differ from one trial to the next.

Friction and valves are drawn once a trial, each joint for itself. The supply
breathes with its compressor: it falls as air is used, until the compressor
starts and fills the tank in a part of the period. Each trial meets it at
another phase.
"""

import dataclasses
import math

import numpy as np
from numpy.typing import NDArray

from drake_affetto.common.fields import check_ranges, number
from drake_affetto.common.typing import Array
from drake_affetto.pneumatics.chamber import Row

# The rows of friction, all of which a trial scales alike.
_FRICTION = [
    Row.COULOMB,
    Row.BREAKAWAY,
    Row.STIFFNESS,
    Row.DAMPING,
    Row.DWELL_TORQUE,
]

# Deviations are clipped at so many standard deviations.
_CLIP = 2.0


@dataclasses.dataclass
class ActuatorVariation:
    """Sizes of what differs; by default nothing does.

    Attributes:
        friction: Standard deviation of a joint's friction, relative.
        valve_lag: The same of its valves' lag.
        dead_time: Standard deviation of its dead time, s.
        supply_swing: Half of the supply's rise and fall, Pa.
        supply_period: Period of that, s.
        compressor_share: Part of the period for which the compressor runs.
    """

    friction: float = number(0.0, 0.0, 0.45)
    valve_lag: float = number(0.0, 0.0, 0.45)
    dead_time: float = number(0.0, 0.0, 0.1)
    supply_swing: float = number(0.0, 0.0, 2e5)
    supply_period: float = number(60.0, 1.0, 3600.0)
    compressor_share: float = number(0.3, 0.01, 0.99)

    def check(self, where: str) -> None:
        """Raises InputError naming the first field that does not fit."""
        check_ranges(self, where)

    @property
    def longest_delay(self) -> float:
        """The most that a trial adds to a dead time, s."""
        return _CLIP * self.dead_time

    def draw(
        self, parameters: NDArray[np.float64], rng: np.random.Generator
    ) -> tuple[Array, Array]:
        """Draws the actuators of one trial.

        Args:
            parameters: (ROWS, n), see `chamber.Row`.
            rng: Source of the draws.

        Returns:
            The trial's (ROWS, n), and how its supply breathes (4,), see
            `supply_change`.
        """
        drawn = np.array(parameters, dtype=float)
        deviation = rng.standard_normal((3, drawn.shape[1]))
        deviation = np.clip(deviation, -_CLIP, _CLIP)
        drawn[_FRICTION] *= 1.0 + self.friction * deviation[0]
        drawn[Row.VALVE_LAG] *= 1.0 + self.valve_lag * deviation[1]
        drawn[Row.DEAD_TIME] += self.dead_time * deviation[2]
        drawn[Row.DEAD_TIME] = np.maximum(drawn[Row.DEAD_TIME], 0.0)
        breath = np.array(
            [
                self.supply_swing,
                self.supply_period,
                self.compressor_share,
                rng.uniform(),
            ]
        )
        return drawn, breath


def supply_change(breath: NDArray[np.float64], time: float) -> float:
    """What the breathing supply has above its mean at `time`, s, in Pa.

    Args:
        breath: (4,) its swing, Pa; its period, s; the part of it for which
            the compressor runs; the phase at time 0, in periods.
    """
    swing, period, share, phase = breath
    if swing == 0.0:
        return 0.0
    x = math.fmod(time / period + phase, 1.0)
    level = x / share if x < share else (1.0 - x) / (1.0 - share)
    return float(swing * (2.0 * level - 1.0))
