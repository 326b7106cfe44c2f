"""Charts of the robot that finds the mirror by itself."""

from collections.abc import Sequence
from typing import Any

import plotly.graph_objects as go

from drake_affetto.experiments.results import MirrorResults
from drake_affetto.experiments.results.self_calibration import (
    BeliefStep,
    SelfCalibrationResults,
)
from drake_affetto.report import style, wording

# Symbols of the methods, other than those of schemes.
_SYMBOLS = ("star", "hexagon", "pentagon")
# Colors of the beliefs in a picture, from the first to the last.
_COLORS = ("grid", "pale_plus", "transfer", "hit", "plus")
# Beliefs by ear that are drawn, by the number of strokes.
_STROKES = (0, 4, 24)
_UNITS = {"hand": "look", "ellipse": "look", "ear": "stroke"}


def demonstrations_needed(
    results: MirrorResults, found: SelfCalibrationResults
) -> style.Chart:
    """Success over the number of demonstrations that a person gives."""
    methods = [name for name in wording.METHODS if name in found.methods]
    schemes = wording.ordered(results.schemes)
    traces: list[Any] = []
    for k, name in enumerate(methods):
        rate = found.methods[name].success_rate
        label = style.escaped(wording.METHODS[name])
        traces.append(
            go.Scatter(
                name=f"none: {label}",
                x=[0.18 * (k - 1)],
                y=[100 * rate.mean],
                error_y=style.whiskers([rate]),
                mode="markers",
                marker={
                    "size": 11,
                    "symbol": _SYMBOLS[k % len(_SYMBOLS)],
                    "color": style.LIGHT[_COLORS[2 + k]],
                },
                hovertemplate=f"%{{y:.0f}} %<extra>{label}</extra>",
            )
        )
    for k, name in enumerate(schemes):
        cells = results.schemes[name]
        rates = [cells[n].success_rate for n in results.samples]
        shift = 0.1 * (k - 0.5 * (len(schemes) - 1))
        traces.append(
            style.scheme_points(
                name,
                "%{x:.0f} demonstrations: %{y:.0f} %",
                x=[n + shift for n in results.samples],
                y=[100 * rate.mean for rate in rates],
                error_y=style.whiskers(rates),
            )
        )
    counts = [0, *results.samples]
    return style.Chart(
        "self-calibration",
        "Success by demonstrations that a person gives",
        f"{found.repeats} mirrors, {found.evaluations} unseen positions each; "
        "whiskers: 95 % confidence. At 0 the robot has found the mirror by "
        "itself.",
        "Without a demonstration: "
        + wording.joined(
            [
                f"{wording.METHODS[name]} "
                f"{wording.percent(found.methods[name].success_rate.mean)}"
                for name in methods
            ]
        )
        + ".",
        style.make_figure(
            traces,
            x={
                "title": {"text": "demonstrations by a person"},
                "tickvals": counts,
                "ticktext": [str(n) for n in counts],
                "showgrid": False,
            },
            y=style.percent_axis("success at unseen positions"),
        ),
        ("way", *(str(n) for n in counts)),
        [
            [
                wording.METHODS[name],
                wording.rate(found.methods[name].success_rate),
            ]
            + ["–"] * len(results.samples)
            for name in methods
        ]
        + [
            [wording.scheme(name), "–"]
            + [
                wording.rate(results.schemes[name][n].success_rate)
                for n in results.samples
            ]
            for name in schemes
        ],
        420,
        wide=True,
    )


def shrinking_belief(found: SelfCalibrationResults) -> style.Chart | None:
    """Believed mirrors of the first repeat, seen from above."""
    steps = _drawn(found.beliefs)
    if not steps or len(found.true_line) != 2:
        return None
    traces: list[Any] = []
    for color, each in zip(_COLORS, steps, strict=False):
        x: list[float | None] = []
        y: list[float | None] = []
        for a, b in each.lines:
            x += [a[0], b[0], None]
            y += [a[1], b[1], None]
        traces.append(
            go.Scatter(
                name=style.escaped(_label(each)),
                x=x,
                y=y,
                mode="lines",
                line={"width": 1, "color": style.LIGHT[color]},
                opacity=0.8,
                hoverinfo="skip",
            )
        )
    (x0, y0), (x1, y1) = found.true_line
    traces += [
        go.Scatter(
            name="the mirror",
            x=[x0, x1],
            y=[y0, y1],
            mode="lines",
            line={"width": 4, "color": style.LIGHT["ink"]},
            hoverinfo="skip",
        ),
        go.Scatter(
            name="the robot",
            x=[0.0],
            y=[0.0],
            mode="markers",
            marker={"size": 14, "color": style.LIGHT["muted"]},
            hoverinfo="skip",
        ),
    ]
    return style.Chart(
        "belief",
        "What it believes of the mirror, from above",
        "The first mirror of the study: lines are mirrors that are still "
        "possible, at the height of the drum's marker; x is ahead of the "
        "robot, y to its left.",
        "The lines draw together on the true mirror.",
        style.make_figure(
            traces,
            x={"title": {"text": "x [m]"}, "range": [-0.3, 1.0]},
            y={
                "title": {"text": "y [m]"},
                "range": [-0.3, 0.8],
                "scaleanchor": "x",
            },
        ),
        ("belief", "mirrors drawn"),
        [[_label(each), str(len(each.lines))] for each in steps],
        480,
        wide=True,
    )


def _drawn(beliefs: Sequence[BeliefStep]) -> list[BeliefStep]:
    """By ear at first and at last, then by ellipse, then by the hand."""
    by_ear = [
        each
        for each in beliefs
        if each.method == "ear" and each.step in _STROKES
    ]
    last = {
        each.method: each for each in beliefs if each.method in wording.METHODS
    }
    return by_ear + [last[name] for name in ("ellipse", "hand") if name in last]


def _label(each: BeliefStep) -> str:
    if each.step == 0:
        return "somewhere on my left"
    count = wording.number(each.step, _UNITS[each.method])
    return f"{wording.METHODS[each.method]}, {count}"
