"""Reads typed YAML, and says in one line what in it does not fit.

Names of files in it (fields of `fields.file_name`) are relative to the file
that holds them, wherever the program was started.
"""

from collections.abc import Mapping, Sequence
import copy
import dataclasses
import difflib
import math
from pathlib import Path
import types
import typing
from typing import Any, Protocol, TypeVar

from pydrake.common.yaml import yaml_load_typed
import yaml

from drake_affetto.common.errors import InputError, shown
from drake_affetto.common.resources import anchor, resolve
from drake_affetto.common.strict_yaml import parse_yaml, read_text


class _Checked(Protocol):
    """A dataclass with defaults that knows what values make sense."""

    def check(self, where: str) -> None: ...


Schema = TypeVar("Schema")
Config = TypeVar("Config", bound=_Checked)


def read_yaml(path: Path) -> dict[str, Any]:
    """The mapping that the file `path` holds.

    Raises:
        InputError: if the file cannot be read, is not YAML (see
            `strict_yaml`), or holds anything but a mapping.
    """
    data = parse_yaml(read_text(path), str(path))
    if data is None:
        raise InputError(
            f"{path} is empty, expected a mapping of fields to values"
        )
    if not isinstance(data, dict):
        raise InputError(f"{path} holds no mapping at its top")
    return data


def anchored(data: Any, schema: Any, folder: Path) -> Any:
    """`data` with the relative names of files in it made absolute.

    Args:
        data: What a file holds, as plain YAML data.
        schema: The dataclass that it fills; fields of `fields.file_name` and
            `fields.file_names` name files.
        folder: The folder of that file.
    """
    if not isinstance(data, Mapping) or not dataclasses.is_dataclass(schema):
        return data
    marked = {
        f.name for f in dataclasses.fields(schema) if f.metadata.get("file")
    }
    kinds = _fields(schema)
    found = {}
    for key, value in data.items():
        if key in marked and isinstance(value, list):
            found[key] = [anchor(each, folder) for each in value]
        elif key in marked:
            found[key] = anchor(value, folder)
        else:
            found[key] = anchored(
                value, _strip_optional(kinds.get(key)), folder
            )
    return found


def typed(
    schema: type[Schema],
    data: dict[str, Any],
    *,
    where: str,
    defaults: Schema | None = None,
) -> Schema:
    """Fills a `schema` dataclass from `data` by Drake's YAML rules.

    Args:
        where: how an error names the whole, for instance the file.
        defaults: what holds where `data` is silent.

    Raises:
        InputError: for an unknown field or a value of the wrong type, by name.
    """
    _refuse_unknown(data, schema, where)
    # Drake's reader takes some misfits (the letters of a word for a list).
    misfit = _first_misfit(data, schema, where)
    if misfit is not None:
        raise InputError(misfit)
    try:
        return yaml_load_typed(
            schema=schema,
            data=yaml.safe_dump(data),
            defaults=copy.deepcopy(defaults),
            retain_map_defaults=True,
        )
    except (
        RuntimeError,
        TypeError,
        ValueError,
        AssertionError,
        AttributeError,
    ) as error:
        raise InputError(f"{where}: {error}") from error


def load_config(
    schema: type[Config],
    source: Config | str | Path,
    overlays: Sequence[str | Path] = (),
) -> Config:
    """Reads a file over the defaults of `schema`, and checks the whole.

    Args:
        schema: a dataclass with defaults and a method `check(where)`.
        source: the file, its package:// URI, or the values themselves.
        overlays: further files, each holding only what it changes.

    Raises:
        InputError: for a file or a value that does not fit, by name.
    """
    files = list(overlays)
    if isinstance(source, schema):
        config, where = source, schema.__name__
    else:
        assert isinstance(source, (str, Path))
        config, where = schema(), resolve(source).name
        files.insert(0, source)
    for item in files:
        path = resolve(item)
        data = anchored(read_yaml(path), schema, path.parent)
        config = typed(schema, data, where=path.name, defaults=config)
    config.check(where)
    return config


def _fields(schema: Any) -> dict[str, Any]:
    """Names and types of the fields of a schema, or {} for anything else."""
    if dataclasses.is_dataclass(schema):
        hints = typing.get_type_hints(schema)
        return {f.name: hints[f.name] for f in dataclasses.fields(schema)}
    if hasattr(schema, "__fields__"):
        return {f.name: f.type for f in schema.__fields__}
    return {}


def _strip_optional(schema: Any) -> Any:
    if typing.get_origin(schema) in (typing.Union, types.UnionType):
        rest = [a for a in typing.get_args(schema) if a is not type(None)]
        if len(rest) == 1:
            return rest[0]
    return schema


def _refuse_unknown(data: Any, schema: Any, where: str) -> None:
    schema = _strip_optional(schema)
    origin, args = typing.get_origin(schema), typing.get_args(schema)
    if origin is list and isinstance(data, list):
        for i, item in enumerate(data):
            _refuse_unknown(item, args[0], f"{where}[{i}]")
    elif origin in (dict, Mapping) and isinstance(data, Mapping):
        for key, item in data.items():
            _refuse_unknown(item, args[1], f"{where}.{key}")
    fields = _fields(schema)
    if not fields or not isinstance(data, Mapping):
        return
    for key, item in data.items():
        if key == "_tag":
            continue
        if key not in fields:
            near = difflib.get_close_matches(str(key), fields, n=1)
            hint = (
                f"did you mean {near[0]!r}?"
                if near
                else (f"known are {', '.join(fields)}")
            )
            raise InputError(f"{where} has no field {shown(key)}; {hint}")
        _refuse_unknown(item, fields[key], f"{where}.{key}")


_SCALARS = {int: "a whole number", float: "a number", str: "text"}


def _is_scalar(schema: type, data: Any) -> bool:
    """Whether `data` is a number or a text, as `schema` says."""
    if isinstance(data, bool) or not isinstance(data, (int, float, str)):
        return False
    if schema is str or isinstance(data, str):
        return schema is str and isinstance(data, str)
    try:
        number = float(data)
    except OverflowError:
        return False
    return math.isfinite(number) and (schema is float or number.is_integer())


def _first_misfit(data: Any, schema: Any, where: str) -> str | None:
    """Says which value of `data` does not have the type of `schema`."""
    if typing.get_origin(schema) in (typing.Union, types.UnionType) and (
        data is None
    ):
        return None
    schema = _strip_optional(schema)
    origin, args = typing.get_origin(schema), typing.get_args(schema)
    expected = None
    if schema is bool and not isinstance(data, bool):
        expected = "true or false"
    elif schema in _SCALARS:
        if not _is_scalar(schema, data):
            expected = _SCALARS[schema]
            if isinstance(data, (int, float)) and schema is float:
                expected = "a finite number"
    elif origin is list:
        if not isinstance(data, list):
            expected = "a list"
        else:
            for i, item in enumerate(data):
                found = _first_misfit(item, args[0], f"{where}[{i}]")
                if found:
                    return found
    elif origin in (dict, Mapping) or _fields(schema):
        if not isinstance(data, Mapping):
            expected = "a mapping"
        else:
            fields = _fields(schema)
            for key, item in data.items():
                kind = args[1] if not fields else fields.get(key)
                if not fields and args[0] is str and not isinstance(key, str):
                    return f"{where} has the key {shown(key)}, expected text"
                if kind is None:
                    continue
                found = _first_misfit(item, kind, f"{where}.{key}")
                if found:
                    return found
    if expected is None:
        return None
    return f"{where} is {shown(data)}, expected {expected}"
