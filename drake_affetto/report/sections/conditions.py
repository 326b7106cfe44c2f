"""When transfer wins."""

from collections.abc import Sequence

from drake_affetto.experiments.results import ConditionRow
from drake_affetto.report import wording
from drake_affetto.report.charts.conditions import advantage, condition_charts
from drake_affetto.report.parts import Section, Statement, in_pairs
from drake_affetto.report.report_data import ReportData


def make(data: ReportData) -> Section | None:
    """The section; None if the conditions were not studied."""
    results = data.results("conditions")
    if results is None:
        return None
    rows = results.conditions
    heat = [
        chart
        for ours in wording.TRANSFERS[::-1]
        if (chart := advantage(rows, ours, "relearn")) is not None
    ]
    charts = condition_charts(rows)
    return Section(
        "conditions",
        "When it wins",
        "When does transfer win?",
        {
            "statements": [_statement(rows)],
            "heat": in_pairs(heat),
            "charts": in_pairs(charts),
        },
        (*heat, *charts),
    )


def _statement(rows: Sequence[ConditionRow]) -> Statement:
    """How transfers compare with relearning, condition by condition."""
    rates = {
        (r.factor, r.value, r.samples, r.scheme): r.success_rate for r in rows
    }
    places = list(dict.fromkeys((r.factor, r.value, r.samples) for r in rows))
    parts = []
    lead = 0
    for ours in wording.TRANSFERS[::-1]:
        counts = {"ahead": 0, "behind": 0, "between": 0}
        behind = []
        for place in places:
            own = rates.get((*place, ours))
            other = rates.get((*place, "relearn"))
            if own is None or other is None:
                continue
            if own.low > other.high:
                counts["ahead"] += 1
            elif own.high < other.low:
                counts["behind"] += 1
                behind.append(f"{place[0]} {place[1]}, {place[2]}")
            else:
                counts["between"] += 1
        total = sum(counts.values())
        if not total:
            continue
        lead += counts["ahead"] - counts["behind"]
        text = (
            f"{wording.in_text(ours)} was clearly ahead of relearning in "
            f"{counts['ahead']} of {total} conditions, clearly behind in "
            f"{counts['behind']}, and within their confidence intervals in "
            f"{counts['between']}"
        )
        if behind:
            text += f" (behind: {'; '.join(behind)} demonstrations)"
        parts.append(text)
    if not parts:
        return Statement(
            "equal",
            "What was compared",
            f"{len(places)} conditions; relearning or transfer was not run.",
        )
    return Statement(
        "transfer" if lead > 0 else "equal" if lead == 0 else "other",
        "Clearly means that the confidence intervals do not overlap",
        " ".join(wording.sentence(part) for part in parts),
    )
