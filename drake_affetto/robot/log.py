"""Logs of the robot's own library.

They are in the robot's units: percent of a joint's range, kPa gauge, and
commands of 0..255.
"""

import dataclasses
from pathlib import Path

import numpy as np

from drake_affetto.common.csv_columns import read_columns
from drake_affetto.common.errors import InputError
from drake_affetto.common.log_limits import (
    LogLimits,
    load_limits,
    require_between,
    require_times,
)
from drake_affetto.common.typing import Array
from drake_affetto.robot.controller import RobotController

# The greatest command on the wire.
COMMAND_MAXIMUM = 255.0


@dataclasses.dataclass(frozen=True)
class JointCourse:
    """What a joint did; arrays have a value for each of N rows.

    Attributes:
        t: Time from the first row, s.
        q: Raw joint angle, % of the range.
        p_a: Raw pressure of chamber a, kPa gauge.
        p_b: Raw pressure of chamber b, kPa gauge.
        c_a: Commanded pressure of chamber a, kPa gauge.
        c_b: Commanded pressure of chamber b, kPa gauge.
    """

    t: Array
    q: Array
    p_a: Array
    p_b: Array
    c_a: Array
    c_b: Array


@dataclasses.dataclass(frozen=True)
class RobotLog(JointCourse):
    """One joint's part of a log; arrays have a value for each of N rows.

    Attributes:
        name: Name of the file, without its suffix.
        joint: Number of the joint in the log.
        q_des: Reference angle, %; not a number in a log that was made at the
            wire, where the reference is never seen.
        dq_des: Reference velocity, %/s.
        q_filtered: Angle that the robot's controller used, %.
        dq_filtered: Velocity that the robot's controller used, %/s.
    """

    name: str
    joint: int
    q_des: Array
    dq_des: Array
    q_filtered: Array
    dq_filtered: Array

    @property
    def has_reference(self) -> bool:
        """Whether the log says which angles were wanted."""
        return bool(np.all(np.isfinite(self.q_des)))


def read_log(
    path: str | Path,
    joint: int,
    controller: RobotController,
    *,
    driven: bool = True,
    limits: LogLimits | None = None,
) -> RobotLog:
    """Reads one joint from a CSV log of the robot.

    Required columns (k is the joint): t, rqk, rpak, rpbk, cak, cbk.
    Optional columns: qdesk, dqdesk, qk, dqk.

    Args:
        path: The CSV file.
        joint: Number of the joint.
        controller: The robot's controller, which has the scale of commands.
        driven: Whether to refuse a log in which the joint was not driven.
        limits: What can be in a log; those of `LIMITS_FILE` by default.

    Raises:
        InputError: If the file is not such a log, or holds what cannot be, in
            units or in time; it names file, column and row.
    """
    path = Path(path)
    data = read_columns(
        path,
        [
            "t",
            *(f"{name}{joint}" for name in ("rq", "rpa", "rpb", "ca", "cb")),
        ],
        [f"{name}{joint}" for name in ("qdes", "dqdes", "q", "dq")],
    )
    limits = limits or load_limits()
    t = data["t"]
    require_times(path, t, limits)
    for name, (low, high), unit in (
        (f"rq{joint}", limits.angle, "% of the joint's range"),
        (f"qdes{joint}", limits.angle, "% of the joint's range"),
        (f"q{joint}", limits.angle, "% of the joint's range"),
        (f"rpa{joint}", limits.pressure, "kPa gauge"),
        (f"rpb{joint}", limits.pressure, "kPa gauge"),
        (f"ca{joint}", limits.command, "as on the wire"),
        (f"cb{joint}", limits.command, "as on the wire"),
        (f"dqdes{joint}", (-np.inf, np.inf), "%/s"),
        (f"dq{joint}", (-np.inf, np.inf), "%/s"),
    ):
        if name in data:
            require_between(path, name, data, low, high, unit)
    if t[-1] - t[0] < 2.0:
        raise InputError(
            f"{path}: {t[-1] - t[0]:.2f} s long, at least 2 s are needed"
        )
    scale = controller.command_maximum / COMMAND_MAXIMUM
    q = data[f"rq{joint}"]
    q_des = data.get(f"qdes{joint}", np.full(t.size, np.nan))
    log = RobotLog(
        name=path.stem,
        joint=joint,
        t=t - t[0],
        q=q,
        p_a=data[f"rpa{joint}"],
        p_b=data[f"rpb{joint}"],
        c_a=scale * data[f"ca{joint}"],
        c_b=scale * data[f"cb{joint}"],
        q_des=q_des,
        dq_des=data.get(f"dqdes{joint}", np.gradient(q_des, t)),
        q_filtered=data.get(f"q{joint}", q),
        dq_filtered=data.get(f"dq{joint}", np.gradient(q, t)),
    )
    if driven:
        _require_driven(path, log)
    return log


def _require_driven(path: Path, log: RobotLog) -> None:
    """Raises InputError for a joint that stands, or is moved by hand."""
    if np.ptp(log.q) < 5.0:
        raise InputError(
            f"{path}: joint {log.joint} does not move "
            f"({np.ptp(log.q):.1f} % of its range)"
        )
    swing = max(np.ptp(log.c_a), np.ptp(log.c_b))
    if swing < 5.0:
        raise InputError(
            f"{path}: joint {log.joint} moves, but its commands do not "
            f"({swing:.1f} kPa): a recording led by hand?"
        )
