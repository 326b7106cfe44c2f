"""Results of the demo."""

import dataclasses
from dataclasses import field
from typing import ClassVar

from drake_affetto.common.study_results import COUNT, StudyResults
from drake_affetto.experiments.results.rates import (
    NOT_EMPTY,
    PROBABILITY,
    REWARD,
    TAU,
    Position,
)


@dataclasses.dataclass(frozen=True)
class DemoTaught:
    """A demonstration of the demo.

    Attributes:
        xy: Position of the drum, m.
        tau: Task parameter τ (2,).
        attempts: Number of times that the movement was demonstrated.
        reward: Reward of the best replay.
        success: Whether the robot's own replay made the drum sound.
    """

    xy: Position
    tau: list[float] = field(metadata=TAU)
    attempts: int = field(metadata=COUNT)
    reward: float = field(metadata=REWARD)
    success: bool = True


@dataclasses.dataclass(frozen=True)
class DemoTrial:
    """A trial of the demo.

    Attributes:
        xy: Position of the drum, m.
        tau: Task parameter τ (2,).
        reward: Reward from the sound.
        success: Whether the reward is above the threshold.
    """

    xy: Position
    tau: list[float] = field(metadata=TAU)
    reward: float = field(metadata=REWARD)
    success: bool


@dataclasses.dataclass(frozen=True)
class DemoDrumming:
    """The demo's part in direct view.

    Attributes:
        demonstrations: Number of demonstrations that the skill learned from.
        taught: The demonstrations.
        positions: The trials at test positions.
        success_rate: Share of successful trials.
    """

    demonstrations: int = field(metadata=COUNT)
    taught: list[DemoTaught]
    positions: list[DemoTrial] = field(metadata=NOT_EMPTY)
    success_rate: float = field(metadata=PROBABILITY)


@dataclasses.dataclass(frozen=True)
class DemoPosition:
    """A test position before the mirror.

    Attributes:
        xy: Position of the drum, m.
        tau: Task parameter τ̂ (2,); None in files of earlier versions.
    """

    xy: Position
    tau: list[float] | None = None


@dataclasses.dataclass(frozen=True)
class DemoScheme:
    """A scheme of transfer in the demo.

    Attributes:
        success_rate: Share of successful trials.
        rewards: Reward at each test position.
    """

    success_rate: float = field(metadata=PROBABILITY)
    rewards: list[float] = field(metadata=REWARD)


@dataclasses.dataclass(frozen=True)
class DemoMirror:
    """The demo's part before the mirror.

    Attributes:
        samples: Number of demonstrations that the schemes were given.
        taught: The demonstrations.
        positions: The test positions.
        schemes: Results by scheme.
    """

    samples: int = field(metadata=COUNT)
    taught: list[DemoTaught]
    positions: list[DemoPosition] = field(metadata=NOT_EMPTY)
    schemes: dict[str, DemoScheme]


@dataclasses.dataclass(frozen=True)
class DemoResults(StudyResults):
    """results.json of `affetto demo`.

    Attributes:
        drumming: Part in direct view.
        mirror: Part before the mirror.
    """

    KIND: ClassVar[str] = "demo"

    drumming: DemoDrumming
    mirror: DemoMirror
