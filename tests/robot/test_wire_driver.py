"""The driver of a robot, which the test plays itself."""

import time

import numpy as np
from pydrake.systems.analysis import Simulator
import pytest

from drake_affetto.common.errors import InputError
from drake_affetto.robot.wire import RobotWire, WireJoint
from drake_affetto.robot.wire_driver import WireDriver
from support.dummy_robot import DummyRobot
from support.wire_client import free_ports

WIRE = RobotWire(
    joints=[WireJoint("one", 0.0, 100.0), WireJoint("two", -50.0, 50.0)]
)
GOOD = b"50.0 100.0 200.0 25.0 300.0 400.0"
WANTED = np.array([200.0, 200.0, 400.0, 400.0]) * 1e3 + 101.3e3


@pytest.fixture
def bench():
    """(robot, driver, simulator, context): the driver at its set-points."""
    ports = free_ports()
    driver = WireDriver(
        WIRE, "127.0.0.1", *ports, sensor_rate=100.0, command_rate=100.0
    )
    context = driver.CreateDefaultContext()
    driver.GetInputPort("pressure_command").FixValue(context, WANTED)
    with DummyRobot(*ports) as robot:
        yield robot, driver, Simulator(driver, context), context
        driver.close()


def step(simulator, count=1):
    context = simulator.get_context()
    for _ in range(count):
        simulator.AdvanceTo(context.get_time() + 0.01)


def link(driver, context):
    return driver.GetOutputPort("link").Eval(context)


def test_it_vents_until_the_robot_is_heard(bench):
    robot, driver, simulator, context = bench
    assert link(driver, context)[0] == 0.0
    step(simulator, 3)
    assert robot.commands()
    robot.send(GOOD)
    step(simulator, 3)
    assert robot.commands()[-1] == [85, 170, 85, 170]
    assert link(driver, context)[0] == 1.0
    state = driver.GetOutputPort("joint_state").Eval(context)
    np.testing.assert_allclose(state[:2], np.radians([50.0, -25.0]))
    np.testing.assert_allclose(
        driver.GetOutputPort("chamber_pressure").Eval(context),
        101.3e3 + 1e3 * np.array([100.0, 300.0, 200.0, 400.0]),
    )


def test_a_robot_that_falls_silent_is_vented(bench):
    robot, driver, simulator, context = bench
    robot.send(GOOD)
    step(simulator, 3)
    time.sleep(WIRE.stale_after + 0.02)
    robot.commands()
    step(simulator, 3)
    assert all(levels == [0, 0, 0, 0] for levels in robot.commands())
    trusted, age, _ = link(driver, context)
    assert trusted == 0.0
    assert age > WIRE.stale_after


@pytest.mark.parametrize(
    "packet",
    [
        b"",
        GOOD + b" 1",
        GOOD.replace(b"50.0", b"nan"),
        GOOD.replace(b"50.0", b"140"),
        GOOD.replace(b"100.0", b"9000"),
        b"\xff" * 2000,
    ],
)
def test_impossible_sensors_do_not_keep_the_link_alive(bench, packet):
    robot, driver, simulator, context = bench
    robot.send(GOOD)
    step(simulator, 2)
    end = time.monotonic() + WIRE.stale_after + 0.02
    sent = 0
    # On a busy machine few packets are sent in that time.
    while time.monotonic() < end or sent < 5:
        robot.send(packet)
        sent += 1
        step(simulator)
        time.sleep(0.01)
    # On a busy machine the last step may have come before that time.
    step(simulator)
    trusted, _, bad = link(driver, context)
    assert trusted == 0.0
    assert bad >= 5
    robot.commands()
    step(simulator, 2)
    assert robot.commands()[-1] == [0, 0, 0, 0]


def test_a_set_point_that_is_no_number_vents(bench):
    robot, driver, simulator, context = bench
    robot.send(GOOD)
    driver.GetInputPort("pressure_command").FixValue(
        context, np.full(4, np.nan)
    )
    step(simulator, 3)
    assert robot.commands()[-1] == [0, 0, 0, 0]


def test_closing_vents_the_robot(bench):
    robot, driver, simulator, _ = bench
    robot.send(GOOD)
    step(simulator, 3)
    robot.commands()
    driver.close()
    assert robot.commands() == [[0, 0, 0, 0]]


def test_a_silent_robot_and_a_port_in_use_are_named(bench):
    _, driver, _, context = bench
    with pytest.raises(InputError, match="the robot is silent"):
        driver.wait(context, 0.05)
    port = driver._socket.getsockname()[1]
    with pytest.raises(InputError, match=f"port {port}"):
        WireDriver(
            WIRE, "127.0.0.1", port, 9, sensor_rate=100.0, command_rate=30.0
        )
