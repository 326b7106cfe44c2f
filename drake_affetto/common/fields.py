"""Fields of dataclasses that carry their own range and help.

One declaration serves the check of a value and the command's option.
"""

import dataclasses
from typing import Any, TypeVar

from drake_affetto.common.errors import require_range

T = TypeVar("T", int, float)


def number(
    default: Any,
    low: float,
    high: float,
    help: str = "",
    *,
    metavar: str = "N",
) -> Any:
    """A field that holds a number, or a tuple of numbers, in [low, high].

    Args:
        default: Default of the field.
        low: Least number.
        high: Greatest number.
        help: Help of the command's option; without it there is no option.
        metavar: Name of the value in the help.
    """
    return dataclasses.field(
        default=default,
        metadata={
            "range": (low, high),
            "help": help,
            "metavar": metavar,
        },
    )


def file_name(default: str) -> Any:
    """A field that names a file; see `yaml_config` for relative names."""
    return dataclasses.field(default=default, metadata={"file": True})


def file_names() -> Any:
    """A field that holds a list of files, none by default."""
    return dataclasses.field(default_factory=list, metadata={"file": True})


def option(
    default: Any,
    help: str,
    *,
    metavar: str | None = None,
) -> Any:
    """A field without a range that is an option of the command."""
    return dataclasses.field(
        default=default,
        metadata={"help": help, "metavar": metavar},
    )


def read_number(text: str, kind: type[T]) -> T:
    """A number in decimal notation; Python's 1_0 and other scripts are none.

    Args:
        text: What a user or a file has.
        kind: int or float.

    Raises:
        ValueError: If it is no such number.
    """
    if "_" in text or not text.isascii():
        raise ValueError(f"{text!r} is not in decimal notation")
    return kind(text)  # type: ignore[call-arg]


def option_name(field: dataclasses.Field) -> str:
    """Name of the field's option, which errors use too: --test-positions."""
    return "--" + field.name.replace("_", "-")


def check_ranges(obj: Any, where: str = "") -> None:
    """Checks the numbers of `obj` and of the dataclasses inside it.

    Args:
        obj: A dataclass with fields of `number`.
        where: Name of `obj` in error messages, such as its file's.

    Raises:
        InputError: For the first field outside its range.
    """
    for field in dataclasses.fields(obj):
        value = getattr(obj, field.name)
        name = f"{where}.{field.name}" if where else field.name
        if dataclasses.is_dataclass(value):
            check_ranges(value, name)
        elif isinstance(value, list):
            for i, each in enumerate(value):
                if dataclasses.is_dataclass(each):
                    check_ranges(each, f"{name}[{i}]")
        if "range" not in field.metadata:
            continue
        if field.metadata["help"]:
            name = option_name(field)
        # Several numbers, or none, only where the default says so.
        several = field.default is dataclasses.MISSING or isinstance(
            field.default, tuple
        )
        if not (several and isinstance(value, (tuple, list))):
            value = (value,)
        for each in value:
            if each is not None or field.default is not None:
                require_range(name, each, *field.metadata["range"])
