"""A success rate with its confidence interval."""

import dataclasses
from dataclasses import field

# What a field accepts, see `drake_affetto.common.typed_json`.
PROBABILITY = {"range": (0.0, 1.0)}
# R is at most 1, and below 0 where a sound is far from all prototypes.
REWARD = {"range": (-1e6, 1.0)}
NOT_NEGATIVE = {"range": (0.0, 1e30)}
TAU = {"length": 2}
NOT_EMPTY = {"not_empty": True}

Position = tuple[float, float]


@dataclasses.dataclass(frozen=True)
class SuccessRate:
    """A success rate with its confidence interval.

    Attributes:
        mean: Share of successful trials.
        low: Lower end of the 95 % interval.
        high: Upper end of the 95 % interval.
    """

    mean: float = field(metadata=PROBABILITY)
    low: float = field(metadata=PROBABILITY)
    high: float = field(metadata=PROBABILITY)
