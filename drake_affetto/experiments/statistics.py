"""Success rates with their uncertainty, and schemes held against each other.

Trials come in repeats: those of one repeat share what was taught and learned,
so they are not independent of each other. All here respects that.
"""

from collections.abc import Iterable, Mapping, Sequence
import dataclasses
import itertools

import numpy as np
from numpy.typing import ArrayLike
from scipy import stats

from drake_affetto.common.errors import require
from drake_affetto.common.typing import Array
from drake_affetto.experiments.results import (
    SchemeCell,
    SchemeComparisonRow,
    StrikeResult,
    SuccessRate,
)

# How alike trials of one repeat are taken to be where all trials went alike, so
# that it cannot be seen: about what it is at rates of 80 to 95 %.
_ASSUMED_CORRELATION = 0.1
# Up to how many repeats all sign changes are gone through (2^n of them).
_EXACT = 14
_RESAMPLES = 20_000


def sounded(strike: StrikeResult | None) -> bool:
    """Whether a strike made the drum sound; None: nothing was struck."""
    return strike is not None and strike.success


def success_table(
    strikes: Sequence[Sequence[StrikeResult | None]],
) -> Array:
    """1 where a strike sounded, else 0: a row a repeat, a column a trial.

    NaN where a strike is not valid: there is nothing to judge.
    """
    return np.array(
        [
            [sounded(s) if is_valid(s) else np.nan for s in row]
            for row in strikes
        ],
        float,
    )


def is_valid(strike: StrikeResult | None) -> bool:
    """Whether a strike is judged: the supervisor passes it, or it was none."""
    return strike is None or not strike.invalid


def invalid_count(strikes: Iterable[StrikeResult | None]) -> int:
    """How many strikes the supervisor does not pass."""
    return sum(not is_valid(strike) for strike in strikes)


def scheme_cell(
    strikes: Sequence[Sequence[StrikeResult | None]],
) -> SchemeCell:
    """What the strikes of a scheme come to.

    Args:
        strikes: A row a repeat, a column a test position.

    Raises:
        InputError: If there is no strike.
    """
    successes = success_table(strikes)
    flat = [strike for row in strikes for strike in row if is_valid(strike)]
    require(bool(flat), "strikes", "none that is valid", "at least one")
    return SchemeCell(
        success_rate(successes),
        _row_means(successes).tolist(),
        [s.reward if s else 0.0 for s in flat],
        [s.landing if s else None for s in flat],
        float(np.mean([s.graze if s else False for s in flat])),
    )


def success_rate(successes: ArrayLike, level: float = 0.95) -> SuccessRate:
    """Mean success and its confidence interval.

    Wilson's interval; where repeats differ from each other by more than
    chance, the number of trials counts for less (design effect). So it does
    where all trials had one outcome, which hides how alike those of a repeat
    are.

    Args:
        successes: booleans (repeats, trials); NaN where a trial is not valid.
        level: of confidence.

    Returns:
        The rate and its interval.

    Raises:
        InputError: if there is no trial.
    """
    table = np.asarray(successes, dtype=float)
    require(
        table.ndim == 2 and table.size > 0,
        "successes",
        f"an array of shape {table.shape}",
        "repeats and trials, at least one of each",
    )
    valid = np.isfinite(table)
    require(bool(valid.any()), "successes", "none that is valid", "a trial")
    mean = float(table[valid].mean())
    n = np.count_nonzero(valid) / _design_effect(table)
    z = stats.norm.ppf(0.5 + 0.5 * level)
    middle = (mean + z**2 / (2.0 * n)) / (1.0 + z**2 / n)
    half = (z / (1.0 + z**2 / n)) * np.sqrt(
        mean * (1.0 - mean) / n + (z / (2.0 * n)) ** 2
    )
    return SuccessRate(
        mean,
        float(max(0.0, min(mean, middle - half))),
        float(min(1.0, max(mean, middle + half))),
    )


def _design_effect(table: np.ndarray) -> float:
    """How many times the variance of the mean exceeds that of a binomial."""
    valid = np.isfinite(table)
    rows = _row_means(table)
    repeats, mean = len(rows), table[valid].mean()
    # Where some are not valid, as many as a repeat has in the mean.
    trials = np.count_nonzero(valid) / repeats
    if repeats < 2:
        return 1.0
    if mean in (0.0, 1.0):
        return 1.0 + (trials - 1) * _ASSUMED_CORRELATION
    between = rows.var(ddof=1) / repeats
    binomial = mean * (1.0 - mean) / (repeats * trials)
    return float(np.clip(between / binomial, 1.0, trials))


def _row_means(table: np.ndarray) -> Array:
    """Mean of the valid trials of each repeat that has any."""
    return np.array(
        [
            row[np.isfinite(row)].mean()
            for row in table
            if np.isfinite(row).any()
        ]
    )


def paired_p(first: ArrayLike, second: ArrayLike) -> float:
    """p of "neither is better", for successes (repeats,) under each of two.

    A permutation test on the differences within repeats: if neither is
    better, each difference might as well have the other sign. Two-sided;
    exact up to 14 repeats.
    """
    difference = np.asarray(first, float) - np.asarray(second, float)
    require(
        difference.ndim == 1 and difference.size > 0,
        "first",
        f"an array of shape {difference.shape}",
        "one number for each repeat",
    )
    if len(difference) < 2:
        return 1.0
    result = stats.permutation_test(
        (difference,),
        lambda x, axis: np.mean(x, axis=axis),
        permutation_type="samples",
        vectorized=True,
        n_resamples=np.inf if len(difference) <= _EXACT else _RESAMPLES,
        rng=np.random.default_rng(0),
    )
    return float(min(1.0, result.pvalue))


def holm(p: Sequence[float]) -> list[float]:
    """p values corrected for their number, by Holm's step-down method."""
    values = np.asarray(p, float)
    order = np.argsort(values, kind="stable")
    steps = (len(values) - np.arange(len(values))) * values[order]
    corrected = np.empty(len(values))
    corrected[order] = np.minimum(1.0, np.maximum.accumulate(steps))
    return corrected.tolist()


def cohens_h(first: float, second: float) -> float:
    """Effect size of the difference between two rates, -π to π.

    By Cohen 0.2 is called small, 0.5 medium and 0.8 large.
    """
    a, b = (2.0 * np.arcsin(np.sqrt(rate)) for rate in (first, second))
    return float(a - b)


def compare_landing(
    landings: Mapping[str, np.ndarray], pair: tuple[str, str], samples: int
) -> SchemeComparisonRow:
    """Compares where the strokes of two schemes land.

    Args:
        landings: By scheme, distances from the head's center (repeats,
            trials), m; NaN without a stroke. Trials correspond as in
            `compare`.
        pair: The two schemes.
        samples: Number of samples that they were given, for the record.
    """
    # Repeats in which both have struck somewhere.
    known = np.logical_and(
        *(np.isfinite(landings[name]).any(axis=1) for name in pair)
    )
    first, second = (
        np.nanmedian(landings[name][known], axis=1) for name in pair
    )
    return SchemeComparisonRow(
        a=pair[0],
        b=pair[1],
        samples=samples,
        difference=float(np.mean(first - second)) if known.any() else 0.0,
        p=paired_p(first, second) if known.any() else None,
        p_corrected=None,
        measure="landing",
    )


def correct_primary(
    rows: Sequence[SchemeComparisonRow],
    pairs: Sequence[tuple[str, str]],
    samples: Sequence[int],
) -> list[SchemeComparisonRow]:
    """Marks the comparisons named beforehand; corrects them among themselves.

    Args:
        rows: Of all pairs, measures and numbers of samples.
        pairs: The pairs named beforehand, in either order.
        samples: The numbers of samples named beforehand.
    """
    named = {frozenset(pair) for pair in pairs}
    primary = {
        i: row.p
        for i, row in enumerate(rows)
        if frozenset((row.a, row.b)) in named
        and row.samples in samples
        and row.p is not None
    }
    marked = list(rows)
    for i, value in zip(primary, holm([*primary.values()]), strict=True):
        marked[i] = dataclasses.replace(
            rows[i], p_corrected=value, primary=True
        )
    return marked


def compare(
    successes: Mapping[str, np.ndarray], samples: int
) -> list[SchemeComparisonRow]:
    """Compares every pair of schemes, corrected for all pairs together.

    Args:
        successes: By scheme, booleans (repeats, trials); trial j of repeat i
            has the same position and the same noise for all schemes.
        samples: Number of samples that the schemes were given, for the record.
    """
    rows: list[SchemeComparisonRow] = []
    for a, b in itertools.combinations(successes, 2):
        first, second = (np.asarray(successes[s], float) for s in (a, b))
        # Pairs of which one is not valid say nothing.
        both = np.isfinite(first) & np.isfinite(second)
        if not both.all():
            first, second = (np.where(both, t, 0.0) for t in (first, second))
        rows.append(
            SchemeComparisonRow(
                a=a,
                b=b,
                samples=samples,
                difference=float(first.mean() - second.mean()),
                p=paired_p(first.sum(axis=1), second.sum(axis=1)),
                effect_size=cohens_h(first.mean(), second.mean()),
                p_corrected=None,
            )
        )
    corrected = holm([row.p for row in rows if row.p is not None])
    return [
        dataclasses.replace(row, p_corrected=value)
        for row, value in zip(rows, corrected, strict=True)
    ]
