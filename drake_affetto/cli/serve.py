"""`affetto serve`: the simulated robot answers the real robot's software."""

import argparse
from collections.abc import Callable
import contextlib
from pathlib import Path
import signal
import sys
import time
from typing import TYPE_CHECKING

from drake_affetto.cli.options import (
    add_scenario_argument,
    add_seed_argument,
    real_number,
    whole_number,
)
from drake_affetto.common.errors import require_range
from drake_affetto.common.owner import claim_file

if TYPE_CHECKING:
    from drake_affetto.robot.server import RobotServer

# Time between two status lines, s: on a terminal, and elsewhere.
_STATUS_PERIODS = (0.5, 10.0)


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declares the command's options."""
    add_scenario_argument(parser)
    parser.set_defaults(scenario="robot")
    numbers = (
        (
            "--sensor-port",
            whole_number,
            50000,
            "PORT",
            "where sensor packets go",
        ),
        (
            "--command-port",
            whole_number,
            50010,
            "PORT",
            "where commands are taken",
        ),
        ("--rate", real_number, 100.0, "HZ", "sensor packets a second"),
        ("--seconds", real_number, None, "S", "stop by itself after this time"),
        (
            "--command-timeout",
            real_number,
            None,
            "S",
            "time without commands after which the last one holds, or all "
            "chambers vent, as the scenario says; 1 s unless it says otherwise",
        ),
    )
    for name, kind, default, metavar, text in numbers:
        parser.add_argument(
            name, type=kind, default=default, metavar=metavar, help=text
        )
    parser.add_argument(
        "--host", default="127.0.0.1", help="address of the client"
    )
    parser.add_argument(
        "--allow-network",
        action="store_true",
        help="let the client be on another machine: whoever can send from its "
        "address moves the simulated robot",
    )
    parser.add_argument(
        "--record", metavar="FILE", help="write sensors and commands as CSV"
    )
    parser.add_argument(
        "--meshcat",
        action="store_true",
        help="show the robot in a browser, where the mouse may pull its right "
        "hand (Ctrl and the left button)",
    )
    add_seed_argument(parser, "seed of the sensors' noise")


def run(args: argparse.Namespace) -> int:
    """Serves the robot until told to stop; returns the exit code.

    Raises:
        InputError: If an option does not fit, or a port is in use.
    """
    from drake_affetto.robot.command_inbox import CommandInbox
    from drake_affetto.robot.recording import WireRecording
    from drake_affetto.robot.server import RobotServer, WireSockets

    require_range("--seed", args.seed, 0, 2**31 - 1)
    require_range("--rate", args.rate, 1.0, 400.0)
    if args.seconds is not None:
        require_range("--seconds", args.seconds, 0.0, 1e7)
    if args.command_timeout is not None:
        require_range("--command-timeout", args.command_timeout, 0.05, 3600.0)

    def open_sockets() -> WireSockets:
        return WireSockets(
            args.host,
            args.sensor_port,
            args.command_port,
            allow_network=args.allow_network,
        )

    # Only to see that it can be done, before anything takes its time.
    open_sockets().close()

    from drake_affetto.robot.simulated_robot import SimulatedRobot, check_served
    from drake_affetto.robot.wire import PacketCodec
    from drake_affetto.station.scenario import load_scenario

    scenario = load_scenario(args.scenario)
    scenario.random_seed = args.seed
    wire = check_served(scenario, args.rate)
    timeout = args.command_timeout or wire.command_timeout
    codec = PacketCodec(wire)
    meshcat = _start_meshcat() if args.meshcat else None
    with contextlib.ExitStack() as stack:
        recording = None
        if args.record is not None:
            record = Path(args.record).expanduser()
            if record.parent.is_dir():
                claim_file(record, "serve")
            recording = stack.enter_context(
                WireRecording(record, codec.num_joints)
            )
        robot = SimulatedRobot(scenario, args.rate, meshcat)
        # Warm by now: from the first packet on time is real time.
        sockets = open_sockets()
        stack.callback(sockets.close)
        inbox = CommandInbox(codec, timeout, wire.on_silence == "hold")
        server = RobotServer(robot, codec, inbox, sockets, args.rate, recording)
        for number in (signal.SIGINT, signal.SIGTERM):
            before = signal.signal(number, lambda *_: server.stop())
            stack.callback(signal.signal, number, before)
        print(
            f"serving: {args.scenario}, {codec.num_joints} joints, sensors to "
            f"{args.host}:{args.sensor_port} at {args.rate:g} Hz, commands on "
            f"port {args.command_port}; after {timeout:g} s without commands "
            + ("the last one holds" if inbox.holds else "all chambers vent"),
            flush=True,
        )
        server.run(args.seconds, _status_printer())
    print(summary(server))
    return 0


def _start_meshcat():
    from pydrake.geometry import StartMeshcat

    from drake_affetto.teaching.mouse_teacher import require_mouse_spring

    require_mouse_spring()
    meshcat = StartMeshcat()
    print(f"watch at {meshcat.web_url()}", flush=True)
    return meshcat


def _status_printer() -> Callable[["RobotServer"], None]:
    """Shows notes and, every now and then, a status line on stderr."""
    terminal = sys.stderr.isatty()
    period = _STATUS_PERIODS[0 if terminal else 1]
    begin = last = time.monotonic()

    def show(server: "RobotServer") -> None:
        nonlocal last
        notes = server.inbox.notes
        while notes:
            clear = "\r\033[K" if terminal else ""
            print(f"{clear}{notes.pop(0)}", file=sys.stderr, flush=True)
        now = time.monotonic()
        if now - last < period:
            return
        last = now
        line = _status(server, now - begin, now)
        end = "" if terminal else "\n"
        start = "\r\033[K" if terminal else ""
        print(f"{start}{line}", end=end, file=sys.stderr, flush=True)

    return show


def _status(server: "RobotServer", wall: float, now: float) -> str:
    inbox, schedule = server.inbox, server.schedule
    age = "none yet" if inbox.last is None else f"{now - inbox.last:.2f} s ago"
    return (
        f"simulated {server.simulated_time:.1f} s of {wall:.1f} s, "
        f"{schedule.rate():.2f} Hz, late {schedule.late}, packets "
        f"{inbox.good} good {inbox.bad} bad, last command {age}"
    )


def summary(server: "RobotServer") -> str:
    """What a finished server says of its run."""
    schedule, inbox = server.schedule, server.inbox
    late = schedule.late / max(1, schedule.ticks)
    return (
        f"served {server.simulated_time:.2f} s: {schedule.ticks} packets at "
        f"{schedule.rate():.2f} Hz, {schedule.late} late ({late:.2%}), longest "
        f"delay {1e3 * schedule.longest_delay:.1f} ms, {schedule.stalls} "
        f"stalls; commands: {inbox.good} good, {inbox.bad} bad, "
        f"{inbox.clients} clients"
    )
