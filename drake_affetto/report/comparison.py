"""The schemes of transfer in one changed view, from a study or the demo."""

from collections.abc import Sequence
import dataclasses

from drake_affetto.experiments.results import (
    DemoMirror,
    MirrorResults,
    SuccessRate,
    TransferMap,
)
from drake_affetto.experiments.statistics import success_rate


@dataclasses.dataclass(frozen=True)
class Comparison:
    """Two schemes with the same number of samples.

    Attributes:
        difference: Difference of the mean rates, first minus second.
        p: p value, corrected for the number of comparisons; None without test.
        effect_size: Effect size, first minus second; None if unknown.
        p_single: p value before the correction.
    """

    difference: float
    p: float | None = None
    effect_size: float | None = None
    p_single: float | None = None

    @property
    def clear(self) -> bool:
        """Whether the difference is significant."""
        return self.p is not None and self.p < 0.05


@dataclasses.dataclass(frozen=True)
class SchemeComparison:
    """The schemes in one changed view, from a study or from the demo.

    Attributes:
        scenario: Name of the view.
        samples: Numbers of demonstrations.
        trials: Number of trials for each scheme and number of samples.
        rates: Success rates by scheme and number of samples.
        rewards: Rewards of all trials, by scheme and number of samples.
        tested: Tests by (scheme, scheme, samples), where one was made.
        map: Map of one repeat, or None.
        error_bars: Name of the intervals of the rates.
    """

    scenario: str
    samples: tuple[int, ...]
    trials: int
    rates: dict[str, dict[int, SuccessRate]]
    rewards: dict[str, dict[int, list[float]]]
    tested: dict[tuple[str, str, int], Comparison]
    map: TransferMap | None
    error_bars: str

    @classmethod
    def of_study(
        cls, results: MirrorResults, scenario: str
    ) -> "SchemeComparison":
        """From the results of `affetto mirror`."""
        tested = {}
        for row in results.comparisons:
            if row.measure != "success":
                continue
            found = Comparison(
                row.difference, row.p_corrected, row.effect_size, row.p
            )
            effect = found.effect_size
            tested[row.a, row.b, row.samples] = found
            tested[row.b, row.a, row.samples] = dataclasses.replace(
                found,
                difference=-found.difference,
                effect_size=None if effect is None else -effect,
            )
        cells = {
            name: {n: by_samples[n] for n in results.samples}
            for name, by_samples in results.schemes.items()
        }
        return cls(
            scenario=scenario,
            samples=tuple(sorted(set(results.samples))),
            trials=results.repeats * results.evaluations,
            rates={
                name: {n: cell.success_rate for n, cell in row.items()}
                for name, row in cells.items()
            },
            rewards={
                name: {n: cell.rewards for n, cell in row.items()}
                for name, row in cells.items()
            },
            tested=tested,
            map=results.map,
            error_bars="95 % confidence over the repeats",
        )

    @classmethod
    def of_demo(cls, mirror: DemoMirror) -> "SchemeComparison":
        """From the part `mirror` of the demo's results."""
        n = mirror.samples
        rows = mirror.schemes
        trials = len(mirror.positions)
        return cls(
            scenario="mirror",
            samples=(n,),
            trials=trials,
            rates={
                name: {n: _rate(row.rewards, row.success_rate)}
                for name, row in rows.items()
            },
            rewards={name: {n: row.rewards} for name, row in rows.items()},
            tested={},
            map=None,
            error_bars="95 % confidence (Wilson) over the trials",
        )

    def compare(self, a: str, b: str, samples: int) -> Comparison:
        """`a` against `b`; without a test only the difference is known."""
        found = self.tested.get((a, b, samples))
        if found is not None:
            return found
        return Comparison(
            self.rates[a][samples].mean - self.rates[b][samples].mean
        )


def _rate(rewards: Sequence[float], mean: float) -> SuccessRate:
    """The rate of single trials, with its interval (Wilson)."""
    if not rewards:
        return SuccessRate(mean, 0.0, 1.0)
    hits = round(mean * len(rewards))
    return success_rate([[i < hits for i in range(len(rewards))]])
