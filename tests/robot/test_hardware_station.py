"""The station with hardware, driving the simulated robot of another process."""

import dataclasses
import re

import numpy as np
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.primitives import ConstantVectorSource, TrajectorySource
from pydrake.trajectories import PiecewisePolynomial
import pytest

from drake_affetto.common.errors import InputError
from drake_affetto.control.pidf import load_control
from drake_affetto.control.pidf_controller import PidfController
from drake_affetto.experiments.episode import TrialRunner
from drake_affetto.robot.controller import load_robot_controller
from drake_affetto.robot.hardware_station import HardwareStation, make_station
from drake_affetto.robot.pid_system import RobotPid, make_set_points
from drake_affetto.robot.wire import load_wire
from drake_affetto.station.scenario import load_scenario
from drake_affetto.station.station import AffettoStation
from support.serving import serving
from support.wire_client import free_ports

# A share of the gains of flow mode, where the inner loop is faster: 30 commands
# a second and the wire's delay swing the arm from half of them on.
GAIN = 0.35
MEAN = 401.3e3  # Pa, 300 kPa gauge
# Time in which the arm comes to the start of the stroke, s.
APPROACH = 3.0
# The wire has its jitter: of so many strokes one may pass above the drum.
STROKES = 3
SHARED = ("estimated_state", "chamber_pressure")
ELBOW = 11


def closed_loop(station, desired):
    """One and the same diagram around either station."""
    builder = DiagramBuilder()
    builder.AddSystem(station)
    pid = builder.AddSystem(RobotPid(load_robot_controller(), load_wire()))
    wanted = builder.AddSystem(ConstantVectorSource(desired))
    builder.Connect(
        wanted.get_output_port(), station.GetInputPort("affetto.desired_state")
    )
    for port in ("desired_state", "estimated_state"):
        builder.Connect(
            station.GetOutputPort(f"affetto.{port}"), pid.GetInputPort(port)
        )
    builder.Connect(
        pid.get_output_port(), station.GetInputPort("affetto.pressure_command")
    )
    return builder.Build()


def hardware():
    return dataclasses.replace(load_scenario("robot"), hardware=True)


@pytest.fixture(scope="module")
def wanted():
    """The right elbow at 60 %, all others at the middle of the range."""
    wire = load_wire()
    share = np.full(13, 50.0)
    share[ELBOW] = 60.0
    at_0 = np.array([j.at_0 for j in wire.joints])
    span = np.array([j.at_100 for j in wire.joints]) - at_0
    return np.append(np.radians(at_0 + 0.01 * share * span), np.zeros(13))


def test_one_diagram_drives_the_simulation_and_the_robot(wanted):
    ends = {}
    simulated = AffettoStation(load_scenario("robot"))
    diagram = closed_loop(simulated, wanted)
    simulator = Simulator(diagram)
    context = simulator.get_mutable_context()
    simulated.reset(context)
    simulator.AdvanceTo(3.0)
    ends["simulated"] = simulated.GetOutputPort("affetto.estimated_state").Eval(
        simulated.GetMyContextFromRoot(context)
    )

    with serving() as server:
        station = make_station(
            hardware(),
            sensor_port=server.sensor_port,
            command_port=server.command_port,
        )
        assert isinstance(station, HardwareStation)
        simulator = Simulator(closed_loop(station, wanted))
        simulator.set_target_realtime_rate(1.0)
        context = simulator.get_mutable_context()
        station.wait(context)
        simulator.AdvanceTo(3.0)
        mine = station.GetMyContextFromRoot(context)
        ends["robot"] = station.GetOutputPort("affetto.estimated_state").Eval(
            mine
        )
        trusted, _, bad = station.GetOutputPort("affetto.link").Eval(mine)
        assert (trusted, bad) == (1.0, 0.0)
        station.close()
        code, out, _ = server.end()
        assert code == 0
        assert " 0 bad, 1 clients" in out
    span = np.radians(130.0)
    for name, state in ends.items():
        error = abs(state[ELBOW] - wanted[ELBOW]) / span
        assert error < 0.15, name


def test_both_stations_have_the_ports_of_the_wire():
    ports = free_ports()
    station = HardwareStation(
        hardware(), sensor_port=ports[0], command_port=ports[1]
    )
    try:
        simulated = AffettoStation(load_scenario("robot"))
        for port in (*SHARED, "desired_state"):
            name = f"affetto.{port}"
            assert (
                station.GetOutputPort(name).size()
                == simulated.GetOutputPort(name).size()
            )
        for port in ("pressure_command", "desired_state"):
            name = f"affetto.{port}"
            assert (
                station.GetInputPort(name).size()
                == simulated.GetInputPort(name).size()
            )
    finally:
        station.close()


def test_a_scenario_without_hardware_is_simulated():
    assert isinstance(make_station(load_scenario("robot")), AffettoStation)
    with pytest.raises(InputError, match="hardware is False"):
        HardwareStation(load_scenario("robot"))


def taught_stroke():
    """A demonstration at the default place, replayed thrice: (T,), (T, n).

    Between two strokes the arm rests for a second.
    """
    scenario = load_scenario("drumming")
    scenario.active_joints = load_wire().names
    runner = TrialRunner(scenario)
    xy = np.array(scenario.world.drum_position)
    theta = runner.teach(xy, seed=0).theta
    replay = runner.strike(xy, theta, seed=0)
    fresh = np.append(True, np.diff(replay.joint_t) > 1e-6)
    q = replay.desired_state[:, : len(scenario.active_joints)]
    t, q = replay.joint_t[fresh], q[fresh]
    pause = t[-1] - t[0] + 1.0
    again = np.concatenate([t + k * pause for k in range(STROKES)])
    return again, np.tile(q, (STROKES, 1))


def pidf_over_the_wire(station, t, q):
    """Our controllers, their pressure differences mapped to set-points."""
    config = station.scenario.control
    parameters = load_control(config.parameters, config.overlays)
    for gains in parameters.gains.values():
        gains.kP, gains.kI, gains.kD = (
            GAIN * each for each in (gains.kP, gains.kI, gains.kD)
        )
    builder = DiagramBuilder()
    builder.AddSystem(station)
    n = station.num_joints
    path = PiecewisePolynomial.FirstOrderHold(
        np.append(0.0, APPROACH + t - t[0]), np.vstack([q[:1], q]).T
    )
    source = builder.AddSystem(TrajectorySource(path, 1))
    controller = PidfController.AddToBuilder(
        builder=builder,
        joint_names=station.scenario.active_joints,
        **{name: station.GetOutputPort(f"affetto.{name}") for name in SHARED},
        config=dataclasses.replace(config, parameters=parameters, overlays=[]),
    )
    mapping = builder.AddSystem(make_set_points(MEAN, n))
    builder.Connect(
        source.get_output_port(), controller.GetInputPort("desired_state")
    )
    builder.Connect(
        controller.GetOutputPort("pid_output"), mapping.get_input_port()
    )
    builder.Connect(
        mapping.get_output_port(),
        station.GetInputPort("affetto.pressure_command"),
    )
    return builder.Build()


@pytest.mark.slow
def test_a_taught_stroke_sent_over_the_wire_strikes_the_simulated_drum():
    t, q = taught_stroke()
    with serving() as server:
        station = HardwareStation(
            hardware(),
            sensor_port=server.sensor_port,
            command_port=server.command_port,
        )
        simulator = Simulator(pidf_over_the_wire(station, t, q))
        simulator.set_target_realtime_rate(1.0)
        station.wait(simulator.get_mutable_context())
        simulator.AdvanceTo(APPROACH + t[-1] - t[0])
        station.close()
        code, _, err = server.end()
    assert code == 0
    forces = [float(x) for x in re.findall(r"the drum: ([\d.]+) N", err)]
    assert forces
    assert max(forces) > 0.5
