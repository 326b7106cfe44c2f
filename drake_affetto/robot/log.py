"""Logs of the robot's own library, and the control law that made them.

Here alone live the robot's units: percent of a joint's range, kPa gauge, and
commands of 0..255. What leaves this module is in rad and Pa absolute.
"""

import dataclasses
import math
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from drake_affetto.common.csv_columns import read_columns
from drake_affetto.common.errors import InputError, require, require_range

PID_FILE = "package://drake_affetto/robot_pid.yaml"
COMMAND_MAXIMUM = 255.0
"""The greatest command on the wire."""


@dataclasses.dataclass
class RobotJoint:
    """One joint of the robot as its own library drives it.

    Args:
        name: the joint's name in the robot's model.
        actuator: its actuator class.
        range_degrees: what 0 to 100 % stand for.
        kP: kPa per %.
        kD: kPa per %/s.
        kI: kPa per % and sample.
    """

    name: str = ""
    actuator: str = ""
    range_degrees: float = 90.0
    kP: float = 0.0
    kD: float = 0.0
    kI: float = 0.0


@dataclasses.dataclass
class RobotStack:
    """The robot's control stack.

    Args:
        control_rate: of commands and log rows, Hz.
        sensor_rate: of the sensors and their filter, Hz.
        filter_order: order of the Butterworth filter of the angle.
        filter_cutoff: its cut-off, Hz.
        stiffness: command of both chambers at u = 0, kPa gauge.
        command_maximum: pressure of the greatest command, kPa gauge.
        joints: the joints, in the order of the log's columns.
    """

    control_rate: float = 30.0
    sensor_rate: float = 100.0
    filter_order: int = 5
    filter_cutoff: float = 10.0
    stiffness: float = 400.0
    command_maximum: float = 600.0
    joints: list[RobotJoint] = dataclasses.field(default_factory=list)

    def check(self, where: str) -> None:
        """Raises InputError naming the first field that does not fit."""
        require_range(f"{where}.control_rate", self.control_rate, 1.0, 1e3)
        require_range(f"{where}.sensor_rate", self.sensor_rate, 1.0, 1e3)
        require_range(f"{where}.filter_order", self.filter_order, 1, 8)
        require_range(
            f"{where}.filter_cutoff",
            self.filter_cutoff,
            0.1,
            0.499 * self.sensor_rate,
        )
        require_range(f"{where}.command_maximum", self.command_maximum, 1.0)
        for i, joint in enumerate(self.joints):
            require_range(
                f"{where}.joints[{i}].range_degrees",
                joint.range_degrees,
                1.0,
                360.0,
            )


def load_stack(file: str | Path = PID_FILE) -> RobotStack:
    """Reads the robot's control stack from YAML.

    Raises:
        InputError: for a file or a value that does not fit, by name.
    """
    # Drake's YAML reader is behind this; the mathematics need none of it.
    from drake_affetto.common.yaml_config import load_config

    return load_config(RobotStack, file)


@dataclasses.dataclass(frozen=True)
class RobotLog:
    """One joint's part of a log, N rows; percent and kPa gauge as logged.

    Attributes:
        name: the file's stem.
        joint: the joint's number in the log.
        t: time, s.
        q: raw joint angle, % of range.
        p_a: raw pressure of chamber a, kPa gauge.
        p_b: of chamber b.
        c_a: commanded pressure of chamber a, kPa gauge.
        c_b: of chamber b.
        q_des: reference angle, %.
        dq_des: its rate, %/s.
        q_filtered: what the robot's controller took for the angle, %.
        dq_filtered: and for its rate, %/s.
    """

    name: str
    joint: int
    t: NDArray[np.float64]
    q: NDArray[np.float64]
    p_a: NDArray[np.float64]
    p_b: NDArray[np.float64]
    c_a: NDArray[np.float64]
    c_b: NDArray[np.float64]
    q_des: NDArray[np.float64]
    dq_des: NDArray[np.float64]
    q_filtered: NDArray[np.float64]
    dq_filtered: NDArray[np.float64]


def read_log(
    path: str | Path, joint: int, stack: RobotStack, *, driven: bool = True
) -> RobotLog:
    """Reads one joint from a CSV log of the robot.

    Columns needed (k is the joint): t, rqk, rpak, rpbk, cak, cbk, qdesk. Used
    where they are there: dqdesk, qk, dqk.

    Args:
        path: the CSV file.
        joint: number of the joint.
        stack: scales of the commands.
        driven: whether to refuse a log in which the joint was not driven.

    Raises:
        InputError: naming the file and what is wrong with it.
    """
    path = Path(path)
    data = read_columns(
        path,
        [
            "t",
            *(f"{name}{joint}" for name in ("rq", "rpa", "rpb", "ca", "cb")),
            f"qdes{joint}",
        ],
        [f"dqdes{joint}", f"q{joint}", f"dq{joint}"],
    )
    for name, column in data.items():
        bad = np.flatnonzero(~np.isfinite(column))
        if bad.size:
            raise InputError(
                f"{path}: column {name} is {column[bad[0]]} in row "
                f"{bad[0] + 1} (t = {data['t'][bad[0]]:g} s)"
            )
    t = data["t"]
    back = np.flatnonzero(np.diff(t) <= 0.0)
    if back.size:
        i = int(back[0])
        raise InputError(
            f"{path}: time does not increase from row {i + 1} "
            f"(t = {t[i]:g} s) to the next ({t[i + 1]:g} s)"
        )
    if t[-1] - t[0] < 2.0:
        raise InputError(
            f"{path}: {t[-1] - t[0]:.2f} s long, at least 2 s are needed"
        )
    scale = stack.command_maximum / COMMAND_MAXIMUM
    q = data[f"rq{joint}"]
    q_des = data[f"qdes{joint}"]
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


def initial_sum(log: RobotLog, joint: RobotJoint, stack: RobotStack) -> float:
    """Σe with which the controller came into the log, % samples.

    It is a state of the controller before the log begins (a run carries on
    the sum of the one before), read off the first row's command.
    """
    if joint.kI == 0.0:
        return 0.0
    error = log.q_des[0] - log.q_filtered[0]
    u = log.c_a[0] - stack.stiffness
    rest = u - joint.kP * error
    rest -= joint.kD * (log.dq_des[0] - log.dq_filtered[0])
    carried = rest / joint.kI - error
    return carried if math.isfinite(carried) else 0.0


def law_mismatch(log: RobotLog, joint: RobotJoint, stack: RobotStack) -> float:
    """Root mean square by which the log's commands differ from the law, kPa.

    Near zero where the log was made with these gains; where it is not, a
    simulation in closed loop with them is not the robot's.
    """
    error = log.q_des - log.q_filtered
    total = initial_sum(log, joint, stack) + np.cumsum(error)
    u = joint.kP * error + joint.kD * (log.dq_des - log.dq_filtered)
    u += joint.kI * total
    command = np.clip(stack.stiffness + u, 0.0, stack.command_maximum)
    return float(np.sqrt(np.mean((command - log.c_a) ** 2)))


def require_joint(stack: RobotStack, joint: int) -> RobotJoint:
    """The joint with that number.

    Raises:
        InputError: if the stack has no such joint.
    """
    require(
        0 <= joint < len(stack.joints),
        "joint",
        joint,
        f"a number from 0 to {len(stack.joints) - 1}",
    )
    return stack.joints[joint]
