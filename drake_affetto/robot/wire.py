"""Packets of the robot's wire: text to arrays in SI units, and back.

The robot sends `q pa pb` for each joint, blank-separated: % of the joint's
range and kPa gauge. It takes `ca cb` for each joint, 0..255: set-points of the
two chambers. Whatever comes in is only parsed as numbers.
"""

from collections.abc import Sequence
import dataclasses
from pathlib import Path

import numpy as np

from drake_affetto.common.errors import (
    InputError,
    require,
    require_choice,
    require_interval,
    require_range,
)
from drake_affetto.common.fields import check_ranges, number
from drake_affetto.common.typing import Array
from drake_affetto.robot.log import COMMAND_MAXIMUM

WIRE_FILE = "package://drake_affetto/robot_wire.yaml"
LONGEST_PACKET = 1024
"""The longest packet that either side reads, bytes."""

_KPA = 1e3
_ANGLE_CHARACTERS = frozenset(b"0123456789+-.eE \t\r\n")


class PacketError(ValueError):
    """A packet that is no message; the text says why."""


@dataclasses.dataclass
class WireJoint:
    """One joint on the wire.

    Attributes:
        name: Name of the joint in the robot's model.
        at_0: Its angle at 0 %, degrees.
        at_100: Its angle at 100 %, degrees.
        offset_a: What the sensor of chamber a reads too much, kPa.
        offset_b: The same of chamber b, kPa.
    """

    name: str = ""
    at_0: float = number(0.0, -360.0, 360.0)
    at_100: float = number(90.0, -360.0, 360.0)
    offset_a: float = number(0.0, -200.0, 200.0)
    offset_b: float = number(0.0, -200.0, 200.0)


@dataclasses.dataclass
class RobotWire:
    """How the robot is spoken to.

    Attributes:
        command_low: Set-point of the command 0, kPa gauge.
        command_high: Set-point of the command 255, kPa gauge.
        command_timeout: Time without commands until `on_silence`, s.
        on_silence: "hold" the last command, or "vent" all chambers.
        out_of_range: What becomes of a packet with a value beyond 0..255:
            "ignore" it, or "clip" the value.
        stale_after: Age from which sensor data are not trusted, s.
        angle_low, angle_high: Angles that a sensor can read, %.
        pressure_low, pressure_high: Pressures that it can read, kPa gauge.
        atmospheric_pressure: What gauge pressures are measured from, Pa.
        joints: Joints in the order of the packets.
    """

    command_low: float = 0.0
    command_high: float = 600.0
    command_timeout: float = number(1.0, 0.05, 3600.0)
    on_silence: str = "vent"
    out_of_range: str = "ignore"
    stale_after: float = number(0.1, 0.01, 10.0)
    angle_low: float = -2.0
    angle_high: float = 102.0
    pressure_low: float = -50.0
    pressure_high: float = 1000.0
    atmospheric_pressure: float = number(101.3e3, 1e4, 2e5)
    joints: list[WireJoint] = dataclasses.field(default_factory=list)

    def check(self, where: str) -> None:
        """Raises InputError naming the first field that does not fit."""
        check_ranges(self, where)
        for part in ("command", "angle", "pressure"):
            require_interval(
                f"{where}.{part}_low, {part}_high",
                [getattr(self, f"{part}_low"), getattr(self, f"{part}_high")],
            )
        require_range(f"{where}.command_low", self.command_low, -100.0, 2e3)
        require_range(f"{where}.command_high", self.command_high, -100.0, 2e3)
        require_choice(f"{where}.on_silence", self.on_silence, "hold", "vent")
        require_choice(
            f"{where}.out_of_range", self.out_of_range, "ignore", "clip"
        )
        for i, joint in enumerate(self.joints):
            require(
                joint.at_0 != joint.at_100,
                f"{where}.joints[{i}].at_100",
                joint.at_100,
                "another angle than at 0 %",
            )

    @property
    def names(self) -> list[str]:
        """Names of the joints, in the order of the packets."""
        return [joint.name for joint in self.joints]


def load_wire(
    file: str | Path = WIRE_FILE, joint_names: Sequence[str] | None = None
) -> RobotWire:
    """Reads how the robot is spoken to from a YAML file.

    Args:
        file: The file, or its package:// URI.
        joint_names: Joints that must be on the wire, in this order.

    Raises:
        InputError: If the file or a value in it does not fit.
    """
    # It imports Drake, which the mathematics do without.
    from drake_affetto.common.yaml_config import load_config

    wire = load_config(RobotWire, file)
    if joint_names is not None and wire.names != list(joint_names):
        raise InputError(
            f"active_joints are {', '.join(joint_names)}, expected those of "
            f"{Path(str(file)).name} in their order: {', '.join(wire.names)}"
        )
    return wire


class PacketCodec:
    """Makes and reads the packets of a robot of n joints.

    Angles (n,) are in rad; pressures (2n,) = [p_a; p_b] in Pa absolute, where
    chamber a is the one that turns the joint towards greater angles. For a
    joint whose percent count the other way it is the wire's chamber b.
    """

    def __init__(self, wire: RobotWire):
        """Prepares the scales of the wire's joints.

        Args:
            wire: Joints, their ranges and their order on the wire.
        """
        n = len(wire.joints)
        require(n > 0, "joints", wire.joints, "at least one joint")
        self.num_joints = n
        self._wire = wire
        self._at_0 = np.radians([j.at_0 for j in wire.joints])
        self._span = np.radians([j.at_100 for j in wire.joints]) - self._at_0
        # Where [p_a; p_b] stand among the wire's pairs a, b, a, b ...
        swapped = self._span < 0.0
        pairs = 2 * np.arange(n)
        self._places = np.concatenate([pairs + swapped, pairs + ~swapped])
        self._offsets = np.array(
            [[j.offset_a, j.offset_b] for j in wire.joints]
        )
        self._levels = COMMAND_MAXIMUM / (wire.command_high - wire.command_low)

    def sensor_values(self, q: Array, pressure: Array) -> Array:
        """What the sensors read, (3n,): q pa pb of each joint, %, kPa gauge.

        Args:
            q: Angles (n,), rad.
            pressure: [p_a; p_b] (2n,), Pa absolute.
        """
        out = np.empty((self.num_joints, 3))
        # A sensor reads nothing beyond its range.
        percent = 100.0 * (q - self._at_0) / self._span
        np.clip(percent, 0.0, 100.0, out=out[:, 0])
        pairs = np.empty(2 * self.num_joints)
        pairs[self._places] = pressure
        pairs -= self._wire.atmospheric_pressure
        out[:, 1:] = pairs.reshape(-1, 2) / _KPA + self._offsets
        return out.ravel()

    def write_sensors(self, q: Array, pressure: Array) -> bytes:
        """The sensors' packet; for arguments see `sensor_values`.

        Args:
            q: Angles (n,), rad.
            pressure: Pressures [p_a; p_b] (2n,), Pa absolute.
        """
        values = self.sensor_values(q, pressure).tolist()
        return " ".join(map("{:.1f}".format, values)).encode("ascii")

    def read_sensors(self, packet: bytes) -> tuple[Array, Array]:
        """The angles (n,), rad, and pressures (2n,), Pa, of a packet.

        Args:
            packet: Bytes of the packet.

        Raises:
            PacketError: If it is no such packet, or a value cannot be.
        """
        words = _words(packet, 3 * self.num_joints)
        if not _ANGLE_CHARACTERS.issuperset(packet):
            raise PacketError("not numbers")
        try:
            values = np.array(list(map(float, words))).reshape(-1, 3)
        except ValueError:
            raise PacketError("not numbers") from None
        wire = self._wire
        percent, pairs = values[:, 0], values[:, 1:]
        # What is not a number fails these comparisons too.
        if not np.all(
            (percent >= wire.angle_low) & (percent <= wire.angle_high)
        ):
            raise PacketError("an angle that cannot be")
        if not np.all(
            (pairs >= wire.pressure_low) & (pairs <= wire.pressure_high)
        ):
            raise PacketError("a pressure that cannot be")
        gauge = _KPA * (pairs - self._offsets).ravel()
        pressure = gauge[self._places] + wire.atmospheric_pressure
        return self._at_0 + 0.01 * percent * self._span, pressure

    def command_levels(self, pressure: Array) -> Array:
        """The commands (2n,), 0..255 unrounded, in the wire's order.

        Args:
            pressure: Set-points [p_a; p_b] (2n,), Pa absolute.

        Raises:
            PacketError: If one of them is no number.
        """
        if not np.all(np.isfinite(pressure)):
            raise PacketError("a set-point that is no number")
        pairs = np.empty(2 * self.num_joints)
        pairs[self._places] = pressure
        gauge = (pairs - self._wire.atmospheric_pressure) / _KPA
        levels = self._levels * (gauge - self._wire.command_low)
        return np.clip(levels, 0.0, COMMAND_MAXIMUM)

    def write_command(self, pressure: Array) -> bytes:
        """The packet of a command; for the argument see `command_levels`.

        Args:
            pressure: Set-points [p_a; p_b] (2n,), Pa absolute.
        """
        levels = np.rint(self.command_levels(pressure)).astype(int).tolist()
        return " ".join(map(str, levels)).encode("ascii")

    def read_levels(self, packet: bytes) -> list[int]:
        """The numbers 0..255 of a command (2n), in the wire's order.

        Args:
            packet: Bytes of the packet.

        Raises:
            PacketError: If it is no such packet.
        """
        words = _words(packet, 2 * self.num_joints)
        if not all(map(_is_whole, words)):
            raise PacketError("not whole numbers")
        levels = list(map(int, words))
        if min(levels) < 0 or max(levels) > COMMAND_MAXIMUM:
            if self._wire.out_of_range == "ignore":
                raise PacketError("a number beyond 0..255")
            top = int(COMMAND_MAXIMUM)
            levels = [min(max(level, 0), top) for level in levels]
        return levels

    def set_points(self, levels: Sequence[float]) -> Array:
        """The set-points [p_a; p_b] (2n,), Pa absolute, of a command.

        Args:
            levels: Numbers from 0 to 255 (2n), in the wire's order.
        """
        gauge = self._wire.command_low + np.asarray(levels) / self._levels
        return self._wire.atmospheric_pressure + _KPA * gauge[self._places]

    def read_command(self, packet: bytes) -> Array:
        """The set-points [p_a; p_b] (2n,), Pa absolute, of a packet.

        Args:
            packet: Bytes of the packet.

        Raises:
            PacketError: If it is no such packet.
        """
        return self.set_points(self.read_levels(packet))

    def vented(self) -> Array:
        """Set-points (2n,) that vent all chambers, Pa absolute."""
        return np.full(2 * self.num_joints, self._wire.atmospheric_pressure)


def _words(packet: bytes, count: int) -> list[bytes]:
    """The words of a packet; raises PacketError unless there are `count`."""
    if len(packet) > LONGEST_PACKET:
        raise PacketError("too long")
    words = packet.split()
    if len(words) != count:
        raise PacketError(f"{len(words)} numbers instead of {count}")
    return words


def _is_whole(word: bytes) -> bool:
    """Whether a word is a whole number of a few digits."""
    return len(word) <= 8 and word.removeprefix(b"-").isdigit()
