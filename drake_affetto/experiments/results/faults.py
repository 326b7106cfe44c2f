"""Results of the study of faults."""

import dataclasses
from dataclasses import field
from typing import ClassVar

from drake_affetto.common.errors import require
from drake_affetto.common.study_results import COUNT, StudyResults
from drake_affetto.experiments.results.rates import (
    NOT_EMPTY,
    NOT_NEGATIVE,
    SuccessRate,
)


@dataclasses.dataclass(frozen=True)
class FaultRow:
    """A kind of fault in one size; the counts are of trials.

    Attributes:
        kind: Kind of fault, one of `faults.config.KINDS`.
        size: Its size; None where the kind has none.
        unit: Unit of the size.
        trials: All of them.
        success: Valid, heard, and the head was hit.
        false_success: Valid and heard, but the head was not hit.
        detected: Ended as not valid after the fault began.
        early: Ended as not valid before it began.
        harmed: The outcome is another than without the fault: heard or not.
        missed: Of these, those that were valid.
        detection_time: Median time from the fault's beginning to its detection,
            s; None where none was detected.
        max_force: Greatest force on drum or table, N.
        max_speed: Greatest speed of a joint, rad/s.
        reasons: How often each reason was given.
    """

    kind: str
    size: float | None
    unit: str
    trials: int = field(metadata=COUNT)
    success: int = field(metadata=COUNT)
    false_success: int = field(metadata=COUNT)
    detected: int = field(metadata=COUNT)
    early: int = field(metadata=COUNT)
    harmed: int = field(metadata=COUNT)
    missed: int = field(metadata=COUNT)
    detection_time: float | None = field(metadata=NOT_NEGATIVE)
    max_force: float = field(metadata=NOT_NEGATIVE)
    max_speed: float = field(metadata=NOT_NEGATIVE)
    reasons: dict[str, int] = field(metadata=COUNT)


@dataclasses.dataclass(frozen=True)
class SoundTrials:
    """The same trials without faults.

    Attributes:
        trials: Number of trials.
        success: Success among those that were valid.
        false_success: Heard, but the head was not hit.
        false_alarms: Ended as not valid.
        reasons: How often each reason was given.
        max_force: Greatest force on drum or table, N.
        max_speed: Greatest speed of a joint, rad/s.
        highest_scores: Greatest score of each check: at 1 it is not passed.
    """

    trials: int = field(metadata=COUNT)
    success: SuccessRate | None
    false_success: int = field(metadata=COUNT)
    false_alarms: int = field(metadata=COUNT)
    reasons: dict[str, int] = field(metadata=COUNT)
    max_force: float = field(metadata=NOT_NEGATIVE)
    max_speed: float = field(metadata=NOT_NEGATIVE)
    highest_scores: dict[str, float]


@dataclasses.dataclass(frozen=True)
class FaultsResults(StudyResults):
    """results.json of `affetto faults`.

    Attributes:
        scenario: Scenario, by name or path.
        demonstrations: Number of demonstrations that the skill knows.
        repeats: Number of trials of each fault and size.
        force_limit: Force that the robot must not exceed by itself, N.
        rows: Faults and sizes.
        sound: The same trials without faults.
        faulted: Number of faulted trials.
        false_success: Successes without a hit, of all trials with faults.
        missed: Trials whose outcome a fault has changed unnoticed.
        false_alarms: Ended as not valid without a fault, or before it began.
        beyond_limit: Trials with a force beyond the limit.
    """

    KIND: ClassVar[str] = "faults"

    scenario: str
    demonstrations: int = field(metadata=COUNT)
    repeats: int = field(metadata=COUNT)
    force_limit: float = field(metadata=NOT_NEGATIVE)
    rows: list[FaultRow] = field(metadata=NOT_EMPTY)
    sound: SoundTrials
    faulted: int = field(metadata=COUNT)
    false_success: int = field(metadata=COUNT)
    missed: int = field(metadata=COUNT)
    false_alarms: int = field(metadata=COUNT)
    beyond_limit: int = field(metadata=COUNT)

    def check(self, where: str) -> None:
        """Raises InputError where counts do not fit each other."""
        total = sum(row.trials for row in self.rows)
        require(
            total == self.faulted,
            f"{where}faulted",
            self.faulted,
            f"{total}, as the rows have",
        )
