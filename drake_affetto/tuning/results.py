"""The results of a tuning study, as its files hold them."""

from collections.abc import Mapping
import dataclasses
from typing import ClassVar

from drake_affetto.common.errors import require
from drake_affetto.common.study_results import COUNT, StudyResults
from drake_affetto.tuning.config import HELD_OUT, TRAINING

DETAILS_FILE = "details.json"


@dataclasses.dataclass(frozen=True)
class TrajectoryResult:
    """The costs of one set of gains on one reference, by joint.

    Attributes:
        cost: Mean cost of all joints.
        tracking_error_deg: Rms tracking error, degrees.
        tracking_percent: Rms tracking error, % of the joint's range.
        effort_percent: Effort of the valves, %.
        oscillation_percent: Oscillation at rest, % of the joint's range.
    """

    cost: float
    tracking_error_deg: dict[str, float]
    tracking_percent: dict[str, float]
    effort_percent: dict[str, float]
    oscillation_percent: dict[str, float]


@dataclasses.dataclass(frozen=True)
class GainsResult:
    """The performance of one set of gains.

    Attributes:
        cost: Cost on the training trajectory.
        gains: Gains by joint and name.
        trajectories: Costs by reference.
        rest_oscillation_percent: Greatest standard deviation at rest in any of
            several postures, by joint, % of the joint's range.
    """

    cost: float
    gains: dict[str, dict[str, float]]
    trajectories: dict[str, TrajectoryResult]
    rest_oscillation_percent: dict[str, float]


@dataclasses.dataclass(frozen=True)
class TrialCounts:
    """Numbers of trials.

    Attributes:
        finished: Number of complete and pruned trials.
        complete: Number of trials that followed the whole trajectory.
        pruned: Number of trials that were stopped early.
        interrupted: Number of trials whose process was killed.
        best: Number by which the study knows the best trial.
    """

    finished: int = dataclasses.field(metadata=COUNT)
    complete: int = dataclasses.field(metadata=COUNT)
    pruned: int = dataclasses.field(metadata=COUNT)
    interrupted: int = dataclasses.field(metadata=COUNT)
    best: int = dataclasses.field(metadata=COUNT)


@dataclasses.dataclass(frozen=True)
class TuningResults(StudyResults):
    """The content of results.json.

    Attributes:
        scenario: Name or file of the scenario.
        start: File of the gains that the search started from.
        tuning: File of references, cost and search.
        joints: Joints whose gains were searched.
        trials: Numbers of trials.
        hand_tuned: Performance of the start.
        best: Performance of the best gains.
        improvement: Decrease of the cost on the training trajectory, as a part
            of the start's cost.
        held_out_improvement: The same for each held-out reference.
    """

    KIND: ClassVar[str] = "tune"

    scenario: str
    start: str
    tuning: str
    joints: list[str]
    trials: TrialCounts
    hand_tuned: GainsResult
    best: GainsResult
    improvement: float
    held_out_improvement: dict[str, float]

    def check(self, where: str) -> None:
        """Raises InputError if references or joints do not fit together.

        Args:
            where: Name of the file in error messages, ending in ": ".
        """
        for name, side in (
            ("hand_tuned", self.hand_tuned),
            ("best", self.best),
        ):
            require(
                set(side.trajectories) == {TRAINING, *HELD_OUT},
                f"{where}{name}.trajectories",
                sorted(side.trajectories),
                f"{TRAINING}, {', '.join(HELD_OUT)}",
            )
            joints = set(self.hand_tuned.gains)
            tables: list[Mapping[str, object]] = [
                side.gains,
                side.rest_oscillation_percent,
            ]
            tables += [
                costs.tracking_error_deg for costs in side.trajectories.values()
            ]
            require(
                all(set(table) == joints for table in tables),
                f"{where}{name}",
                sorted(side.gains),
                "the same joints everywhere",
            )


@dataclasses.dataclass(frozen=True)
class TrialRow:
    """One finished trial.

    Attributes:
        number: Number by which the study knows it.
        pruned: Whether it was stopped early.
        cost: Cost; of a pruned trial, up to where it was stopped.
    """

    number: int
    pruned: bool
    cost: float


@dataclasses.dataclass(frozen=True)
class ReferenceTraces:
    """Joint angles along one reference, by joint, degrees.

    Attributes:
        t: Times, s.
        desired: The reference.
        hand_tuned: Angles with the gains of the start.
        tuned: Angles with the best gains.
    """

    t: list[float]
    desired: dict[str, list[float]]
    hand_tuned: dict[str, list[float]]
    tuned: dict[str, list[float]]


@dataclasses.dataclass(frozen=True)
class TuningDetails:
    """The content of details.json: what the report's charts show.

    Attributes:
        trials: The finished trials.
        importance: Importance of each gain by joint and gain; the gains of a
            joint add to 1. None after too few trials.
        references: Joint angles by reference.
    """

    trials: list[TrialRow]
    importance: dict[str, dict[str, float]] | None
    references: dict[str, ReferenceTraces]
