"""Results as dataclasses: written to JSON and read back with checks.

A dataclass is its own schema. A field's annotation says what JSON must hold;
its metadata may narrow that:

    field(metadata={"range": (0.0, 1.0)})   bounds of a number, or of each in
                                            a list or mapping of numbers
    field(metadata={"not_empty": True})     a list or mapping with content
    field(metadata={"length": 2})           a list of so many

No number is beyond ±1e100: results are measured and summed, and no sum of them
overflows.

A field with a default may be missing in the JSON (files of earlier versions).
Keys without a field are ignored (files of later versions).
"""

from collections.abc import Mapping
import dataclasses
import functools
import math
import os
import reprlib
import types
import typing
from typing import Any, Literal, TypeVar, Union, get_args, get_origin

from drake_affetto.common.errors import InputError
from drake_affetto.common.nested import map_leaves

T = TypeVar("T")

# No number in results is greater.
_GREATEST = 1e100

_NAMES: dict[type, str] = {
    float: "a number",
    int: "a whole number",
    str: "a text",
    bool: "true or false",
}


def to_plain(value: Any) -> Any:
    """`value` as the mappings, lists, texts and numbers that JSON knows.

    Args:
        value: A dataclass, or a nest of dataclasses, mappings, sequences,
            numpy arrays and scalars.
    """

    def leaf(value: Any) -> Any:
        if dataclasses.is_dataclass(value) and not isinstance(value, type):
            fields = dataclasses.fields(value)
            return to_plain({f.name: getattr(value, f.name) for f in fields})
        if hasattr(value, "tolist"):
            return to_plain(value.tolist())
        if isinstance(value, os.PathLike):
            return os.fspath(value)
        return value

    return map_leaves(value, leaf)


def from_plain(
    kind: type[T],
    value: Any,
    where: str = "",
    limits: Mapping[str, Any] | None = None,
) -> T:
    """Reads what `to_plain` has written.

    Args:
        kind: The dataclass, or any annotation of a dataclass's field.
        value: The plain data, such as `json.loads` gives.
        where: Name of the value in error messages, e.g. "results.json: ".
        limits: What metadata of a field narrows it, where `kind` is a field's.

    Raises:
        InputError: If `value` does not fit `kind`. The one line names the
            place, the value and what was expected.
    """
    return _read(kind, value, where, limits or {})


def _read(kind: Any, value: Any, where: str, limits: Mapping[str, Any]) -> Any:
    origin = get_origin(kind)
    if origin in (Union, types.UnionType):
        if value is None and type(None) in get_args(kind):
            return None
        (inner,) = (each for each in get_args(kind) if each is not type(None))
        return _read(inner, value, where, limits)
    if dataclasses.is_dataclass(kind):
        return _read_dataclass(kind, value, where)
    if origin is Literal:
        choices = get_args(kind)
        _need(value in choices, where, value, " or ".join(map(repr, choices)))
        return value
    if origin in (list, tuple):
        return _read_sequence(kind, value, where, limits)
    if origin is dict:
        return _read_mapping(kind, value, where, limits)
    return _read_scalar(kind, value, where, limits)


def _read_dataclass(kind: Any, value: Any, where: str) -> Any:
    _need(isinstance(value, dict), where, value, "an object")
    hints = _hints(kind)
    read = {}
    for field in dataclasses.fields(kind):
        place = _inside(where, field.name)
        if field.name in value:
            read[field.name] = _read(
                hints[field.name], value[field.name], place, field.metadata
            )
        elif (
            field.default is dataclasses.MISSING
            and field.default_factory is dataclasses.MISSING
        ):
            raise InputError(f"{place} is missing")
    return kind(**read)


@functools.cache
def _hints(kind: type) -> dict[str, Any]:
    return typing.get_type_hints(kind)


def _read_sequence(
    kind: Any, value: Any, where: str, limits: Mapping[str, Any]
) -> Any:
    _need(isinstance(value, list), where, value, "a list")
    limits = _check_content(value, where, limits)
    items = get_args(kind)
    if get_origin(kind) is tuple and items[-1] is not Ellipsis:
        count = len(items)
        _need(len(value) == count, where, value, f"{count} values")
        kinds = items
    else:
        kinds = (items[0],) * len(value)
    read = [
        _read(each, item, f"{where}[{i}]", limits)
        for i, (each, item) in enumerate(zip(kinds, value, strict=True))
    ]
    return tuple(read) if get_origin(kind) is tuple else read


def _read_mapping(
    kind: Any, value: Any, where: str, limits: Mapping[str, Any]
) -> dict[Any, Any]:
    _need(isinstance(value, dict), where, value, "an object")
    limits = _check_content(value, where, limits)
    key_kind, item_kind = get_args(kind)
    read = {}
    for key, item in value.items():
        place = _inside(where, key)
        if key_kind is int:
            # JSON has no other keys than texts.
            _need(key.isdecimal(), where, key, "whole numbers as keys")
        read[key_kind(key)] = _read(item_kind, item, place, limits)
    return read


def _read_scalar(
    kind: Any, value: Any, where: str, limits: Mapping[str, Any]
) -> Any:
    if kind is Any:
        return value
    accepted = (int, float) if kind is float else kind
    fits = isinstance(value, accepted) and (
        kind is bool or not isinstance(value, bool)
    )
    if isinstance(value, int) and value.bit_length() > 1000:
        fits = False  # No float holds it.
    expected = _NAMES[kind]
    bounds = limits.get("range") if kind in (int, float) else None
    if bounds is not None:
        expected += f" from {bounds[0]:g} to {bounds[1]:g}"
        fits = fits and bounds[0] <= value <= bounds[1]
    if kind in (int, float):
        fits = fits and math.isfinite(value) and abs(value) <= _GREATEST
        if bounds is None and isinstance(value, (int, float)) and not fits:
            expected += f" from {-_GREATEST:g} to {_GREATEST:g}"
    _need(fits, where, value, expected)
    # A whole number stays one: it is written again as it was read.
    return value


def _check_content(
    value: Any, where: str, limits: Mapping[str, Any]
) -> Mapping[str, Any]:
    """Checks that something is there; gives the limits of what is inside."""
    if limits.get("not_empty") and not value:
        raise InputError(f"{where} is empty")
    length = limits.get("length")
    if length is not None:
        _need(len(value) == length, where, value, f"{length} values")
    inner = {"not_empty", "length"}
    return {k: v for k, v in limits.items() if k not in inner}


def _need(condition: bool, where: str, value: Any, expected: str) -> None:
    if not condition:
        raise InputError(
            f"{where} is {reprlib.repr(value)}, expected {expected}"
        )


def _inside(where: str, key: str) -> str:
    """The name of the part `key`; `where` may be a file and a colon."""
    joint = "" if not where or where.endswith(": ") else "."
    return f"{where}{joint}{key}"
