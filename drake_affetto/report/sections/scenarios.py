"""The schemes of transfer in other changed views."""

from collections.abc import Callable, Mapping

from drake_affetto.report import wording
from drake_affetto.report.charts.conditions import scenario_dots
from drake_affetto.report.comparison import SchemeComparison
from drake_affetto.report.parts import Section, Statement, make_table
from drake_affetto.report.report_data import ReportData


def make(data: ReportData) -> Section | None:
    """The section; None if the other views were not studied."""
    comparisons = data.comparisons
    if not comparisons:
        return None
    chart = scenario_dots(comparisons)
    counts = sorted({n for each in comparisons.values() for n in each.samples})
    tables = []
    for n in counts[::-1]:
        header, rows, best = _scenario_rows(comparisons, n)
        count = wording.number(n, "demonstration")
        table = make_table(
            header,
            rows,
            f"Success with {count}: mean and 95 % confidence. A star marks "
            "the highest rate.",
            best=best,
            free=True,
            show_caption=True,
        )
        tables.append((count, table))
    return Section(
        "scenarios",
        "Other views",
        "Other changes of the view",
        {
            "statements": [_statement(comparisons)],
            "chart": chart,
            "main": tables[0][1],
            "others": tables[1:],
        },
        (chart,),
    )


def _scenario_rows(
    comparisons: Mapping[str, SchemeComparison], n: int
) -> tuple[list[str], list[list[str]], Callable[[int, int], bool]]:
    names = wording.ordered({k for c in comparisons.values() for k in c.rates})
    rows, leading = [], []
    for view, comparison in comparisons.items():
        if n not in comparison.samples:
            continue
        conclusion = wording.conclude(comparison, n)
        rows.append(
            [
                wording.scenario(view),
                *(
                    f"{wording.percent(comparison.rates[name][n].mean)}\n"
                    + wording.interval(comparison.rates[name][n])
                    if name in comparison.rates
                    else "–"
                    for name in names
                ),
                {
                    "transfer": "transfer",
                    "equal": "undecided",
                    "other": wording.joined(
                        [wording.scheme(k) for k in conclusion.leaders]
                    ),
                }[conclusion.winner],
            ]
        )
        leading.append({1 + names.index(name) for name in conclusion.leaders})
    header = ["view", *(wording.scheme(name) for name in names), "ahead"]
    return header, rows, lambda i, j: j in leading[i]


def _statement(comparisons: Mapping[str, SchemeComparison]) -> Statement:
    by_winner: dict[str, list[str]] = {"transfer": [], "equal": [], "other": []}
    for view, comparison in comparisons.items():
        conclusion = wording.conclude(comparison, comparison.samples[-1])
        label = wording.scenario(view)
        if conclusion.winner == "other":
            names = wording.joined(
                [wording.in_text(k) for k in conclusion.leaders]
            )
            label = f"{label} ({names})"
        by_winner[conclusion.winner].append(label)
    parts = []
    for winner, text in (
        ("transfer", "a transfer was ahead of everything else in"),
        (
            "equal",
            "no significant difference between a transfer and another scheme "
            "in",
        ),
        ("other", "another scheme was ahead of both transfers in"),
    ):
        found = by_winner[winner]
        if found:
            parts.append(
                f"{text} {len(found)} of {len(comparisons)} views: "
                f"{wording.joined(found)}"
            )
    return Statement(
        next(
            kind for kind in ("other", "equal", "transfer") if by_winner[kind]
        ),
        "With the most demonstrations of each view",
        " ".join(wording.sentence(part) for part in parts),
    )
