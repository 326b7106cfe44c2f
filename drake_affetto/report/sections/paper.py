"""Every number that the paper prints and that was found here too."""

from drake_affetto.report import wording
from drake_affetto.report.parts import Section, make_table
from drake_affetto.report.report_data import ReportData
from drake_affetto.report.wording import conclude


def make(data: ReportData) -> Section | None:
    """The section; None if there is nothing to compare with the paper."""
    rows = [*_drumming_rows(data), *_order_rows(data), *_toy_rows(data)]
    if not rows:
        return None
    table = make_table(
        ("", "paper", "here"),
        rows,
        "Beside the paper's numbers",
        free=True,
        stacked=True,
    )
    return Section(
        "paper",
        "Beside the paper",
        "Beside the paper's numbers",
        {"table": table, "toy": data.results("toy") is not None},
    )


def _drumming_rows(data: ReportData) -> list[list[str]]:
    rows = []
    drumming = data.drumming
    if drumming:
        rows.append(
            [
                "unseen positions hit, drum seen directly",
                "10 of 10 after 25 demonstrations",
                f"{drumming.hits} of {len(drumming.tests)} after "
                f"{drumming.demonstrations}",
            ]
        )
    drum = data.results("drum")
    if drum:
        separation = drum.separation
        rows.append(
            [
                "threshold of the reward",
                "R > 0.15",
                f"R > {separation.threshold:g}: "
                f"{separation.false_hits} false and "
                f"{separation.missed_hits} missed hits in "
                f"{separation.trials} trials",
            ]
        )
    return rows


def _order_rows(data: ReportData) -> list[list[str]]:
    """The order of the schemes, a row for each number of samples."""
    comparison = data.comparison
    if comparison is None:
        return []
    rows = []
    for n in comparison.samples:
        rates = [
            f"{wording.scheme(name)} {wording.percent(row[n].mean)}"
            for name, row in sorted(
                comparison.rates.items(), key=lambda item: -item[1][n].mean
            )
        ]
        order = {
            "clear": "the same order, significant",
            "in the means": "the same order in the means only",
            "not": "not the same order",
            "": "not all schemes were run",
        }[conclude(comparison, n).order]
        rows.append(
            [
                f"order with {wording.number(n, 'new demonstration')} "
                f"({wording.scenario(comparison.scenario)})",
                "transfer > relearned; continued and unchanged do not adapt "
                "(3 to 5 demonstrations)",
                f"{order}: {', '.join(rates)}",
            ]
        )
    return rows


def _toy_rows(data: ReportData) -> list[list[str]]:
    toy = data.results("toy")
    if toy is None:
        return []
    rows = []
    for key, label in (
        ("train_mse", "toy: error where it was trained"),
        ("test_mse", "toy: error on the other 6 points"),
        ("rotated_mse", "toy: error on the turned square"),
    ):
        value = getattr(toy.source, key)
        rows.append(
            [
                label,
                f"{getattr(toy.paper.source, key):.2f}",
                f"{value:.2g}" if value < 1 else f"{value:.2f}",
            ]
        )
    named = {
        "paper": "Eq. 5, random starts",
        "paper_single_start": "Eq. 5, one start",
        "default": "our default",
    }
    for key, label in (
        ("train_mse_mean", "toy: after transfer, the five points"),
        ("other_mse_mean", "toy: after transfer, the other points"),
    ):
        here = [
            f"{method}: {getattr(toy.transfer[name], key):.2g}"
            for name, method in named.items()
            if name in toy.transfer
        ]
        spread = getattr(toy.paper.transfer, key.replace("mean", "std"))
        there = f"{getattr(toy.paper.transfer, key):.3f}"
        if spread is not None:
            there += f" (± {spread:.3f})"
        rows.append([label, there, ", ".join(here) or "–"])
    return rows
