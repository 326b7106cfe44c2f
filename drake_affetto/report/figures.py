"""The page's charts: plotly figures from results, nothing written or read.

All colours are of `LIGHT`; the page exchanges them for those of the same name
in `DARK` where the reader prefers that, and back, without drawing data anew.
"""

from collections.abc import Callable, Iterable, Sequence
import dataclasses
import html
import math
import textwrap
from typing import Any

import numpy as np
import plotly.graph_objects as go

from drake_affetto.report import words
from drake_affetto.report.data import THRESHOLD, Contest, Rate

# By name; every value occurs once, so that either can be told from the other.
# The schemes' are chosen to differ for colour-blind eyes too, and each has a
# symbol of its own besides.
LIGHT = {
    "ink": "#1c2530",
    "muted": "#5a6673",
    "grid": "#e1e6eb",
    "surface": "#fefefe",
    "unchanged": "#848e98",
    "relearn": "#c2500c",
    "continue": "#8c2a6e",
    "transfer": "#3b94cf",
    "transfer_default": "#0b4f92",
    "gaussian_process": "#0a8f6a",
    "other_scheme": "#7d6608",
    "hit": "#0b66a8",
    "miss": "#b85407",
    "random": "#1f6fb2",
    "active": "#bf5b04",
    "paper": "#7a1f4d",
    "plus": "#0f4c8a",
    "minus": "#a8480a",
    "pale_plus": "#6fa8dd",
    "pale_minus": "#eca06c",
    "low_reward": "#f6e7c1",
    "mid_reward": "#4fa5a0",
    "high_reward": "#123a6b",
}
DARK = {
    "ink": "#e8edf2",
    "muted": "#a6b1bc",
    "grid": "#303b46",
    "surface": "#182028",
    "unchanged": "#808a94",
    "relearn": "#f08a3e",
    "continue": "#f59ac8",
    "transfer": "#3f8fd0",
    "transfer_default": "#a9d4ff",
    "gaussian_process": "#2fbf94",
    "other_scheme": "#cdb84a",
    "hit": "#62b1ee",
    "miss": "#f29a4b",
    "random": "#6cb4f0",
    "active": "#f5a04e",
    "paper": "#e58fb8",
    "plus": "#4f9fe6",
    "minus": "#e5893f",
    "pale_plus": "#1f5f9e",
    "pale_minus": "#8f4a12",
    "low_reward": "#5a3c10",
    "mid_reward": "#3f9c96",
    "high_reward": "#c9e6ff",
}
SYMBOLS = {
    "unchanged": "circle-open",
    "relearn": "square",
    "continue": "triangle-up",
    "transfer": "diamond",
    "transfer_default": "circle",
    "gaussian_process": "cross",
}
_FONT = (
    'system-ui, -apple-system, "Segoe UI", Roboto, "Helvetica Neue", Arial, '
    '"Liberation Sans", sans-serif'
)


@dataclasses.dataclass(frozen=True)
class Chart:
    """A figure with what makes it readable without seeing it.

    Attributes:
        key: unique on the page, of letters, digits and hyphens.
        title: short.
        caption: in plain words, what it shows and how to read it.
        summary: one sentence for who cannot see it.
        figure: of plotly.
        header, rows: the same as a table.
        height: in CSS pixels.
        wide: whether it takes the page's whole width.
    """

    key: str
    title: str
    caption: str
    summary: str
    figure: go.Figure
    header: Sequence[str]
    rows: Sequence[Sequence[Any]]
    height: int = 360
    wide: bool = False


def text(value: Any) -> str:
    """For plotly, which reads a kind of HTML in its texts."""
    return html.escape(str(value), quote=False)


def scheme_color(name: str) -> str:
    """The one colour of a scheme."""
    return LIGHT[name if name in SYMBOLS else "other_scheme"]


def _marker(name: str) -> dict[str, Any]:
    """A scheme's colour and symbol."""
    return {
        "symbol": SYMBOLS.get(name, "star"),
        "size": 9,
        "color": scheme_color(name),
        "line": {"width": 1.5, "color": scheme_color(name)},
    }


def _whiskers(rates: Sequence[Rate]) -> dict[str, Any]:
    """Confidence intervals of rates, for points in percent."""
    return {
        "type": "data",
        "symmetric": False,
        "array": [100 * (r.high - r.mean) for r in rates],
        "arrayminus": [100 * (r.mean - r.low) for r in rates],
        "thickness": 1.2,
        "width": 3,
    }


def _figure(
    traces: Iterable[Any] = (),
    *,
    x: dict[str, Any] | None = None,
    y: dict[str, Any] | None = None,
    **layout: Any,
) -> go.Figure:
    """A figure in the page's style: no box, no zoom that catches scrolling."""
    axis = {
        "gridcolor": LIGHT["grid"],
        "linecolor": LIGHT["grid"],
        "zeroline": False,
        "ticks": "",
        "automargin": True,
        "fixedrange": True,
        "title": {"standoff": 10},
    }
    template = go.layout.Template(
        layout={
            "font": {"family": _FONT, "size": 13, "color": LIGHT["ink"]},
            "paper_bgcolor": "rgba(0,0,0,0)",
            "plot_bgcolor": "rgba(0,0,0,0)",
            "xaxis": axis,
            "yaxis": axis,
            "margin": {"l": 8, "r": 14, "t": 14, "b": 8},
            "hoverlabel": {
                "bgcolor": LIGHT["surface"],
                "bordercolor": LIGHT["muted"],
                "font": {"color": LIGHT["ink"], "family": _FONT},
            },
            "legend": {
                "orientation": "h",
                # Over the whole width, not over the axes' alone.
                "xref": "container",
                "yref": "container",
                "x": 0,
                "y": 1,
                "xanchor": "left",
                "yanchor": "top",
                "bgcolor": "rgba(0,0,0,0)",
            },
            "dragmode": False,
        }
    )
    return go.Figure(
        list(traces),
        {"template": template, "xaxis": x or {}, "yaxis": y or {}, **layout},
    )


def _percent_axis(title: str = "success", **more: Any) -> dict[str, Any]:
    return {
        "title": {"text": title},
        "range": [-3, 105],
        "tickvals": [0, 25, 50, 75, 100],
        "ticktext": ["0 %", "25 %", "50 %", "75 %", "100 %"],
        **more,
    }


def _line(
    value: float, label: str, color: str, *, vertical: bool, position: str
) -> dict[str, dict[str, Any]]:
    """A dashed line over the whole chart as a shape and an annotation.

    Args:
        position: of the label beside the line, "start" or "end".
    """
    first, second = ("x", "y") if vertical else ("y", "x")
    end = position == "end"
    return {
        "shape": {
            "type": "line",
            first + "0": value,
            first + "1": value,
            second + "0": 0,
            second + "1": 1,
            second + "ref": "paper",
            "line": {"color": color, "width": 1.5, "dash": "dash"},
        },
        "annotation": {
            "text": label,
            first: value,
            second: 1.0 if end else 0.0,
            second + "ref": "paper",
            "showarrow": False,
            "font": {"color": color, "size": 12},
            "xanchor": "left" if vertical else ("right" if end else "left"),
            "yanchor": ("top" if end else "bottom") if vertical else "bottom",
            "xshift": 5 if vertical else 0,
        },
    }


def _with_lines(*lines: dict[str, dict[str, Any]]) -> dict[str, Any]:
    return {
        "shapes": [line["shape"] for line in lines],
        "annotations": [line["annotation"] for line in lines],
    }


# --- Drumming: Fig. 3 --------------------------------------------------------


def learning_curve(
    random: list[dict[str, Any]],
    active: list[dict[str, Any]] | None,
    *,
    evaluations: int,
    repeats: int,
) -> Chart:
    """Fig. 3c: success over the number of demonstrations, with a band."""
    curves = [("random", "positions in random order", "solid", random)]
    if active:
        curves.append(
            ("active", "the least certain position next", "dot", active)
        )
    traces: list[Any] = []
    rows = []
    for key, label, dash, curve in curves:
        n = [point["n"] for point in curve]
        mean, low, high = (
            [100.0 * point["success_rate"][kind] for point in curve]
            for kind in ("mean", "low", "high")
        )
        traces.append(
            go.Scatter(
                x=n + n[::-1],
                y=high + low[::-1],
                fill="toself",
                fillcolor=LIGHT[key],
                mode="none",
                opacity=0.18,
                hoverinfo="skip",
                showlegend=False,
                legendgroup=key,
            )
        )
        traces.append(
            go.Scatter(
                x=n,
                y=mean,
                customdata=list(zip(low, high, strict=True)),
                name=label,
                legendgroup=key,
                mode="lines+markers",
                line={"color": LIGHT[key], "width": 2.5, "dash": dash},
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
        )
        rows += [
            [label, point["n"], words.rate(Rate.of(point["success_rate"]))]
            for point in curve
        ]
    traces.append(
        go.Scatter(
            x=[25],
            y=[100],
            name="paper: 10 of 10 after 25",
            mode="markers",
            marker={"symbol": "star", "size": 15, "color": LIGHT["paper"]},
            hovertemplate="paper: 10 of 10 after 25<extra></extra>",
        )
    )
    last = max(25, *(point["n"] for point in random))
    figure = _figure(
        traces,
        x={
            "title": {"text": "demonstrations"},
            "range": [0, last + 1],
            "dtick": 5,
        },
        y=_percent_axis("success at unseen positions"),
        **_with_lines(
            _line(90, "90 %", LIGHT["muted"], vertical=False, position="start")
        ),
    )
    several = repeats > 1
    caption = (
        "Fig. 3c. After each demonstration the skill drums at "
        f"{words.number(evaluations, 'position')} it was never shown. "
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
    return Chart(
        "learning-curve",
        "How many demonstrations does it take?",
        caption.strip(),
        "Success rises from "
        f"{words.percent(random[0]['success_rate']['mean'])} after "
        f"{words.number(random[0]['n'], 'demonstration')} to "
        f"{words.percent(random[-1]['success_rate']['mean'])} after "
        f"{random[-1]['n']}.",
        figure,
        ("order", "demonstrations", "success (95 % confidence)"),
        rows,
        420,
    )


def similarity(
    t: list[float], hit: list[float], miss: list[float], threshold: float
) -> Chart:
    """Fig. 3b: the similarity at each offset, for a hit and for a miss."""
    curves = [("hit", "a hit", "solid", hit), ("miss", "a miss", "dash", miss)]
    figure = _figure(
        [
            go.Scatter(
                x=t,
                y=values,
                name=label,
                mode="lines",
                line={"color": LIGHT[key], "width": 2, "dash": dash},
                hovertemplate="%{x:.2f} s: %{y:.2f}<extra>"
                + label
                + "</extra>",
            )
            for key, label, dash, values in curves
        ],
        x={"title": {"text": "offset in the recording [s]"}},
        y={"title": {"text": "similarity R"}},
        **_with_lines(
            _line(
                threshold,
                f"R = {threshold:g}",
                LIGHT["muted"],
                vertical=False,
                position="start",
            )
        ),
    )
    step = max(1, math.ceil(len(t) / 150))
    return Chart(
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
    taught: list[dict[str, Any]], tests: list[dict[str, Any]]
) -> Chart:
    """Where was taught and tested, seen from above as the robot sees it."""
    return _taught_and_tested(
        taught,
        tests,
        # Across and along the table, cm.
        lambda row: (100.0 * row["xy"][1], 100.0 * row["xy"][0]),
        ("y [cm]", "x [cm]"),
        key="workspace",
        title="Where it was taught, where it was tested",
        caption="The table from above, the robot below the picture. Crosses: "
        "where the drum stood while teaching. Discs: where it stood in the "
        "tests, coloured by the reward; a miss is a diagonal cross.",
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
    taught: list[dict[str, Any]], tests: list[dict[str, Any]]
) -> Chart | None:
    """The same places as the skill has them; None if they are not two numbers.

    Rows whose `tau` is [y_img, q3* in rad].
    """
    if any(len(row["tau"]) != 2 for row in (*taught, *tests)):
        return None
    return _taught_and_tested(
        taught,
        tests,
        lambda row: (math.degrees(row["tau"][1]), row["tau"][0]),
        ("q3* [°]", "y_img"),
        key="task-space",
        title="The same places, as the skill has them",
        caption="Two numbers say where the drum is: how far the upper body "
        "has turned to centre the marker (q3*), and how high the marker then "
        "stands in the picture (y_img). The skill learns from the crosses and "
        "is asked at the discs.",
        x={
            "title": {"text": "turned to the left ← q3* [°]"},
            "autorange": "reversed",
        },
        y={"title": {"text": "y_img"}, "autorange": "reversed"},
    )


def _taught_and_tested(
    taught: list[dict[str, Any]],
    tests: list[dict[str, Any]],
    place: Callable[[dict[str, Any]], tuple[float, float]],
    names: tuple[str, str],
    *,
    key: str,
    title: str,
    caption: str,
    x: dict[str, Any],
    y: dict[str, Any],
) -> Chart:
    def points(rows: list[dict[str, Any]]) -> dict[str, list[float]]:
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
                "color": LIGHT["muted"],
                "line": {"width": 1.5, "color": LIGHT["muted"]},
            },
            opacity=1.0 if len(taught) < 60 else 0.5,
            hovertemplate=f"taught at {where}<extra></extra>",
        )
    ]
    for success, label, symbol in (
        (True, "tested: hit", "circle"),
        (False, "tested: miss", "x"),
    ):
        rows = [row for row in tests if row["success"] is success]
        if not rows:
            continue
        edge = {"width": 1.2, "color": LIGHT["ink"]}
        rewards = [row["reward"] for row in rows]
        traces.append(
            go.Scatter(
                points(rows),
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
        )
        # In the legend with one colour: there the markers have no reward.
        traces.append(
            go.Scatter(
                x=[None],
                y=[None],
                name=label,
                mode="markers",
                marker={
                    "symbol": symbol,
                    "size": 11,
                    "color": LIGHT["mid_reward"],
                    "line": edge,
                },
            )
        )
    figure = _figure(
        traces,
        x=x,
        y=y,
        coloraxis={
            "cmin": 0,
            "cmax": 1,
            "colorscale": [
                [0, LIGHT["low_reward"]],
                [0.5, LIGHT["mid_reward"]],
                [1, LIGHT["high_reward"]],
            ],
            "colorbar": {
                "title": {"text": "reward", "side": "right"},
                "thickness": 12,
                "outlinewidth": 0,
            },
        },
    )
    hits = sum(row["success"] for row in tests)
    return Chart(
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
                f"{row['reward']:.2f}",
                "hit" if row["reward"] > THRESHOLD else "miss",
            ]
            for kind, group in (("taught", taught), ("tested", tests))
            for row in group
        ],
        420,
    )


def separation(
    rewards: list[dict[str, Any]], threshold: float, impulse_threshold: float
) -> Chart:
    """Rewards of trials that touched the drum's head and of those that not."""
    groups: dict[str, list[float]] = {"hit": [], "miss": []}
    for row in rewards:
        impulse = row["impulse"]
        touched = impulse is not None and impulse > impulse_threshold
        groups["hit" if touched else "miss"].append(row["reward"])
    top = max([1.0, *groups["hit"], *groups["miss"]])
    low = min([0.0, *groups["hit"], *groups["miss"]])
    width = 0.05
    # Whole bins around zero, so that the threshold is an edge.
    edges = width * np.arange(
        math.floor(low / width + 1e-9), math.ceil(top / width - 1e-9) + 1
    )
    centres = 0.5 * (edges[:-1] + edges[1:])
    labels = {"hit": "head touched", "miss": "head not touched"}
    traces = []
    counts = {}
    for key, values in groups.items():
        counts[key] = np.histogram(values, edges)[0]
        share = 100.0 * counts[key] / max(1, len(values))
        traces.append(
            go.Bar(
                x=centres.tolist(),
                y=share.tolist(),
                width=0.92 * width,
                name=f"{labels[key]} ({words.number(len(values), 'trial')})",
                customdata=counts[key].tolist(),
                marker={
                    "color": LIGHT[key],
                    "pattern": {"shape": "" if key == "hit" else "/"},
                },
                opacity=0.85,
                hovertemplate="R around %{x:.2f}: %{customdata} trials, "
                "%{y:.1f} %<extra>" + labels[key] + "</extra>",
            )
        )
    figure = _figure(
        traces,
        x={"title": {"text": "reward R"}},
        y={"title": {"text": "share of its group"}, "ticksuffix": " %"},
        barmode="overlay",
        **_with_lines(
            _line(
                threshold,
                f"R = {threshold:g}",
                LIGHT["ink"],
                vertical=True,
                position="end",
            )
        ),
    )
    return Chart(
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


# --- Mirror: Fig. 5 ----------------------------------------------------------


def success_by_scheme(contest: Contest) -> Chart:
    """Fig. 5a: success by scheme and number of samples, with intervals."""
    names = words.ordered(contest.rates)
    rows = [
        [words.scheme(name, full=True)]
        + [words.rate(contest.rates[name][n]) for n in contest.samples]
        for name in names
    ]
    several = len(contest.samples) > 1
    traces: list[Any] = []
    # Along the axis: a place for each number of samples, or for each scheme.
    width = 0.86 / len(names)
    for k, name in enumerate(names):
        found = [contest.rates[name][n] for n in contest.samples]
        shift = (k - 0.5 * (len(names) - 1)) * width
        place = [i + shift for i in range(len(found))] if several else [k]
        mean = [100 * r.mean for r in found]
        along, across = ("x", "y") if several else ("y", "x")
        error = _whiskers(found) | {"color": LIGHT["ink"], "thickness": 1.4}
        # The bar is pale, so that the whisker is seen on it in any theme.
        traces.append(
            go.Bar(
                {along: place, across: mean},
                orientation="v" if several else "h",
                width=0.9 * width if several else 0.62,
                marker={"color": scheme_color(name)},
                opacity=0.4,
                hoverinfo="skip",
                showlegend=False,
                legendgroup=name,
            )
        )
        traces.append(
            go.Scatter(
                {along: place, across: mean, f"error_{across}": error},
                name=text(words.scheme(name)),
                mode="markers",
                marker=_marker(name),
                customdata=[[100 * r.low, 100 * r.high] for r in found],
                hovertemplate=f"%{{{across}:.0f}} % (%{{customdata[0]:.0f}} "
                "to %{customdata[1]:.0f})<extra>"
                + text(words.scheme(name))
                + "</extra>",
                showlegend=several,
                legendgroup=name,
            )
        )
    if several:
        figure = _figure(
            traces,
            x={
                "title": {"text": "new demonstrations"},
                "tickvals": list(range(len(contest.samples))),
                "ticktext": [str(n) for n in contest.samples],
                "showgrid": False,
            },
            y=_percent_axis("success at unseen positions"),
        )
    else:
        n = contest.samples[0]
        figure = _figure(
            traces,
            x=_percent_axis("success at unseen positions"),
            y={
                "tickvals": list(range(len(names))),
                "ticktext": [
                    f"{text(words.scheme(name))}<br><b>"
                    f"{words.percent(contest.rates[name][n].mean)}</b>"
                    for name in names
                ],
                "range": [len(names) - 0.5, -0.5],
                "showgrid": False,
            },
        )
    counts = words.joined([str(n) for n in contest.samples])
    return Chart(
        "schemes",
        f"Success in the new view ({words.scenario(contest.scenario)})",
        f"Fig. 5a. The drum is seen otherwise than it was taught; {counts} new "
        "demonstrations may be used. Share of "
        f"{words.number(contest.trials, 'trial')} per scheme"
        f"{' and number of demonstrations' if several else ''} in which the "
        f"drum was heard; whiskers: {contest.error_bars}.",
        "Highest with "
        + "; with ".join(
            f"{words.number(n, 'demonstration')}: "
            + words.joined([words.in_text(k) for k in verdict.leaders])
            for n in contest.samples
            for verdict in [words.judge(contest, n)]
        )
        + ".",
        figure,
        ("scheme", *(f"{n} demonstrations" for n in contest.samples)),
        rows,
        420 if several else 60 + 52 * len(names),
        wide=several,
    )


def rewards_by_scheme(contest: Contest) -> Chart | None:
    """Every trial's reward, at the greatest number of samples."""
    n = contest.samples[-1]
    names = [
        name for name in words.ordered(contest.rewards)
        if contest.rewards[name][n]
    ]  # fmt: skip
    if not names:
        return None
    traces = []
    rows = []
    for row, name in enumerate(names):
        values = contest.rewards[name][n]
        # Spread by rank rather than by chance: the same page each time.
        spread = [0.28 * math.sin(2.4 * i) for i in range(len(values))]
        traces.append(
            go.Scatter(
                x=values,
                y=[row + s for s in spread],
                name=text(words.scheme(name)),
                mode="markers",
                marker=_marker(name),
                opacity=0.8,
                showlegend=False,
                hovertemplate="R = %{x:.2f}<extra>"
                + text(words.scheme(name))
                + "</extra>",
            )
        )
        heard = sum(v > THRESHOLD for v in values)
        rows.append(
            [
                words.scheme(name, full=True),
                len(values),
                heard,
                f"{np.median(values):.2f}",
                f"{min(values):.2f}",
                f"{max(values):.2f}",
            ]
        )
    everything = [v for name in names for v in contest.rewards[name][n]]
    low, high = min(everything), max(everything)
    figure = _figure(
        traces,
        x={
            "title": {"text": "reward R of each trial"},
            "range": [min(0.0, low) - 0.03, max(high, THRESHOLD) + 0.05],
        },
        y={
            "tickvals": list(range(len(names))),
            "ticktext": [text(words.scheme(name)) for name in names],
            "range": [len(names) - 0.1, -0.5],
            "showgrid": False,
        },
        **_with_lines(
            _line(
                THRESHOLD,
                f"R = {THRESHOLD:g}",
                LIGHT["muted"],
                vertical=True,
                position="start",
            )
        ),
    )
    return Chart(
        "rewards",
        "The sound behind the rates",
        f"Every trial after {words.number(n, 'demonstration')}, by its reward: "
        "right of the line the drum was heard. Near zero the hand missed; a "
        "high reward is a clean stroke.",
        f"Rewards of single trials by scheme, from {low:.2f} to {high:.2f}.",
        figure,
        ("scheme", "trials", "heard", "median R", "least R", "greatest R"),
        rows,
        80 + 50 * len(names),
    )


def significance(contest: Contest, samples: int) -> Chart:
    """Fig. 5b: pairwise differences of the rates with their significance."""
    names = words.ordered(contest.rates)
    labels = [_wrapped(words.scheme(name), 10) for name in names]
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
            found = contest.compare(a, b, samples)
            values[-1].append(round(100 * found.difference, 1))
            shown[-1].append(
                _signed(100 * found.difference) + ("*" if found.clear else "")
            )
            effect = (
                ""
                if found.effect_size is None
                else f"<br>effect size (Cohen's h) {found.effect_size:+.2f}"
            )
            hovers[-1].append(
                f"{text(words.scheme(a))} − {text(words.scheme(b))}: "
                f"{words.points(found.difference)}"
                f"<br>corrected {words.p_value(found.p)}{effect}"
            )
            if i < j:
                rows.append(
                    [
                        f"{words.scheme(a)} − {words.scheme(b)}",
                        words.points(found.difference),
                        words.p_value(found.p_single),
                        words.p_value(found.p),
                        "–"
                        if found.effect_size is None
                        else f"{found.effect_size:+.2f}",
                        "yes" if found.clear else "no",
                    ]
                )
    figure = _figure(
        [
            go.Heatmap(
                z=values,
                x=labels,
                y=labels,
                text=shown,
                customdata=hovers,
                texttemplate="%{text}",
                textfont={"size": 11, "color": LIGHT["ink"]},
                hovertemplate="%{customdata}<extra></extra>",
                hoverongaps=False,
                zmin=-100,
                zmax=100,
                colorscale=_diverging(),
                showscale=False,
                xgap=2,
                ygap=2,
            )
        ],
        x={"side": "bottom", "tickangle": -90, "showgrid": False},
        y={"autorange": "reversed", "showgrid": False},
    )
    clear = [row for row in rows if row[-1] == "yes"]
    return Chart(
        f"significance-{samples}",
        f"With {words.number(samples, 'demonstration')}",
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


def _signed(value: float) -> str:
    """As "+12", "−5", "0"."""
    size = round(value)
    return f"{'+' if size > 0 else '−' if size < 0 else ''}{abs(size)}"


def _diverging() -> list[list[Any]]:
    """From behind to ahead; ink is readable on all of it."""
    return [
        [0, LIGHT["pale_minus"]],
        [0.5, LIGHT["surface"]],
        [1, LIGHT["pale_plus"]],
    ]


def transfer_map(grid: dict[str, Any]) -> list[Chart]:
    """The map h: a grid of what is seen now, and where h puts it."""
    n_rows, n_columns = grid["shape"]
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
        points = np.array(grid[part], dtype=float)
        net = points.reshape(n_rows, n_columns, 2)
        taught = np.array(grid[f"taught_{part}"], dtype=float).reshape(-1, 2)
        names = grid[f"{part}_names"]
        # As in images.
        downwards = names[1].startswith("y_img")
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
                        "color": LIGHT[key],
                        "width": 1.4,
                        "dash": "solid" if key == "plus" else "dot",
                    },
                    hoverinfo="skip",
                    showlegend=False,
                )
            )
        corners = [net[0, 0], net[0, -1], net[-1, -1], net[-1, 0]]
        traces.append(
            go.Scatter(
                x=[float(c[0]) for c in corners],
                y=[float(c[1]) for c in corners],
                mode="markers+text",
                text=["A", "B", "C", "D"],
                textposition=_outward(corners, downwards),
                textfont={"size": 14, "color": LIGHT["ink"]},
                marker={"size": 7, "color": LIGHT["ink"]},
                cliponaxis=False,
                showlegend=False,
                hovertemplate="corner %{text}: %{x:.2f}, %{y:.2f}"
                "<extra></extra>",
            )
        )
        traces.append(
            go.Scatter(
                x=taught[:, 0].tolist(),
                y=taught[:, 1].tolist(),
                mode="markers+text",
                text=[str(i + 1) for i in range(len(taught))],
                textposition="middle center",
                textfont={"size": 11, "color": LIGHT["surface"]},
                marker={"size": 19, "color": LIGHT["paper"]},
                showlegend=False,
                hovertemplate="demonstration %{text}: %{x:.2f}, %{y:.2f}"
                "<extra></extra>",
            )
        )
        figure = _figure(
            traces,
            x={"title": {"text": text(names[0])}, "showgrid": False},
            y={"title": {"text": text(names[1])}, "showgrid": False},
        )
        if downwards:
            figure.update_yaxes(autorange="reversed")
        charts.append(
            Chart(
                f"map-{part}",
                title,
                caption,
                f"A grid of {n_rows} by {n_columns} points over {names[0]} and "
                f"{names[1]}; its corners are at "
                + words.joined([f"({c[0]:.2f}, {c[1]:.2f})" for c in corners])
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


# --- Other views, other conditions -------------------------------------------


def scenario_dots(contests: dict[str, Contest]) -> Chart:
    """Success by changed view, a symbol for each scheme."""
    names = words.ordered(
        {name for contest in contests.values() for name in contest.rates}
    )
    views = list(contests)
    traces = []
    for k, name in enumerate(names):
        shift = 0.11 * (k - 0.5 * (len(names) - 1))
        here = [
            (i, view, contests[view].rates[name][contests[view].samples[-1]])
            for i, view in enumerate(views)
            if name in contests[view].rates
        ]
        traces.append(
            go.Scatter(
                x=[100 * r.mean for _, _, r in here],
                y=[i + shift for i, _, _ in here],
                error_x=_whiskers([r for _, _, r in here]) | {"width": 0},
                name=text(words.scheme(name)),
                mode="markers",
                marker=_marker(name),
                customdata=[text(words.scenario(v)) for _, v, _ in here],
                hovertemplate="%{customdata}: %{x:.0f} %<extra>"
                + text(words.scheme(name))
                + "</extra>",
            )
        )
    figure = _figure(
        traces,
        x=_percent_axis("success at unseen positions"),
        y={
            "tickvals": list(range(len(views))),
            "ticktext": [
                text(words.scenario(v)).replace(" and ", " and<br>")
                for v in views
            ],
            "range": [len(views) - 0.5, -0.5],
            "showgrid": False,
        },
        shapes=[
            {
                "type": "line",
                "xref": "paper",
                "x0": 0,
                "x1": 1,
                "y0": i + 0.5,
                "y1": i + 0.5,
                "line": {"color": LIGHT["grid"], "width": 1},
            }
            for i in range(len(views) - 1)
        ],
    )
    return Chart(
        "scenarios",
        "Seven ways of seeing otherwise"
        if len(views) == 7
        else "Other ways of seeing otherwise",
        "Success with the most demonstrations of each view; lines are 95 % "
        "confidence. Each scheme keeps its colour and symbol.",
        f"Success of {len(names)} schemes in {len(views)} changed views.",
        figure,
        ("view", *(words.scheme(name) for name in names)),
        [
            [words.scenario(view)]
            + [
                words.rate(
                    contests[view].rates[name][contests[view].samples[-1]]
                )
                if name in contests[view].rates
                else "–"
                for name in names
            ]
            for view in views
        ],
        110 + 82 * len(views),
        wide=True,
    )


def condition_charts(conditions: list[dict[str, Any]]) -> list[Chart]:
    """Success of the schemes over what was varied, a chart for each factor.

    Over the factor's values where each was run with one number of samples, or
    with the commonest of them; and over the number of samples for each value
    that was run with several.
    """
    charts: list[Chart] = []
    factors = list(dict.fromkeys(row["factor"] for row in conditions))
    for factor in factors:
        rows = [row for row in conditions if row["factor"] == factor]
        values = list(dict.fromkeys(row["value"] for row in rows))
        counts = {
            value: sorted({r["samples"] for r in rows if r["value"] == value})
            for value in values
        }
        if len(values) > 1:
            chosen = [
                row
                for row in rows
                if row["samples"] == _common(counts, row["value"])
            ]
            samples = sorted({row["samples"] for row in chosen})
            charts.append(
                _condition_chart(
                    f"condition-{len(charts)}",
                    factor.capitalize(),
                    f"Success over “{factor}”, with "
                    + (
                        words.number(samples[0], "demonstration")
                        if len(samples) == 1
                        else "the numbers of demonstrations in the table"
                    )
                    + "; whiskers are 95 % confidence.",
                    factor,
                    [(row["value"], row) for row in chosen],
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
                            (row["samples"], row)
                            for row in sorted(rows, key=lambda r: r["samples"])
                            if row["value"] == value
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
    points: list[tuple[Any, dict[str, Any]]],
) -> Chart:
    names = words.ordered({row["scheme"] for _, row in points})
    ticks = list(dict.fromkeys(text(place) for place, _ in points))
    traces = []
    for name in names:
        own = [(text(x), row) for x, row in points if row["scheme"] == name]
        found = [Rate.of(row["success_rate"]) for _, row in own]
        traces.append(
            go.Scatter(
                x=[ticks.index(x) for x, _ in own],
                y=[100 * r.mean for r in found],
                error_y=_whiskers(found),
                name=text(words.scheme(name)),
                mode="lines+markers",
                line={"color": scheme_color(name), "width": 2},
                marker=_marker(name),
                hovertemplate="%{y:.0f} %<extra>"
                + text(words.scheme(name))
                + "</extra>",
            )
        )
    figure = _figure(
        traces,
        x={
            "title": {"text": text(axis)},
            "tickvals": list(range(len(ticks))),
            "ticktext": ticks,
            "range": [-0.25, len(ticks) - 0.75],
        },
        y=_percent_axis(),
    )
    return Chart(
        key,
        title,
        caption,
        f"Success of {words.joined([words.in_text(n) for n in names])} over "
        f"{axis}: {words.joined(ticks)}.",
        figure,
        (axis, "scheme", "demonstrations", "success (95 % confidence)"),
        [
            [
                place,
                words.scheme(row["scheme"]),
                row["samples"],
                words.rate(Rate.of(row["success_rate"])),
            ]
            for place, row in points
        ],
        330,
    )


def advantage(
    conditions: list[dict[str, Any]], ours: str, rival: str
) -> Chart | None:
    """By how much one scheme beats another, over conditions and samples."""
    means = {
        (row["factor"], row["value"], row["samples"], row["scheme"]): row[
            "success_rate"
        ]["mean"]
        for row in conditions
    }
    places = list(dict.fromkeys((r["factor"], r["value"]) for r in conditions))
    samples = sorted({row["samples"] for row in conditions})
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
                    words.percent(pair[0]),
                    words.percent(pair[1]),
                    words.points(difference),
                ]
            )
    if not rows:
        return None
    figure = _figure(
        [
            go.Heatmap(
                z=z,
                x=[str(n) for n in samples],
                y=[f"{text(factor)}:<br>{text(v)}" for factor, v in places],
                text=[
                    ["" if v is None else _signed(v) for v in row] for row in z
                ],
                texttemplate="%{text}",
                textfont={"color": LIGHT["ink"]},
                hovertemplate="%{y}, %{x} demonstrations: %{z:+.0f} points"
                "<extra></extra>",
                hoverongaps=False,
                zmin=-100,
                zmax=100,
                colorscale=_diverging(),
                showscale=False,
                xgap=2,
                ygap=2,
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
    return Chart(
        f"advantage-{ours.replace('_', '-')}",
        f"{words.scheme(ours, full=True)}, minus relearning"
        if rival == "relearn"
        else f"{words.scheme(ours, full=True)}, minus {words.scheme(rival)}",
        f"Percentage points by which {words.in_text(ours)} succeeded more "
        f"often (+, blue) or less often (−, orange) than "
        f"{words.in_text(rival)}.",
        f"Ahead in {ahead} of {len(rows)} cells.",
        figure,
        (
            "condition",
            "demonstrations",
            words.scheme(ours),
            words.scheme(rival),
            "difference",
        ),
        rows,
        110 + 44 * len(places),
    )


# --- Toy: Fig. 2 -------------------------------------------------------------


def toy_errors(
    figures: dict[str, Any],
    labels: dict[str, dict[str, str]],
    *,
    key: str,
    square: str,
    paper: float | None,
) -> Chart:
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
        for name, row in figures[group].items()
    ]
    traces = []
    for i, (group, label, row) in enumerate(methods):
        color = LIGHT["random" if group == "transfer" else "active"]
        seeds = [
            v for v in row["per_seed"].get("other_mse_mean", []) if v > 0.0
        ]
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
                hovertemplate="%{x:.3g}<extra>" + text(label) + ", a seed"
                "</extra>",
            )
        )
    for kind, title, color, symbol in (
        ("transfer", "transfer", "random", "circle"),
        ("baselines", "without transfer", "active", "square"),
    ):
        own = [
            (i, row["other_mse_mean"], label)
            for i, (group, label, row) in enumerate(methods)
            if group == kind and row["other_mse_mean"] > 0.0
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
                    "color": LIGHT[color],
                    "line": {"color": LIGHT["ink"], "width": 1.5},
                },
                customdata=[text(label) for _, _, label in own],
                hovertemplate="%{customdata}: median %{x:.3g}<extra></extra>",
            )
        )
    lines = (
        [
            _line(
                math.log10(paper),
                f"paper: {paper:g}",
                LIGHT["paper"],
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
    figure = _figure(
        traces,
        x={
            "title": {"text": "mean squared error"},
            "type": "log",
            "dtick": 1,
            "tickformat": "~g",
        },
        y={
            "tickvals": list(range(len(methods))),
            "ticktext": [_wrapped(label) for _, label, _ in methods],
            "range": [len(methods) - 0.1, -0.5],
            "tickfont": {"size": 12},
        },
        **_with_lines(*lines),
    )
    _, best, least = min(methods, key=lambda m: m[2]["other_mse_mean"])
    return Chart(
        key,
        f"On the square {square}",
        "Fig. 2. Errors on the 100 points whose values were not given, after "
        "five that were; a pale dot is the mean of one seed, the bordered "
        "symbol the median over the seeds. Less is better; the axis is "
        "logarithmic.",
        f"Lowest: {best} with {least['other_mse_mean']:.3g}.",
        figure,
        ("method", "on those", "on the others", "± over subsets", "95 %"),
        [
            [
                label,
                f"{row['train_mse_mean']:.3g}",
                f"{row['other_mse_mean']:.3g}",
                f"{row['other_mse_std']:.3g}",
                f"{row['other_mse_p95']:.3g}",
            ]
            for _, label, row in methods
        ],
        90 + 38 * len(methods),
    )


def _wrapped(label: str, width: int = 18) -> str:
    """In lines of at most `width` letters where words allow it."""
    return "<br>".join(text(line) for line in textwrap.wrap(label, width))
