"""Logs of a robot that the tests invent, in the form of the real ones."""

import dataclasses

import numpy as np

from drake_affetto.identification.problem import JointProblem
from drake_affetto.identification.simulator import JointSimulator
from drake_affetto.pneumatics.parameters import (
    ActuatorClass,
    PneumaticParameters,
)
from drake_affetto.robot.controller import load_robot_controller
from drake_affetto.robot.log import RobotLog

JOINT = 5
CONTROLLER = load_robot_controller()


def make_problem():
    """The left elbow's problem, apart from the default actuators."""
    return JointProblem(
        joint=CONTROLLER.joints[JOINT],
        controller=CONTROLLER,
        supply=PneumaticParameters(),
        actuator=ActuatorClass(),
    )


def true_values(problem):
    """A robot that is not the one the fit starts from."""
    values = problem.start()
    values.update(
        coulomb_torque=0.12,
        dwell_torque=0.05,
        viscous_friction=0.09,
        inertia=3e-3,
        load_constant=0.05,
        load_linear=0.15,
        fill_conductance=1.2 * values["fill_conductance"],
        exhaust_conductance=1.5 * values["exhaust_conductance"],
        dead_volume=15e-6,
        dead_time=0.08,
        offset_a=1.0,
        offset_b=-1.5,
    )
    return values


def make_log(problem, values, *, seconds=5.0, seed=0, start_delay=0.09):
    """A log of the robot with `values`, following a random reference."""
    random = np.random.default_rng(seed)
    t = np.arange(0.0, seconds + 1e-9, 1 / 30)
    knots = np.arange(0.0, seconds + 1.0, 0.7)
    targets = np.concatenate([[0.0], random.uniform(10, 80, knots.size - 1)])
    slow = np.interp(t, knots, targets)
    window = np.hanning(9) / np.sum(np.hanning(9))
    q_des = np.convolve(np.pad(slow, 4, mode="edge"), window, mode="valid")
    blank = RobotLog(
        name=f"invented_{seed}",
        joint=JOINT,
        t=t,
        q=np.zeros(t.size),
        p_a=np.full(t.size, 2.0),
        p_b=np.full(t.size, 556.0),
        c_a=np.full(t.size, 400.0),
        c_b=np.full(t.size, 400.0),
        q_des=q_des,
        dq_des=np.gradient(q_des, t),
        q_filtered=np.zeros(t.size),
        dq_filtered=np.zeros(t.size),
    )
    # The first command of a run that starts with an empty integrator.
    joint = problem.joint
    first = joint.kP * q_des[0] + joint.kD * blank.dq_des[0]
    first += joint.kI * q_des[0]
    blank.c_a[0] += first
    done = JointSimulator(problem).run(values, blank, start_delay=start_delay)
    return dataclasses.replace(
        blank, q=done.q, p_a=done.p_a, p_b=done.p_b, c_a=done.c_a, c_b=done.c_b
    )


def write_csv(path, log, *, change=None):
    """Writes a log as the robot's library does; `change` edits the columns."""
    k = log.joint
    columns = {
        "t": log.t,
        f"rq{k}": log.q,
        f"rpa{k}": log.p_a,
        f"rpb{k}": log.p_b,
        f"ca{k}": log.c_a * 255 / 600,
        f"cb{k}": log.c_b * 255 / 600,
        f"qdes{k}": log.q_des,
        f"dqdes{k}": log.dq_des,
    }
    columns = {name: np.array(column) for name, column in columns.items()}
    if change is not None:
        change(columns)
    lines = [",".join(columns)]
    for row in zip(*columns.values(), strict=True):
        lines.append(",".join(repr(float(x)) for x in row))
    path.write_text("\n".join(lines) + "\n")
    return path
