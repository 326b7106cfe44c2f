"""Tells what has no text: parameters, fields and ports of what is public.

Each finding is a warning of the build, and the build takes warnings for errors.
"""

import ast
from collections.abc import Callable, Iterator
import dataclasses
import enum
import inspect
import itertools
import re
from typing import Any

# A section of a Google-style docstring, and an entry of one.
_SECTION = re.compile(r"^(\s*)(Args|Attributes|Keyword Args|Other Args):\s*$")
_ENTRY = re.compile(r"^(\*{0,2}\w+(?:, *\*{0,2}\w+)*)(?: \([^)]*\))?:\s*(.*)$")
_KNOWN = {"self", "cls"}

# Parameters that mean the same wherever they occur. They are told here once;
# the pages show the text in each entry that lacks one of its own.
COMMON = {
    "builder": "Builder of the diagram.",
    "context": "Context of the system, the station or the plant.",
    "where": "Name of the whole, for messages.",
    "rng": "Source of random numbers.",
    "plant": "The multibody plant.",
    "scene_graph": "The scene graph of the plant.",
    "config": "The settings.",
    "X": "Inputs (m, d), a row each.",
    "y": "Outputs (m, F), or (m) where there is one only.",
    "n_in": "Number of inputs.",
    "n_out": "Number of outputs.",
    "xy": "Position [x, y] of the drum on the table, m.",
    "yaw": "Angle of the yaw joint, rad.",
    "seed": "Seed of the random numbers.",
    "path": "Path of the file.",
    "uv": "Pixel coordinates (..., 2).",
    "X_WC": "Pose of the camera in the world (..., 4, 4).",
    "X_WM": "Pose of the mirror in the world (..., 4, 4).",
    "p_W": "Points in the world (..., 3), m.",
    "p_C": "Points in the camera's frame (..., 3), m.",
}
# A docstring that says no more than this is that of the base class.
OF_BASE = "See base class."
# The same of methods that many systems have.
COMMON_OF = {
    "AddToBuilder": {
        "name": "Name of the system in the diagram.",
        "plant": "The multibody plant, finalized.",
    },
}


def entries(docstring: str) -> dict[str, str]:
    """The entries of all `Args` and `Attributes`, with what each begins with.

    Args:
        docstring: As `inspect.getdoc` gives it.
    """
    found: dict[str, str] = {}
    inside: int | None = None
    depth: int | None = None
    last: list[str] = []
    for line in docstring.splitlines():
        head = _SECTION.match(line)
        if head:
            inside, depth = len(head[1]), None
            continue
        if inside is None or not line.strip():
            continue
        indent = len(line) - len(line.lstrip())
        if indent <= inside:
            inside = None
            continue
        depth = indent if depth is None else depth
        entry = _ENTRY.match(line.strip()) if indent == depth else None
        if entry:
            last = [name.strip(" *") for name in entry[1].split(",")]
            found |= dict.fromkeys(last, entry[2])
        elif indent > depth:
            # The text may begin on the line after the name.
            found |= {name: found[name] or line.strip() for name in last}
    return found


def parameters(function: Callable[..., Any]) -> list[str]:
    """Names of the parameters that a caller can give."""
    try:
        found = inspect.signature(function).parameters
    except (TypeError, ValueError):
        return []
    return [name for name in found if not name.startswith("_")]


def untold(function: Callable[..., Any], docstring: str) -> list[str]:
    """Parameters of which the docstring has no entry and no word.

    A short docstring may speak of a parameter in its sentence, as `name`.
    """
    told = entries(docstring)
    prose = set(re.findall(r"`+(\w+)[^`\n]*`+", docstring))
    return [
        name
        for name in parameters(function)
        if name not in _KNOWN and not told.get(name) and name not in prose
    ]


def common_entries(
    function: Callable[..., Any], docstring: str
) -> dict[str, str]:
    """Texts for the parameters that are told in COMMON alone."""
    name = getattr(function, "__name__", "")
    known = COMMON | COMMON_OF.get(name, {})
    return {
        each: known[each]
        for each in untold(function, docstring)
        if each in known
    }


def missing_of_function(function: Callable[..., Any]) -> list[str]:
    """Parameters of a function or method without a text."""
    docstring = inspect.getdoc(function) or ""
    common = common_entries(function, docstring)
    return [each for each in untold(function, docstring) if each not in common]


def missing_of_class(cls: type) -> list[str]:
    """Parameters or fields of a class without an entry.

    They may stand in the docstring of the class, of `__init__`, or of a base
    whose fields they are.
    """
    told: dict[str, str] = {}
    prose: set[str] = set()
    # Those of Drake, scikit-learn and so on are told there.
    own = cls.__module__.partition(".")[0]
    for each in reversed(cls.__mro__):
        if each.__module__.partition(".")[0] == own:
            told |= entries(inspect.cleandoc(each.__doc__ or ""))
            init = each.__dict__.get("__init__")
            told |= entries(
                inspect.cleandoc(getattr(init, "__doc__", "") or "")
            )
            told |= attribute_texts(each)
            prose |= set(re.findall(r"`(\w+)`", each.__doc__ or ""))
    if issubclass(cls, enum.Enum):
        return []
    if dataclasses.is_dataclass(cls):
        wanted = [
            field.name
            for field in dataclasses.fields(cls)
            if not field.name.startswith("_")
        ]
    elif "__init__" in cls.__dict__ or "__new__" in cls.__dict__:
        wanted = parameters(cls)
    else:
        wanted = []
    common = set() if dataclasses.is_dataclass(cls) else set(COMMON)
    # Classes made by a template take what its own docstring says.
    template = wanted == ["args", "kwargs"]
    return [
        name
        for name in wanted
        if not (template or name in _KNOWN | common)
        and not told.get(name)
        and name not in prose
    ]


def attribute_texts(cls: type) -> dict[str, str]:
    """Texts that stand as strings below the fields of a class."""
    try:
        tree = ast.parse(inspect.cleandoc("\n" + inspect.getsource(cls)))
    except (OSError, TypeError, SyntaxError):
        return {}
    body = tree.body[0].body if isinstance(tree.body[0], ast.ClassDef) else []
    found = {}
    for field, text in itertools.pairwise(body):
        if (
            isinstance(field, ast.AnnAssign)
            and isinstance(field.target, ast.Name)
            and isinstance(text, ast.Expr)
            and isinstance(text.value, ast.Constant)
        ):
            found[field.target.id] = str(text.value.value)
    return found


# What Drake calls, and what its templates add to a class.
_DRAKE = re.compile(r"Do[A-Z]|ToScalarType|ToAutoDiffXd|ToSymbolic")


def public_members(cls: type) -> Iterator[tuple[str, Any]]:
    """Methods and properties that the class itself defines for its users."""
    for name, value in vars(cls).items():
        if name.startswith("_") or _DRAKE.match(name):
            continue
        if isinstance(value, (staticmethod, classmethod)):
            yield name, value.__func__
        elif inspect.isfunction(value) or isinstance(value, property):
            yield name, value


def check(name: str, value: Any) -> Iterator[str]:
    """What is not told of a public name, one line each.

    Args:
        name: Full name, for the lines.
        value: Function, class or constant.
    """
    if inspect.isclass(value):
        if not (value.__doc__ or "").strip():
            yield f"{name} has no docstring"
        for missing in missing_of_class(value):
            yield f"{name}: parameter {missing!r} has no text"
        for member, function in public_members(value):
            if (function.__doc__ or "").strip() == OF_BASE:
                continue
            yield from check(f"{name}.{member}", function)
    elif isinstance(value, property):
        if not inspect.getdoc(value):
            yield f"{name} has no docstring"
    elif callable(value):
        if not inspect.getdoc(value):
            yield f"{name} has no docstring"
        for missing in missing_of_function(value):
            yield f"{name}: parameter {missing!r} has no text"
