"""The wire to a robot as a system: set-points out, readings in."""

import math
import socket
import time

import numpy as np
from pydrake.systems.framework import Context, DiscreteValues, LeafSystem

from drake_affetto.common.errors import InputError
from drake_affetto.common.systems import input_port, output_port
from drake_affetto.common.typing import Array
from drake_affetto.robot.wire import (
    LONGEST_PACKET,
    PacketCodec,
    PacketError,
    RobotWire,
)


class WireDriver(LeafSystem):
    """Speaks to a robot of n joints over its wire, in real time.

    .. pydrake_system::

        name: WireDriver
        input_ports:
        - pressure_command
        output_ports:
        - joint_state
        - chamber_pressure
        - link

    - `pressure_command` (2n): set-points [p_a; p_b], Pa absolute.
    - `joint_state` (2n): [q; 0], the last angles that were read, rad.
    - `chamber_pressure` (2n): [p_a; p_b], the last that were read, Pa absolute.
    - `link` (3): whether the sensors are trusted (1 or 0), the age of their
      last good packet, s, and the number of packets that were none.

    Readings are taken `sensor_rate` times a second and commands are sent
    `command_rate` times a second of simulated time: run the `Simulator` with a
    target real-time rate of 1. While there are no fresh, possible sensor data,
    or a set-point is no number, commands vent all chambers.
    """

    def __init__(
        self,
        wire: RobotWire,
        host: str,
        sensor_port: int,
        command_port: int,
        *,
        sensor_rate: float,
        command_rate: float,
    ):
        """Binds the port of the sensors; nothing is sent yet.

        Args:
            wire: How the robot is spoken to.
            host: Address of the robot.
            sensor_port: Own port, to which the robot sends.
            command_port: The robot's port of commands.
            sensor_rate: Readings a second, Hz.
            command_rate: Commands a second, Hz.

        Raises:
            InputError: If the port is in use.
        """
        super().__init__()
        self._wire, self._codec = wire, PacketCodec(wire)
        self._robot = (host, command_port)
        n = self._codec.num_joints
        self._socket = _listen(host, sensor_port)
        self._outbound = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._arrival = -math.inf
        self._bad = 0
        self.DeclareVectorInputPort("pressure_command", 2 * n)
        self._state = self.DeclareDiscreteState(2 * n)
        self._pressure = self.DeclareDiscreteState(self._codec.vented())
        self._link = self.DeclareDiscreteState([0.0, math.inf, 0.0])
        self.DeclareStateOutputPort("joint_state", self._state)
        self.DeclareStateOutputPort("chamber_pressure", self._pressure)
        self.DeclareStateOutputPort("link", self._link)
        self.DeclarePeriodicDiscreteUpdateEvent(
            1.0 / sensor_rate, 0.0, self._receive
        )
        self.DeclarePeriodicPublishEvent(1.0 / command_rate, 0.0, self._send)

    get_pressure_command_input_port = input_port("[p_a; p_b] (2n), Pa.")
    get_joint_state_output_port = output_port("[q; 0] (2n), rad.")
    get_chamber_pressure_output_port = output_port("[p_a; p_b] (2n), Pa.")
    get_link_output_port = output_port("Trusted, age [s], bad packets (3).")

    def close(self) -> None:
        """Vents the robot a last time and closes the sockets."""
        self._write(self._codec.vented())
        self._socket.close()
        self._outbound.close()

    def wait(self, context: Context, timeout: float) -> None:
        """Waits for the robot, and puts what it reads into the state.

        Args:
            timeout: Longest wait, s.

        Raises:
            InputError: If no good packet comes in time.
        """
        end = time.monotonic() + timeout
        while (reading := self._latest()) is None:
            if time.monotonic() > end:
                raise InputError(
                    f"the robot is silent: no sensor packet on port "
                    f"{self._socket.getsockname()[1]} within {timeout:g} s "
                    f"({self._bad} others)"
                )
            time.sleep(0.002)
        q, pressure = reading
        context.SetDiscreteState(self._state, np.append(q, np.zeros(q.size)))
        context.SetDiscreteState(self._pressure, pressure)
        context.SetDiscreteState(self._link, self._link_state())

    def _latest(self) -> tuple[Array, Array] | None:
        """The newest good reading among the packets that wait, if any."""
        reading = None
        # A flood must not hold the simulation up.
        for _ in range(1000):
            try:
                packet, sender = self._socket.recvfrom(LONGEST_PACKET + 1)
            except OSError:
                break
            if sender[0] != self._robot[0]:
                continue
            try:
                reading = self._codec.read_sensors(packet)
            except PacketError:
                self._bad += 1
                continue
            self._arrival = time.monotonic()
        return reading

    def _link_state(self) -> Array:
        age = time.monotonic() - self._arrival
        return np.array([age < self._wire.stale_after, age, self._bad], float)

    def _receive(self, context: Context, values: DiscreteValues) -> None:
        reading = self._latest()
        if reading is not None:
            q, pressure = reading
            values.get_mutable_value(self._state)[: q.size] = q
            values.get_mutable_value(self._pressure)[:] = pressure
        values.get_mutable_value(self._link)[:] = self._link_state()

    def _send(self, context: Context) -> None:
        # The link as it is now: the state may be a sensor's period older.
        if self._link_state()[0]:
            port = self.get_pressure_command_input_port()
            self._write(port.Eval(context))
        else:
            self._write(self._codec.vented())

    def _write(self, pressure: Array) -> None:
        try:
            packet = self._codec.write_command(pressure)
        except PacketError:
            packet = self._codec.write_command(self._codec.vented())
        try:
            self._outbound.sendto(packet, self._robot)
        except OSError:
            # Lost like any other packet: the wire knows no answer.
            return


def _listen(host: str, port: int) -> socket.socket:
    """A socket for the robot's sensors, which does not block."""
    found = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    own = "127.0.0.1" if host.startswith("127.") else "0.0.0.0"
    try:
        found.bind((own, port))
    except OSError as error:
        found.close()
        raise InputError(
            f"port {port} of the sensors cannot be used: {error.strerror}"
        ) from error
    found.setblocking(False)
    return found
