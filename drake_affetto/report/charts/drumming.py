"""Charts of the drumming study (paper Fig. 3)."""

from collections.abc import Callable, Sequence
import math
from typing import Any, Protocol

import numpy as np
import plotly.graph_objects as go

from drake_affetto.experiments.results import (
    CurvePoint,
    RewardRow,
)
from drake_affetto.report import style, wording


class PositionRow(Protocol):
    """A trial at a position of the drum: taught or tested."""

    @property
    def xy(self) -> tuple[float, float]:
        """Position of the drum, m."""

    @property
    def tau(self) -> Sequence[float]:
        """Task parameter τ."""

    @property
    def reward(self) -> float:
        """Reward from the sound."""


class TestedRow(PositionRow, Protocol):
    """A trial at a test position."""

    @property
    def success(self) -> bool:
        """Whether the reward is above the threshold."""


def learning_curve(
    random: Sequence[CurvePoint],
    active: Sequence[CurvePoint] | None,
    *,
    evaluations: int,
    repeats: int,
) -> style.Chart:
    """Fig. 3c: success over the number of demonstrations, with a band."""
    curves = [("random", "positions in random order", "solid", random)]
    if active:
        curves.append(
            ("active", "the least certain position next", "dot", active)
        )
    traces: list[Any] = []
    rows = []
    for key, label, dash, curve in curves:
        traces += _curve(key, label, dash, curve)
        rows += [
            [label, point.n, wording.rate(point.success_rate)]
            for point in curve
        ]
    traces.append(
        go.Scatter(
            x=[25],
            y=[100],
            name="paper: 10 of 10 after 25",
            mode="markers",
            marker={
                "symbol": "star",
                "size": 15,
                "color": style.LIGHT["paper"],
            },
            hovertemplate="paper: 10 of 10 after 25<extra></extra>",
        )
    )
    last = max(25, *(point.n for point in random))
    figure = style.make_figure(
        traces,
        x={
            "title": {"text": "demonstrations"},
            "range": [0, last + 1],
            "dtick": 5,
        },
        y=style.percent_axis("success at unseen positions"),
        **style.with_lines(
            style.reference_line(
                90,
                "90 %",
                style.LIGHT["muted"],
                vertical=False,
                position="start",
            )
        ),
    )
    several = repeats > 1
    caption = (
        "Fig. 3c. After each demonstration the skill drums at "
        f"{wording.number(evaluations, 'position')} it was never shown. "
        + (
            f"Lines are means over {repeats} repeats with other "
            "demonstrations, bands their 95 % confidence. "
            if several
            else "Bands are the 95 % confidence of so many trials. "
        )
        + (
            "Dotted: the next demonstration is given where the skill is least "
            "certain, rather than anywhere."
            if active
            else ""
        )
    )
    return style.Chart(
        "learning-curve",
        "How many demonstrations does it take?",
        caption.strip(),
        "Success rises from "
        f"{wording.percent(random[0].success_rate.mean)} after "
        f"{wording.number(random[0].n, 'demonstration')} to "
        f"{wording.percent(random[-1].success_rate.mean)} after "
        f"{random[-1].n}.",
        figure,
        ("order", "demonstrations", "success (95 % confidence)"),
        rows,
        420,
    )


def _curve(
    key: str, label: str, dash: str, curve: Sequence[CurvePoint]
) -> list[Any]:
    """A band of confidence, and the curve of the means."""
    n = [point.n for point in curve]
    mean, low, high = (
        [100.0 * getattr(point.success_rate, kind) for point in curve]
        for kind in ("mean", "low", "high")
    )
    band = go.Scatter(
        x=n + n[::-1],
        y=high + low[::-1],
        fill="toself",
        fillcolor=style.LIGHT[key],
        mode="none",
        opacity=0.18,
        hoverinfo="skip",
        showlegend=False,
        legendgroup=key,
    )
    line = go.Scatter(
        x=n,
        y=mean,
        customdata=list(zip(low, high, strict=True)),
        name=label,
        legendgroup=key,
        mode="lines+markers",
        line={"color": style.LIGHT[key], "width": 2.5, "dash": dash},
        marker={
            "size": 6,
            "symbol": "circle" if key == "random" else "diamond",
        },
        hovertemplate=(
            "%{x} demonstrations: %{y:.0f} %"
            " (%{customdata[0]:.0f} to %{customdata[1]:.0f})"
            "<extra></extra>"
        ),
    )
    return [band, line]


def similarity(
    t: list[float], hit: list[float], miss: list[float], threshold: float
) -> style.Chart:
    """Fig. 3b: the similarity at each offset, for a hit and for a miss."""
    curves = [("hit", "a hit", "solid", hit), ("miss", "a miss", "dash", miss)]
    figure = style.make_figure(
        [
            go.Scatter(
                x=t,
                y=values,
                name=label,
                mode="lines",
                line={"color": style.LIGHT[key], "width": 2, "dash": dash},
                hovertemplate="%{x:.2f} s: %{y:.2f}<extra>"
                + label
                + "</extra>",
            )
            for key, label, dash, values in curves
        ],
        x={"title": {"text": "offset in the recording [s]"}},
        y={"title": {"text": "similarity R"}},
        **style.threshold_line(threshold, vertical=False),
    )
    step = max(1, math.ceil(len(t) / 150))
    return style.Chart(
        "similarity",
        "What counts as a drum",
        "Fig. 3b. The recording is compared with the sounds heard while "
        "teaching, slid along it; R is how alike the best of them is. The "
        "greatest R of a trial is its reward, and a drum is heard above "
        f"{threshold:g}.",
        f"The hit's similarity peaks at {max(hit, default=0):.2f}, the miss "
        f"never exceeds {max(miss, default=0):.2f}.",
        figure,
        ("offset [s]", "hit", "miss"),
        [
            [f"{a:.2f}", f"{b:.3f}", f"{c:.3f}"]
            for a, b, c in list(zip(t, hit, miss, strict=True))[::step]
        ],
        320,
    )


def workspace(
    taught: Sequence[PositionRow],
    tests: Sequence[TestedRow],
    threshold: float,
) -> style.Chart:
    """Where was taught and tested, seen from above as the robot sees it."""
    return _taught_and_tested(
        taught,
        tests,
        threshold,
        # Across and along the table, cm.
        lambda row: (100.0 * row.xy[1], 100.0 * row.xy[0]),
        ("y [cm]", "x [cm]"),
        key="workspace",
        title="Where it was taught, where it was tested",
        caption="The table from above, the robot below the picture. Crosses: "
        "where the drum stood while teaching. Discs: where it stood in the "
        "tests, colored by the reward; a miss is a diagonal cross.",
        x={
            "title": {"text": "y: to the robot's left ← [cm]"},
            "autorange": "reversed",
            "constrain": "domain",
        },
        y={
            "title": {"text": "x: forward → [cm]"},
            "scaleanchor": "x",
            "constrain": "domain",
        },
    )


def task_space(
    taught: Sequence[PositionRow],
    tests: Sequence[TestedRow],
    threshold: float,
) -> style.Chart | None:
    """The same places as the skill has them; None if they are not two numbers.

    Rows whose `tau` is [y_img, q3* in rad].
    """
    if any(len(row.tau) != 2 for row in (*taught, *tests)):
        return None
    return _taught_and_tested(
        taught,
        tests,
        threshold,
        lambda row: (math.degrees(row.tau[1]), row.tau[0]),
        ("q3* [°]", "y_img"),
        key="task-space",
        title="The same places, as the skill has them",
        caption="Two numbers say where the drum is: how far the upper body "
        "has turned to center the marker (q3*), and how high the marker then "
        "stands in the picture (y_img). The skill learns from the crosses and "
        "is asked at the discs.",
        x={
            "title": {"text": "turned to the left ← q3* [°]"},
            "autorange": "reversed",
        },
        y={"title": {"text": "y_img"}, "autorange": "reversed"},
    )


def _taught_and_tested(
    taught: Sequence[PositionRow],
    tests: Sequence[TestedRow],
    threshold: float,
    place: Callable[[PositionRow], tuple[float, float]],
    names: tuple[str, str],
    *,
    key: str,
    title: str,
    caption: str,
    x: dict[str, Any],
    y: dict[str, Any],
) -> style.Chart:
    def points(rows: Sequence[PositionRow]) -> dict[str, list[float]]:
        return {
            "x": [place(row)[0] for row in rows],
            "y": [place(row)[1] for row in rows],
        }

    where = f"{names[1]} %{{y:.2f}}, {names[0]} %{{x:.2f}}"
    traces = [
        go.Scatter(
            points(taught),
            name="taught",
            mode="markers",
            marker={
                "symbol": "cross-thin-open",
                "size": 9,
                "color": style.LIGHT["muted"],
                "line": {"width": 1.5, "color": style.LIGHT["muted"]},
            },
            opacity=1.0 if len(taught) < 60 else 0.5,
            hovertemplate=f"taught at {where}<extra></extra>",
        )
    ]
    for success in (True, False):
        rows = [row for row in tests if row.success is success]
        if rows:
            traces += _tested(points(rows), rows, success, where)
    figure = style.make_figure(
        traces,
        x=x,
        y=y,
        coloraxis={
            "cmin": 0,
            "cmax": 1,
            "colorscale": [
                [0, style.LIGHT["low_reward"]],
                [0.5, style.LIGHT["mid_reward"]],
                [1, style.LIGHT["high_reward"]],
            ],
            "colorbar": {
                "title": {"text": "reward", "side": "right"},
                "thickness": 12,
                "outlinewidth": 0,
            },
        },
    )
    hits = sum(row.success for row in tests)
    return style.Chart(
        key,
        title,
        caption,
        f"{hits} of {len(tests)} tests hit the drum; "
        f"{len(taught)} positions were taught.",
        figure,
        ("", names[1], names[0], "reward", "result"),
        [
            [
                kind,
                f"{place(row)[1]:.2f}",
                f"{place(row)[0]:.2f}",
                f"{row.reward:.2f}",
                "hit" if row.reward > threshold else "miss",
            ]
            for kind, group in (("taught", taught), ("tested", tests))
            for row in group
        ],
        420,
    )


def _tested(
    points: dict[str, list[float]],
    rows: Sequence[TestedRow],
    success: bool,
    where: str,
) -> list[Any]:
    """Trials that all hit or all missed, and their entry in the legend."""
    label, symbol = (
        ("tested: hit", "circle") if success else ("tested: miss", "x")
    )
    edge = {"width": 1.2, "color": style.LIGHT["ink"]}
    rewards = [row.reward for row in rows]
    trials = go.Scatter(
        points,
        name=label,
        mode="markers",
        marker={
            "symbol": symbol,
            "size": 13,
            "color": rewards,
            "coloraxis": "coloraxis",
            "line": edge,
        },
        showlegend=False,
        customdata=rewards,
        hovertemplate=f"reward %{{customdata:.2f}} at {where}"
        f"<extra>{label}</extra>",
    )
    # In the legend with one color: there the markers have no reward.
    legend = go.Scatter(
        x=[None],
        y=[None],
        name=label,
        mode="markers",
        marker={
            "symbol": symbol,
            "size": 11,
            "color": style.LIGHT["mid_reward"],
            "line": edge,
        },
    )
    return [trials, legend]


def separation(
    rewards: Sequence[RewardRow], threshold: float, impulse_threshold: float
) -> style.Chart:
    """Rewards of trials that touched the drum's head and of those that not."""
    groups: dict[str, list[float]] = {"hit": [], "miss": []}
    for row in rewards:
        impulse = row.impulse
        touched = impulse is not None and impulse > impulse_threshold
        groups["hit" if touched else "miss"].append(row.reward)
    top = max([1.0, *groups["hit"], *groups["miss"]])
    low = min([0.0, *groups["hit"], *groups["miss"]])
    width = 0.05
    # Whole bins around zero, so that the threshold is an edge.
    edges = width * np.arange(
        math.floor(low / width + 1e-9), math.ceil(top / width - 1e-9) + 1
    )
    centers = 0.5 * (edges[:-1] + edges[1:])
    labels = {"hit": "head touched", "miss": "head not touched"}
    traces = []
    counts = {}
    for key, values in groups.items():
        counts[key] = np.histogram(values, edges)[0]
        share = 100.0 * counts[key] / max(1, len(values))
        traces.append(
            go.Bar(
                x=centers.tolist(),
                y=share.tolist(),
                width=0.92 * width,
                name=f"{labels[key]} ({wording.number(len(values), 'trial')})",
                customdata=counts[key].tolist(),
                marker={
                    "color": style.LIGHT[key],
                    "pattern": {"shape": "" if key == "hit" else "/"},
                },
                opacity=0.85,
                hovertemplate="R around %{x:.2f}: %{customdata} trials, "
                "%{y:.1f} %<extra>" + labels[key] + "</extra>",
            )
        )
    figure = style.make_figure(
        traces,
        x={"title": {"text": "reward R"}},
        y={"title": {"text": "share of its group"}, "ticksuffix": " %"},
        barmode="overlay",
        **style.threshold_line(
            threshold,
            vertical=True,
            color=style.LIGHT["ink"],
            position="end",
        ),
    )
    return style.Chart(
        "separation",
        "Does the sound tell the truth?",
        "The reward is made from sound alone. Here the simulation says "
        "whether the hand really touched the drum's head with more than "
        f"{impulse_threshold:g} N s: both groups should lie on their own side "
        "of the line.",
        f"{len(groups['hit'])} trials touched the head, {len(groups['miss'])} "
        f"did not; the threshold is {threshold:g}.",
        figure,
        ("reward", "trials that touched", "trials that did not"),
        [
            [f"{a:.2f} to {b:.2f}", int(hit), int(miss)]
            for a, b, hit, miss in zip(
                edges[:-1],
                edges[1:],
                counts["hit"],
                counts["miss"],
                strict=True,
            )
            if hit or miss
        ],
        340,
    )
