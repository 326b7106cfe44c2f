"""Draws a Diagram: systems as tables of ports, connections as arrows.

Drake describes a Diagram in Graphviz's language; here the description is made
readable (no ports that nothing is connected to, the Diagram's own ports named
where they are, a color for each stage) and rendered by the Graphviz library
that pygraphviz brings along, so that no `dot` program is needed.
"""

from __future__ import annotations

import html
from pathlib import Path
import re
from typing import TYPE_CHECKING

from drake_affetto.common.errors import InputError, require
from drake_affetto.common.output import (
    write_bytes_atomic,
    write_text_atomic,
)

if TYPE_CHECKING:
    from pydrake.systems.framework import System

SOURCE_SUFFIXES = (".dot", ".gv")
IMAGE_SUFFIXES = (".svg", ".png", ".pdf")

# The stages of the signal's way round, in pale colors that print.
STAGE_COLORS = {
    "scene": "#e6e6e6",
    "perception": "#cfe3f7",
    "skill": "#dcd3f2",
    "motion": "#f7d4e3",
    "control": "#fbdcc4",
    "pneumatics": "#fbeeb8",
    "sensing": "#fbeeb8",
    "sound": "#d3efd0",
    "teaching": "#cdeeea",
}

_STYLE = """rankdir=LR
graph [fontname="Helvetica", fontsize=12, ranksep=0.6, nodesep=0.3]
node [fontname="Helvetica", fontsize=11]
edge [color="#444444", arrowsize=0.7]"""

_NODE = re.compile(
    r"^(?P<id>s\d+) \[shape=none, border=0, label=<\n"
    r"(?P<table><TABLE.*?</TABLE>)\n>\];$",
    re.DOTALL | re.MULTILINE,
)
_HEADER = re.compile(r"<TR><TD [^>]*>\s*(?P<text><B>.*?)</TD></TR>", re.DOTALL)
_CLASS = re.compile(r"<B>(?:\w+\.)*(\w+)")
_NAME = re.compile(r"^name=(.*)$", re.MULTILINE)
_PORT = re.compile(r'<TD PORT="(?P<id>[uy]\d+)"[^>]*>(?P<text>.*?)</TD>')
_EDGE = re.compile(r"^(\w+):(\w+):e -> (\w+):(\w+):w.*\n", re.MULTILINE)
_OWN_PORT = re.compile(r'<TR><TD BORDER="1" PORT="(\d+)">(.*?)</TD></TR>')


def graphviz_source(
    system: System, *, max_depth: int = 1, all_ports: bool = False
) -> str:
    """The Graphviz description of `system`, made readable.

    Args:
        max_depth: how deep nested Diagrams are opened; at 0 the whole is one
            block.
        all_ports: whether to keep the ports that nothing is connected to.

    Raises:
        InputError: for a negative `max_depth`.
    """
    require(max_depth >= 0, "max_depth", max_depth, "0 or more")
    source = system.GetGraphvizString(max_depth)
    connected = set()
    for start, output, end, input_ in _EDGE.findall(source):
        connected |= {(start, output), (end, input_)}
    source, exported = _take_out_own_ports(source)
    colors = _stage_colors(system)
    # A block that stands alone has no connections and is its ports.
    keep_all = all_ports or not connected

    def redraw(match: re.Match[str]) -> str:
        node, table = match["id"], match["table"]
        header = _HEADER.search(table)
        if header is None:
            return match[0]
        name = _NAME.search(header["text"])
        color = colors.get(html.unescape(name[1]) if name else "", "white")
        ports = [
            (port["id"], port["text"] + exported.get((node, port["id"]), ""))
            for port in _PORT.finditer(table)
            if keep_all or (node, port["id"]) in connected
        ]
        inputs = [port for port in ports if port[0].startswith("u")]
        outputs = [port for port in ports if port[0].startswith("y")]
        return (
            f"{node} [shape=none, border=0, label=<\n"
            '<TABLE BORDER="0" CELLSPACING="0" CELLPADDING="4">\n'
            f'<TR><TD BORDER="1" COLSPAN="2" BGCOLOR="{color}">\n'
            f"{header['text']}</TD></TR>\n{_rows(inputs, outputs)}"
            "</TABLE>\n>];"
        )

    source = _NODE.sub(redraw, source)
    source = _CLASS.sub(r"<B>\1", source)
    return source.replace("rankdir=LR", _STYLE, 1)


def _take_out_own_ports(source: str) -> tuple[str, dict[tuple[str, str], str]]:
    """Removes the outermost Diagram's own ports, and their arrows.

    They would draw as one long list, with an arrow across the whole picture
    for each.

    Returns:
        The source without them, and the words that say so at the port, by
        node and port.
    """
    outermost = re.match(r"digraph _(\d+) ", source)
    assert outermost is not None
    words: dict[tuple[str, str], str] = {}
    for side in ("in", "out"):
        own = f"s{outermost[1]}{side}"
        block = re.search(
            rf"^subgraph cluster{own} {{.*?^}}\n",
            source,
            re.DOTALL | re.MULTILINE,
        )
        if block is None:
            continue
        names = dict(_OWN_PORT.findall(block[0]))
        source = source.replace(block[0], "", 1)
        for edge in list(_EDGE.finditer(source)):
            start, output, end, input_ = edge.groups()
            if start == own:
                port, name = (end, input_), f"\N{BULLET} {names[output]}"
                color = "#1565c0"
            elif end == own:
                port, name = (start, output), f"{names[input_]} \N{BULLET}"
                color = "#2e7d32"
            else:
                continue
            text = f'<BR/><FONT COLOR="{color}">{name}</FONT>'
            words[port] = words.get(port, "") + text
            source = source.replace(edge[0], "", 1)
    return source, words


def write_diagram(
    system: System,
    path: str | Path,
    max_depth: int = 1,
    *,
    all_ports: bool = False,
) -> Path:
    """Draws `system` into the file `path`, as its suffix says.

    Args:
        path: .svg, .png or .pdf for a picture; .dot or .gv for its source.
        max_depth: how deep nested Diagrams are opened.
        all_ports: whether to keep the ports that nothing is connected to.

    Returns:
        The file written.

    Raises:
        InputError: for another suffix, a negative depth, or a file that cannot
            be written.
    """
    path = check_suffix(path)
    source = graphviz_source(system, max_depth=max_depth, all_ports=all_ports)
    if path.suffix.lower() in SOURCE_SUFFIXES:
        write_text_atomic(path, source)
        return path
    import pygraphviz

    graph = pygraphviz.AGraph(string=source)
    graph.layout(prog="dot")
    write_bytes_atomic(path, graph.draw(format=path.suffix.lower()[1:]))
    return path


def check_suffix(path: str | Path) -> Path:
    path = Path(path).expanduser()
    known = IMAGE_SUFFIXES + SOURCE_SUFFIXES
    if path.suffix.lower() not in known:
        raise InputError(f"{path} should end in one of {', '.join(known)}")
    return path


def _stage_colors(system: System) -> dict[str, str]:
    """The color of each subsystem that belongs to a stage, by its name."""
    colors = {}
    for subsystem in getattr(system, "GetSystems", list)():
        package, _, rest = type(subsystem).__module__.partition(".")
        stage = rest.partition(".")[0]
        if package == "drake_affetto" and stage in STAGE_COLORS:
            colors[subsystem.get_name()] = STAGE_COLORS[stage]
        colors |= _stage_colors(subsystem)
    return colors


def _rows(inputs: list[tuple[str, str]], outputs: list[tuple[str, str]]) -> str:
    """The table's rows: inputs at the left, outputs at the right.

    The shorter side's last port takes the rows that are left over.
    """
    count = max(len(inputs), len(outputs))

    def cell(ports: list[tuple[str, str]], row: int) -> str:
        if row < len(ports):
            port, text = ports[row]
            span = count - row if row == len(ports) - 1 else 1
            return f'<TD PORT="{port}" BORDER="1" ROWSPAN="{span}">{text}</TD>'
        if row == 0:
            return f'<TD BORDER="1" ROWSPAN="{count}"> </TD>'
        return ""

    return "".join(
        f"<TR>{cell(inputs, row)}{cell(outputs, row)}</TR>\n"
        for row in range(count)
    )
