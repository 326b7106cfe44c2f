"""`affetto serve` in a process of its own."""

import contextlib
from pathlib import Path
import subprocess
import sys

from support.wire_client import free_ports

ROOT = Path(__file__).parents[2]


class Serving:
    """A server's process and ports."""

    def __init__(self, process, sensor_port, command_port, first):
        self.process = process
        self.sensor_port, self.command_port = sensor_port, command_port
        self.first = first

    def memory(self):
        """Resident memory, bytes."""
        text = Path(f"/proc/{self.process.pid}/statm").read_text()
        return 4096 * int(text.split()[1])

    def end(self):
        """Ends it by SIGTERM; returns exit code, the rest of stdout, stderr."""
        self.process.terminate()
        out, err = self.process.communicate(timeout=20)
        return self.process.returncode, out, err


@contextlib.contextmanager
def serving(*options):
    """A server that sends packets, ended afterwards."""
    sensor_port, command_port = free_ports()
    process = subprocess.Popen(
        [
            sys.executable,
            "-m",
            "drake_affetto.cli",
            "serve",
            f"--sensor-port={sensor_port}",
            f"--command-port={command_port}",
            *options,
        ],
        cwd=ROOT,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    try:
        first = process.stdout.readline()
        yield Serving(process, sensor_port, command_port, first)
    finally:
        process.kill()
        process.communicate()
