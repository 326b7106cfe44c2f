"""The headline numbers."""

import dataclasses
from statistics import fmean

from drake_affetto.report import wording
from drake_affetto.report.comparison import SchemeComparison
from drake_affetto.report.parts import Section
from drake_affetto.report.report_data import ReportData
from drake_affetto.report.wording import conclude
from drake_affetto.tuning.config import TRAINING


@dataclasses.dataclass(frozen=True)
class Tile:
    """A headline number.

    Attributes:
        value: The number.
        label: What it is.
        note: More about it, in small letters.
    """

    value: str
    label: str
    note: str = ""


def make(data: ReportData) -> Section:
    """The section, a tile for each number."""
    tiles = [
        *_drumming_tiles(data),
        *_transfer_tiles(data),
        *_self_calibration_tiles(data),
        *_toy_tiles(data),
        *_tuning_tiles(data),
    ] or _few_tiles(data)
    columns = {1: 1, 2: 2, 4: 4, 5: 5, 7: 4, 8: 4}.get(len(tiles), 3)
    return Section(
        "short", "In short", "In short", {"tiles": tiles, "columns": columns}
    )


def _drumming_tiles(data: ReportData) -> list[Tile]:
    tiles = []
    drumming = data.drumming
    if drumming:
        count = wording.number(drumming.demonstrations, "demonstration")
        tiles.append(
            Tile(
                f"{drumming.hits} of {len(drumming.tests)}",
                "unseen positions hit, the drum seen directly",
                f"after {count}; paper: 10 of 10 after 25",
            )
        )
    drum = data.results("drum")
    if drum is None:
        return tiles
    if drum.n_to_90 is not None:
        note = "given in random order"
        if drum.active is not None:
            chosen = drum.active.n_to_90
            note += (
                "; never when the skill chooses"
                if chosen is None
                else f"; {chosen} when the least certain is next"
            )
        tiles.append(
            Tile(
                str(drum.n_to_90),
                "demonstrations until success stays at 90 %",
                note,
            )
        )
    separation = drum.separation
    wrong = separation.false_hits + separation.missed_hits
    tiles.append(
        Tile(
            wording.percent(1.0 - wrong / max(1, separation.trials)),
            "of trials judged rightly by sound alone",
            f"{wording.number(wrong, 'error')} in {separation.trials}",
        )
    )
    return tiles


def _transfer_tiles(data: ReportData) -> list[Tile]:
    comparison = data.comparison
    if comparison is None:
        return []
    tiles = []
    n = comparison.samples[-1]
    own = [k for k in wording.TRANSFERS[::-1] if k in comparison.rates]
    if own:
        best = max(own, key=lambda k: comparison.rates[k][n].mean)
        tiles.append(
            Tile(
                wording.percent(comparison.rates[best][n].mean),
                f"{wording.in_text(best)}, {n} new demonstrations",
                _standing(comparison, conclude(comparison, n)),
            )
        )
    if "unchanged" in comparison.rates:
        tiles.append(
            Tile(
                wording.percent(comparison.rates["unchanged"][n].mean),
                "the same skill without transfer",
                f"in the view: {wording.scenario(comparison.scenario)}",
            )
        )
    return tiles


def _self_calibration_tiles(data: ReportData) -> list[Tile]:
    results = data.results("self_calibration")
    if results is None:
        return []
    found = results.self_calibration
    name = "hand" if "hand" in found.methods else next(iter(found.methods))
    method = found.methods[name]
    tiles = [
        Tile(
            wording.percent(method.success_rate.mean),
            f"without a demonstration, by {wording.METHODS.get(name, name)}",
            f"{method.looks:.0f} looks, {found.repeats} mirrors",
        )
    ]
    if found.watch is not None:
        tiles.append(
            Tile(
                wording.percent(found.watch.noticed.mean),
                f"of mirrors turned by {found.watch.turned_by:g}° noticed",
                "within six strokes",
            )
        )
    return tiles


def _toy_tiles(data: ReportData) -> list[Tile]:
    toy = data.results("toy")
    if toy is None:
        return []
    name = "default" if "default" in toy.transfer else next(iter(toy.transfer))
    return [
        Tile(
            f"{toy.transfer[name].other_mse_mean:.2g}",
            "toy error after transfer from five points",
            f"{toy.source.rotated_mse:.3g} before; paper: "
            f"{toy.paper.transfer.other_mse_mean:g} after",
        )
    ]


def _tuning_tiles(data: ReportData) -> list[Tile]:
    results = data.results("tune")
    if results is None:
        return []
    before, after = (
        fmean(gains.trajectories[TRAINING].tracking_error_deg.values())
        for gains in (results.hand_tuned, results.best)
    )
    return [
        Tile(
            f"{after:.2f}°",
            "mean tracking error with tuned gains",
            f"{before:.2f}° with the hand-tuned ones, on the training "
            "trajectory",
        )
    ]


def _standing(
    comparison: SchemeComparison, conclusion: wording.Conclusion
) -> str:
    """How the better of the transfers compares with the others, in short."""
    rates = {
        name: row[conclusion.samples] for name, row in comparison.rates.items()
    }
    rivals = [
        name
        for name in (*conclusion.leaders, *conclusion.level)
        if name not in wording.TRANSFERS
    ]
    if not rivals:
        return "ahead of all other schemes" + (
            "" if comparison.tested else f", {comparison.trials} trials each"
        )
    rival = max(rivals, key=lambda name: rates[name].mean)
    summary = f"{wording.in_text(rival)}: {wording.percent(rates[rival].mean)}"
    if not comparison.tested:
        return f"{summary}; {comparison.trials} trials each"
    if conclusion.winner == "equal":
        return f"{summary}, no significant difference"
    return f"{summary}, significantly better"


def _few_tiles(data: ReportData) -> list[Tile]:
    tiles = []
    if data.comparisons:
        tiles.append(Tile(str(len(data.comparisons)), "changed views compared"))
    conditions = data.results("conditions")
    if conditions:
        places = {(row.factor, row.value) for row in conditions.conditions}
        tiles.append(Tile(str(len(places)), "conditions compared"))
    return tiles
