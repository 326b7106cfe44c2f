"""Results of the toy experiment."""

import dataclasses
from dataclasses import field

from drake_affetto.experiments.results.rates import NOT_EMPTY


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
    transfer: dict[str, ToyMethod] = field(metadata=NOT_EMPTY)
    baselines: dict[str, ToyMethod] = field(metadata=NOT_EMPTY)


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
    transfer: dict[str, ToyMethod] = field(metadata=NOT_EMPTY)
    baselines: dict[str, ToyMethod] = field(metadata=NOT_EMPTY)
    wide: ToyFigures | None = None

    def check(self, where: str) -> None:
        """All parts fit each other."""
