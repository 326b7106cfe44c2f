"""The directive `face`: all public names of a room, from its own face.

    .. face:: drake_affetto.skill

gives a table of the names and then an entry for each. What has no text, see
`docstring_check`, is a warning.
"""

import ast
from collections.abc import Iterator
import dataclasses
import importlib
import inspect
from pathlib import Path
import re
from typing import Any

import docstring_check
from docutils import nodes
from docutils.parsers.rst import directives
from pydrake.systems.scalar_conversion import TemplateSystem
import pydrake_system
from sphinx.application import Sphinx
from sphinx.pycode import ModuleAnalyzer
from sphinx.util import logging
from sphinx.util.docutils import SphinxDirective

logger = logging.getLogger(__name__)

# A shape or unit of one letter, as in "q: (n), rad" or "s.", is no item of a
# list.
_LIKE_AN_ITEM = re.compile(
    r"^(\s*(?:\*{0,2}\w+: )?)(\([A-Za-z]\)|[A-Za-z]\.)(?=[\s,.]|$)"
)
# What Drake's templates and scikit-learn add to a class of ours.
_FOREIGN = re.compile(
    r"Do[A-Z]|ToScalarType|ToAutoDiffXd|ToSymbolic|set_\w+_request$"
)

PACKAGE = Path(__file__).parents[2] / "drake_affetto"


def rooms() -> list[str]:
    """The rooms that offer public names."""
    return sorted(
        path.parent.name
        for path in PACKAGE.glob("*/__init__.py")
        if getattr(
            importlib.import_module(f"drake_affetto.{path.parent.name}"),
            "__all__",
            None,
        )
    )


def write_pages(folder: Path) -> None:
    """Writes a page for each room; those of rooms that have gone go.

    Args:
        folder: Where to; what is right already stays as it is.
    """
    folder.mkdir(exist_ok=True)
    wanted = {}
    for room in rooms():
        name = f"drake_affetto.{room}"
        text = f"{name}\n{'=' * len(name)}\n\n.. face:: {name}\n"
        wanted[folder / f"{room}.rst"] = text
    for path in set(folder.glob("*.rst")) - set(wanted):
        path.unlink()
    for path, text in wanted.items():
        if not path.is_file() or path.read_text() != text:
            path.write_text(text)


def first_sentence(docstring: str) -> str:
    """What a docstring says first, in one line."""
    head = inspect.cleandoc(docstring).partition("\n\n")[0]
    text = " ".join(head.split())
    return re.split(r"(?<=[.])\s", text)[0]


def summary(value: Any) -> str:
    """One line about a public name."""
    if isinstance(value, TemplateSystem):
        return "Template of the system over its scalar types."
    if not (inspect.isclass(value) or callable(value)):
        return "Constant."
    return first_sentence(value.__doc__ or "")


def constant_text(face: str, name: str) -> list[str]:
    """What is said of a constant beside it, as `#:` or as a string below it."""
    text = Path(str(importlib.import_module(face).__file__)).read_text()
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.ImportFrom) and name in {
            alias.name for alias in node.names
        }:
            found = ModuleAnalyzer.for_module(str(node.module))
            return found.find_attr_docs().get(("", name), [])
    return []


def is_constant(value: Any) -> bool:
    """Whether a public name is neither a class, a function nor a template."""
    return not (callable(value) or isinstance(value, TemplateSystem))


def entry(face: str, name: str, value: Any) -> Iterator[str]:
    """The lines of reStructuredText that document a name."""
    if isinstance(value, TemplateSystem):
        types = ", ".join(f"``{T.__name__}``" for (T,) in value.param_list)
        yield f".. py:data:: {face}.{name}"
        yield ""
        yield (
            f"   Template of :class:`~{face}.{name.rstrip('_')}` over the "
            f"scalar types {types}: ``{name}[AutoDiffXd]``."
        )
    elif inspect.isclass(value):
        yield f".. autoclass:: {face}.{name}"
        yield "   :members:"
        yield "   :member-order: bysource"
        hidden = [name for name in dir(value) if _FOREIGN.match(name)]
        if hidden:
            yield f"   :exclude-members: {', '.join(hidden)}"
    elif callable(value):
        yield f".. autofunction:: {face}.{name}"
    else:
        yield f".. py:data:: {face}.{name}"
        yield ""
        yield from (f"   {line}" for line in constant_text(face, name))
    yield ""


class Face(SphinxDirective):
    """Documents all names of a face."""

    required_arguments = 1
    option_spec = {"only": directives.unchanged}  # noqa: RUF012

    def run(self) -> list[nodes.Node]:
        """The table of names and their entries."""
        face = self.arguments[0]
        module = importlib.import_module(face)
        names = sorted(module.__all__, key=str.lower)
        lines = [f".. py:module:: {face}", "   :no-index-entry:", ""]
        about = inspect.cleandoc(module.__doc__ or "")
        lines += [
            about,
            "",
            ".. list-table::",
            "   :class: names",
            "   :widths: auto",
            "",
        ]
        for name in names:
            value = getattr(module, name)
            self.env.note_dependency(source_file(value))
            self._complain(f"{face}.{name}", value)
            lines.append(f"   * - :py:obj:`~{face}.{name}`")
            lines.append(f"     - {summary(value)}")
        lines.append("")
        for name in names:
            lines += entry(face, name, getattr(module, name))
        return self.parse_text_to_nodes("\n".join(lines))

    def _complain(self, name: str, value: Any) -> None:
        """Warns of what has no text."""
        if isinstance(value, TemplateSystem):
            return
        if is_constant(value):
            face, _, own = name.rpartition(".")
            if not constant_text(face, own):
                logger.warning(
                    "%s has no text", name, location=self.get_location()
                )
            return
        for finding in docstring_check.check(name, value):
            logger.warning("%s", finding, location=self.get_location())
        if inspect.isclass(value) and value.__doc__:
            home = inspect.getmodule(value)
            for port in pydrake_system.untold_ports(
                value.__doc__, lambda other: docstring_of(other, home)
            ):
                logger.warning(
                    "%s: port %r has no text",
                    name,
                    port,
                    location=self.get_location(),
                )


def docstring_of(name: str, home: Any) -> str:
    """Docstring of a system that another one's docstring refers to."""
    for room in (home.__name__.rpartition(".")[0], *map(_face, rooms())):
        found = getattr(importlib.import_module(room), name, None)
        if found is not None:
            return str(found.__doc__)
    return ""


def _face(room: str) -> str:
    return f"drake_affetto.{room}"


def source_file(value: Any) -> str:
    """The file of a name, on which its page depends."""
    try:
        return inspect.getsourcefile(value) or __file__
    except TypeError:
        return __file__


def complete_docstring(
    app: Sphinx, what: str, name: str, obj: Any, options: Any, lines: list[str]
) -> None:
    """Adds the parameters that mean the same everywhere, where it lacks them.

    Runs before napoleon, on the Google style.
    """
    for row, line in enumerate(lines):
        lines[row] = _LIKE_AN_ITEM.sub(r"\1\\\2", line)
    fit = what in ("method", "function", "class")
    if not fit or dataclasses.is_dataclass(obj):
        return
    if "".join(lines).strip() == docstring_check.OF_BASE:
        lines[:] = base_docstring(obj).splitlines()
    text = "\n".join(lines)
    if what == "class":
        # Its own docstring comes first, then that of `__init__`, if any.
        own, init = (
            inspect.cleandoc(getattr(each, "__doc__", None) or "")
            for each in (obj, vars(obj).get("__init__"))
        )
        if init and text.strip() != init:
            return
        text = f"{own}\n\n{init}"
    told = docstring_check.common_entries(obj, text)
    if not told:
        return
    added = [f"    {key}: {text}" for key, text in told.items()]
    for row, line in enumerate(lines):
        if re.match(r"Args:\s*$", line):
            lines[row + 1 : row + 1] = added
            return
    for row, line in enumerate(lines):
        if re.match(r"(Returns|Raises|Yields):\s*$", line):
            lines[row:row] = ["Args:", *added, ""]
            return
    lines += ["", "Args:", *added, ""]


def base_docstring(function: Any) -> str:
    """Docstring of the method of a base class that this one stands for."""
    owner, _, name = function.__qualname__.rpartition(".")
    cls = getattr(inspect.getmodule(function), owner)
    for base in cls.__mro__[1:]:
        found = inspect.cleandoc(
            getattr(base.__dict__.get(name), "__doc__", "") or ""
        )
        if found and found != docstring_check.OF_BASE:
            return found
    return ""


def setup(app: Sphinx) -> dict[str, Any]:
    """Registers the directive."""
    app.add_directive("face", Face)
    app.connect("autodoc-process-docstring", complete_docstring, priority=100)
    return {"parallel_read_safe": True}
