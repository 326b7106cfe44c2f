"""The real robot: its logs, its controller, its wire and both ends of it."""

from typing import TYPE_CHECKING

from drake_affetto.common.lazy import attach

if TYPE_CHECKING:
    from drake_affetto.robot.command_inbox import (
        CommandInbox,
    )
    from drake_affetto.robot.controller import (
        RobotController,
        RobotJoint,
        load_robot_controller,
    )
    from drake_affetto.robot.hardware_station import (
        HardwareStation,
        make_station,
    )
    from drake_affetto.robot.log import (
        RobotLog,
        read_log,
    )
    from drake_affetto.robot.pid_system import (
        RobotPid,
        make_set_points,
    )
    from drake_affetto.robot.recording import (
        WireRecording,
    )
    from drake_affetto.robot.schedule import (
        Schedule,
    )
    from drake_affetto.robot.server import (
        RobotServer,
        WireSockets,
    )
    from drake_affetto.robot.simulated_robot import (
        SimulatedRobot,
    )
    from drake_affetto.robot.wire import (
        PacketCodec,
        PacketError,
        RobotWire,
        WireJoint,
        load_wire,
    )
    from drake_affetto.robot.wire_driver import (
        WireDriver,
    )

__getattr__, __dir__, __all__ = attach(
    __name__,
    {
        "CommandInbox": "command_inbox",
        "HardwareStation": "hardware_station",
        "PacketCodec": "wire",
        "PacketError": "wire",
        "RobotController": "controller",
        "RobotJoint": "controller",
        "RobotLog": "log",
        "RobotPid": "pid_system",
        "RobotServer": "server",
        "RobotWire": "wire",
        "Schedule": "schedule",
        "SimulatedRobot": "simulated_robot",
        "WireDriver": "wire_driver",
        "WireJoint": "wire",
        "WireRecording": "recording",
        "WireSockets": "server",
        "load_robot_controller": "controller",
        "load_wire": "wire",
        "make_set_points": "pid_system",
        "make_station": "hardware_station",
        "read_log": "log",
    },
)
