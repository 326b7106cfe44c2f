"""Tables of what dataclasses of the package hold, from their own docstrings.

    .. fields:: drake_affetto.motion.DmpConfig

lists name, default and text. With `:deep:` the dataclasses inside follow.

    .. columns::

lists the columns of a study's table of trials.
"""

from collections.abc import Iterator
import dataclasses
import importlib
import inspect
import typing
from typing import Any

import docstring_check
from docutils import nodes
from docutils.parsers.rst import directives
from parameter_tables import to_table
from sphinx.application import Sphinx
from sphinx.util.docutils import SphinxDirective

from drake_affetto.experiments.tables import COLUMNS


def find(path: str) -> type:
    """The dataclass at a dotted path.

    Raises:
        ValueError: If there is none.
    """
    module, _, name = path.rpartition(".")
    found = getattr(importlib.import_module(module), name, None)
    if not (isinstance(found, type) and dataclasses.is_dataclass(found)):
        raise ValueError(f"{path} is no dataclass")
    return found


def texts(cls: type) -> dict[str, str]:
    """Texts of the fields, also those of the bases."""
    told: dict[str, str] = {}
    for each in reversed(cls.__mro__):
        told |= docstring_check.entries(inspect.cleandoc(each.__doc__ or ""))
        told |= docstring_check.attribute_texts(each)
    return told


def type_name(annotation: Any) -> str:
    """A type as a reader writes it."""
    if isinstance(annotation, type) and not typing.get_args(annotation):
        return annotation.__name__
    text = str(annotation)
    for module in ("typing.", "collections.abc."):
        text = text.replace(module, "")
    pieces = text.replace("[", "[ ").split("drake_affetto.")
    return pieces[0].replace("[ ", "[") + "".join(
        piece[piece.rfind(".", 0, _end(piece)) + 1 :].replace("[ ", "[")
        for piece in pieces[1:]
    )


def _end(piece: str) -> int:
    return next(
        (i for i, c in enumerate(piece) if not (c.isalnum() or c in "._")),
        len(piece),
    )


def rows_of(cls: type) -> list[list[str]]:
    """A row each field, the head first."""
    told = texts(cls)
    hints = typing.get_type_hints(cls)
    rows = [["field", "type", "default", "what it is"]]
    for field in dataclasses.fields(cls):
        if field.name.startswith("_"):
            continue
        default = field.default
        shown = "" if default is dataclasses.MISSING else f"{default}"
        rows.append(
            [
                field.name,
                type_name(hints[field.name]),
                shown,
                told.get(field.name, ""),
            ]
        )
    if not any(row[2] for row in rows[1:]):
        for row in rows:
            del row[2]
    return rows


def inner(cls: type, seen: set[type]) -> Iterator[type]:
    """The dataclasses inside, each once, in the order of their use."""
    for annotation in typing.get_type_hints(cls).values():
        for each in _arguments(annotation):
            if dataclasses.is_dataclass(each) and each not in seen:
                seen.add(typing.cast(type, each))
                yield typing.cast(type, each)
                yield from inner(typing.cast(type, each), seen)


def _arguments(annotation: Any) -> Iterator[Any]:
    yield annotation
    for each in typing.get_args(annotation):
        yield from _arguments(each)


class Fields(SphinxDirective):
    """Fields of a dataclass."""

    required_arguments = 1
    option_spec = {"deep": directives.flag}  # noqa: RUF012

    def run(self) -> list[nodes.Node]:
        """The table; with `deep` one for each dataclass inside too."""
        try:
            cls = find(self.arguments[0])
        except (ValueError, ImportError) as error:
            raise self.error(str(error)) from error
        self.env.note_dependency(inspect.getsourcefile(cls) or __file__)
        made: list[nodes.Node] = [to_table(rows_of(cls))]
        if "deep" in self.options:
            for each in inner(cls, {cls}):
                line = inspect.cleandoc(each.__doc__ or "").splitlines()[0]
                name = nodes.literal(text=each.__name__)
                made.append(
                    nodes.paragraph("", "", name, nodes.Text(f": {line}"))
                )
                made.append(to_table(rows_of(each)))
        return made


class Columns(SphinxDirective):
    """Columns of the table of trials."""

    def run(self) -> list[nodes.Node]:
        """The table."""
        rows = [["column", "type", "unit", "what it is"]]
        rows += [[c.name, c.dtype, c.unit, c.about] for c in COLUMNS]
        return [to_table(rows)]


def setup(app: Sphinx) -> dict[str, Any]:
    """Registers the directives."""
    app.add_directive("fields", Fields)
    app.add_directive("columns", Columns)
    return {"parallel_read_safe": True}
