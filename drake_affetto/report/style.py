"""The style of the page's charts: colors, axes, markers.

All colors are of `LIGHT`; the page exchanges them for those of the same name
in `DARK` where the reader prefers that, and back, without drawing data again.
"""

from collections.abc import Iterable, Sequence
import dataclasses
import html
import textwrap
from typing import Any

import plotly.graph_objects as go

from drake_affetto.experiments.results import (
    SuccessRate,
)
from drake_affetto.report import wording

# By name; every value occurs once, so that either can be told from the other.
# The schemes' are chosen to differ for color-blind eyes too, and each has a
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
    "transfer_affine": "#4a36e8",
    "gaussian_process": "#0a8f6a",
    "affine_regression": "#4d5a1e",
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
    "transfer_affine": "#7a52f2",
    "gaussian_process": "#2fbf94",
    "affine_regression": "#b4c46a",
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
    "transfer_affine": "circle-open-dot",
    "gaussian_process": "cross",
    "affine_regression": "x",
}

_FONT = (
    'system-ui, -apple-system, "Segoe UI", Roboto, "Helvetica Neue", Arial, '
    '"Liberation Sans", sans-serif'
)


@dataclasses.dataclass(frozen=True)
class Chart:
    """A figure with what makes it readable without seeing it.

    Attributes:
        key: Name on the page, of letters, digits and hyphens.
        title: Short title.
        caption: What it shows and how to read it, in plain words.
        summary: One sentence for readers who cannot see it.
        figure: Figure of plotly.
        header: Heads of the columns of its table.
        rows: Rows of its table.
        height: Height, CSS px.
        wide: Whether it takes the page's whole width.
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


def escaped(value: Any) -> str:
    """For plotly, which reads a kind of HTML in its texts."""
    return html.escape(str(value), quote=False)


def scheme_color(name: str) -> str:
    """The one color of a scheme."""
    return LIGHT[name if name in SYMBOLS else "other_scheme"]


def scheme_marker(name: str) -> dict[str, Any]:
    """A scheme's color and symbol."""
    return {
        "symbol": SYMBOLS.get(name, "star"),
        "size": 9,
        "color": scheme_color(name),
        "line": {"width": 1.5, "color": scheme_color(name)},
    }


def scheme_points(name: str, hover: str, **how: Any) -> go.Scatter:
    """A scheme's points, with its color, symbol and name.

    Args:
        name: Scheme.
        hover: What is shown at a point that is touched, as plotly's template.
        how: Further arguments of plotly's scatter.
    """
    label = escaped(wording.scheme(name))
    look = {"mode": "markers", "marker": scheme_marker(name)}
    return go.Scatter(
        name=label,
        hovertemplate=f"{hover}<extra>{label}</extra>",
        **(look | how),
    )


def whiskers(rates: Sequence[SuccessRate]) -> dict[str, Any]:
    """Confidence intervals of rates, for points in percent."""
    return {
        "type": "data",
        "symmetric": False,
        "array": [100 * (r.high - r.mean) for r in rates],
        "arrayminus": [100 * (r.mean - r.low) for r in rates],
        "thickness": 1.2,
        "width": 3,
    }


def make_figure(
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


def percent_axis(title: str = "success", **more: Any) -> dict[str, Any]:
    return {
        "title": {"text": title},
        "range": [-3, 105],
        "tickvals": [0, 25, 50, 75, 100],
        "ticktext": ["0 %", "25 %", "50 %", "75 %", "100 %"],
        **more,
    }


def places_axis(labels: Sequence[str], after: float = 0.5) -> dict[str, Any]:
    """An axis with a place for each label, 0, 1, ... from the top down.

    Args:
        labels: Labels of the places.
        after: Room after the last place.
    """
    return {
        "tickvals": list(range(len(labels))),
        "ticktext": list(labels),
        "range": [len(labels) - 1 + after, -0.5],
        "showgrid": False,
    }


def reference_line(
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


def threshold_line(
    threshold: float,
    *,
    vertical: bool,
    color: str = LIGHT["muted"],
    position: str = "start",
) -> dict[str, Any]:
    """Parts of a figure that show the reward above which a trial succeeds."""
    label = f"R = {threshold:g}"
    return with_lines(
        reference_line(
            threshold, label, color, vertical=vertical, position=position
        )
    )


def with_lines(*lines: dict[str, dict[str, Any]]) -> dict[str, Any]:
    return {
        "shapes": [line["shape"] for line in lines],
        "annotations": [line["annotation"] for line in lines],
    }


def wrapped(label: str, width: int = 18) -> str:
    """In lines of at most `width` letters where words allow it."""
    return "<br>".join(escaped(line) for line in textwrap.wrap(label, width))


def signed(value: float) -> str:
    """As "+12", "−5", "0"."""
    size = round(value)
    return f"{'+' if size > 0 else '−' if size < 0 else ''}{abs(size)}"


def diverging_scale() -> list[list[Any]]:
    """From behind to ahead; ink is readable on all of it."""
    return [
        [0, LIGHT["pale_minus"]],
        [0.5, LIGHT["surface"]],
        [1, LIGHT["pale_plus"]],
    ]


def difference_map(
    z: Sequence[Sequence[float | None]],
    x: Sequence[str],
    y: Sequence[str],
    text: Sequence[Sequence[str]],
    **more: Any,
) -> go.Heatmap:
    """Differences of success rates as a map of colors.

    Args:
        z: Differences, percentage points; None for no cell.
        x: Names of the columns.
        y: Names of the rows.
        text: Text in each cell.
        more: Further arguments of plotly's heat map.
    """
    return go.Heatmap(
        z=z,
        x=x,
        y=y,
        text=text,
        texttemplate="%{text}",
        hoverongaps=False,
        zmin=-100,
        zmax=100,
        colorscale=diverging_scale(),
        showscale=False,
        xgap=2,
        ygap=2,
        **more,
    )
