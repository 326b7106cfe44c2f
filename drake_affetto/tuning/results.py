"""What a tuning study does, and what came of it."""

from collections.abc import Sequence
import dataclasses

from drake_affetto.common.typing import Array
from drake_affetto.tuning.references import (
    DEFAULT_FILE,
    JointCosts,
    Reference,
)

START_FILE = "package://drake_affetto/control_hand_tuned.yaml"

GAINS = ("kP", "kI", "kD", "kF")


@dataclasses.dataclass(frozen=True)
class TunePlan:
    """What determines a tuning study, but for how many trials it has.

    Attributes:
        joints: whose gains are searched; the others keep those of `start`.
        seed: of the search.
        scenario: name or file of the scenario.
        start: YAML file of the gains that the search starts from.
        tuning: YAML file of `TuningConfig`.
    """

    joints: tuple[str, ...]
    seed: int = 0
    scenario: str = "drumming"
    start: str = START_FILE
    tuning: str = DEFAULT_FILE


@dataclasses.dataclass(frozen=True)
class Run:
    """One run along a reference.

    Attributes:
        q: (T', n) angles at the reference's times, rad; T' < T where the run
            was stopped.
        opening: (T', n) of the valves.
    """

    q: Array
    opening: Array


def parameter_names(joints: Sequence[str]) -> list[str]:
    """Names of a study's parameters: joint by joint, its gains' factors."""
    return [f"{joint}.{gain}" for joint in joints for gain in GAINS]


@dataclasses.dataclass(frozen=True)
class Assessment:
    """How two sets of gains do on all references.

    Attributes:
        references: by name.
        runs: by reference's name, the hand-tuned and the best gains' run.
        costs: as `runs`.
    """

    references: dict[str, Reference]
    runs: dict[str, tuple[Run, Run]]
    costs: dict[str, tuple[JointCosts, JointCosts]]
