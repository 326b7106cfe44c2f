"""The real robot: its logs and its controller."""

from typing import TYPE_CHECKING

from drake_affetto.common.lazy import attach

if TYPE_CHECKING:
    from drake_affetto.robot.controller import (
        RobotController,
        RobotJoint,
        load_robot_controller,
    )
    from drake_affetto.robot.log import RobotLog, read_log

__getattr__, __dir__, __all__ = attach(
    __name__,
    {
        "RobotController": "controller",
        "RobotJoint": "controller",
        "RobotLog": "log",
        "load_robot_controller": "controller",
        "read_log": "log",
    },
)
