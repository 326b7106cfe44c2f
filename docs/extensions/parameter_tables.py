"""Tables of the numbers in models/, read from the files when the site is built.

    .. parameters:: pneumatics.yaml
       :section: classes

lists the values of a YAML file with what its comments say of each. In the
comments the evidence stands in brackets, as `[fit]` or `[est]`; see EVIDENCE.

    .. joints:: affetto.sdf

lists the joints of an SDF.
"""

from collections.abc import Iterator, Sequence
import dataclasses
from pathlib import Path
import re
from typing import Any
import xml.etree.ElementTree as ElementTree

from docutils import nodes
from docutils.parsers.rst import directives
from sphinx.application import Sphinx
from sphinx.util.docutils import SphinxDirective
import yaml

MODELS = Path(__file__).parents[2] / "models"

# What the marks in the comments mean.
EVIDENCE = {
    "fit": "fitted",
    "step": "measured",
    "logs": "measured",
    "size": "by size",
    "prot": "protocol",
    "est": "estimated",
    "paper": "the paper's",
    "tuned": "tuned",
    "choice": "chosen",
    "aim": "studies of people",
    "time": "studies of people",
}
_MARK = re.compile(r"\[(\w+)\]")


@dataclasses.dataclass(frozen=True)
class Value:
    """A number of a file.

    Attributes:
        path: Keys on the way to it.
        value: As the file has it.
        comment: What is said beside it, or above it.
        marks: What it rests on: marks of its comment, else of what the file's
            first comment says of its name, else of "Without a mark: [est]".
    """

    path: tuple[str, ...]
    value: str
    comment: str = ""
    marks: tuple[str, ...] = ()


def head_comment(text: str) -> str:
    """The comment at the top of a file."""
    lines = []
    for line in text.splitlines():
        if not line.startswith("#"):
            break
        lines.append(line[1:].removeprefix(" "))
    return "\n".join(lines)


def values(text: str) -> list[Value]:
    """All values of a YAML file, with their comments."""
    root = yaml.compose(text, Loader=yaml.SafeLoader)
    assert isinstance(root, yaml.MappingNode)
    head = head_comment(text)
    found = _values(root, (), text.splitlines(), len(head.splitlines()))
    return [
        dataclasses.replace(each, marks=_marks(each, head)) for each in found
    ]


def _marks(value: Value, head: str) -> tuple[str, ...]:
    """The marks of a value, each once."""
    said = _MARK.findall(value.comment)
    if not said:
        # "valve_lag [step] 11 to 18 ms, regulator_gain [step]; underlap [est]"
        name = re.escape(value.path[-1])
        told = re.search(rf"\b{name}\b(:?)([^;.]*)", head)
        said = _MARK.findall(told[2]) if told else []
        if told and not told[1]:
            del said[1:]  # of the names that follow
    if not said:
        said = re.findall(r"Without a\s+mark: \[(\w+)\]", head)
    return tuple(dict.fromkeys(mark for mark in said if mark in EVIDENCE))


def _values(
    node: yaml.Node, path: tuple[str, ...], lines: Sequence[str], head: int
) -> Iterator[Value]:
    if isinstance(node, yaml.MappingNode):
        for key, value in node.value:
            yield from _values(value, (*path, key.value), lines, head)
        return
    first, last = node.start_mark, _end(node)
    text = (
        node.value
        if isinstance(node, yaml.ScalarNode)
        else _flat(lines, first, last)
    )
    yield Value(path, text, _comment(lines, first.line, last, head))


def _end(node: yaml.Node) -> yaml.Mark:
    """Where a value ends; that of a list in lines is that of its last item."""
    if isinstance(node, yaml.SequenceNode) and not node.flow_style:
        return _end(node.value[-1])
    if isinstance(node, yaml.MappingNode) and not node.flow_style:
        return _end(node.value[-1][1])
    return node.end_mark


def _flat(lines: Sequence[str], first: yaml.Mark, last: yaml.Mark) -> str:
    """A list as it stands in the file, in one line."""
    rows = [*lines[first.line : last.line + 1]]
    if len(rows) == 1:
        return rows[0][first.column : last.column]
    rows[0], rows[-1] = rows[0][first.column :], rows[-1][: last.column]
    return " ".join(row.partition(" #")[0].strip() for row in rows).strip()


def _comment(
    lines: Sequence[str], first: int, last: yaml.Mark, head: int
) -> str:
    """The comment beside a value, or the ones directly above it."""
    if last.line < len(lines):
        beside = lines[last.line][last.column :]
        if "#" in beside:
            return beside.partition("#")[2].strip()
    above: list[str] = []
    row = first - 1
    while row >= head and lines[row].lstrip().startswith("#"):
        above.insert(0, lines[row].strip().lstrip("# "))
        row -= 1
    return " ".join(above)


def select(found: Sequence[Value], section: str) -> list[Value]:
    """The values below a section, their paths without it.

    Args:
        found: As `values` gives them.
        section: Keys joined by dots.

    Raises:
        ValueError: If there are none.
    """
    keys = tuple(section.split(".")) if section else ()
    chosen = [
        dataclasses.replace(each, path=each.path[len(keys) :])
        for each in found
        if each.path[: len(keys)] == keys and len(each.path) > len(keys)
    ]
    if not chosen:
        raise ValueError(f"there is no section {section!r}")
    return chosen


def as_grid(found: Sequence[Value]) -> list[list[str]] | None:
    """Values of the same names in several groups: a row each name.

    Args:
        found: As `select` gives them.

    Returns:
        Rows with the head first; None where they are no such groups.
    """
    groups: dict[str, dict[str, Value]] = {}
    for each in found:
        if len(each.path) != 2:
            return None
        groups.setdefault(each.path[0], {})[each.path[1]] = each
    names = list(dict.fromkeys(each.path[1] for each in found))
    if len(groups) < 3 or any(
        len(g) < 0.6 * len(names) for g in groups.values()
    ):
        return None
    rows = [["", *groups]]
    for name in names:
        cells = []
        for group in groups.values():
            each = group.get(name)
            told = "".join(f" [{m}]" for m in (each.marks if each else ()))
            cells.append((each.value if each else "") + told)
        rows.append([name, *cells])
    return rows


def as_list(found: Sequence[Value]) -> list[list[str]]:
    """A row each value, with its evidence and comment, the head first."""
    rows = [["parameter", "value", "evidence", "remark"]]
    for each in found:
        remark = re.sub(r"\s*\[\w+\]", "", each.comment).strip()
        told = dict.fromkeys(EVIDENCE[mark] for mark in each.marks)
        evidence = ", ".join(told)
        rows.append([".".join(each.path), each.value, evidence, remark])
    for column in (3, 2):
        if not any(row[column] for row in rows[1:]):
            for row in rows:
                del row[column]
    return rows


def joints(path: Path) -> list[list[str]]:
    """The joints of an SDF with their limits, a row each, the head first."""
    rows = [["joint", "axis", "from, °", "to, °", "damping, N m s/rad"]]
    for joint in ElementTree.parse(path).iter("joint"):
        axis = joint.find("axis")
        if axis is None or joint.get("type") != "revolute":
            continue
        limits = [
            f"{float(axis.findtext(f'limit/{end}', '0')) * 57.29578:.0f}"
            for end in ("lower", "upper")
        ]
        damping = axis.findtext("dynamics/damping", "0")
        name = str(joint.get("name"))
        rows.append([name, axis.findtext("xyz", ""), *limits, damping])
    return rows


def links(path: Path) -> list[list[str]]:
    """The bodies of an SDF with their masses, a row each, the head first."""
    rows = [["body", "mass, kg"]]
    for link in ElementTree.parse(path).iter("link"):
        mass = link.findtext("inertial/mass")
        if mass is not None:
            rows.append([str(link.get("name")), mass])
    return rows


def to_table(rows: Sequence[Sequence[str]]) -> nodes.Node:
    """A table of texts that scrolls by itself where the page is narrow."""
    table = nodes.table(classes=["parameters"])
    group = nodes.tgroup(cols=len(rows[0]))
    table += group
    for _ in rows[0]:
        group += nodes.colspec(colwidth=1)
    for kind, part in ((nodes.thead, rows[:1]), (nodes.tbody, rows[1:])):
        body = kind()
        group += body
        for row in part:
            line = nodes.row()
            body += line
            for index, cell in enumerate(row):
                content = (
                    nodes.literal(text=cell)
                    if index == 0 and kind is nodes.tbody
                    else nodes.Text(cell)
                )
                line += nodes.entry("", nodes.paragraph("", "", content))
    return table


class _OfModels(SphinxDirective):
    """What the directives have in common: a file below models/."""

    required_arguments = 1

    def file(self, folder: str = "") -> Path:
        path = MODELS / folder / self.arguments[0]
        if not path.is_file():
            raise self.error(f"there is no {path.relative_to(MODELS.parent)}")
        self.env.note_dependency(str(path))
        return path


class Parameters(_OfModels):
    """Values of a YAML file, or of a section of it."""

    option_spec = {  # noqa: RUF012
        "section": directives.unchanged,
        "without": directives.unchanged,
        "head": directives.flag,
    }

    def run(self) -> list[nodes.Node]:
        """The table, after the file's first comment if `head` is given."""
        text = self.file().read_text(encoding="utf-8")
        found = values(text)
        without = self.options.get("without", "").split()
        found = [each for each in found if each.path[0] not in without]
        try:
            chosen = select(found, self.options.get("section", ""))
        except ValueError as error:
            raise self.error(f"{self.arguments[0]}: {error}") from error
        made: list[nodes.Node] = []
        if "head" in self.options:
            made.append(nodes.literal_block(text=head_comment(text)))
        rows = as_grid(chosen) or as_list(chosen)
        made.append(to_table(rows))
        return made


class Joints(_OfModels):
    """Joints of an SDF."""

    def run(self) -> list[nodes.Node]:
        """The table."""
        path = self.file("sdf")
        return [to_table(joints(path))]


class Links(_OfModels):
    """Bodies of an SDF."""

    def run(self) -> list[nodes.Node]:
        """The table."""
        path = self.file("sdf")
        return [to_table(links(path))]


def setup(app: Sphinx) -> dict[str, Any]:
    """Registers the directives."""
    app.add_directive("parameters", Parameters)
    app.add_directive("joints", Joints)
    app.add_directive("links", Links)
    return {"parallel_read_safe": True}
