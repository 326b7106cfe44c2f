"""The robot's end of the wire, played by hand: what a test tells it to send."""

import socket

from support.wire_client import HOST


class DummyRobot:
    """Sends what it is told and keeps the last command."""

    def __init__(self, sensor_port, command_port):
        self.socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.socket.bind((HOST, command_port))
        self.socket.setblocking(False)
        self.client = (HOST, sensor_port)

    def __enter__(self):
        return self

    def __exit__(self, *error):
        self.socket.close()

    def send(self, data):
        self.socket.sendto(data, self.client)

    def commands(self):
        """The commands that came since the last call, each a list of ints."""
        found = []
        while True:
            try:
                packet = self.socket.recv(4096)
            except BlockingIOError:
                return found
            found.append([int(word) for word in packet.split()])
