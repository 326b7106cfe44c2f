"""Errors that a user can mend, each told in one line."""

from collections.abc import Iterator, Sequence
import contextlib
import math
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from drake_affetto.common.typing import Array


class InputError(ValueError):
    """Something the user gave does not fit; the message says what and why.

    The command line prints the message alone and exits with code 2.
    """


# Longer values are cut in the middle: a message is one line.
_LONGEST_VALUE = 160


def shown(value: Any) -> str:
    """`value` as a message shows it: its repr, cut if it is long."""
    text = repr(value)
    if len(text) > _LONGEST_VALUE:
        half = _LONGEST_VALUE // 2
        text = f"{text[:half]}...{text[-half:]}"
    return text


def require(condition: bool, field: str, value: Any, expected: str) -> None:
    """Raises InputError naming `field`, `value` and what was `expected`."""
    if not condition:
        raise InputError(f"{field} is {shown(value)}, expected {expected}")


def one_line(message: object) -> str:
    """A message of others, which may have several lines, as one."""
    return " ".join(str(message).split())


@contextlib.contextmanager
def naming(where: str) -> Iterator[None]:
    """Names the whole, a file or a field, in errors about a part of it."""
    try:
        yield
    except InputError as error:
        raise InputError(f"{where}: {error}") from error


def require_range(
    field: str,
    value: float,
    low: float = -math.inf,
    high: float = math.inf,
) -> None:
    """Raises InputError unless `value` is a number in [low, high]."""
    if math.isinf(low) and math.isinf(high):
        expected = "a finite number"
    elif math.isinf(low):
        expected = f"a number of at most {high:g}"
    elif math.isinf(high):
        expected = f"a number of at least {low:g}"
    else:
        expected = f"a number from {low:g} to {high:g}"
    # A truth value is no number, though Python's are.
    fits = isinstance(value, (int, float)) and not isinstance(value, bool)
    fits = fits and low <= value <= high
    require(fits and abs(value) < math.inf, field, value, expected)


def require_choice(field: str, value: Any, *choices: Any) -> None:
    """Raises InputError unless `value` is one of `choices`."""
    require(value in choices, field, value, " or ".join(map(repr, choices)))


def require_interval(field: str, value: Sequence[float]) -> None:
    """Raises InputError unless `value` is a lower and a greater upper limit."""
    expected = "a lower and a greater upper limit"
    require(
        isinstance(value, Sequence) and len(value) == 2, field, value, expected
    )
    for i, limit in enumerate(value):
        require_range(f"{field}[{i}]", limit)
    require(value[0] < value[1], field, value, expected)


def require_array(
    field: str,
    value: Any,
    shape: tuple[int | None, ...] | None = None,
    *,
    low: float = -math.inf,
    high: float = math.inf,
    positive: bool = False,
    expected: str = "",
) -> "Array":
    """Returns `value` as an array of finite numbers in [low, high].

    Args:
        field: Name of the array in errors.
        value: What is converted to an array of floats.
        shape: Expected shape; None where any length fits, or for any shape.
        low: Least value of an entry.
        high: Greatest value of an entry.
        positive: Whether entries must be above 0.
        expected: What the array should be, in words, for a wrong shape.

    Raises:
        InputError: If it is no array of numbers, has another shape, or an
            entry does not fit: the message names the first such entry by its
            index and value.
    """
    import numpy as np

    try:
        array = np.asarray(value, dtype=float)
    except (TypeError, ValueError) as error:
        raise InputError(f"{field} is no array of numbers") from error
    fits = shape is None or (
        array.ndim == len(shape)
        and all(
            want is None or want == size
            for want, size in zip(shape, array.shape, strict=True)
        )
    )
    if not fits:
        assert shape is not None
        sizes = ", ".join("any" if n is None else str(n) for n in shape)
        sizes += "," if len(shape) == 1 else ""
        raise InputError(
            f"{field} is an array of shape {array.shape}, expected "
            f"{expected or 'the shape'} ({sizes})"
        )
    good = np.isfinite(array) & (array >= low) & (array <= high)
    if positive:
        good &= array > 0.0
    if not good.all():
        index = tuple(int(i) for i in np.argwhere(~good)[0])
        place = field
        if index:
            place += f"[{', '.join(map(str, index))}]"
        entry = float(array[index])
        if positive:
            require(False, place, entry, "a number above 0")
        require_range(place, entry, low, high)
    return array


def require_file(field: str, path: str | Path) -> Path:
    """Returns `path` as a Path; raises InputError where no such file is."""
    path = Path(path)
    require(path.is_file(), field, str(path), "an existing file")
    return path
