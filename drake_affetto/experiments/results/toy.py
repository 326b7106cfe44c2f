"""Results of the toy experiment."""

import dataclasses
from dataclasses import field
from typing import ClassVar

from drake_affetto.common.study_results import COUNT, StudyResults
from drake_affetto.experiments.results.rates import (
    NOT_EMPTY,
    NOT_NEGATIVE,
)


@dataclasses.dataclass(frozen=True)
class SourceErrors:
    """Errors of the skill before transfer.

    Attributes:
        train_mse: Mean squared error on the training points.
        test_mse: Mean squared error on the other points of the same draw.
        rotated_mse: Mean squared error on the rotated points.
    """

    train_mse: float = field(metadata=NOT_NEGATIVE)
    test_mse: float = field(metadata=NOT_NEGATIVE)
    rotated_mse: float = field(metadata=NOT_NEGATIVE)


@dataclasses.dataclass(frozen=True)
class TransferErrors:
    """Errors of one method after transfer.

    Attributes:
        train_mse_mean: Error on the labeled points, mean over the subsets.
        train_mse_std: Standard deviation over the subsets.
        other_mse_mean: Error on the other points, mean over the subsets.
        other_mse_std: Standard deviation over the subsets.
    """

    train_mse_mean: float = field(metadata=NOT_NEGATIVE)
    train_mse_std: float = field(metadata=NOT_NEGATIVE)
    other_mse_mean: float = field(metadata=NOT_NEGATIVE)
    other_mse_std: float = field(metadata=NOT_NEGATIVE)


@dataclasses.dataclass(frozen=True)
class ToySource(SourceErrors):
    """Errors before transfer, medians over the seeds.

    Attributes:
        per_seed: The same errors for each seed.
    """

    per_seed: dict[str, list[float]] = field(default_factory=dict)


@dataclasses.dataclass(frozen=True)
class ToyMethod(TransferErrors):
    """Errors of one method, medians over the seeds.

    Attributes:
        other_mse_p95: 95th percentile over the subsets.
        per_seed: The same errors for each seed.
    """

    other_mse_p95: float = field(metadata=NOT_NEGATIVE)
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
class ToyPaper:
    """The paper's figures of the toy experiment.

    Attributes:
        source: Errors before transfer.
        transfer: Errors after transfer.
    """

    source: SourceErrors
    transfer: TransferErrors


# As printed in the paper: mean and standard deviation over 100 repeats.
PAPER = ToyPaper(
    SourceErrors(train_mse=0.00, test_mse=0.06, rotated_mse=41.71),
    TransferErrors(
        train_mse_mean=0.001,
        train_mse_std=0.001,
        other_mse_mean=0.354,
        other_mse_std=0.661,
    ),
)


@dataclasses.dataclass(frozen=True, kw_only=True)
class ToyResults(StudyResults):
    """results.json of `affetto toy`.

    Attributes:
        seed: The first of the seeds.
        seeds: Number of seeds.
        repeats: Number of subsets of a seed.
        function: The function that is learned.
        paper: Figures of the paper.
        source: Errors before transfer, on the paper's domain.
        transfer: Errors by variant of transfer, on the paper's domain.
        baselines: Errors by baseline, on the paper's domain.
        wide: The same on a wider domain; None if not run.
    """

    KIND: ClassVar[str] = "toy"

    seeds: int = field(metadata=COUNT)
    repeats: int = field(metadata=COUNT)
    function: str = ""
    paper: ToyPaper
    source: ToySource
    transfer: dict[str, ToyMethod] = field(metadata=NOT_EMPTY)
    baselines: dict[str, ToyMethod] = field(metadata=NOT_EMPTY)
    wide: ToyFigures | None = None
