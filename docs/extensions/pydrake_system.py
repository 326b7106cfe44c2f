"""The directive `pydrake_system`: a system's block with its ports.

In a docstring, as in Drake's own documentation:

    .. pydrake_system::

        name: BlobSensor
        input_ports:
        - color_image
        output_ports:
        - blob

Inputs stand left, outputs right. A port of which the docstring says nothing is
a warning.
"""

from collections.abc import Iterator
import dataclasses
import html
import inspect
import re
from typing import Any

from docutils import nodes
from sphinx.application import Sphinx
from sphinx.util import logging
from sphinx.util.docutils import SphinxDirective
import yaml

logger = logging.getLogger(__name__)

_BLOCK = re.compile(r"^( *)\.\. pydrake_system::\n\n((?:\1 +.*\n|\n)+)", re.M)
# "Ports and units are those of `PidfController`."
_ELSEWHERE = re.compile(r"Ports,?\s[^.]*\bare\s+those\s+of\s+`(\w+)`")


@dataclasses.dataclass(frozen=True)
class Block:
    """A system as its block says.

    Attributes:
        name: Name of the system.
        input_ports: Each with a remark in parentheses, if it has one.
        output_ports: The same of the outputs.
    """

    name: str
    input_ports: tuple[str, ...] = ()
    output_ports: tuple[str, ...] = ()


def read_block(text: str) -> Block:
    """Reads what stands below the directive.

    Raises:
        ValueError: If it is no such block.
    """
    try:
        found = yaml.safe_load(inspect.cleandoc(text))
    except yaml.YAMLError as error:
        raise ValueError(f"not YAML: {error}") from error
    if not isinstance(found, dict) or not isinstance(found.get("name"), str):
        raise ValueError("expected name, input_ports and output_ports")
    unknown = set(found) - {"name", "input_ports", "output_ports"}
    if unknown:
        raise ValueError(f"unknown: {', '.join(sorted(unknown))}")
    ports = [
        tuple(map(str, found.get(key) or ()))
        for key in ("input_ports", "output_ports")
    ]
    return Block(found["name"], *ports)


def port_name(port: str) -> str:
    """The name without its remark: "u" of "u (optional)"."""
    return port.partition(" ")[0]


def _items(docstring: str) -> Iterator[str]:
    """What stands before the colon in each item of a list."""
    for item in re.finditer(r"^ *- ((?:[^\n]|\n +(?! *- ))+)", docstring, re.M):
        yield item[1].partition(":")[0]


def untold_ports(docstring: str, other: Any = None) -> list[str]:
    """Ports of the docstring's block of which no list item says anything.

    Args:
        docstring: Of the system's class.
        other: Gives the docstring of a system by its name, to which this one
            may refer for its ports.

    Raises:
        ValueError: If a block cannot be read.
    """
    docstring = inspect.cleandoc(docstring) + "\n"
    missing = []
    for found in _BLOCK.finditer(docstring):
        block = read_block(found[2])
        text = _BLOCK.sub("", docstring)
        elsewhere = _ELSEWHERE.search(docstring)
        if elsewhere and other is not None:
            told_there = inspect.cleandoc(other(elsewhere[1]) or "") + "\n"
            text += _BLOCK.sub("", told_there)
        heads = " ".join(_items(text.replace("``", "`")))
        told = set(re.findall(r"[\w.]+", heads))
        for port in (*block.input_ports, *block.output_ports):
            if port_name(port) not in told:
                missing.append(port_name(port))
    return missing


def _port(port: str, arrow: str) -> str:
    name, _, remark = port.partition(" ")
    text = f"<code>{html.escape(name)}</code>"
    if remark:
        text += f" <small>{html.escape(remark)}</small>"
    pieces = [text, f'<span aria-hidden="true">{arrow}</span>']
    return "<li>" + " ".join(pieces) + "</li>"


def to_html(block: Block) -> str:
    """The block's picture: three columns, which stack on a narrow page."""
    sides = []
    for side, ports in (
        ("input", block.input_ports),
        ("output", block.output_ports),
    ):
        listed = "".join(_port(port, "→") for port in ports)
        sides.append(
            f'<ul class="{side}s" aria-label="{side} ports">{listed}</ul>'
            if ports
            else f'<p class="{side}s">no {side} ports</p>'
        )
    name = html.escape(block.name)
    return (
        f'<div class="system-block" role="group" aria-label="Block of {name}">'
        f'{sides[0]}<p class="system-name">{name}</p>{sides[1]}</div>'
    )


class PydrakeSystem(SphinxDirective):
    """Draws the block below it."""

    has_content = True

    def run(self) -> list[nodes.Node]:
        """The block as HTML."""
        try:
            block = read_block("\n".join(self.content))
        except ValueError as error:
            raise self.error(f"pydrake_system: {error}") from error
        return [nodes.raw("", to_html(block), format="html")]


def setup(app: Sphinx) -> dict[str, Any]:
    """Registers the directive."""
    app.add_directive("pydrake_system", PydrakeSystem)
    return {"parallel_read_safe": True}
