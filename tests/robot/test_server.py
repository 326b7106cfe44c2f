"""The served robot, from the other end of its wire."""

import os
import signal
import subprocess
import sys
import time

import numpy as np
import pytest

from drake_affetto.cli.main import main
from drake_affetto.robot.controller import load_robot_controller
from drake_affetto.robot.log import read_log
from drake_affetto.robot.server import WireSockets
from support.serving import serving
from support.wire_client import WireClient, free_ports

JOINTS = 13


@pytest.fixture(scope="module")
def server(tmp_path_factory):
    record = tmp_path_factory.mktemp("serve") / "record.csv"
    with serving("--record", str(record), "--command-timeout=0.5") as found:
        found.record = record
        yield found
        # Last of the module: how it ends, and what it says then.
        code, out, err = found.end()
        assert code == 0
        assert "served" in out
        assert "bad" in out
        assert "Traceback" not in err
        assert "the clock begins anew" in err
        assert "all chambers vent" in err


@pytest.fixture
def client(server):
    with WireClient(server.sensor_port, server.command_port) as found:
        yield found


def settle(client, levels, seconds=0.9):
    """Repeats a command; returns the mean of the last packets, (n, 3)."""
    end = time.monotonic() + seconds
    seen = []
    while time.monotonic() < end:
        client.send(levels)
        seen.append(client.read())
    return np.mean(seen[-10:], axis=0)


def test_it_says_that_it_serves_and_vents_before_the_first_command(
    server, client
):
    assert server.first.startswith("serving: robot, 13 joints")
    seen = np.mean([client.read() for _ in range(20)], axis=0)
    assert seen.shape == (JOINTS, 3)
    assert np.all((seen[:, 0] >= 0.0) & (seen[:, 0] <= 100.0))
    # Sensor offsets apart, nothing but noise is above the atmosphere.
    assert np.median(seen[:, 1:]) < 3.0
    assert np.max(seen[:, 1:]) < 60.0


def test_the_robots_client_accepts_the_rate(client):
    # Within 1 Hz; three tries, for other processes may take the cores.
    rates = []
    for _ in range(3):
        rates.append(client.measured_rate())
        if abs(rates[-1] - 100.0) < 1.0:
            return
    pytest.fail(f"{rates} Hz")


def test_chambers_go_to_their_set_points(client):
    levels = np.full((JOINTS, 2), 170.0)
    levels[5] = [51.0, 204.0]
    seen = settle(client, levels)
    assert seen[5, 1:] == pytest.approx([120.0, 480.0], abs=12.0)
    assert seen[9, 1:] == pytest.approx([400.0, 400.0], abs=12.0)


def test_silence_vents_the_robot(client):
    settle(client, np.full((JOINTS, 2), 170.0))
    end = time.monotonic() + 2.2
    while time.monotonic() < end:
        seen = client.read()
    assert np.median(seen[:, 1:]) < 20.0


MALFORMED = [
    b"",
    b"x" * 100,
    b"nan " * 26,
    b"inf " * 26,
    b"1e400 " * 26,
    b"-1 " * 26,
    b"256 " * 26,
    b"0 " * 25,
    b"0 " * 27,
    b"0 " * 32000,
    "٠ ".encode() * 26,
    bytes(range(256)),
]


def test_malformed_packets_change_nothing(client):
    levels = np.full((JOINTS, 2), 170.0)
    settle(client, levels)
    begin = len(client.arrivals)
    for k in range(1000):
        client.send_text(MALFORMED[k % len(MALFORMED)])
        if k % 10 == 0:
            client.send(levels)
            seen = client.read()
    assert np.median(seen[:, 1:]) == pytest.approx(400.0, abs=5.0)
    gaps = np.diff(client.arrivals[begin:])
    assert np.median(gaps) == pytest.approx(0.01, abs=0.002)


def test_a_burst_of_commands_leaves_no_delay_and_no_memory(server, client):
    settle(client, np.full((JOINTS, 2), 170.0))
    before = server.memory()
    for _ in range(20_000):
        client.send_text(b"100 " * 26)
    # After the burst the newest command is at work soon.
    seen = settle(client, np.full((JOINTS, 2), 200.0), 1.2)
    assert np.median(seen[:, 1:]) == pytest.approx(200 * 600 / 255, abs=8.0)
    assert server.memory() - before < 8e6


def test_a_stopped_process_goes_on_without_a_burst(server, client):
    client.read()
    os.kill(server.process.pid, signal.SIGSTOP)
    time.sleep(0.5)
    os.kill(server.process.pid, signal.SIGCONT)
    client.inbound.setblocking(False)
    while True:
        # What was under way when it stopped.
        try:
            client.inbound.recv(1024)
        except BlockingIOError:
            break
    client.inbound.settimeout(20.0)
    begin = time.monotonic()
    for _ in range(50):
        client.read()
    assert time.monotonic() - begin > 0.4


def test_a_client_that_is_killed_leaves_the_next_one_a_robot(server):
    code = (
        "import sys; sys.path.insert(0, 'tests')\n"
        "from support.wire_client import WireClient\n"
        "import numpy as np\n"
        f"c = WireClient({server.sensor_port}, {server.command_port})\n"
        "c.start(); print('up', flush=True)\n"
        "c.control(60, lambda t: np.full((13, 2), 100.0))\n"
    )
    first = subprocess.Popen(
        [sys.executable, "-c", code], stdout=subprocess.PIPE, text=True
    )
    assert first.stdout.readline() == "up\n"
    first.kill()
    first.communicate()
    with WireClient(server.sensor_port, server.command_port) as client:
        seen = settle(client, np.full((JOINTS, 2), 170.0))
        assert np.median(seen[:, 1:]) == pytest.approx(400.0, abs=5.0)


def test_the_record_is_a_log(server):
    controller = load_robot_controller()
    log = read_log(server.record, 5, controller, driven=False)
    # The left elbow's command of `test_chambers_go_to_their_set_points`.
    asked = np.isclose(log.c_a, 120.0)
    assert log.p_a[asked][-1] == pytest.approx(120.0, abs=12.0)
    assert np.mean(np.diff(log.t)) == pytest.approx(0.01, abs=1e-6)
    assert not log.has_reference


@pytest.mark.slow
def test_all_22_joints_are_served():
    with serving("--scenario=robot_22") as server:
        assert server.first.startswith("serving: robot_22, 22 joints")
        ports = (server.sensor_port, server.command_port)
        with WireClient(*ports, joints=22) as client:
            seen = settle(client, np.full((22, 2), 170.0), 1.5)
        assert seen.shape == (22, 3)
        assert np.median(seen[:, 1:]) == pytest.approx(400.0, abs=5.0)


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (["--scenario=robt"], "did you mean 'robot'"),
        (["--scenario=drumming"], "scenario.wire"),
        (["--rate=130"], "multiple of"),
        (["--rate=0"], "--rate is 0"),
        (["--rate=nan"], "--rate is nan"),
        (["--host=192.0.2.7"], "--allow-network"),
        (["--host=robot"], "IPv4 address"),
        (["--sensor-port=0"], "--sensor-port is 0"),
        (["--sensor-port=50010"], "another port"),
        (["--seconds=-1"], "--seconds is -1"),
        (["--command-timeout=0"], "--command-timeout is 0"),
        (["--record=/nowhere/x.csv"], "cannot write"),
        (["--seed=-1"], "--seed"),
    ],
)
def test_what_does_not_fit_is_said_in_one_line(options, words, capsys):
    assert main(["serve", *options]) == 2
    out, err = capsys.readouterr()
    assert words in err
    assert err.count("\n") == 1
    assert out == ""


def test_a_port_in_use_is_said_in_one_line(capsys):
    ports = free_ports()
    with WireClient(ports[1], ports[0]):
        code = main(
            [
                "serve",
                f"--sensor-port={ports[0]}",
                f"--command-port={ports[1]}",
            ]
        )
    assert code == 2
    err = capsys.readouterr().err
    assert f"--command-port {ports[1]} cannot be used" in err
    assert err.count("\n") == 1


def test_packets_of_other_addresses_are_not_taken():
    ports = free_ports()
    sockets = WireSockets("127.0.0.2", *ports)
    try:
        with WireClient(*ports) as client:
            client.there = ("127.0.0.2", ports[1])
            client.send_text("hello")
            assert sockets.receive(0.5) is None
    finally:
        sockets.close()
