"""The charts of tuning: history, importance of gains, joint angles."""

from collections.abc import Mapping
import itertools

import plotly.graph_objects as go
from plotly.subplots import make_subplots

from drake_affetto.report import style
from drake_affetto.tuning.config import HELD_OUT, REST, TRAINING
from drake_affetto.tuning.results import (
    ReferenceTraces,
    TuningDetails,
    TuningResults,
)

TITLES = {
    TRAINING: "sines and steps",
    **{name: name for name in HELD_OUT},
    REST: "rest in several postures",
}

_BEFORE, _AFTER = style.LIGHT["relearn"], style.LIGHT["transfer"]


def label(joint: str) -> str:
    """The name of a joint in words."""
    return joint.replace("_", " ")


def history(details: TuningDetails, results: TuningResults) -> style.Chart:
    """The cost of each trial, and the least so far."""
    trials = sorted(details.trials, key=lambda row: row.number)
    complete = [row for row in trials if not row.pruned]
    pruned = [row for row in trials if row.pruned]
    costs = [row.cost for row in complete]
    traces = [
        go.Scatter(
            x=[row.number for row in pruned],
            y=[row.cost for row in pruned],
            mode="markers",
            name="stopped early",
            marker={"color": style.LIGHT["muted"], "symbol": "x", "size": 6},
        ),
        go.Scatter(
            x=[row.number for row in complete],
            y=costs,
            mode="markers",
            name="trial",
            marker={"color": _AFTER, "size": 6},
            opacity=0.6,
        ),
        go.Scatter(
            x=[row.number for row in complete],
            y=list(itertools.accumulate(costs, min)),
            mode="lines",
            name="best so far",
            line={"color": _AFTER, "width": 2},
        ),
        go.Scatter(
            x=[0, max((row.number for row in trials), default=1)],
            y=[results.hand_tuned.cost] * 2,
            mode="lines",
            name="hand-tuned",
            line={"color": _BEFORE, "dash": "dash", "width": 2},
        ),
    ]
    figure = style.make_figure(
        traces,
        x={"title": {"text": "trial"}},
        y={"title": {"text": "cost"}, "type": "log", "tickformat": "~g"},
    )
    return style.Chart(
        "tuning-history",
        "Cost of the trials",
        "The mean cost of all joints: tracking error, effort of the valves and "
        "oscillation at rest. Trials that cost far more than the best one did "
        "at the same time were stopped. Less is better; the axis is "
        "logarithmic.",
        f"Lowest: {min(costs, default=results.hand_tuned.cost):.3g}, "
        f"hand-tuned {results.hand_tuned.cost:.3g}.",
        figure,
        ("trial", "cost", "stopped early"),
        [
            [row.number, f"{row.cost:.4g}", "yes" if row.pruned else "no"]
            for row in trials
        ],
        wide=True,
    )


def importance(shares: Mapping[str, Mapping[str, float]]) -> style.Chart:
    """The share of each gain in the variance of its joint's cost."""
    joints = list(shares)
    names = list(shares[joints[0]])
    colors = [style.LIGHT[k] for k in ("random", "active", "gaussian_process")]
    colors.append(style.LIGHT["continue"])
    traces = [
        go.Bar(
            y=[style.escaped(label(joint)) for joint in joints],
            x=[100.0 * shares[joint][name] for joint in joints],
            name=name,
            orientation="h",
            marker={"color": color},
            hovertemplate="%{y}, " + name + ": %{x:.0f} %<extra></extra>",
        )
        for name, color in zip(names, colors, strict=True)
    ]
    figure = style.make_figure(
        traces,
        x={"title": {"text": "share, %"}, "range": [0, 100]},
        y={"autorange": "reversed"},
        barmode="stack",
        legend={"traceorder": "normal"},
    )
    return style.Chart(
        "tuning-importance",
        "Importance of the gains",
        "The share of each gain in the variance of the logarithm of its "
        "joint's cost over the trials (functional ANOVA).",
        "; ".join(
            f"{label(joint)}: most important {max(row, key=lambda k: row[k])}"
            for joint, row in shares.items()
        )
        + ".",
        figure,
        ("joint", *names),
        [
            [label(joint), *(f"{row[name]:.0%}" for name in names)]
            for joint, row in shares.items()
        ],
        130 + 32 * len(joints),
        wide=True,
    )


def traces(name: str, reference: ReferenceTraces) -> style.Chart:
    """Joint angles along one reference, a row for each joint."""
    joints = list(reference.desired)
    figure = make_subplots(
        rows=len(joints),
        cols=1,
        shared_xaxes=True,
        vertical_spacing=0.125 / max(len(joints), 2),
        subplot_titles=[style.escaped(label(joint)) for joint in joints],
    )
    for i, joint in enumerate(joints):
        for angles, kind, color, width in (
            (reference.desired, "desired", style.LIGHT["muted"], 2.5),
            (reference.hand_tuned, "hand-tuned", _BEFORE, 1.3),
            (reference.tuned, "tuned", _AFTER, 1.3),
        ):
            figure.add_scatter(
                x=reference.t,
                y=angles[joint],
                mode="lines",
                name=kind,
                legendgroup=kind,
                showlegend=i == 0,
                line={"color": color, "width": width},
                row=i + 1,
                col=1,
            )
    figure.update_layout(template=style.make_figure().layout.template)
    figure.update_layout(margin={"l": 8, "r": 14, "t": 60, "b": 8})
    figure.update_yaxes(ticksuffix="°")
    figure.update_xaxes(title_text="time, s", row=len(joints), col=1)
    kind = {TRAINING: "training", REST: "rest"}.get(name, "held out")

    def worst(angles: Mapping[str, list[float]], joint: str) -> str:
        pairs = zip(angles[joint], reference.desired[joint], strict=False)
        return f"{max(abs(q - goal) for q, goal in pairs):.1f}"

    return style.Chart(
        f"tuning-{name.replace('_', '-')}",
        f"Before and after: {TITLES.get(name, label(name))} ({kind})",
        "Joint angles along the reference, with the hand-tuned and with the "
        "tuned gains.",
        f"{len(joints)} joints over {reference.t[-1]:.1f} s.",
        figure,
        ("joint", "greatest error hand-tuned, °", "greatest error tuned, °"),
        [
            [
                label(joint),
                worst(reference.hand_tuned, joint),
                worst(reference.tuned, joint),
            ]
            for joint in joints
        ],
        120 + 150 * len(joints),
        wide=True,
    )
