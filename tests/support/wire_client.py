"""A client of the robot's wire, written from the description of the protocol.

It reads sensor packets in a thread, filters them at their own rate, sends
commands 30 times a second and keeps a log in the columns of the robot's own
library. Every number of it is the protocol's; nothing of the package's own
codec is used, so that both can be compared.
"""

import csv
import socket
import threading
import time

import numpy as np
from scipy.signal import butter, lfilter, lfilter_zi

HOST = "127.0.0.1"
RATE = 30.0
SENSOR_RATE = 100.0
STIFFNESS = 400.0


def free_ports(count=2):
    """Ports that nobody uses right now."""
    sockets = [
        socket.socket(socket.AF_INET, socket.SOCK_DGRAM) for _ in range(count)
    ]
    try:
        for each in sockets:
            each.bind((HOST, 0))
        return [each.getsockname()[1] for each in sockets]
    finally:
        for each in sockets:
            each.close()


class WireClient:
    """Reads sensors, sends commands, and logs both."""

    def __init__(self, sensor_port, command_port, joints=13):
        self.n = joints
        self.inbound = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.inbound.bind((HOST, sensor_port))
        self.inbound.settimeout(20.0)
        self.outbound = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.there = (HOST, command_port)
        self.arrivals = []
        self.rows = []
        self.raw = self.filtered = None
        self.rate = np.zeros(joints)
        self._filter = butter(5, 10.0, fs=SENSOR_RATE)
        self._memory = None
        self._running = False

    def __enter__(self):
        return self

    def __exit__(self, *error):
        self.stop()
        self.inbound.close()
        self.outbound.close()

    def read(self):
        """The next packet: q pa pb of each joint, (n, 3)."""
        packet = self.inbound.recv(1024)
        self.arrivals.append(time.monotonic())
        values = np.array([float(word) for word in packet.decode().split()])
        assert values.size == 3 * self.n
        return values.reshape(-1, 3)

    def measured_rate(self, count=100):
        """Mean rate of the next packets, as the robot's client measures it."""
        self.read()
        begin = len(self.arrivals) - 1
        for _ in range(count):
            self.read()
        span = self.arrivals[-1] - self.arrivals[begin]
        return count / span

    def send_text(self, text):
        data = text if isinstance(text, bytes) else text.encode()
        self.outbound.sendto(data, self.there)

    def send(self, levels):
        """Sends ca cb of each joint, (n, 2), 0..255."""
        whole = [str(round(float(x))) for x in np.ravel(levels)]
        self.send_text(" ".join(whole))

    def start(self):
        """Begins to read in the background."""
        self._running = True
        self._take(self.read())
        self._thread = threading.Thread(target=self._loop, daemon=True)
        self._thread.start()

    def stop(self):
        if self._running:
            self._running = False
            self._thread.join()

    def _loop(self):
        while self._running:
            self._take(self.read())

    def _take(self, raw):
        b, a = self._filter
        q = raw[:, 0]
        if self._memory is None:
            self._memory = np.outer(lfilter_zi(b, a), q)
            self.filtered = q
        new, self._memory = lfilter(b, a, q[None], axis=0, zi=self._memory)
        self.rate = (new[0] - self.filtered) * SENSOR_RATE
        self.filtered, self.raw = new[0], raw

    def control(self, seconds, command):
        """Sends command(t) -> levels (n, 2) at 30 Hz, in absolute time."""
        begin = time.monotonic()
        for k in range(round(seconds * RATE)):
            time.sleep(max(0.0, begin + k / RATE - time.monotonic()))
            self.send(command(k / RATE))

    def initialize(self, ramp=5.0, hold=5.0):
        """The robot's own start: chamber b climbs to 240, a stays vented."""

        def command(t):
            level = 240.0 * min(t / ramp, 1.0)
            return np.tile([0.0, level], (self.n, 1))

        self.control(ramp + hold, command)

    def track(self, seconds, reference, gains, driven, stiffness=STIFFNESS):
        """The robot's PID law; logs rows as the robot's library does.

        Args:
            seconds: Duration.
            reference: reference(t) -> qdes, dqdes (n,) each.
            gains: kP, kD, kI (n,) each.
            driven: Joints that are controlled; others keep u = 0.
        """
        kP, kD, kI = gains
        total = np.zeros(self.n)
        active = np.isin(np.arange(self.n), driven)

        def command(t):
            nonlocal total
            raw, q, dq = self.raw, self.filtered, self.rate
            qdes, dqdes = reference(t)
            error = qdes - q
            total = total + error
            u = np.where(active, kP * error + kD * (dqdes - dq) + kI * total, 0)
            pair = np.stack([stiffness + u, stiffness - u], axis=1)
            levels = 255.0 / 600.0 * np.clip(pair, 0.0, 600.0)
            self.rows.append((t, raw, q, dq, levels, qdes, dqdes))
            return levels

        self.control(seconds, command)

    def write_log(self, path):
        """Writes the rows as CSV."""
        names = ("rq", "rpa", "rpb", "q", "dq", "ca", "cb", "qdes", "dqdes")
        with open(path, "w", newline="") as file:
            writer = csv.writer(file)
            writer.writerow(
                ["t", *(f"{x}{k}" for x in names for k in range(self.n))]
            )
            for t, raw, q, dq, levels, qdes, dqdes in self.rows:
                parts = (*raw.T, q, dq, *levels.T, qdes, dqdes)
                writer.writerow([t, *np.concatenate(parts)])
        return path
