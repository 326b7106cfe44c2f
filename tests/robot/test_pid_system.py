"""The robot's PID law as a system, beside the law written out."""

import dataclasses

import numpy as np
from pydrake.systems.analysis import Simulator
import pytest

from drake_affetto.common.errors import InputError
from drake_affetto.robot.controller import load_robot_controller
from drake_affetto.robot.pid_system import RobotPid, make_set_points
from drake_affetto.robot.wire import PacketCodec, load_wire

CONTROLLER = load_robot_controller()
WIRE = load_wire()
N = len(WIRE.joints)


def run_law(wire, seconds):
    """The levels that the system commands for fixed states, %."""
    system = RobotPid(CONTROLLER, wire)
    context = system.CreateDefaultContext()
    at_0 = np.radians([j.at_0 for j in wire.joints])
    span = np.radians([j.at_100 for j in wire.joints]) - at_0

    def state(percent, rate):
        q = at_0 + 0.01 * percent * span
        return np.append(q, np.full(N, 0.01 * rate) * span)

    for port, value in (
        ("desired_state", (50, 12)),
        ("estimated_state", (44, 7)),
    ):
        system.GetInputPort(port).FixValue(context, state(*value))
    Simulator(system, context).AdvanceTo(seconds)
    command = system.GetOutputPort("pressure_command").Eval(context)
    return PacketCodec(wire).command_levels(command).reshape(N, 2)


def test_commands_are_those_of_the_law():
    levels = run_law(WIRE, 2 / 30 + 0.01)  # its third sample
    for (c_a, c_b), joint in zip(levels, CONTROLLER.joints, strict=True):
        u = joint.kP * 6.0 + joint.kD * 5.0 + joint.kI * 18.0
        assert c_a == pytest.approx(255 / 600 * (400 + u))
        assert c_b == pytest.approx(255 / 600 * (400 - u))


def test_a_joint_that_counts_the_other_way_gets_the_same_commands():
    turned = [
        dataclasses.replace(j, at_0=j.at_100, at_100=j.at_0)
        for j in WIRE.joints
    ]
    wire = dataclasses.replace(WIRE, joints=turned)
    np.testing.assert_allclose(run_law(wire, 0.05), run_law(WIRE, 0.05))


def test_joints_without_gains_are_named():
    wire = load_wire("package://drake_affetto/robot_wire_22.yaml")
    with pytest.raises(InputError, match="no gains for waist_pitch"):
        RobotPid(CONTROLLER, wire)


def test_set_points_have_the_difference_that_is_asked_for():
    system = make_set_points(5e5, 3)
    context = system.CreateDefaultContext()
    u = np.array([1e5, -2e5, 0.0])
    system.get_input_port().FixValue(context, u)
    p = system.get_output_port().Eval(context)
    np.testing.assert_allclose(p[:3] - p[3:], u)
    np.testing.assert_allclose(p[:3] + p[3:], 1e6)
