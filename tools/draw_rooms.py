"""Draws the rooms of the package and which imports which, from the code.

Writes `docs/rooms.dot` (Graphviz source, which a test compares with the code)
and `docs/rooms.svg`:

    python tools/draw_rooms.py [--png FILE]

An arrow leads from a room to a room that it imports, also inside functions.
An arrow that follows from others (a imports b, b imports c, a imports c) is
left out. Nothing of the package itself is imported.
"""

import argparse
import ast
import html
from pathlib import Path
import textwrap

ROOT = Path(__file__).resolve().parents[1]
PACKAGE = ROOT / "drake_affetto"
DOCS = ROOT / "docs"

# A module at the top of the package that only re-exports a room's names.
_ALIASES = {"scenario": "station"}

# Groups of rooms, in pale colors that print.
_COLORS = {
    "#e6e6e6": ("common", "geometry"),
    "#cfe3f7": ("scene", "perception", "calibration"),
    "#dcd3f2": ("skill", "motion"),
    "#fbeeb8": ("control", "pneumatics", "sensing"),
    "#d3efd0": ("sound", "faults", "teaching"),
    "#f7d4e3": ("station",),
    "#fbdcc4": ("robot", "runner", "experiments", "tuning", "identification"),
    "#cdeeea": ("report", "cli"),
}

_HEAD = """digraph rooms {
rankdir=TB
graph [fontname="Helvetica", ranksep=0.45, nodesep=0.25]
node [fontname="Helvetica", fontsize=12, shape=box, style="filled,rounded"]
edge [color="#444444", arrowsize=0.7]
"""


def rooms() -> dict[str, list[Path]]:
    """The modules of each folder of the package, by the folder's name."""
    return {
        folder.name: sorted(folder.rglob("*.py"))
        for folder in sorted(PACKAGE.iterdir())
        if (folder / "__init__.py").is_file()
    }


def imported_rooms(path: Path) -> set[str]:
    """The rooms that a module imports, anywhere in its text."""
    names = set()
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            names |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.module:
            names |= {f"{node.module}.{alias.name}" for alias in node.names}
    parts = [name.split(".") for name in names]
    found = {
        part[1] for part in parts if part[0] == PACKAGE.name and len(part) > 1
    }
    return {_ALIASES.get(name, name) for name in found}


def import_graph() -> dict[str, set[str]]:
    """For each room the other rooms that it imports."""
    modules = rooms()
    return {
        room: set.union(*map(imported_rooms, paths)) & set(modules) - {room}
        for room, paths in modules.items()
    }


def reduced(graph: dict[str, set[str]]) -> dict[str, set[str]]:
    """The graph without arrows that follow from others; it has no circle."""

    def reach(room: str) -> set[str]:
        return set().union(
            graph[room], *(reach(other) for other in graph[room])
        )

    return {
        room: direct - set().union(*map(reach, direct))
        for room, direct in graph.items()
    }


def graphviz_source() -> str:
    """The picture in Graphviz's language."""
    modules = rooms()
    colors = {room: color for color, group in _COLORS.items() for room in group}
    lines = [_HEAD]
    for room, paths in modules.items():
        face = ast.parse((PACKAGE / room / "__init__.py").read_text("utf-8"))
        text = (ast.get_docstring(face) or "").split("\n\n")[0]
        text = text.replace("`", "").rstrip(".")
        summary = "<BR/>".join(map(html.escape, textwrap.wrap(text, 34)))
        count = sum(len(path.read_text("utf-8").splitlines()) for path in paths)
        # Rounded, so that the picture does not age with every change.
        size = f"{max(1, round(count / 100)) * 100:,} lines"
        lines.append(
            f'{room} [fillcolor="{colors.get(room, "#ffffff")}", label=<'
            f"<B>{room}</B><BR/>"
            f'<FONT POINT-SIZE="9">{summary}<BR/>{size}</FONT>>]'
        )
    for room, others in reduced(import_graph()).items():
        lines += [f"{room} -> {other}" for other in sorted(others)]
    return "\n".join([*lines, "}", ""])


def main() -> None:
    """Writes the source and the picture."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--png", metavar="FILE", help="draw this image too")
    args = parser.parse_args()
    import pygraphviz

    source = graphviz_source()
    graph = pygraphviz.AGraph(string=source)
    graph.layout(prog="dot")
    (DOCS / "rooms.dot").write_text(source, encoding="utf-8")
    (DOCS / "rooms.svg").write_bytes(graph.draw(format="svg"))
    if args.png:
        Path(args.png).write_bytes(graph.draw(format="png"))


if __name__ == "__main__":
    main()
