"""Results of the drumming study."""

import dataclasses
from dataclasses import field
from typing import ClassVar

from drake_affetto.common.errors import InputError
from drake_affetto.common.study_results import COUNT, StudyResults
from drake_affetto.experiments.results.rates import (
    NOT_EMPTY,
    NOT_NEGATIVE,
    PROBABILITY,
    REWARD,
    TAU,
    Position,
    SuccessRate,
)


@dataclasses.dataclass(frozen=True)
class _Seen:
    """A position of the drum that the robot has looked at in one repeat.

    Attributes:
        repeat: Number of the study's repeat.
        xy: Position of the drum, m.
        tau: Task parameter τ (2,).
    """

    repeat: int = field(metadata=COUNT)
    xy: Position
    tau: list[float] = field(metadata=TAU)


@dataclasses.dataclass(frozen=True)
class TaughtPosition(_Seen):
    """A position of the drum at which a demonstration was given.

    Attributes:
        attempts: Number of times that the movement was demonstrated.
        reward: Reward of the best replay.
        max_pull: Greatest force of the teacher, N.
    """

    attempts: int = field(metadata=COUNT)
    reward: float = field(metadata=REWARD)
    max_pull: float | None = field(metadata=NOT_NEGATIVE)


@dataclasses.dataclass(frozen=True)
class CurvePoint:
    """The success after some demonstrations.

    Attributes:
        n: Number of demonstrations.
        success_rate: Success at the test positions.
        per_repeat: Share of successes in each repeat.
    """

    n: int = field(metadata=COUNT)
    success_rate: SuccessRate
    per_repeat: list[float] = field(default_factory=list, metadata=PROBABILITY)


@dataclasses.dataclass(frozen=True)
class LearningCurve:
    """Success over the number of demonstrations.

    Attributes:
        by_demonstrations: Points of the curve, in order.
        n_to_90: Number from which on success stays at 90 % or more.
    """

    by_demonstrations: list[CurvePoint] = field(metadata=NOT_EMPTY)
    n_to_90: int | None = field(metadata=COUNT)


@dataclasses.dataclass(frozen=True)
class EvaluatedPosition(_Seen):
    """A trial at a test position.

    Attributes:
        reward: Reward from the sound.
        success: Whether the reward is above the threshold.
        contact_impulse: Impulse on the drum's head, N s.
        landing: Distance from the head's center at which the palm comes
            down, m; None where nothing was struck.
    """

    reward: float = field(metadata=REWARD)
    success: bool
    contact_impulse: float | None = field(metadata=NOT_NEGATIVE)
    landing: float | None = field(default=None, metadata=NOT_NEGATIVE)


@dataclasses.dataclass(frozen=True)
class FinalTest:
    """The test after the last demonstration.

    Attributes:
        success_rate: Share of successful trials.
        positions: The trials.
    """

    success_rate: float = field(metadata=PROBABILITY)
    positions: list[EvaluatedPosition] = field(metadata=NOT_EMPTY)


@dataclasses.dataclass(frozen=True)
class RewardEvaluation:
    """The reward as a classifier, compared with the contact of the trial.

    Attributes:
        auc: Area under the ROC curve; None without both hits and misses.
        threshold: Reward above which a trial is a success.
        false_hits: Number of successes without contact.
        missed_hits: Number of contacts without success.
        impulse_threshold: Impulse on the head above which it was hit, N s.
        trials: Number of trials.
        hits: Number of trials in which the head was hit.
    """

    auc: float | None = field(metadata=PROBABILITY)
    threshold: float
    false_hits: int = field(metadata=COUNT)
    missed_hits: int = field(metadata=COUNT)
    impulse_threshold: float
    trials: int = field(metadata=COUNT)
    hits: int = field(metadata=COUNT)


@dataclasses.dataclass(frozen=True)
class RewardRow:
    """One trial's reward and contact.

    Attributes:
        order: Order of the demonstrations, "random" or "active".
        repeat: Number of the study's repeat.
        n: Number of demonstrations.
        xy: Position of the drum, m.
        reward: Reward from the sound.
        impulse: Impulse on the drum's head, N s.
    """

    order: str
    repeat: int = field(metadata=COUNT)
    n: int = field(metadata=COUNT)
    xy: Position
    reward: float = field(metadata=REWARD)
    impulse: float | None = field(metadata=NOT_NEGATIVE)


@dataclasses.dataclass(frozen=True)
class SimilarityTraces:
    """Similarity to the prototypes over time (paper Fig. 3b).

    Attributes:
        t: Times, s.
        hit: Similarity in a trial that was a hit.
        miss: Similarity in a trial that was a miss.
    """

    t: list[float]
    hit: list[float]
    miss: list[float]

    def check(self, where: str) -> None:
        """Raises InputError if the lists differ in length."""
        if len({len(self.t), len(self.hit), len(self.miss)}) > 1:
            raise InputError(f"{where} has lists of several lengths")


@dataclasses.dataclass(frozen=True)
class DrumResults(StudyResults):
    """results.json of `affetto drum`.

    Attributes:
        scenario: Scenario, by name or path.
        demonstrations: Number of demonstrations of a repeat.
        evaluations: Number of test positions.
        repeats: Number of repeats.
        taught: Positions of all demonstrations.
        first_try: Share of demonstrations that succeeded at once.
        by_demonstrations: Learning curve in random order.
        n_to_90: Number from which on success stays at 90 % or more.
        active: Learning curve in the skill's own order; None if not tried.
        final: Test after the last demonstration.
        separation: How well the reward tells hits from misses.
        rewards: Reward and contact of all trials.
        similarity: Examples of Fig. 3b; None without both a hit and a miss.
        chance: Success of the best constant stroke, played blind.
        bodies: How each repeat's robot departs from its model, by name of the
            number; empty where all are alike.
        invalid: Number of trials that the supervisor did not pass: they are in
            none of the other figures.
    """

    KIND: ClassVar[str] = "drum"

    scenario: str
    demonstrations: int = field(metadata=COUNT)
    evaluations: int = field(metadata=COUNT)
    repeats: int = field(metadata=COUNT)
    taught: list[TaughtPosition]
    first_try: float | None = field(metadata=PROBABILITY)
    by_demonstrations: list[CurvePoint] = field(metadata=NOT_EMPTY)
    n_to_90: int | None = field(metadata=COUNT)
    active: LearningCurve | None
    final: FinalTest
    separation: RewardEvaluation
    rewards: list[RewardRow]
    similarity: SimilarityTraces | None = None
    chance: SuccessRate | None = None
    bodies: list[dict[str, float]] = field(default_factory=list)
    invalid: int = field(default=0, metadata=COUNT)

    def check(self, where: str) -> None:
        """Raises InputError where parts do not fit each other."""
        if self.similarity is not None:
            self.similarity.check(f"{where}similarity")
