"""What sections consist of, for the templates to lay out."""

import base64
from collections.abc import Callable, Sequence
import dataclasses
from pathlib import Path
import struct
from typing import Any

from drake_affetto.report.study_folder import read_media
from drake_affetto.report.style import Chart

TEMPLATES = Path(__file__).parent / "templates"


@dataclasses.dataclass(frozen=True)
class Section:
    """One section of the page.

    Attributes:
        key: Name of the section's template and of its place on the page.
        label: Name in the navigation.
        title: Heading.
        context: Variables of the template.
        charts: All charts of the section, in order.
    """

    key: str
    label: str
    title: str
    context: dict[str, Any]
    charts: tuple[Chart, ...] = ()


@dataclasses.dataclass(frozen=True)
class Cell:
    """One cell of a table.

    Attributes:
        value: Text of the cell.
        label: Head of its column, for pages on which cells are stacked.
        small: Text below it in small letters.
        best: Whether it is marked.
    """

    value: str
    label: str
    small: str = ""
    best: bool = False


@dataclasses.dataclass(frozen=True)
class Table:
    """A table that scrolls by itself; the first cell of a row is its head.

    Attributes:
        header: Heads of the columns.
        rows: Rows of cells.
        caption: What the table shows; visible to all with `show_caption`.
        free: Whether it is as long as it is, rather than scrolling.
        stacked: Whether the cells of a row stack on a narrow page.
        show_caption: Whether the caption is visible.
    """

    header: Sequence[str]
    rows: Sequence[Sequence[Cell]]
    caption: str
    free: bool = False
    stacked: bool = False
    show_caption: bool = False


def make_table(
    header: Sequence[Any],
    rows: Sequence[Sequence[Any]],
    caption: str,
    *,
    best: Callable[[int, int], bool] = lambda row, column: False,
    **how: bool,
) -> Table:
    """A table of values.

    Args:
        header: Heads of the columns.
        rows: Values; what follows the end of a line is small.
        caption: What the table shows.
        best: Whether the cell (row, column) is marked.
        how: Fields of `Table`.
    """
    heads = [str(head) for head in header]
    cells: list[list[Cell]] = []
    for i, row in enumerate(rows):
        cells.append([])
        for j, value in enumerate(row):
            text, _, small = str(value).partition("\n")
            cells[-1].append(Cell(text, heads[j], small, best(i, j)))
    return Table(heads, cells, caption, **how)


@dataclasses.dataclass(frozen=True)
class Picture:
    """A picture inside the page.

    Attributes:
        uri: Data URI.
        width: Width, px.
        height: Height, px.
        alt: Description for readers who do not see it.
    """

    uri: str
    width: int
    height: int
    alt: str


def picture_of_study(path: Path, alt: str) -> Picture:
    """A PNG that a study left.

    Raises:
        InputError: If it is damaged.
    """
    data = read_media(path)
    width, height = struct.unpack(">II", data[16:24])
    return Picture(data_uri(data, "image/png"), width, height, alt)


def picture_of_package(name: str, alt: str) -> Picture:
    """A picture that comes with the package, 960 x 640."""
    data = (TEMPLATES / name).read_bytes()
    return Picture(data_uri(data, "image/jpeg"), 960, 640, alt)


def data_uri(data: bytes, kind: str) -> str:
    """Bytes as an address that holds them."""
    return f"data:{kind};base64,{base64.b64encode(data).decode('ascii')}"


@dataclasses.dataclass(frozen=True)
class Statement:
    """A box with a statement.

    Attributes:
        kind: As `Conclusion.winner`.
        head: Heading.
        text: Sentences.
    """

    kind: str
    head: str
    text: str


def chart_table(chart: Chart) -> Table:
    """The table below a chart."""
    return make_table(chart.header, chart.rows, f"Data of: {chart.title}")


def in_pairs(charts: Sequence[Chart]) -> list[Chart]:
    """Charts in two columns; one that would stand alone is made wide."""
    placed: list[Chart] = []
    waiting = False
    for chart in charts:
        if waiting and chart.wide:
            placed[-1] = dataclasses.replace(placed[-1], wide=True)
        waiting = not (waiting or chart.wide)
        placed.append(chart)
    if waiting:
        placed[-1] = dataclasses.replace(placed[-1], wide=True)
    return placed
