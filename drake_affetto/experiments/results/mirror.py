"""Results of the studies of changed views and other conditions."""

import dataclasses
from dataclasses import field
from typing import ClassVar

import numpy as np

from drake_affetto.common.errors import InputError
from drake_affetto.common.study_results import COUNT, StudyResults
from drake_affetto.experiments.results.rates import (
    NOT_EMPTY,
    PROBABILITY,
    REWARD,
    Position,
    SuccessRate,
)
from drake_affetto.experiments.results.self_calibration import (
    SelfCalibrationResults,
)


@dataclasses.dataclass(frozen=True)
class SchemeCell:
    """One scheme with one number of samples.

    Attributes:
        success_rate: Success at the test positions.
        per_repeat: Share of successes in each repeat.
        rewards: Reward of each trial.
        landing: Distance from the head's center at which the palm comes down
            in each trial, m; None where nothing was struck.
        grazes: Share of trials in which the head sounds although the palm
            comes down beside it.
    """

    success_rate: SuccessRate
    per_repeat: list[float] = field(default_factory=list, metadata=PROBABILITY)
    rewards: list[float] = field(default_factory=list, metadata=REWARD)
    landing: list[float | None] = field(default_factory=list)
    grazes: float | None = None


@dataclasses.dataclass(frozen=True, kw_only=True)
class SchemeComparisonRow:
    """The paired test of two schemes.

    Attributes:
        a: First scheme.
        b: Second scheme.
        samples: Number of samples that both were given.
        difference: Success rate of `a` minus that of `b`.
        p: p value of "neither is better".
        effect_size: Cohen's h.
        p_corrected: p value, corrected for the number of comparisons.
        measure: What is compared, "success" or "landing", m.
        primary: Whether this comparison was named before the study.
    """

    a: str
    b: str
    samples: int = field(metadata=COUNT)
    difference: float
    p: float | None = None
    effect_size: float | None = None
    p_corrected: float | None
    measure: str = "success"
    primary: bool = False


@dataclasses.dataclass(frozen=True)
class TransferMap:
    """The map h of one repeat, on a grid.

    Attributes:
        scheme: Scheme that found the map.
        samples: Number of samples that it was given.
        input_names: Names of the two task parameters in the new view.
        output_names: Names of the two task parameters in the old view.
        shape: Shape of the grid.
        input: Points of the grid.
        output: Their images under h.
        taught_input: Task parameters of the demonstrations.
        taught_output: Their images under h.
    """

    scheme: str
    samples: int = field(metadata=COUNT)
    input_names: list[str]
    output_names: list[str]
    shape: list[int]
    input: list[Position]
    output: list[Position]
    taught_input: list[Position]
    taught_output: list[Position]

    def check(self, where: str) -> None:
        """Raises InputError where the lists do not fit the grid."""
        points = int(np.prod(self.shape))
        if len(self.shape) != 2 or not (
            len(self.output) == points == len(self.input) > 0
        ):
            raise InputError(
                f"{where} has {len(self.input)} inputs and "
                f"{len(self.output)} outputs, expected a grid of {self.shape}"
            )
        for name in ("input_names", "output_names"):
            if len(getattr(self, name)) != 2:
                raise InputError(f"{where}.{name} has not two names")
        if len(self.taught_input) != len(self.taught_output):
            raise InputError(
                f"{where} has taught inputs and outputs of several lengths"
            )


@dataclasses.dataclass(frozen=True)
class MirrorResults(StudyResults):
    """results.json of `affetto mirror`, for one changed view.

    Attributes:
        scenario: Scenario of the changed view, by name or path.
        samples: Numbers of demonstrations that the schemes were given.
        repeats: Number of repeats.
        evaluations: Number of test positions of a repeat.
        demonstrations: Number of demonstrations in direct view.
        choice: How the samples were chosen.
        variability: Factor of the teacher's variation.
        workspace: Share of the drum's region that was used.
        schemes: Results by scheme and number of samples.
        comparisons: Paired tests of the schemes.
        map: The map of the first repeat; None if no scheme found one.
        chance: Success of the best constant stroke, played blind.
        bodies: How each repeat's robot departs from its model, by name of the
            number; empty where all are alike.
        knowledge: How wrongly the optical map knows the camera, see
            `CalibrationError`; empty where the default's map is another one.
        invalid: Number of trials that the supervisor did not pass: they are in
            none of the other figures.
        self_calibration: How the robot finds the mirror by itself; None if it
            was not tried.
    """

    KIND: ClassVar[str] = "mirror"

    scenario: str
    samples: list[int] = field(metadata={**NOT_EMPTY, **COUNT})
    repeats: int = field(metadata=COUNT)
    evaluations: int = field(metadata=COUNT)
    demonstrations: int = field(metadata=COUNT)
    choice: str
    variability: float
    workspace: float
    schemes: dict[str, dict[int, SchemeCell]] = field(metadata=NOT_EMPTY)
    comparisons: list[SchemeComparisonRow]
    map: TransferMap | None = None
    chance: SuccessRate | None = None
    bodies: list[dict[str, float]] = field(default_factory=list)
    knowledge: dict[str, float] = field(default_factory=dict)
    invalid: int = field(default=0, metadata=COUNT)
    self_calibration: SelfCalibrationResults | None = None

    def check(self, where: str) -> None:
        """Raises InputError where parts do not fit each other."""
        if self.self_calibration is not None:
            self.self_calibration.check(f"{where}self_calibration")
        for name, cells in self.schemes.items():
            for samples in self.samples:
                if samples not in cells:
                    raise InputError(
                        f"{where}schemes.{name} has nothing for {samples} "
                        "samples"
                    )
        if self.map is not None:
            self.map.check(f"{where}map")


@dataclasses.dataclass(frozen=True)
class ScenariosResults(StudyResults):
    """results.json of `affetto mirror --all-scenarios`.

    Attributes:
        scenarios: Results by changed view.
    """

    KIND: ClassVar[str] = "scenarios"

    scenarios: dict[str, MirrorResults] = field(metadata=NOT_EMPTY)

    def check(self, where: str) -> None:
        """Raises InputError where parts do not fit each other."""
        for name, each in self.scenarios.items():
            each.check(f"{where}scenarios.{name}.")


@dataclasses.dataclass(frozen=True)
class ConditionRow:
    """A scheme's success under one condition.

    Attributes:
        factor: What is changed.
        value: What it is changed to.
        scheme: Scheme.
        samples: Number of samples that it was given.
        success_rate: Success at the test positions.
        per_repeat: Share of successes in each repeat.
    """

    factor: str
    value: str
    scheme: str
    samples: int = field(metadata=COUNT)
    success_rate: SuccessRate
    per_repeat: list[float] = field(default_factory=list, metadata=PROBABILITY)


@dataclasses.dataclass(frozen=True)
class ConditionsResults(StudyResults):
    """results.json of the study on when transfer wins.

    Attributes:
        scenario: Scenario of the changed view.
        repeats: Number of repeats.
        evaluations: Number of test positions of a repeat.
        conditions: Success by condition, scheme and number of samples.
    """

    KIND: ClassVar[str] = "conditions"

    scenario: str
    repeats: int = field(metadata=COUNT)
    evaluations: int = field(metadata=COUNT)
    conditions: list[ConditionRow] = field(metadata=NOT_EMPTY)
