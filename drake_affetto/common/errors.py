"""Errors that a user can mend, each told in one line."""

import math
from pathlib import Path
from typing import Any


class InputError(ValueError):
    """Something the user gave does not fit; the message says what and why.

    The command line prints the message alone and exits with code 2.
    """


def require(condition: bool, field: str, value: Any, expected: str) -> None:
    """Raises InputError naming `field`, `value` and what was `expected`."""
    if not condition:
        raise InputError(f"{field} is {value!r}, expected {expected}")


def require_range(
    field: str,
    value: float,
    low: float = -math.inf,
    high: float = math.inf,
) -> None:
    """Raises InputError unless `value` is a number in [low, high]."""
    if math.isinf(low):
        expected = f"a number of at most {high:g}"
    elif math.isinf(high):
        expected = f"a number of at least {low:g}"
    else:
        expected = f"a number from {low:g} to {high:g}"
    fits = isinstance(value, (int, float)) and low <= value <= high
    require(fits and math.isfinite(value), field, value, expected)


def require_file(field: str, path: str | Path) -> Path:
    """Returns `path` as a Path; raises InputError where no such file is."""
    path = Path(path)
    require(path.is_file(), field, str(path), "an existing file")
    return path
