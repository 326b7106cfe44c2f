"""YAML as a person reads it: what two readers take differently is refused.

PyYAML reads YAML 1.1, in which `010` is 8, `1:30` is 90, `on` is true and the
second of two equal keys wins without a word. Here numbers are those of JSON,
only `true` and `false` are truth values, and a key stands once.
"""

from pathlib import Path
import re
from typing import Any

import yaml

from drake_affetto.common.errors import InputError

# Deeper nests, and larger expansions of aliases, describe no robot.
_DEEPEST = 40
_MOST_NODES = 200_000

_INT = re.compile(r"[-+]?(?:0|[1-9][0-9]*)$")
_FLOAT = re.compile(
    r"""(?:[-+]?(?:[0-9]+\.[0-9]*|\.[0-9]+|(?:0|[1-9][0-9]*)(?=[eE]))
    (?:[eE][-+]?[0-9]+)?|[-+]?\.(?:inf|Inf|INF)|\.(?:nan|NaN|NAN))$""",
    re.VERBOSE,
)
_BOOL = re.compile(r"(?:true|True|TRUE|false|False|FALSE)$")
# What YAML 1.1 or 1.2 calls a number, too: octal, binary, hexadecimal,
# sexagesimal, with underscores.
_DOUBTFUL = re.compile(
    r"""[-+]?(?:0[0-9_]+|0[box][0-9a-fA-F_]+|[0-9][0-9_]*(?::[0-5]?[0-9])+
    (?:\.[0-9_]*)?|[0-9]+_[0-9_]*(?:\.[0-9_]*)?(?:[eE][-+]?[0-9]+)?
    |[0-9]+\.[0-9]*_[0-9_]*(?:[eE][-+]?[0-9]+)?)$""",
    re.VERBOSE,
)


class _Loader(yaml.SafeLoader):
    """A safe loader with the numbers of JSON and a limit of depth."""

    depth = 0

    def compose_node(self, parent: Any, index: Any) -> yaml.Node | None:
        self.depth += 1
        if self.depth > _DEEPEST:
            raise yaml.MarkedYAMLError(
                problem=f"nested more than {_DEEPEST} deep",
                problem_mark=self.peek_event().start_mark,
            )
        node = super().compose_node(parent, index)
        self.depth -= 1
        return node


_TAG = "tag:yaml.org,2002:"
_REPLACED = {f"{_TAG}{name}" for name in ("bool", "int", "float", "timestamp")}
_Loader.yaml_implicit_resolvers = {
    first: [rule for rule in rules if rule[0] not in _REPLACED]
    for first, rules in yaml.SafeLoader.yaml_implicit_resolvers.items()
}
_Loader.add_implicit_resolver(f"{_TAG}bool", _BOOL, list("tTfF"))
_Loader.add_implicit_resolver(f"{_TAG}int", _INT, list("-+0123456789"))
_Loader.add_implicit_resolver(f"{_TAG}float", _FLOAT, list("-+.0123456789"))


def parse_yaml(text: str, where: str) -> Any:
    """What the YAML `text` holds; None for an empty one.

    Args:
        text: One document.
        where: Name of the text in errors: its file.

    Raises:
        InputError: If it is no YAML, a key stands twice in a mapping, a
            number can be read in two ways, or it is nested too deeply.
    """
    try:
        loader = _Loader(text)
        try:
            node = loader.get_single_node()
            if node is None:
                return None
            _Walk(where).visit(node, "")
            return loader.construct_document(node)
        finally:
            loader.dispose()
    except yaml.YAMLError as error:
        mark = getattr(error, "problem_mark", None)
        line = f" in line {mark.line + 1}" if mark is not None else ""
        problem = getattr(error, "problem", None) or "it cannot be parsed"
        raise InputError(f"{where} is not YAML: {problem}{line}") from error
    except (AttributeError, OverflowError, TypeError, ValueError) as error:
        if isinstance(error, InputError):
            raise
        # A tag that its value does not fit: !!int of a word.
        raise InputError(f"{where} is not YAML: {error}") from error


def check_yaml(path: Path) -> None:
    """Refuses a file with a doubled key, whatever tags its values have.

    For files that another reader takes, such as Drake's directives.

    Raises:
        InputError: As `parse_yaml`, or if the file cannot be read.
    """
    text = read_text(path)
    try:
        node = _Loader(text).get_single_node()
    except yaml.YAMLError:
        return  # Its own reader says what it does not understand.
    if node is not None:
        _Walk(str(path)).visit(node, "")


def read_text(path: Path) -> str:
    """The text of a file, without a byte order mark.

    Raises:
        InputError: If it cannot be read or is not UTF-8.
    """
    try:
        return path.read_text(encoding="utf-8-sig")
    except OSError as error:
        raise InputError(f"cannot read {path}: {error.strerror}") from error
    except UnicodeDecodeError as error:
        raise InputError(f"{path} is not UTF-8 text") from error


class _Walk:
    """A walk over the nodes of a document that looks for what is doubtful."""

    def __init__(self, where: str):
        self._where = where
        self._visited = 0
        self._open: set[int] = set()

    def visit(self, node: yaml.Node, place: str) -> None:
        """Checks a node and all inside; `place` is its name."""
        self._visited += 1
        name = f"{self._where}: {place or 'the whole'}"
        if id(node) in self._open:
            raise InputError(f"{name} contains itself by an alias")
        if self._visited > _MOST_NODES:
            raise InputError(
                f"{self._where}: more than {_MOST_NODES} values, aliases "
                "expanded"
            )
        self._open.add(id(node))
        if isinstance(node, yaml.MappingNode):
            self._visit_mapping(node, place)
        elif isinstance(node, yaml.SequenceNode):
            for i, item in enumerate(node.value):
                self.visit(item, f"{place}[{i}]")
        elif isinstance(node, yaml.ScalarNode):
            self._check_scalar(node, name)
        self._open.remove(id(node))

    def _visit_mapping(self, node: yaml.MappingNode, place: str) -> None:
        lines: dict[str, int] = {}
        for key, item in node.value:
            line = key.start_mark.line + 1
            if not isinstance(key, yaml.ScalarNode):
                raise InputError(
                    f"{self._where}: a key in line {line} is no single word"
                )
            inside = f"{place}.{key.value}" if place else key.value
            if key.value in lines:
                raise InputError(
                    f"{self._where}: {inside} is given twice, in lines "
                    f"{lines[key.value]} and {line}"
                )
            lines[key.value] = line
            self.visit(item, inside)

    @staticmethod
    def _check_scalar(node: yaml.ScalarNode, name: str) -> None:
        line = node.start_mark.line + 1
        if node.style is None and _DOUBTFUL.match(node.value):
            raise InputError(
                f"{name} is {node.value} in line {line}, expected a plain "
                "decimal number (or text in quotes): readers of YAML take "
                "this one differently"
            )
        numeric = node.tag in (f"{_TAG}int", f"{_TAG}float")
        if numeric and len(node.value) > 400:
            raise InputError(
                f"{name} in line {line} is a number of {len(node.value)} digits"
            )
