"""What trials and studies give, one dataclass a kind.

The same dataclasses are written to the store and to results.json, and read
from there: `pack` and `unpack` for trials, `to_plain` and `from_plain` of
`drake_affetto.common.typed_json` for studies. The order of the fields is that
of the JSON.
"""

import dataclasses
from dataclasses import field
from typing import Any, ClassVar

import numpy as np

from drake_affetto.common.errors import InputError
from drake_affetto.common.typed_json import from_plain, to_plain

_PROBABILITY = {"range": (0.0, 1.0)}
_NOT_EMPTY = {"not_empty": True}

Position = tuple[float, float]


# --- Trials: one row in the store each.


@dataclasses.dataclass(frozen=True)
class GazeResult:
    """A search for the drum with the gaze.

    Attributes:
        found: Whether the gaze settled on the marker.
        tau: Task parameter τ (2,); zeros where nothing was found.
        duration: Time that the search took, s.
    """

    KIND: ClassVar[str] = "look"
    ARRAYS: ClassVar[tuple[str, ...]] = ()

    found: bool
    tau: list[float]
    duration: float


@dataclasses.dataclass(frozen=True)
class DemonstrationResult:
    """A demonstration at one position of the drum, with its repetitions.

    Attributes:
        xy: Position of the drum, m.
        found: Whether the robot found the drum with its gaze.
        tau: Task parameter τ (2,).
        attempts: Number of times that the movement was demonstrated.
        success: Whether the robot's own replay made the drum sound.
        reward: Reward of the best replay (paper Eq. 10).
        max_pull: Greatest force of the teacher, N.
        theta: (F,) parameters of the movement; empty if nothing was found.
        q: (T, n) recorded joint angles, rad.
        prototype: (bands, frames) spectrogram of the best replay's hit.
    """

    KIND: ClassVar[str] = "demonstration"
    ARRAYS: ClassVar[tuple[str, ...]] = ("theta", "q", "prototype")

    xy: list[float]
    found: bool
    tau: list[float]
    attempts: int
    success: bool
    reward: float
    max_pull: float
    theta: np.ndarray
    q: np.ndarray
    prototype: np.ndarray


@dataclasses.dataclass(frozen=True)
class StrikeResult:
    """A movement at a drum whose task parameter is known already.

    Attributes:
        reward: Reward from the sound (paper Eq. 10).
        success: Whether the reward is above the threshold.
        max_force: Greatest force on the drum's head, N.
        impulse: Impulse on the drum's head, N s.
        reward_over_time: (frames,) similarity to the prototypes as they
            slide over the recording.
    """

    KIND: ClassVar[str] = "strike"
    ARRAYS: ClassVar[tuple[str, ...]] = ("reward_over_time",)

    reward: float
    success: bool
    max_force: float
    impulse: float
    reward_over_time: np.ndarray


@dataclasses.dataclass(frozen=True)
class DrummingResult:
    """The whole chain: gaze, skill, movement, sound.

    Attributes:
        found: Whether the gaze settled on the marker.
        tau: Task parameter τ (2,).
        reward: Reward from the sound (paper Eq. 10); 0 without a movement.
        success: Whether the reward is above the threshold.
        max_force: Greatest force on the drum's head, N.
        impulse: Impulse on the drum's head, N s.
    """

    KIND: ClassVar[str] = "drumming"
    ARRAYS: ClassVar[tuple[str, ...]] = ()

    found: bool
    tau: list[float]
    reward: float
    success: bool
    max_force: float
    impulse: float


TrialResult = GazeResult | DemonstrationResult | StrikeResult | DrummingResult

TRIAL_RESULTS: dict[str, Any] = {
    kind.KIND: kind
    for kind in (GazeResult, DemonstrationResult, StrikeResult, DrummingResult)
}


def pack(result: TrialResult) -> tuple[dict[str, Any], dict[str, np.ndarray]]:
    """A trial's result as the plain data and the arrays of the store."""
    values = {
        each.name: getattr(result, each.name)
        for each in dataclasses.fields(result)
    }
    arrays = {name: values.pop(name) for name in result.ARRAYS}
    return to_plain(values), arrays


def unpack(
    kind: str, plain: dict[str, Any], arrays: dict[str, np.ndarray]
) -> Any:
    """The inverse of `pack`, for a trial of the kind `kind`.

    Raises:
        InputError: If there is no such kind of trial.
    """
    if kind not in TRIAL_RESULTS:
        raise InputError(f"no kind of trial is called {kind!r}")
    return TRIAL_RESULTS[kind](**plain, **arrays)


# --- Studies: one results.json each.


@dataclasses.dataclass(frozen=True)
class SuccessRate:
    """A success rate with its confidence interval.

    Attributes:
        mean: Share of successful trials.
        low: Lower end of the 95 % interval.
        high: Upper end of the 95 % interval.
    """

    mean: float = field(metadata=_PROBABILITY)
    low: float = field(metadata=_PROBABILITY)
    high: float = field(metadata=_PROBABILITY)


@dataclasses.dataclass(frozen=True)
class TaughtPosition:
    """A position of the drum at which a demonstration was given.

    Attributes:
        repeat: Number of the study's repeat.
        xy: Position of the drum, m.
        tau: Task parameter τ (2,).
        attempts: Number of times that the movement was demonstrated.
        reward: Reward of the best replay.
        max_pull: Greatest force of the teacher, N.
    """

    repeat: int
    xy: Position
    tau: list[float]
    attempts: int
    reward: float
    max_pull: float | None


@dataclasses.dataclass(frozen=True)
class CurvePoint:
    """The success after some demonstrations.

    Attributes:
        n: Number of demonstrations.
        success_rate: Success at the test positions.
        per_repeat: Share of successes in each repeat.
    """

    n: int
    success_rate: SuccessRate
    per_repeat: list[float] = field(default_factory=list)


@dataclasses.dataclass(frozen=True)
class LearningCurve:
    """Success over the number of demonstrations.

    Attributes:
        by_demonstrations: Points of the curve, in order.
        n_to_90: Number from which on success stays at 90 % or more.
    """

    by_demonstrations: list[CurvePoint] = field(metadata=_NOT_EMPTY)
    n_to_90: int | None


@dataclasses.dataclass(frozen=True)
class EvaluatedPosition:
    """A trial at a test position.

    Attributes:
        repeat: Number of the study's repeat.
        xy: Position of the drum, m.
        tau: Task parameter τ (2,).
        reward: Reward from the sound.
        success: Whether the reward is above the threshold.
        contact_impulse: Impulse on the drum's head, N s.
    """

    repeat: int
    xy: Position
    tau: list[float]
    reward: float
    success: bool
    contact_impulse: float | None


@dataclasses.dataclass(frozen=True)
class FinalTest:
    """The test after the last demonstration.

    Attributes:
        success_rate: Share of successful trials.
        positions: The trials.
    """

    success_rate: float = field(metadata=_PROBABILITY)
    positions: list[EvaluatedPosition]


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

    auc: float | None
    threshold: float
    false_hits: int
    missed_hits: int
    impulse_threshold: float
    trials: int
    hits: int


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
    repeat: int
    n: int
    xy: Position
    reward: float
    impulse: float | None


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
class DrumResults:
    """results.json of `affetto drum`.

    Attributes:
        study: Kind of study, "drum".
        version: Version of the package that ran it.
        seed: Seed of everything that is random.
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
    """

    study: str
    version: str
    seed: int
    scenario: str
    demonstrations: int
    evaluations: int
    repeats: int
    taught: list[TaughtPosition]
    first_try: float | None = field(metadata=_PROBABILITY)
    by_demonstrations: list[CurvePoint] = field(metadata=_NOT_EMPTY)
    n_to_90: int | None
    active: LearningCurve | None
    final: FinalTest
    separation: RewardEvaluation
    rewards: list[RewardRow]
    similarity: SimilarityTraces | None = None

    def check(self, where: str) -> None:
        """Raises InputError where parts do not fit each other."""
        if self.similarity is not None:
            self.similarity.check(f"{where}similarity")


@dataclasses.dataclass(frozen=True)
class SchemeCell:
    """One scheme with one number of samples.

    Attributes:
        success_rate: Success at the test positions.
        per_repeat: Share of successes in each repeat.
        rewards: Reward of each trial.
    """

    success_rate: SuccessRate
    per_repeat: list[float] = field(default_factory=list)
    rewards: list[float] = field(default_factory=list)


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
    """

    a: str
    b: str
    samples: int
    difference: float
    p: float | None = None
    effect_size: float | None = None
    p_corrected: float | None


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
    samples: int
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
class MirrorResults:
    """results.json of `affetto mirror`, for one changed view.

    Attributes:
        study: Kind of study, "mirror".
        version: Version of the package that ran it.
        seed: Seed of everything that is random.
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
    """

    study: str
    version: str
    seed: int
    scenario: str
    samples: list[int] = field(metadata=_NOT_EMPTY)
    repeats: int
    evaluations: int
    demonstrations: int
    choice: str
    variability: float
    workspace: float
    schemes: dict[str, dict[int, SchemeCell]] = field(metadata=_NOT_EMPTY)
    comparisons: list[SchemeComparisonRow]
    map: TransferMap | None = None

    def check(self, where: str) -> None:
        """Raises InputError where parts do not fit each other."""
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
class ScenariosResults:
    """results.json of `affetto mirror --all-scenarios`.

    Attributes:
        study: Kind of study, "scenarios".
        version: Version of the package that ran it.
        seed: Seed of everything that is random.
        scenarios: Results by changed view.
    """

    study: str
    version: str
    seed: int
    scenarios: dict[str, MirrorResults] = field(metadata=_NOT_EMPTY)

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
    samples: int
    success_rate: SuccessRate
    per_repeat: list[float] = field(default_factory=list)


@dataclasses.dataclass(frozen=True)
class ConditionsResults:
    """results.json of the study on when transfer wins.

    Attributes:
        study: Kind of study, "conditions".
        version: Version of the package that ran it.
        seed: Seed of everything that is random.
        scenario: Scenario of the changed view.
        repeats: Number of repeats.
        evaluations: Number of test positions of a repeat.
        conditions: Success by condition, scheme and number of samples.
    """

    study: str
    version: str
    seed: int
    scenario: str
    repeats: int
    evaluations: int
    conditions: list[ConditionRow] = field(metadata=_NOT_EMPTY)

    def check(self, where: str) -> None:
        """All parts fit each other."""


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
    tau: list[float]
    attempts: int
    reward: float
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
    tau: list[float]
    reward: float
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

    demonstrations: int
    taught: list[DemoTaught]
    positions: list[DemoTrial]
    success_rate: float = field(metadata=_PROBABILITY)


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

    success_rate: float = field(metadata=_PROBABILITY)
    rewards: list[float]


@dataclasses.dataclass(frozen=True)
class DemoMirror:
    """The demo's part before the mirror.

    Attributes:
        samples: Number of demonstrations that the schemes were given.
        taught: The demonstrations.
        positions: The test positions.
        schemes: Results by scheme.
    """

    samples: int
    taught: list[DemoTaught]
    positions: list[DemoPosition]
    schemes: dict[str, DemoScheme]


@dataclasses.dataclass(frozen=True)
class DemoResults:
    """results.json of `affetto demo`.

    Attributes:
        study: Kind of study, "demo".
        version: Version of the package that ran it.
        seed: Seed of everything that is random.
        drumming: Part in direct view.
        mirror: Part before the mirror.
    """

    study: str
    version: str
    seed: int
    drumming: DemoDrumming
    mirror: DemoMirror

    def check(self, where: str) -> None:
        """All parts fit each other."""


@dataclasses.dataclass(frozen=True)
class ToySource:
    """Errors of the skill before transfer, medians over the seeds.

    Attributes:
        train_mse: Mean squared error on the training points.
        test_mse: Mean squared error on the test points.
        rotated_mse: Mean squared error on the rotated points.
        per_seed: The same errors for each seed.
    """

    train_mse: float
    test_mse: float
    rotated_mse: float
    per_seed: dict[str, list[float]] = field(default_factory=dict)


@dataclasses.dataclass(frozen=True)
class ToyMethod:
    """Errors of one method, medians over the seeds.

    Attributes:
        train_mse_mean: Error on the labeled points, mean over the subsets.
        train_mse_std: Standard deviation over the subsets.
        other_mse_mean: Error on the other points, mean over the subsets.
        other_mse_std: Standard deviation over the subsets.
        other_mse_p95: 95th percentile over the subsets.
        per_seed: The same errors for each seed.
    """

    train_mse_mean: float
    train_mse_std: float
    other_mse_mean: float
    other_mse_std: float
    other_mse_p95: float
    per_seed: dict[str, list[float]]


@dataclasses.dataclass(frozen=True)
class ToyFigures:
    """The toy experiment on one domain.

    Attributes:
        source: Errors before transfer.
        transfer: Errors by variant of transfer.
        baselines: Errors by baseline.
    """

    source: ToySource
    transfer: dict[str, ToyMethod] = field(metadata=_NOT_EMPTY)
    baselines: dict[str, ToyMethod] = field(metadata=_NOT_EMPTY)


@dataclasses.dataclass(frozen=True)
class ToyPaperSource:
    """The paper's errors of the skill before transfer.

    Attributes:
        train_mse: Mean squared error on the training points.
        test_mse: Mean squared error on the test points.
        rotated_mse: Mean squared error on the rotated points.
    """

    train_mse: float
    test_mse: float
    rotated_mse: float


@dataclasses.dataclass(frozen=True)
class ToyPaperTransfer:
    """The paper's errors after transfer.

    Attributes:
        train_mse_mean: Mean squared error on the labeled points.
        train_mse_std: Its standard deviation over the subsets.
        other_mse_mean: Mean squared error on the other points.
        other_mse_std: Its standard deviation over the subsets.
    """

    train_mse_mean: float
    train_mse_std: float
    other_mse_mean: float
    other_mse_std: float


@dataclasses.dataclass(frozen=True)
class ToyPaper:
    """The paper's figures of the toy experiment.

    Attributes:
        source: Errors before transfer.
        transfer: Errors after transfer.
    """

    source: ToyPaperSource
    transfer: ToyPaperTransfer


@dataclasses.dataclass(frozen=True, kw_only=True)
class ToyResults:
    """results.json of `affetto toy`.

    Attributes:
        study: Kind of study, "toy".
        version: Version of the package that ran it.
        seed: First seed.
        seeds: Number of seeds.
        repeats: Number of subsets of a seed.
        function: The function that is learned.
        paper: Figures of the paper.
        source: Errors before transfer, on the paper's domain.
        transfer: Errors by variant of transfer, on the paper's domain.
        baselines: Errors by baseline, on the paper's domain.
        wide: The same on a wider domain; None if not run.
    """

    study: str
    version: str
    seed: int
    seeds: int
    repeats: int
    function: str = ""
    paper: ToyPaper
    source: ToySource
    transfer: dict[str, ToyMethod] = field(metadata=_NOT_EMPTY)
    baselines: dict[str, ToyMethod] = field(metadata=_NOT_EMPTY)
    wide: ToyFigures | None = None

    def check(self, where: str) -> None:
        """All parts fit each other."""


STUDY_RESULTS: dict[str, Any] = {
    "demo": DemoResults,
    "drum": DrumResults,
    "mirror": MirrorResults,
    "scenarios": ScenariosResults,
    "conditions": ConditionsResults,
    "toy": ToyResults,
}


def read_study(study: str, plain: Any, where: str) -> Any:
    """Reads a study's results from JSON's plain data.

    Args:
        study: Kind of study, a key of `STUDY_RESULTS`.
        plain: Content of its results.json.
        where: Name of the file in error messages, ending in ": ".

    Raises:
        InputError: If it is of another shape; the line names the place.
    """
    results = from_plain(STUDY_RESULTS[study], plain, where)
    results.check(where)
    return results
