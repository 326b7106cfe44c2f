"""What can be in a log of the robot: units, rates, gaps and readings."""

from collections.abc import Mapping
import dataclasses
from pathlib import Path

import numpy as np

from drake_affetto.common.errors import InputError, require_interval
from drake_affetto.common.fields import check_ranges, number
from drake_affetto.common.typing import Array

LIMITS_FILE = "package://drake_affetto/robot_log.yaml"


@dataclasses.dataclass
class LogLimits:
    """What can be in a log; see `models/robot_log.yaml`.

    Attributes:
        rate: Least and greatest rate of the rows, Hz.
        longest_gap: Longest time between two rows, s.
        angle: Least and greatest angle, measured or wanted, %.
        pressure: Least and greatest pressure, kPa gauge.
        command: Least and greatest command.
    """

    rate: list[float] = dataclasses.field(default_factory=lambda: [5.0, 1e3])
    longest_gap: float = number(0.3, 1e-3, 10.0)
    angle: list[float] = dataclasses.field(
        default_factory=lambda: [-20.0, 120.0]
    )
    pressure: list[float] = dataclasses.field(
        default_factory=lambda: [-20.0, 800.0]
    )
    command: list[float] = dataclasses.field(
        default_factory=lambda: [0.0, 255.0]
    )

    def check(self, where: str) -> None:
        """Raises InputError naming the first field that does not fit."""
        check_ranges(self, where)
        for name in ("rate", "angle", "pressure", "command"):
            require_interval(f"{where}.{name}", getattr(self, name))


def load_limits(file: str | Path = LIMITS_FILE) -> LogLimits:
    """Reads what can be in a log from a YAML file.

    Raises:
        InputError: If the file or a value in it does not fit.
    """
    # It imports Drake, which the mathematics do without.
    from drake_affetto.common.yaml_config import load_config

    return load_config(LogLimits, file)


def require_between(
    path: Path,
    name: str,
    data: Mapping[str, Array],
    low: float,
    high: float,
    unit: str,
) -> None:
    """Raises InputError for the first value of a column that cannot be."""
    column = data[name]
    # What is not a number fails these comparisons too.
    good = (column >= low) & (column <= high) & np.isfinite(column)
    if not good.all():
        i = int(np.argmin(good))
        span = f" from {low:g} to {high:g}" if np.isfinite(low) else ""
        raise InputError(
            f"{path}: column {name} is {column[i]:g} in row {i + 1} "
            f"(t = {data['t'][i]:g} s), expected a number{span} ({unit})"
        )


def require_times(path: Path, t: Array, limits: LogLimits) -> None:
    """Raises InputError for times that no robot can have written."""
    if not np.isfinite(t).all():
        i = int(np.argmin(np.isfinite(t)))
        raise InputError(
            f"{path}: column t is {t[i]:g} in row {i + 1}, expected a time, s"
        )
    step = np.diff(t)
    back = np.flatnonzero(step <= 0.0)
    if back.size:
        i = int(back[0])
        raise InputError(
            f"{path}: time does not increase from row {i + 1} "
            f"(column t is {t[i]:g} s) to row {i + 2} ({t[i + 1]:g} s)"
        )
    low, high = limits.rate
    rate = 1.0 / float(np.median(step))
    if not low <= rate <= high:
        hint = ""
        for unit, factor in (("ms", 1e3), ("µs", 1e6), ("ns", 1e9)):
            if low <= rate * factor <= high:
                hint = f"; is the time in {unit}?"
        raise InputError(
            f"{path}: column t has {rate:.3g} rows a second, expected "
            f"{low:g} to {high:g}{hint}"
        )
    gap = int(np.argmax(step))
    if step[gap] > limits.longest_gap:
        raise InputError(
            f"{path}: {step[gap]:.3g} s are missing in column t between row "
            f"{gap + 1} (t = {t[gap]:g} s) and row {gap + 2}, expected at "
            f"most {limits.longest_gap:g} s"
        )
