"""Charts over changed views and other conditions."""

from collections.abc import Mapping, Sequence
from typing import Any

from drake_affetto.experiments.results import (
    ConditionRow,
)
from drake_affetto.report import style, wording
from drake_affetto.report.comparison import SchemeComparison


def scenario_dots(comparisons: Mapping[str, SchemeComparison]) -> style.Chart:
    """Success by changed view, a symbol for each scheme."""
    names = wording.ordered(
        {name for each in comparisons.values() for name in each.rates}
    )
    views = list(comparisons)
    traces = []
    for k, name in enumerate(names):
        shift = 0.11 * (k - 0.5 * (len(names) - 1))
        here = [
            (
                i,
                view,
                comparisons[view].rates[name][comparisons[view].samples[-1]],
            )
            for i, view in enumerate(views)
            if name in comparisons[view].rates
        ]
        traces.append(
            style.scheme_points(
                name,
                "%{customdata}: %{x:.0f} %",
                x=[100 * r.mean for _, _, r in here],
                y=[i + shift for i, _, _ in here],
                error_x=style.whiskers([r for _, _, r in here]) | {"width": 0},
                customdata=[
                    style.escaped(wording.scenario(v)) for _, v, _ in here
                ],
            )
        )
    figure = style.make_figure(
        traces,
        x=style.percent_axis("success at unseen positions"),
        y=style.places_axis(
            [
                style.escaped(wording.scenario(v)).replace(" and ", " and<br>")
                for v in views
            ]
        ),
        shapes=[
            {
                "type": "line",
                "xref": "paper",
                "x0": 0,
                "x1": 1,
                "y0": i + 0.5,
                "y1": i + 0.5,
                "line": {"color": style.LIGHT["grid"], "width": 1},
            }
            for i in range(len(views) - 1)
        ],
    )
    return style.Chart(
        "scenarios",
        "Seven ways of seeing otherwise"
        if len(views) == 7
        else "Other ways of seeing otherwise",
        "Success with the most demonstrations of each view; lines are 95 % "
        "confidence. Each scheme keeps its color and symbol.",
        f"Success of {len(names)} schemes in {len(views)} changed views.",
        figure,
        ("view", *(wording.scheme(name) for name in names)),
        [
            [wording.scenario(view)]
            + [
                wording.rate(
                    comparisons[view].rates[name][comparisons[view].samples[-1]]
                )
                if name in comparisons[view].rates
                else "–"
                for name in names
            ]
            for view in views
        ],
        110 + 82 * len(views),
        wide=True,
    )


def condition_charts(conditions: Sequence[ConditionRow]) -> list[style.Chart]:
    """Success of the schemes over what was varied, a chart for each factor.

    Over the factor's values where each was run with one number of samples, or
    with the commonest of them; and over the number of samples for each value
    that was run with several.
    """
    charts: list[style.Chart] = []
    factors = list(dict.fromkeys(row.factor for row in conditions))
    for factor in factors:
        rows = [row for row in conditions if row.factor == factor]
        values = list(dict.fromkeys(row.value for row in rows))
        counts = {
            value: sorted({r.samples for r in rows if r.value == value})
            for value in values
        }
        if len(values) > 1:
            chosen = [
                row for row in rows if row.samples == _common(counts, row.value)
            ]
            samples = sorted({row.samples for row in chosen})
            charts.append(
                _condition_chart(
                    f"condition-{len(charts)}",
                    factor.capitalize(),
                    f"Success over “{factor}”, with "
                    + (
                        wording.number(samples[0], "demonstration")
                        if len(samples) == 1
                        else "the numbers of demonstrations in the table"
                    )
                    + "; whiskers are 95 % confidence.",
                    factor,
                    [(row.value, row) for row in chosen],
                )
            )
        for value in values:
            if len(counts[value]) > 1:
                charts.append(
                    _condition_chart(
                        f"condition-{len(charts)}",
                        f"{factor.capitalize()}: {value}",
                        "Success over the number of demonstrations, with "
                        f"“{factor}” at “{value}”; whiskers are 95 % "
                        "confidence.",
                        "demonstrations",
                        [
                            (row.samples, row)
                            for row in sorted(rows, key=lambda r: r.samples)
                            if row.value == value
                        ],
                    )
                )
    return charts


def _common(counts: dict[str, list[int]], value: str) -> int:
    """Which number of samples stands for `value`: one that all values have."""
    shared = set.intersection(*(set(found) for found in counts.values()))
    return max(shared) if shared else counts[value][-1]


def _condition_chart(
    key: str,
    title: str,
    caption: str,
    axis: str,
    points: list[tuple[Any, ConditionRow]],
) -> style.Chart:
    names = wording.ordered({row.scheme for _, row in points})
    ticks = list(dict.fromkeys(style.escaped(place) for place, _ in points))
    traces = []
    for name in names:
        own = [
            (style.escaped(x), row) for x, row in points if row.scheme == name
        ]
        found = [row.success_rate for _, row in own]
        traces.append(
            style.scheme_points(
                name,
                "%{y:.0f} %",
                x=[ticks.index(x) for x, _ in own],
                y=[100 * r.mean for r in found],
                error_y=style.whiskers(found),
                mode="lines+markers",
                line={"color": style.scheme_color(name), "width": 2},
            )
        )
    figure = style.make_figure(
        traces,
        x={
            "title": {"text": style.escaped(axis)},
            "tickvals": list(range(len(ticks))),
            "ticktext": ticks,
            "range": [-0.25, len(ticks) - 0.75],
        },
        y=style.percent_axis(),
    )
    return style.Chart(
        key,
        title,
        caption,
        "Success of "
        + wording.joined([wording.in_text(n) for n in names])
        + f" over {axis}: {wording.joined(ticks)}.",
        figure,
        (axis, "scheme", "demonstrations", "success (95 % confidence)"),
        [
            [
                place,
                wording.scheme(row.scheme),
                row.samples,
                wording.rate(row.success_rate),
            ]
            for place, row in points
        ],
        330,
    )


def advantage(
    conditions: Sequence[ConditionRow], ours: str, rival: str
) -> style.Chart | None:
    """By how much one scheme beats another, over conditions and samples."""
    means = {
        (row.factor, row.value, row.samples, row.scheme): row.success_rate.mean
        for row in conditions
    }
    places = list(dict.fromkeys((r.factor, r.value) for r in conditions))
    samples = sorted({row.samples for row in conditions})
    z: list[list[float | None]] = []
    rows = []
    for place in places:
        z.append([])
        for n in samples:
            pair = [means.get((*place, n, name)) for name in (ours, rival)]
            if pair[0] is None or pair[1] is None:
                z[-1].append(None)
                continue
            difference = pair[0] - pair[1]
            z[-1].append(round(100 * difference, 1))
            rows.append(
                [
                    f"{place[0]}: {place[1]}",
                    n,
                    wording.percent(pair[0]),
                    wording.percent(pair[1]),
                    wording.points(difference),
                ]
            )
    if not rows:
        return None
    figure = style.make_figure(
        [
            style.difference_map(
                z,
                [str(n) for n in samples],
                [
                    f"{style.escaped(factor)}:<br>{style.escaped(v)}"
                    for factor, v in places
                ],
                [
                    ["" if v is None else style.signed(v) for v in row]
                    for row in z
                ],
                textfont={"color": style.LIGHT["ink"]},
                hovertemplate="%{y}, %{x} demonstrations: %{z:+.0f} points"
                "<extra></extra>",
            )
        ],
        x={
            "title": {"text": "demonstrations"},
            "type": "category",
            "showgrid": False,
        },
        y={"autorange": "reversed", "showgrid": False},
    )
    ahead = sum(v is not None and v > 0.5 for row in z for v in row)
    return style.Chart(
        f"advantage-{ours.replace('_', '-')}",
        f"{wording.scheme(ours, full=True)}, minus relearning"
        if rival == "relearn"
        else f"{wording.scheme(ours, full=True)}, minus "
        + wording.scheme(rival),
        f"Percentage points by which {wording.in_text(ours)} succeeded more "
        f"often (+, blue) or less often (−, orange) than "
        f"{wording.in_text(rival)}.",
        f"Ahead in {ahead} of {len(rows)} cells.",
        figure,
        (
            "condition",
            "demonstrations",
            wording.scheme(ours),
            wording.scheme(rival),
            "difference",
        ),
        rows,
        110 + 44 * len(places),
    )
