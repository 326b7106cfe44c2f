"""The chart of the toy experiment (paper Fig. 2)."""

import math
from typing import Any

import plotly.graph_objects as go

from drake_affetto.experiments.results import (
    ToyFigures,
    ToyMethod,
    ToyResults,
)
from drake_affetto.report import style

_Method = tuple[str, str, ToyMethod]


def _seeds(methods: list[_Method]) -> list[Any]:
    """A pale dot for each seed of each method."""
    traces = []
    for i, (group, label, row) in enumerate(methods):
        color = style.LIGHT["random" if group == "transfer" else "active"]
        seeds = [v for v in row.per_seed.get("other_mse_mean", []) if v > 0.0]
        traces.append(
            go.Scatter(
                x=seeds,
                y=[i] * len(seeds),
                mode="markers",
                marker={
                    "size": 8,
                    "color": color,
                    "symbol": "circle" if group == "transfer" else "square",
                },
                opacity=0.35,
                showlegend=False,
                hovertemplate="%{x:.3g}<extra>"
                + style.escaped(label)
                + ", a seed"
                "</extra>",
            )
        )
    return traces


def _medians(methods: list[_Method]) -> list[Any]:
    """The median of each method, over its seeds."""
    traces = []
    for kind, title, color, symbol in (
        ("transfer", "transfer", "random", "circle"),
        ("baselines", "without transfer", "active", "square"),
    ):
        own = [
            (i, row.other_mse_mean, label)
            for i, (group, label, row) in enumerate(methods)
            if group == kind and row.other_mse_mean > 0.0
        ]
        traces.append(
            go.Scatter(
                x=[v for _, v, _ in own],
                y=[i for i, _, _ in own],
                mode="markers",
                name=f"{title} (median)",
                marker={
                    "symbol": symbol,
                    "size": 12,
                    "color": style.LIGHT[color],
                    "line": {"color": style.LIGHT["ink"], "width": 1.5},
                },
                customdata=[style.escaped(label) for _, _, label in own],
                hovertemplate="%{customdata}: median %{x:.3g}<extra></extra>",
            )
        )
    return traces


def toy_errors(
    figures: ToyFigures | ToyResults,
    labels: dict[str, dict[str, str]],
    *,
    key: str,
    square: str,
    paper: float | None,
) -> style.Chart:
    """Fig. 2: errors on the points not given, by method; a dot for a seed.

    Args:
        figures: of one square in the toy's results.
        labels: by group ("transfer", "baselines") and method, what it is
            called; others keep their name.
        key: of the chart.
        square: what the square is called.
        paper: the paper's figure, to be drawn as a line.
    """
    methods = [
        (group, labels.get(group, {}).get(name, name), row)
        for group in ("transfer", "baselines")
        for name, row in getattr(figures, group).items()
    ]
    traces = [*_seeds(methods), *_medians(methods)]
    lines = (
        [
            style.reference_line(
                math.log10(paper),
                f"paper: {paper:g}",
                style.LIGHT["paper"],
                vertical=True,
                position="start",
            )
        ]
        if paper
        else []
    )
    for line in lines:
        # On a logarithmic axis a shape's place is the value itself.
        line["shape"].update(x0=paper, x1=paper)
    figure = style.make_figure(
        traces,
        x={
            "title": {"text": "mean squared error"},
            "type": "log",
            "dtick": 1,
            "tickformat": "~g",
        },
        y={
            "tickvals": list(range(len(methods))),
            "ticktext": [style.wrapped(label) for _, label, _ in methods],
            "range": [len(methods) - 0.1, -0.5],
            "tickfont": {"size": 12},
        },
        **style.with_lines(*lines),
    )
    _, best, least = min(methods, key=lambda m: m[2].other_mse_mean)
    return style.Chart(
        key,
        f"On the square {square}",
        "Fig. 2. Errors on the 15 points whose values were not given, after "
        "five that were; a pale dot is the mean of one seed, the bordered "
        "symbol the median over the seeds. Less is better; the axis is "
        "logarithmic.",
        f"Lowest: {best} with {least.other_mse_mean:.3g}.",
        figure,
        ("method", "on those", "on the others", "± over subsets", "95 %"),
        [
            [
                label,
                f"{row.train_mse_mean:.3g}",
                f"{row.other_mse_mean:.3g}",
                f"{row.other_mse_std:.3g}",
                f"{row.other_mse_p95:.3g}",
            ]
            for _, label, row in methods
        ],
        90 + 38 * len(methods),
    )
