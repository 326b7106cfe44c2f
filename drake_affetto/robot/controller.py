"""The robot's own controller: rates, filter, scales and gains.

Its units are those of the robot: percent of a joint's range, kPa gauge, and
commands of 0..255.
"""

import dataclasses
import math
from pathlib import Path

from drake_affetto.common.errors import require, require_range
from drake_affetto.common.fields import check_ranges, number

PID_FILE = "package://drake_affetto/robot_pid.yaml"


@dataclasses.dataclass
class RobotJoint:
    """One joint of the robot as its own library controls it.

    Attributes:
        name: Name of the joint in the robot's model.
        actuator: Name of its actuator class.
        range_degrees: Range of the joint, 0 to 100 %, degrees.
        kP: Proportional gain, kPa per %.
        kD: Derivative gain, kPa per %/s.
        kI: Integral gain, kPa per % and sample.
    """

    name: str = ""
    actuator: str = ""
    range_degrees: float = number(90.0, 1.0, 360.0)
    kP: float = 0.0
    kD: float = 0.0
    kI: float = 0.0


@dataclasses.dataclass
class RobotController:
    """The robot's own PID controller of pressures.

    Attributes:
        control_rate: Rate of commands and of a log's rows, Hz.
        sensor_rate: Rate of the sensors and their filter, Hz.
        filter_order: Order of the angle's Butterworth filter.
        filter_cutoff: Cut-off frequency of that filter, Hz.
        stiffness: Command of both chambers at u = 0, kPa gauge.
        command_maximum: Pressure at the greatest command, kPa gauge.
        joints: Joints, in the order of the log's columns.
    """

    control_rate: float = number(30.0, 1.0, 1e3)
    sensor_rate: float = number(100.0, 1.0, 1e3)
    filter_order: int = number(5, 1, 8)
    filter_cutoff: float = 10.0
    stiffness: float = 400.0
    command_maximum: float = number(600.0, 1.0, math.inf)
    joints: list[RobotJoint] = dataclasses.field(default_factory=list)

    def check(self, where: str) -> None:
        """Raises InputError naming the first field that does not fit."""
        check_ranges(self, where)
        # Below half the sampling rate.
        require_range(
            f"{where}.filter_cutoff",
            self.filter_cutoff,
            0.1,
            0.499 * self.sensor_rate,
        )


def load_robot_controller(file: str | Path = PID_FILE) -> RobotController:
    """Reads the robot's controller from a YAML file.

    Args:
        file: The file, or its package:// URI.

    Raises:
        InputError: If the file or a value in it does not fit.
    """
    # It imports Drake, which the mathematics do without.
    from drake_affetto.common.yaml_config import load_config

    return load_config(RobotController, file)


def require_joint(controller: RobotController, joint: int) -> RobotJoint:
    """The joint of that number in the logs.

    Raises:
        InputError: If the controller has no such joint.
    """
    require(
        0 <= joint < len(controller.joints),
        "joint",
        joint,
        f"a number from 0 to {len(controller.joints) - 1}",
    )
    return controller.joints[joint]
