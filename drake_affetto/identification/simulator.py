"""Simulation of a robot's log: one joint, its actuator, its controller.

The model is that of the trials: `chamber.step_joints` in regulator mode, with
a joint of constant inertia, viscous friction, a load that depends on the
angle, and a lower stop.

A log differs from others in its initial state and in the delay of its first
commands, which varies by tens of milliseconds from run to run (`start_delay`).
Later the dead time is a common one plus a fitted share (`start_share`) of the
difference between the log's start delay and the usual one.

The compiled kernel is long, for a call in its loop would cost time.
"""

import dataclasses
import math
from typing import NamedTuple

import numba
import numpy as np
from scipy.signal import butter

from drake_affetto.common.typing import Array
from drake_affetto.identification.problem import JointProblem
from drake_affetto.pneumatics.chamber import (
    DWELL_OFFSET_PER_JOINT,
    MASS_OFFSET,
    REGULATOR_MODE,
    Row,
    joint_volume,
    memory_size,
    step_joints,
)
from drake_affetto.pneumatics.flow import GAS_CONSTANT
from drake_affetto.robot.control_law import initial_error_sum
from drake_affetto.robot.log import JointCourse, RobotLog

# Errors that weigh the same in the fit: of the angle, % of the range, and of
# a pressure, kPa.
ANGLE_SCALE = 2.5
PRESSURE_SCALE = 10.0

# Errors before this time of a log are not reported, s.
JUDGED_FROM = 1.0

# Step of the simulation, s.
_STEP = 0.001
# The start delay is estimated from this first part of a log, s.
_START_WINDOW = 1.0
# The start delay holds until the first of these times of a log, and is
# replaced gradually by the later dead time until the second, s.
_HOLD_START_DELAY = 0.5
_BLEND_END = 0.9
# The usual start delay, and the range of all, s.
_USUAL_START_DELAY = 0.09
_START_DELAYS = (0.03, 0.18)
# First part of a window, in which the joint follows the log, s.
LEAD_IN = 0.25
# The joint's stops: stiffness, N m/rad, and damping, N m s/rad.
_STOP_STIFFNESS = 50.0
_STOP_DAMPING = 0.5

# Plain integers, which compiled functions fold.
_K_A, _K_B = int(Row.K_A), int(Row.K_B)
_DEAD_TIME = int(Row.DEAD_TIME)
_ATMOSPHERE, _TEMPERATURE = int(Row.ATMOSPHERE), int(Row.TEMPERATURE)
_DWELL = MASS_OFFSET + DWELL_OFFSET_PER_JOINT


@dataclasses.dataclass(frozen=True)
class Simulated(JointCourse):
    """A simulated log, at the log's own times, as the robot's sensors see it.

    The angle is within 0 and 100 %, and the pressures have the sensors'
    offsets.
    """

    def errors(self, log: RobotLog) -> Array:
        """Differences to the log, (N, 3): angle, %, and p_a and p_b, kPa.

        Args:
            log: The log that was simulated.
        """
        n = self.t.size
        return np.stack(
            [
                self.q - log.q[:n],
                self.p_a - log.p_a[:n],
                self.p_b - log.p_b[:n],
            ],
            axis=1,
        )

    def rms(self, log: RobotLog) -> Array:
        """Rms errors from `JUDGED_FROM` on, (3,), of angle, p_a and p_b.

        Args:
            log: The log that was simulated.
        """
        judged = self.errors(log)[self.t >= JUDGED_FROM]
        return np.sqrt(np.mean(judged**2, axis=0))


@numba.njit(cache=True)
def _reading(angle, angle_range):
    """The angle that the sensor measures, %, between 0 and 100."""
    return min(max(100.0 * angle / angle_range, 0.0), 100.0)


@numba.njit(cache=True)
def _simulate(
    parameters,
    joint,
    law,
    delays,
    closed_loop,
    release,
    dwell,
    t,
    state,
    commands,
    reference,
    numerator,
    denominator,
    memory,
):
    """Simulates one joint at steps of 1 ms up to the last time in `t`.

    Args:
        parameters: Parameters of the kernel, (ROWS, 1).
        joint: Joint in SI units: [inertia, viscous friction, load (3), stop
            angle, range].
        law: Controller: [kP, kD, kI, stiffness, maximum, Σe before, sensor
            period].
        delays: Times: [dead time of the start, dead time afterwards, end of
            the start, end of the blend between them, step h], s.
        closed_loop: Whether commands come from the law, or from `commands`.
        release: Time until which the joint follows `state`, s.
        dwell: Initial dwell of the friction.
        t: Times of the log from 0, (N,), s.
        state: Measured q, rad, q̇, and p_a and p_b, Pa absolute, (N, 4).
        commands: Logged commands, (N, 2), kPa gauge.
        reference: Reference angle, %, and velocity, %/s, (N, 2).
        numerator: Numerator of the angle's filter.
        denominator: Denominator of the angle's filter.
        memory: Zeros, of the kernel's `memory_size`.

    Returns:
        q, %, p_a and p_b, Pa absolute, and both commands, kPa gauge, (N, 5).
    """
    h = delays[4]
    N = t.size
    out = np.empty((N, 5))
    par = parameters.copy()
    atmosphere = par[_ATMOSPHERE, 0]
    inertia, viscous = joint[0], joint[1]
    stop, angle_range = joint[5], joint[6]
    kP, kD, kI = law[0], law[1], law[2]
    stiffness, maximum = law[3], law[4]
    total = law[5]
    sensor_steps = round(law[6] / h)

    # The initial state: at rest, unless the joint follows the log first.
    x = np.array([state[0, 0], state[0, 1]])
    if release <= 0.0:
        x[1] = 0.0
        if _reading(x[0], angle_range) <= 0.0:
            x[0] = stop
    pressure = np.array([state[0, 2], state[0, 3]])
    torque = np.zeros(1)
    flow = np.zeros(2)
    command = np.array([pressure[0], pressure[1]])
    torque[0] = par[_K_A, 0] * (pressure[0] - atmosphere)
    torque[0] -= par[_K_B, 0] * (pressure[1] - atmosphere)
    order = denominator.size
    raw = np.full(order, _reading(x[0], angle_range))
    filtered = np.full(order - 1, raw[0])
    rate = 0.0

    k = 0
    row = 0
    steps = math.ceil(t[N - 1] / h) + 1
    first = True
    for s in range(steps + 1):
        now = s * h
        # The sensor, which reads tenths of a percent, and its filter.
        if s % sensor_steps == 0:
            for i in range(order - 1, 0, -1):
                raw[i] = raw[i - 1]
            raw[0] = round(10.0 * _reading(x[0], angle_range)) / 10.0
            y = 0.0
            for i in range(order):
                y += numerator[i] * raw[i]
            for i in range(1, order):
                y -= denominator[i] * filtered[i - 1]
            rate = (y - filtered[0]) / law[6]
            for i in range(order - 2, 0, -1):
                filtered[i] = filtered[i - 1]
            filtered[0] = y
        # A row of the log: the controller gives new commands.
        if k < N and now >= t[k] - 1e-9:
            if closed_loop:
                error = reference[k, 0] - filtered[0]
                total += error
                u = kP * error + kD * (reference[k, 1] - rate) + kI * total
                c_a = min(max(stiffness + u, 0.0), maximum)
                c_b = min(max(stiffness - u, 0.0), maximum)
            else:
                c_a = commands[k, 0]
                c_b = commands[k, 1]
            out[k, 0] = _reading(x[0], angle_range)
            out[k, 1] = pressure[0]
            out[k, 2] = pressure[1]
            out[k, 3] = c_a
            out[k, 4] = c_b
            command[0] = 1e3 * c_a + atmosphere
            command[1] = 1e3 * c_b + atmosphere
            k += 1

        # The dead time of the start passes into the later one.
        weight = (delays[3] - now) / (delays[3] - delays[2])
        weight = min(max(weight, 0.0), 1.0)
        par[_DEAD_TIME, 0] = weight * delays[0] + (1.0 - weight) * delays[1]

        if now < release:
            # The joint and the pressures follow the log.
            while row < N - 2 and t[row + 1] < now + h:
                row += 1
            part = (now + h - t[row]) / (t[row + 1] - t[row])
            for i in range(2):
                x[i] = state[row, i] + part * (
                    state[row + 1, i] - state[row, i]
                )
                pressure[i] = state[row, 2 + i] + part * (
                    state[row + 1, 2 + i] - state[row, 2 + i]
                )
            # Ambient temperature: the mass that belongs to this pressure.
            RT = GAS_CONSTANT * par[_TEMPERATURE, 0]
            volumes = joint_volume(x[0], 0, par)
            for i in range(2):
                memory[MASS_OFFSET + i] = pressure[i] * volumes[i] / RT
        else:
            # The joint moves: semi-implicit Euler, with stops.
            share = x[0] / angle_range
            load = joint[2] + share * (joint[3] + share * joint[4])
            contact = 0.0
            spring = 0.0
            damping = viscous
            if x[0] < stop:
                contact = _STOP_STIFFNESS * (stop - x[0])
                spring = _STOP_STIFFNESS
                damping += _STOP_DAMPING
            elif x[0] > 1.05 * angle_range:
                contact = _STOP_STIFFNESS * (1.05 * angle_range - x[0])
                spring = _STOP_STIFFNESS
                damping += _STOP_DAMPING
            gain = h / inertia
            x[1] = (x[1] + gain * (torque[0] - load + contact)) / (
                1.0 + gain * (damping + h * spring)
            )
            x[0] += h * x[1]
        logged_a = pressure[0]
        logged_b = pressure[1]
        # The chambers and the friction.
        step_joints(
            h,
            REGULATOR_MODE,
            0.0,
            par,
            command,
            x,
            pressure,
            torque,
            flow,
            memory,
        )
        if first:
            # The memory exists from the first step on.
            memory[_DWELL] = dwell
            first = False
        if now + h < release:
            pressure[0] = logged_a
            pressure[1] = logged_b
    return out


class _Setting(NamedTuple):
    """Part of the kernel's arguments, as they are explained there."""

    law: Array
    delays: Array
    closed_loop: bool
    release: float
    dwell: float


class JointSimulator:
    """Simulates logs of one joint with given parameter values."""

    def __init__(self, problem: JointProblem):
        """Prepares the filter of the robot's controller.

        Args:
            problem: The joint, its parameters and what is known of them.
        """
        self.problem = problem
        controller = problem.controller
        self._filter = butter(
            controller.filter_order,
            controller.filter_cutoff / (0.5 * controller.sensor_rate),
        )

    def run(
        self,
        values: dict[str, float],
        log: RobotLog,
        *,
        closed_loop: bool = True,
        start_delay: float = _USUAL_START_DELAY,
        until: float = math.inf,
        time_step: float = _STEP,
    ) -> Simulated:
        """Simulates a log from its first row on, free-running.

        Args:
            values: Values of the fitted parameters by name.
            log: Log with the initial state, the reference and, in open loop,
                the commands.
            closed_loop: Whether the robot's PID law makes the commands; a log
                without a reference has its own instead.
            start_delay: Dead time of the start, see `estimate_start_delay`, s.
            until: Time at which the simulation ends, s.
            time_step: Step of the simulation, s.
        """
        joint = self.problem.joint
        controller = self.problem.controller
        law = np.array(
            [
                joint.kP,
                joint.kD,
                joint.kI,
                controller.stiffness,
                controller.command_maximum,
                initial_error_sum(log, joint, controller),
                1.0 / controller.sensor_rate,
            ]
        )
        delays = np.array(
            [
                start_delay,
                max(
                    values["dead_time"]
                    + values["start_share"]
                    * (start_delay - _USUAL_START_DELAY),
                    0.0,
                ),
                _HOLD_START_DELAY,
                _BLEND_END,
                time_step,
            ]
        )
        rows = int(np.searchsorted(log.t, until, side="right"))
        closed_loop = closed_loop and log.has_reference
        setting = _Setting(law, delays, closed_loop, release=0.0, dwell=1.0)
        return self._simulate(values, log, slice(0, rows), setting)

    def window(
        self, values: dict[str, float], log: RobotLog, first: int, rows: int
    ) -> Simulated:
        """Simulates `rows` rows of a log in open loop from the measured state.

        During the lead-in the joint follows the log, so that lines and valves
        come into their state; then it moves freely.

        Args:
            values: Values of the fitted parameters by name.
            log: Log of the joint.
            first: First row of the window.
            rows: Number of rows.
        """
        travel = np.sum(np.abs(np.diff(log.q[: first + 1]))) / 100.0
        travel *= self.problem.angle_range
        dwell = math.exp(-travel / values["dwell_travel"])
        delay = values["dead_time"]
        delays = np.array([delay, delay, 0.5, 1.0, _STEP])
        law = np.array([0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.01])
        setting = _Setting(law, delays, False, LEAD_IN, dwell)
        return self._simulate(values, log, slice(first, first + rows), setting)

    def _simulate(
        self,
        values: dict[str, float],
        log: RobotLog,
        rows: slice,
        setting: _Setting,
    ) -> Simulated:
        problem = self.problem
        angle_range = problem.angle_range
        parameters = problem.kernel_parameters(values)
        joint = np.array(
            [
                values["inertia"],
                values["viscous_friction"],
                values["load_constant"],
                values["load_linear"],
                values["load_quadratic"],
                0.01 * values["stop_angle"] * angle_range,
                angle_range,
            ]
        )
        atmosphere = problem.supply.atmospheric_pressure
        t = log.t[rows] - log.t[rows][0]
        q = 0.01 * angle_range * log.q[rows]
        state = np.stack(
            [
                q,
                np.gradient(q, t) if t.size > 1 else np.zeros(t.size),
                1e3 * (log.p_a[rows] - values["offset_a"]) + atmosphere,
                1e3 * (log.p_b[rows] - values["offset_b"]) + atmosphere,
            ],
            axis=1,
        )
        start, later, _, _, step = setting.delays
        out = _simulate(  # type: ignore[call-arg]
            parameters,
            joint,
            *setting,
            t,
            state,
            np.stack([log.c_a[rows], log.c_b[rows]], axis=1),
            np.stack([log.q_des[rows], log.dq_des[rows]], axis=1),
            *self._filter,
            np.zeros(memory_size(1, step, max(start, later))),
        )
        return Simulated(
            t=log.t[rows],
            q=out[:, 0],
            p_a=1e-3 * (out[:, 1] - atmosphere) + values["offset_a"],
            p_b=1e-3 * (out[:, 2] - atmosphere) + values["offset_b"],
            c_a=out[:, 3],
            c_b=out[:, 4],
        )

    def estimate_start_delay(
        self, values: dict[str, float], log: RobotLog
    ) -> float:
        """Estimates the dead time of the log's first commands, s.

        It is the dead time that fits the log's first second best; later rows
        are not used.

        Args:
            values: Values of the fitted parameters by name.
            log: Log of the joint.
        """

        def misfit(delay: float) -> float:
            simulated = self.run(
                values, log, start_delay=delay, until=_START_WINDOW
            )
            return float(np.sum(weighted_errors(simulated.errors(log)) ** 2))

        step = 0.0075
        grid = np.arange(*_START_DELAYS, step)
        cost = [misfit(d) for d in grid]
        best = int(np.argmin(cost))
        for _ in range(2):
            step /= 3.0
            grid = grid[best] + step * np.array([-2, -1, 0, 1, 2])
            cost = [misfit(d) for d in grid]
            best = int(np.argmin(cost))
        return float(grid[best])


def weighted_errors(errors: Array) -> Array:
    """Errors (N, 3) in units of their scales, limited to ±4."""
    scale = np.array([ANGLE_SCALE, PRESSURE_SCALE, PRESSURE_SCALE])
    weighted = np.nan_to_num(
        errors / scale, nan=10.0, posinf=10.0, neginf=-10.0
    )
    # Limited, so that one slip at another time does not outweigh the rest.
    return 4.0 * np.tanh(weighted / 4.0)
