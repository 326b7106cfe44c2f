"""How well `affetto serve` keeps its time, alone, beside a client, and abused.

Starts a server and plays its client: rates and gaps of the packets, then ten
thousand packets that are no commands, a hundred thousand good ones at once, a
server that is stopped for two seconds, and a client that is killed.

    python analysis/experiments/wire_timing.py [--seconds 60]
"""

import argparse
import os
from pathlib import Path
import signal
import socket
import subprocess
import sys
import time

import numpy as np

HOST, SENSORS, COMMANDS = "127.0.0.1", 50100, 50110
GOOD = b" ".join([b"100"] * 26)
BAD = [
    b"",
    b"x" * 50,
    b"nan " * 26,
    b"inf " * 26,
    b"1e400 " * 26,
    b"-1 " * 26,
    b"256 " * 26,
    b"7 " * 25,
    b"7 " * 27,
    b"7 " * 32000,
    b"\xff\x00" * 30,
]


class Reader:
    """Notes when the packets arrive, and what the last one said."""

    def __init__(self) -> None:
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._socket.bind((HOST, SENSORS))
        self._socket.settimeout(10.0)
        self.sender = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.last = b""

    def send(self, packet: bytes) -> None:
        self.sender.sendto(packet, (HOST, COMMANDS))

    def arrivals(self, seconds: float, command_rate: float = 0.0) -> np.ndarray:
        """Times at which packets came; commands are sent in between."""
        times = [time.monotonic()]
        next_command = times[0]
        while times[-1] - times[0] < seconds:
            self.last = self._socket.recv(1024)
            times.append(time.monotonic())
            if command_rate and times[-1] >= next_command:
                next_command += 1.0 / command_rate
                # What a client computes between two commands.
                np.linalg.svd(np.random.default_rng(0).random((60, 60)))
                self.send(GOOD)
        return np.array(times[1:])

    def pressure(self) -> float:
        """Median of the pressures of the last packet, kPa."""
        values = np.array(self.last.split(), float).reshape(-1, 3)
        return float(np.median(values[:, 1:]))


def show(name: str, times: np.ndarray) -> None:
    """Prints rate and gaps, and how many packets were late."""
    gaps = 1e3 * np.diff(times)
    # Late beside the schedule on which most of them are.
    k = np.arange(times.size)
    late = times - times[0] - 0.01 * k
    late -= np.percentile(late, 5)
    load = os.getloadavg()[0]
    print(
        f"{name}: {1.0 / np.mean(np.diff(times)):.2f} Hz; gaps median "
        f"{np.median(gaps):.2f}, 99 % {np.percentile(gaps, 99):.2f}, longest "
        f"{gaps.max():.1f} ms; {np.mean(late > 5e-3):.2%} over 5 ms late; load "
        f"{load:.1f}",
        flush=True,
    )


def memory(process: subprocess.Popen) -> float:
    """Resident memory of a process, MB."""
    text = Path(f"/proc/{process.pid}/statm").read_text(encoding="ascii")
    return int(text.split()[1]) * os.sysconf("SC_PAGE_SIZE") / 1e6


def abuse(reader: Reader, server: subprocess.Popen) -> None:
    """Bad packets, a burst, a stop and a killed client."""
    for _ in range(100):
        reader.arrivals(0.01)
        reader.send(GOOD)
    for k in range(10_000):
        reader.send(BAD[k % len(BAD)])
        if k % 50 == 0:
            reader.arrivals(0.01)
    times = reader.arrivals(0.5)
    show("after 10,000 packets that are no commands", times)
    reader.arrivals(0.7, 30.0)
    before = memory(server)
    begin = time.monotonic()
    for _ in range(100_000):
        reader.send(GOOD)
    sent = time.monotonic() - begin
    reader.send(b"200 " * 26)
    begin = time.monotonic()
    pressure = reader.pressure()
    while reader.pressure() < pressure + 50.0:
        reader.arrivals(0.01)
        reader.send(b"200 " * 26)
        if time.monotonic() - begin > 10.0:
            break
    print(
        f"100,000 commands in {sent:.2f} s: the next one shows after "
        f"{time.monotonic() - begin:.2f} s, memory {before:.1f} to "
        f"{memory(server):.1f} MB"
    )
    show("afterwards", reader.arrivals(3.0))
    server.send_signal(signal.SIGSTOP)
    time.sleep(2.0)
    server.send_signal(signal.SIGCONT)
    show("about a stop of 2 s", reader.arrivals(3.0))
    killed = subprocess.Popen(
        [
            sys.executable,
            "-c",
            "import socket, time\n"
            "s = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)\n"
            f"while s.sendto({GOOD!r}, ('{HOST}', {COMMANDS})):\n"
            "    time.sleep(0.03)\n",
        ]
    )
    reader.arrivals(1.0)
    killed.kill()
    killed.wait()
    show("about a client that is killed", reader.arrivals(3.0))


def main() -> None:
    """Measures and prints."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seconds", type=float, default=60.0)
    args = parser.parse_args()
    server = subprocess.Popen(
        [
            sys.executable,
            "-m",
            "drake_affetto.cli",
            "serve",
            f"--sensor-port={SENSORS}",
            f"--command-port={COMMANDS}",
        ],
        stdout=subprocess.PIPE,
        text=True,
    )
    assert server.stdout is not None
    print(server.stdout.readline().strip(), flush=True)
    try:
        reader = Reader()
        show("alone", reader.arrivals(args.seconds))
        show("beside a client", reader.arrivals(args.seconds, 30.0))
        abuse(reader, server)
    finally:
        server.terminate()
        print(server.communicate(timeout=20)[0].strip())


if __name__ == "__main__":
    main()
