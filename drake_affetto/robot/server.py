"""A simulated robot behind its wire, in real time."""

from collections.abc import Callable
import contextlib
import gc
import ipaddress
import select
import socket

from drake_affetto.common.errors import InputError, require, require_range
from drake_affetto.robot.command_inbox import CommandInbox
from drake_affetto.robot.recording import WireRecording
from drake_affetto.robot.schedule import STALL, Schedule
from drake_affetto.robot.simulated_robot import SimulatedRobot
from drake_affetto.robot.wire import LONGEST_PACKET, PacketCodec

# Packets that are read in a tick that is late already: a flood of them must
# not delay it further.
_WHILE_LATE = 64
# Room for packets that wait, bytes.
_BUFFER = 1 << 20


class WireSockets:
    """The two one-way streams: sensors to one address, commands from it."""

    def __init__(
        self,
        host: str,
        sensor_port: int,
        command_port: int,
        *,
        allow_network: bool = False,
    ):
        """Checks the addresses and binds the command port.

        Args:
            host: Address of the client.
            sensor_port: Port to which sensor packets go.
            command_port: Port on which commands are taken.
            allow_network: Whether the client may be on another machine.

        Raises:
            InputError: For addresses that do not fit, or a port in use.
        """
        address = check_addresses(
            host, sensor_port, command_port, allow_network=allow_network
        )
        self.client = (str(address), sensor_port)
        self.unsent = 0
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        # Another machine's address cannot be bound: there all interfaces are.
        own = str(address) if address.is_loopback else "0.0.0.0"
        try:
            self._socket.bind((own, command_port))
        except OSError as error:
            self._socket.close()
            raise InputError(
                f"--command-port {command_port} cannot be used on {own}: "
                f"{error.strerror}"
            ) from error
        # As much as the system grants: a burst that does not fit is dropped.
        self._socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, _BUFFER)
        self._socket.setblocking(False)

    def send(self, packet: bytes) -> None:
        """Sends a sensor packet to the client, whether one is there or not.

        Args:
            packet: Bytes of the packet.
        """
        try:
            self._socket.sendto(packet, self.client)
        except OSError:
            self.unsent += 1

    def receive(self, timeout: float) -> tuple[bytes, int] | None:
        """Waits for a packet from the client's address.

        Args:
            timeout: Longest time to wait, s.

        Returns:
            The packet and the port that it came from; None without one.
        """
        try:
            packet, sender = self._read()
        except BlockingIOError:
            # Asked only where nothing waits: a burst is read without.
            wait = max(0.0, timeout)
            if not select.select([self._socket], [], [], wait)[0]:
                return None
            try:
                packet, sender = self._read()
            except OSError:
                return None
        except OSError:
            return None
        return (packet, sender[1]) if sender[0] == self.client[0] else None

    def close(self) -> None:
        """Closes the socket."""
        self._socket.close()

    def _read(self) -> tuple[bytes, tuple[str, int]]:
        # One byte more, so that what is too long is seen to be.
        return self._socket.recvfrom(LONGEST_PACKET + 1)


def check_addresses(
    host: str, sensor_port: int, command_port: int, *, allow_network: bool
) -> ipaddress.IPv4Address:
    """The address of the client.

    Raises:
        InputError: For addresses that do not fit.
    """
    for name, port in (("sensor", sensor_port), ("command", command_port)):
        require_range(f"--{name}-port", port, 1, 65535)
    require(
        sensor_port != command_port,
        "--command-port",
        command_port,
        "another port than --sensor-port",
    )
    try:
        address = ipaddress.IPv4Address(
            "127.0.0.1" if host == "localhost" else host
        )
    except ValueError:
        raise InputError(
            f"--host is {host!r}, expected an IPv4 address such as 127.0.0.1"
        ) from None
    if not address.is_loopback and not allow_network:
        raise InputError(
            f"--host is {host}, another machine; it needs --allow-network"
        )
    if address.is_multicast or address.is_unspecified:
        raise InputError(f"--host is {host}, expected the address of one host")
    return address


class RobotServer:
    """Steps the robot in real time, sends its sensors and takes commands."""

    def __init__(
        self,
        robot: SimulatedRobot,
        codec: PacketCodec,
        inbox: CommandInbox,
        sockets: WireSockets,
        rate: float,
        recording: WireRecording | None = None,
    ):
        """Takes what it is made of; see `run`.

        Args:
            robot: A robot that is warm.
            codec: Its packets.
            inbox: Keeps the commands.
            sockets: Bound sockets.
            rate: Sensor packets a second, Hz.
            recording: Takes a row for each of them.
        """
        self._robot, self._codec = robot, codec
        self.inbox, self._sockets = inbox, sockets
        self.schedule = Schedule(1.0 / rate)
        self._recording = recording
        self._begin = robot.time
        self._stopping = False

    @property
    def simulated_time(self) -> float:
        """Simulated time since the server began, s."""
        return self._robot.time - self._begin

    def stop(self) -> None:
        """Ends `run` at the next tick; may be called by a signal's handler."""
        self._stopping = True

    def run(
        self, seconds: float | None, on_tick: Callable[["RobotServer"], None]
    ) -> None:
        """Serves until told to stop.

        Args:
            seconds: Simulated time after which it ends by itself, s.
            on_tick: Called after each tick.
        """
        schedule = self.schedule
        with _without_collector():
            schedule.start()
            while not self._stopping and (
                seconds is None or self.simulated_time < seconds - 1e-9
            ):
                self.inbox.watch(schedule.clock())
                levels = self.inbox.levels
                self._robot.command(self._codec.set_points(levels))
                # The next tick's sensors are made before it is due.
                self._robot.advance()
                q, pressure = self._robot.read()
                packet = self._codec.write_sensors(q, pressure)
                self._receive_until_due()
                delay = schedule.tick()
                self._sockets.send(packet)
                if delay > STALL:
                    self.inbox.notes.append(
                        f"{delay:.1f} s behind: the clock begins anew"
                    )
                if self._recording is not None:
                    self._recording.add(
                        self.simulated_time,
                        self._codec.sensor_values(q, pressure),
                        levels,
                    )
                strike = self._robot.finished_strike()
                if strike > 0.0:
                    self.inbox.notes.append(f"the drum: {strike:.1f} N")
                on_tick(self)

    def _receive_until_due(self) -> None:
        late = 0
        while late < _WHILE_LATE and not self._stopping:
            remaining = self.schedule.remaining()
            late += remaining <= 0.0
            got = self._sockets.receive(remaining)
            if got is not None:
                self.inbox.take(*got, self.schedule.clock())
            elif remaining <= 0.0:
                return


@contextlib.contextmanager
def _without_collector():
    """Keeps the garbage collector from pausing the loop for what is old."""
    gc.collect()
    gc.freeze()
    try:
        yield
    finally:
        gc.unfreeze()
