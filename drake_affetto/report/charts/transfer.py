"""Charts of the schemes of transfer in one changed view (paper Fig. 5)."""

import math
from typing import Any

import numpy as np
import plotly.graph_objects as go

from drake_affetto.experiments.results import (
    TransferMap,
)
from drake_affetto.report import style, wording
from drake_affetto.report.comparison import Comparison, SchemeComparison
from drake_affetto.sound.reward import SUCCESS_THRESHOLD


def success_by_scheme(comparison: SchemeComparison) -> style.Chart:
    """Fig. 5a: success by scheme and number of samples, with intervals."""
    names = wording.ordered(comparison.rates)
    rows = [
        [wording.scheme(name, full=True)]
        + [wording.rate(comparison.rates[name][n]) for n in comparison.samples]
        for name in names
    ]
    several = len(comparison.samples) > 1
    traces = _bars(comparison, names)
    if several:
        figure = style.make_figure(
            traces,
            x={
                "title": {"text": "new demonstrations"},
                "tickvals": list(range(len(comparison.samples))),
                "ticktext": [str(n) for n in comparison.samples],
                "showgrid": False,
            },
            y=style.percent_axis("success at unseen positions"),
        )
    else:
        n = comparison.samples[0]
        figure = style.make_figure(
            traces,
            x=style.percent_axis("success at unseen positions"),
            y=style.places_axis(
                [
                    f"{style.escaped(wording.scheme(name))}<br><b>"
                    f"{wording.percent(comparison.rates[name][n].mean)}</b>"
                    for name in names
                ]
            ),
        )
    counts = wording.joined([str(n) for n in comparison.samples])
    return style.Chart(
        "schemes",
        f"Success in the new view ({wording.scenario(comparison.scenario)})",
        f"Fig. 5a. The drum is seen otherwise than it was taught; {counts} new "
        "demonstrations may be used. Share of "
        f"{wording.number(comparison.trials, 'trial')} per scheme"
        f"{' and number of demonstrations' if several else ''} in which the "
        f"drum was heard; whiskers: {comparison.error_bars}.",
        "Highest with "
        + "; with ".join(
            f"{wording.number(n, 'demonstration')}: "
            + wording.joined([wording.in_text(k) for k in conclusion.leaders])
            for n in comparison.samples
            for conclusion in [wording.conclude(comparison, n)]
        )
        + ".",
        figure,
        ("scheme", *(f"{n} demonstrations" for n in comparison.samples)),
        rows,
        420 if several else 60 + 52 * len(names),
        wide=several,
    )


def _bars(comparison: SchemeComparison, names: list[str]) -> list[Any]:
    """Pale bars with markers and whiskers, a color for each scheme."""
    several = len(comparison.samples) > 1
    traces: list[Any] = []
    # Along the axis: a place for each number of samples, or for each scheme.
    width = 0.86 / len(names)
    for k, name in enumerate(names):
        found = [comparison.rates[name][n] for n in comparison.samples]
        shift = (k - 0.5 * (len(names) - 1)) * width
        place = [i + shift for i in range(len(found))] if several else [k]
        mean = [100 * r.mean for r in found]
        along, across = ("x", "y") if several else ("y", "x")
        error = style.whiskers(found) | {
            "color": style.LIGHT["ink"],
            "thickness": 1.4,
        }
        # The bar is pale, so that the whisker is seen on it in any theme.
        traces.append(
            go.Bar(
                {along: place, across: mean},
                orientation="v" if several else "h",
                width=0.9 * width if several else 0.62,
                marker={"color": style.scheme_color(name)},
                opacity=0.4,
                hoverinfo="skip",
                showlegend=False,
                legendgroup=name,
            )
        )
        traces.append(
            style.scheme_points(
                name,
                f"%{{{across}:.0f}} % (%{{customdata[0]:.0f}} to "
                "%{customdata[1]:.0f})",
                customdata=[[100 * r.low, 100 * r.high] for r in found],
                showlegend=several,
                legendgroup=name,
                **{along: place, across: mean, f"error_{across}": error},
            )
        )
    return traces


def rewards_by_scheme(comparison: SchemeComparison) -> style.Chart | None:
    """Every trial's reward, at the greatest number of samples."""
    n = comparison.samples[-1]
    names = [
        name for name in wording.ordered(comparison.rewards)
        if comparison.rewards[name][n]
    ]  # fmt: skip
    if not names:
        return None
    traces = []
    rows = []
    for row, name in enumerate(names):
        values = comparison.rewards[name][n]
        # Spread by rank rather than by chance: the same page each time.
        spread = [0.28 * math.sin(2.4 * i) for i in range(len(values))]
        traces.append(
            style.scheme_points(
                name,
                "R = %{x:.2f}",
                x=values,
                y=[row + s for s in spread],
                opacity=0.8,
                showlegend=False,
            )
        )
        heard = sum(v > SUCCESS_THRESHOLD for v in values)
        rows.append(
            [
                wording.scheme(name, full=True),
                len(values),
                heard,
                f"{np.median(values):.2f}",
                f"{min(values):.2f}",
                f"{max(values):.2f}",
            ]
        )
    everything = [v for name in names for v in comparison.rewards[name][n]]
    low, high = min(everything), max(everything)
    figure = style.make_figure(
        traces,
        x={
            "title": {"text": "reward R of each trial"},
            "range": [
                min(0.0, low) - 0.03,
                max(high, SUCCESS_THRESHOLD) + 0.05,
            ],
        },
        y=style.places_axis(
            [style.escaped(wording.scheme(name)) for name in names], after=0.9
        ),
        **style.threshold_line(SUCCESS_THRESHOLD, vertical=True),
    )
    return style.Chart(
        "rewards",
        "The sound behind the rates",
        f"Every trial after {wording.number(n, 'demonstration')}, by its "
        "reward: right of the line the drum was heard. Near zero the hand "
        "missed; a high reward is a clean stroke.",
        f"Rewards of single trials by scheme, from {low:.2f} to {high:.2f}.",
        figure,
        ("scheme", "trials", "heard", "median R", "least R", "greatest R"),
        rows,
        80 + 50 * len(names),
    )


def significance(comparison: SchemeComparison, samples: int) -> style.Chart:
    """Fig. 5b: pairwise differences of the rates with their significance."""
    names = wording.ordered(comparison.rates)
    labels = [style.wrapped(wording.scheme(name), 10) for name in names]
    values: list[list[float | None]] = []
    shown: list[list[str]] = []
    hovers: list[list[str]] = []
    rows = []
    for i, a in enumerate(names):
        values.append([])
        shown.append([])
        hovers.append([])
        for j, b in enumerate(names):
            if a == b:
                values[-1].append(None)
                shown[-1].append("")
                hovers[-1].append("")
                continue
            found = comparison.compare(a, b, samples)
            values[-1].append(round(100 * found.difference, 1))
            shown[-1].append(
                style.signed(100 * found.difference)
                + ("*" if found.clear else "")
            )
            pair = f"{wording.scheme(a)} − {wording.scheme(b)}"
            hovers[-1].append(_hover(pair, found))
            if i < j:
                rows.append(_pair_row(pair, found))
    figure = style.make_figure(
        [
            style.difference_map(
                values,
                labels,
                labels,
                shown,
                customdata=hovers,
                textfont={"size": 11, "color": style.LIGHT["ink"]},
                hovertemplate="%{customdata}<extra></extra>",
            )
        ],
        x={"side": "bottom", "tickangle": -90, "showgrid": False},
        y={"autorange": "reversed", "showgrid": False},
    )
    clear = [row for row in rows if row[-1] == "yes"]
    return style.Chart(
        f"significance-{samples}",
        f"With {wording.number(samples, 'demonstration')}",
        "Row minus column, in percentage points; a star marks a difference "
        "with a corrected p below 0.05. Touch a cell for p and effect size "
        "(Cohen's h).",
        f"{len(clear)} of {len(rows)} pairs differ significantly"
        + (": " + "; ".join(f"{r[0]} {r[1]}" for r in clear) if clear else "")
        + ".",
        figure,
        (
            "pair",
            "difference",
            "p",
            "corrected p",
            "effect size",
            "significant",
        ),
        rows,
        380,
    )


def _hover(pair: str, found: Comparison) -> str:
    """What a cell shows when it is touched."""
    text = (
        f"{style.escaped(pair)}: {wording.points(found.difference)}"
        f"<br>corrected {wording.p_value(found.p)}"
    )
    if found.effect_size is not None:
        text += f"<br>effect size (Cohen's h) {found.effect_size:+.2f}"
    return text


def _pair_row(pair: str, found: Comparison) -> list[str]:
    """The same pair's row in the table."""
    effect = found.effect_size
    return [
        pair,
        wording.points(found.difference),
        wording.p_value(found.p_single),
        wording.p_value(found.p),
        "–" if effect is None else f"{effect:+.2f}",
        "yes" if found.clear else "no",
    ]


def transfer_map(grid: TransferMap) -> list[style.Chart]:
    """The map h: a grid of what is seen now, and where h puts it."""
    n_rows, n_columns = grid.shape
    charts = []
    for part, title, caption in (
        (
            "input",
            "What the robot sees now",
            "A regular grid over the image of the new view; the numbers are "
            "the places it was shown.",
        ),
        (
            "output",
            "Where the map h puts it",
            "The same grid through h, in the task space of the old skill: a "
            "turned, stretched or mirrored grid is what the map has found out "
            "about the new view. Numbers are the same places.",
        ),
    ):
        points = np.array(getattr(grid, part), dtype=float)
        net = points.reshape(n_rows, n_columns, 2)
        taught = np.array(getattr(grid, f"taught_{part}"), dtype=float).reshape(
            -1, 2
        )
        names = getattr(grid, f"{part}_names")
        # As in images.
        downwards = names[1].startswith("y_img")
        corners = [net[0, 0], net[0, -1], net[-1, -1], net[-1, 0]]
        traces = [
            *_net_lines(net),
            _corners(corners, downwards),
            _numbered(taught),
        ]
        figure = style.make_figure(
            traces,
            x={"title": {"text": style.escaped(names[0])}, "showgrid": False},
            y={"title": {"text": style.escaped(names[1])}, "showgrid": False},
        )
        if downwards:
            figure.update_yaxes(autorange="reversed")
        charts.append(
            style.Chart(
                f"map-{part}",
                title,
                caption,
                f"A grid of {n_rows} by {n_columns} points over {names[0]} and "
                f"{names[1]}; its corners are at "
                + wording.joined([f"({c[0]:.2f}, {c[1]:.2f})" for c in corners])
                + ".",
                figure,
                ("point", names[0], names[1]),
                [
                    [label, f"{x:.3f}", f"{y:.3f}"]
                    for label, (x, y) in [
                        *zip("ABCD", corners, strict=True),
                        *(
                            (f"demonstration {i + 1}", p)
                            for i, p in enumerate(taught)
                        ),
                    ]
                ],
                360,
            )
        )
    return charts


def _net_lines(net: np.ndarray) -> list[Any]:
    """The lines of a grid (rows, columns, 2) in both directions."""
    traces: list[Any] = []
    for lines, key, label in (
        (net, "plus", "first direction"),
        (net.transpose(1, 0, 2), "minus", "second direction"),
    ):
        joined = np.concatenate(
            [np.vstack([line, [[np.nan, np.nan]]]) for line in lines]
        )
        traces.append(
            go.Scatter(
                x=_gaps(joined[:, 0]),
                y=_gaps(joined[:, 1]),
                mode="lines",
                name=label,
                line={
                    "color": style.LIGHT[key],
                    "width": 1.4,
                    "dash": "solid" if key == "plus" else "dot",
                },
                hoverinfo="skip",
                showlegend=False,
            )
        )
    return traces


def _corners(corners: list[np.ndarray], downwards: bool) -> go.Scatter:
    """The grid's corners, A to D."""
    return go.Scatter(
        x=[float(c[0]) for c in corners],
        y=[float(c[1]) for c in corners],
        mode="markers+text",
        text=["A", "B", "C", "D"],
        textposition=_outward(corners, downwards),
        textfont={"size": 14, "color": style.LIGHT["ink"]},
        marker={"size": 7, "color": style.LIGHT["ink"]},
        cliponaxis=False,
        showlegend=False,
        hovertemplate="corner %{text}: %{x:.2f}, %{y:.2f}<extra></extra>",
    )


def _numbered(taught: np.ndarray) -> go.Scatter:
    """The demonstrations (k, 2), with their numbers."""
    return go.Scatter(
        x=taught[:, 0].tolist(),
        y=taught[:, 1].tolist(),
        mode="markers+text",
        text=[str(i + 1) for i in range(len(taught))],
        textposition="middle center",
        textfont={"size": 11, "color": style.LIGHT["surface"]},
        marker={"size": 19, "color": style.LIGHT["paper"]},
        showlegend=False,
        hovertemplate="demonstration %{text}: %{x:.2f}, %{y:.2f}"
        "<extra></extra>",
    )


def _gaps(values: np.ndarray) -> list[float | None]:
    """With None for NaN, which JSON has not."""
    return [None if math.isnan(v) else float(v) for v in values]


def _outward(corners: list[np.ndarray], downwards: bool) -> list[str]:
    """Where a label stands so that it does not lie on the net."""
    middle = np.mean(corners, axis=0)
    return [
        ("top" if (c[1] > middle[1]) != downwards else "bottom")
        + (" right" if c[0] > middle[0] else " left")
        for c in corners
    ]
