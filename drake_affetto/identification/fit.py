"""Identification of a joint's actuator from logs of the robot.

The model is the one of the trials: `chamber.step_joints` in regulator mode,
with a joint of constant inertia, viscous friction, a load that depends on the
angle, and a lower stop. It is fitted in two stages:

1. shooting: many short windows, each started from the measured state, under
   the logged commands. Errors cannot accumulate, so that a poor start is no
   hindrance;
2. whole runs, free-running in closed loop under the robot's own PID law.

What a log tells of itself and nothing else of it is used for its simulation:
the state at its beginning, and how late its first commands took effect, which
differs from run to run by tens of milliseconds (`start_delay`). Afterwards
the dead time is a common one and a fitted share (`start_share`) of how much
later or earlier than usual the log started.
"""

from collections.abc import Callable, Sequence
import dataclasses
import math

import numba
import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares
from scipy.signal import butter

from drake_affetto.common.errors import InputError
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
from drake_affetto.pneumatics.parameters import (
    ActuatorClass,
    JointActuator,
    PneumaticParameters,
)
from drake_affetto.robot.log import (
    RobotJoint,
    RobotLog,
    RobotStack,
    initial_sum,
)

ANGLE_SCALE = 2.5
"""An error of the angle that weighs as much as `PRESSURE_SCALE`, % of range."""
PRESSURE_SCALE = 10.0
"""An error of the pressure, kPa."""
JUDGED_FROM = 1.0
"""Errors are reported from this time of a log on, s."""

_STEP = 0.001
_START_WINDOW = 1.0
_HOLD_START_DELAY = 0.5
_BLEND_END = 0.9
_USUAL_START_DELAY = 0.09
_START_DELAYS = (0.03, 0.18)
_WINDOW = 0.8
_LEAD_IN = 0.25
_STOP_STIFFNESS = 50.0
_STOP_DAMPING = 0.5

# Plain integers, which compiled functions fold.
_K_A, _K_B = int(Row.K_A), int(Row.K_B)
_DEAD_TIME = int(Row.DEAD_TIME)
_ATMOSPHERE, _TEMPERATURE = int(Row.ATMOSPHERE), int(Row.TEMPERATURE)
_DWELL = MASS_OFFSET + DWELL_OFFSET_PER_JOINT


@dataclasses.dataclass(frozen=True)
class FitParameter:
    """One fitted number.

    Attributes:
        name: a field of `ActuatorClass`, or one of the joint's or log's own.
        unit: its SI unit.
        lower: lower bound.
        upper: upper bound.
        start: where the fit begins.
        logarithmic: whether its scale is logarithmic.
    """

    name: str
    unit: str
    lower: float
    upper: float
    start: float
    logarithmic: bool = True

    def encode(self, value: float) -> float:
        """`value` as a fraction of the way between the bounds."""
        if self.logarithmic:
            span = math.log(self.upper / self.lower)
            return math.log(value / self.lower) / span
        return (value - self.lower) / (self.upper - self.lower)

    def decode(self, fraction: float) -> float:
        """The inverse of `encode`, held within the bounds."""
        fraction = min(max(fraction, 0.0), 1.0)
        if self.logarithmic:
            return self.lower * (self.upper / self.lower) ** fraction
        return self.lower + fraction * (self.upper - self.lower)

    def slope(self, fraction: float) -> float:
        """Derivative of `decode`."""
        if self.logarithmic:
            return self.decode(fraction) * math.log(self.upper / self.lower)
        return self.upper - self.lower


@dataclasses.dataclass(frozen=True)
class JointProblem:
    """What is fixed while a joint is identified.

    Attributes:
        joint: the joint in the robot's own stack.
        stack: that stack.
        supply: parameters of the air (its classes are not used).
        actuator: the joint's class before the fit. Its torque constant is
            kept: pressures and angles alone determine volumes, flows, torques
            and the inertia only in proportion to it.
    """

    joint: RobotJoint
    stack: RobotStack
    supply: PneumaticParameters
    actuator: ActuatorClass

    @property
    def angle_range(self) -> float:
        """What 100 % of the joint's range are, rad."""
        return math.radians(self.joint.range_degrees)

    def parameters(self) -> list[FitParameter]:
        """The fitted parameters with bounds in proportion to the actuator."""
        K = self.actuator.torque_constant
        V = self.actuator.dead_volume
        middle = V + 0.5 * K * self.angle_range
        # The flow that changes a chamber's pressure at a rate of 1/s.
        flow = middle / 1.2e5
        kPa = 1e3 * K
        # 1 kPa per %/s, and per %/s²
        rate = 1e3 * K / (0.01 * self.angle_range)
        return [
            FitParameter("area_ratio", "1", 0.75, 1.0, 0.95, False),
            FitParameter("dead_volume", "m³", 0.3 * V, 4.0 * V, V),
            FitParameter(
                "fill_conductance",
                "m³/(s Pa)",
                1.5 * flow,
                20.0 * flow,
                5.2 * flow,
            ),
            FitParameter(
                "exhaust_conductance",
                "m³/(s Pa)",
                0.6 * flow,
                12.0 * flow,
                1.9 * flow,
            ),
            FitParameter(
                "leak_conductance",
                "m³/(s Pa)",
                0.0,
                0.4 * flow,
                0.1 * flow,
                False,
            ),
            FitParameter("underlap", "1", -0.05, 0.08, 0.01, False),
            FitParameter("valve_lag", "s", 2e-3, 50e-3, 16e-3),
            FitParameter("dead_time", "s", 0.03, 0.17, 0.09, False),
            FitParameter("regulator_gain", "1/Pa", 3e-6, 60e-6, 9.6e-6),
            FitParameter(
                "coulomb_torque", "N m", 2.0 * kPa, 60.0 * kPa, 15.0 * kPa
            ),
            FitParameter(
                "dwell_torque", "N m", 1.0 * kPa, 120.0 * kPa, 20.0 * kPa
            ),
            FitParameter("dwell_travel", "rad", 0.5, 30.0, 4.0),
            FitParameter("bristle_deflection", "rad", 5e-4, 2e-2, 2e-3),
            FitParameter(
                "inertia", "kg m²", 2e-3 * rate, 6e-2 * rate, 1e-2 * rate
            ),
            FitParameter(
                "viscous_friction",
                "N m s/rad",
                0.1 * rate,
                3.0 * rate,
                0.6 * rate,
            ),
            FitParameter(
                "load_constant", "N m", -80 * kPa, 80 * kPa, 0.0, False
            ),
            FitParameter(
                "load_linear", "N m", -200 * kPa, 200 * kPa, 30 * kPa, False
            ),
            FitParameter(
                "load_quadratic", "N m", -200 * kPa, 200 * kPa, 0.0, False
            ),
            FitParameter("stop_angle", "%", -10.0, 0.0, -3.0, False),
            FitParameter("offset_a", "kPa", -15.0, 15.0, 0.0, False),
            FitParameter("offset_b", "kPa", -15.0, 15.0, 0.0, False),
            FitParameter("start_share", "1", 0.0, 1.0, 0.3, False),
        ]

    def start(self) -> dict[str, float]:
        """The values with which the fit begins."""
        return {p.name: p.start for p in self.parameters()}

    def fitted_actuator(self, values: dict[str, float]) -> ActuatorClass:
        """The actuator class with the fitted `values`."""
        names = {f.name for f in dataclasses.fields(ActuatorClass)}
        chosen = {k: v for k, v in values.items() if k in names}
        coulomb = chosen["coulomb_torque"]
        return dataclasses.replace(
            self.actuator, **chosen, breakaway_torque=coulomb
        )

    def kernel_parameters(
        self, values: dict[str, float]
    ) -> NDArray[np.float64]:
        """The (ROWS, 1) parameter array of the compiled kernel."""
        actuator = self.fitted_actuator(values)
        supply = dataclasses.replace(
            self.supply,
            classes={"fitted": actuator},
            joints={"joint": JointActuator(actuator="fitted")},
        )
        return supply.for_joints(["joint"], [0.0], [self.angle_range])


@dataclasses.dataclass(frozen=True)
class Simulated:
    """A simulated log, at the log's own times.

    Attributes:
        t: s.
        q: as the robot's sensor would read it, %.
        p_a: kPa gauge, with the sensor's offset.
        p_b: of chamber b.
        c_a: commanded pressure, kPa gauge.
        c_b: of chamber b.
    """

    t: NDArray[np.float64]
    q: NDArray[np.float64]
    p_a: NDArray[np.float64]
    p_b: NDArray[np.float64]
    c_a: NDArray[np.float64]
    c_b: NDArray[np.float64]

    def errors(self, log: RobotLog) -> NDArray[np.float64]:
        """Differences (N, 3) to the log: angle [%], p_a and p_b [kPa]."""
        n = self.t.size
        return np.stack(
            [
                self.q - log.q[:n],
                self.p_a - log.p_a[:n],
                self.p_b - log.p_b[:n],
            ],
            axis=1,
        )

    def rms(self, log: RobotLog) -> NDArray[np.float64]:
        """Root mean squares (3) of the errors from `JUDGED_FROM` on."""
        judged = self.errors(log)[self.t >= JUDGED_FROM]
        return np.sqrt(np.mean(judged**2, axis=0))


@numba.njit(cache=True)
def _reading(angle, angle_range):
    """The angle sensor: percent, between 0 and 100."""
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
        parameters: (ROWS, 1) of the kernel.
        joint: [inertia, viscous friction, load (3), stop angle, range], SI.
        law: [kP, kD, kI, stiffness, maximum, Σe before, sensor period].
        delays: [dead time of the start and afterwards, end of the start, end of
            the blend between them, h], s.
        closed_loop: whether commands come from the law, or from `commands`.
        release: until then the joint is led along `state`, s.
        dwell: initial dwell of the friction.
        t: (N) times of the log, s, from 0.
        state: (N, 4) q [rad], q̇, p_a, p_b [Pa absolute] as measured.
        commands: (N, 2) logged commands, kPa gauge.
        reference: (N, 2) reference angle and rate, % and %/s.
        numerator: of the filter of the angle.
        denominator: of the same.
        memory: zeros, of the kernel's `memory_size`.

    Returns:
        (N, 5): q [%], p_a, p_b [Pa absolute] and both commands [kPa gauge].
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

        weight = (delays[3] - now) / (delays[3] - delays[2])
        weight = min(max(weight, 0.0), 1.0)
        par[_DEAD_TIME, 0] = weight * delays[0] + (1.0 - weight) * delays[1]

        if now < release:
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
        led_a = pressure[0]
        led_b = pressure[1]
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
            pressure[0] = led_a
            pressure[1] = led_b
    return out


class JointSimulator:
    """Simulates logs of one joint with given parameter values."""

    def __init__(self, problem: JointProblem):
        """Prepares the robot's filter and control law."""
        self.problem = problem
        stack = problem.stack
        self._filter = butter(
            stack.filter_order,
            stack.filter_cutoff / (0.5 * stack.sensor_rate),
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
            values: values of the fitted parameters by name.
            log: gives the initial state, the reference and, in open loop, the
                commands.
            closed_loop: whether the robot's PID law makes the commands.
            start_delay: see `estimate_start_delay`, s.
            until: time at which to end, s.
            time_step: of the simulation, s.
        """
        joint = self.problem.joint
        stack = self.problem.stack
        law = np.array(
            [
                joint.kP,
                joint.kD,
                joint.kI,
                stack.stiffness,
                stack.command_maximum,
                initial_sum(log, joint, stack),
                1.0 / stack.sensor_rate,
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
        return self._simulate(
            values, log, slice(0, rows), law, delays, closed_loop, 0.0, 1.0
        )

    def window(
        self, values: dict[str, float], log: RobotLog, first: int, rows: int
    ) -> Simulated:
        """Simulates `rows` rows of a log in open loop from the measured state.

        For the time of the lead-in the joint is led along the log, until the
        lines and valves are in their state; then it runs free.
        """
        travel = np.sum(np.abs(np.diff(log.q[: first + 1]))) / 100.0
        travel *= self.problem.angle_range
        dwell = math.exp(-travel / values["dwell_travel"])
        delay = values["dead_time"]
        delays = np.array([delay, delay, 0.5, 1.0, _STEP])
        law = np.array([0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.01])
        return self._simulate(
            values,
            log,
            slice(first, first + rows),
            law,
            delays,
            False,
            _LEAD_IN,
            dwell,
        )

    def _simulate(
        self,
        values: dict[str, float],
        log: RobotLog,
        rows: slice,
        law: NDArray[np.float64],
        delays: NDArray[np.float64],
        closed_loop: bool,
        release: float,
        dwell: float,
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
        out = _simulate(  # type: ignore[call-arg]
            parameters,
            joint,
            law,
            delays,
            closed_loop,
            release,
            dwell,
            t,
            state,
            np.stack([log.c_a[rows], log.c_b[rows]], axis=1),
            np.stack([log.q_des[rows], log.dq_des[rows]], axis=1),
            *self._filter,
            np.zeros(memory_size(1, delays[4], max(delays[0], delays[1]))),
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
        """The dead time of the log's first commands, s.

        It is the one that fits the log's first second best; later rows are not
        read.
        """

        def misfit(delay: float) -> float:
            simulated = self.run(
                values, log, start_delay=delay, until=_START_WINDOW
            )
            return float(np.sum(_weighted(simulated.errors(log)) ** 2))

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


def _weighted(errors: NDArray[np.float64]) -> NDArray[np.float64]:
    scale = np.array([ANGLE_SCALE, PRESSURE_SCALE, PRESSURE_SCALE])
    weighted = np.nan_to_num(
        errors / scale, nan=10.0, posinf=10.0, neginf=-10.0
    )
    # Bounded, so that one slip at another moment does not outweigh the rest.
    return 4.0 * np.tanh(weighted / 4.0)


@dataclasses.dataclass
class FitState:
    """What a fit has come to.

    Attributes:
        values: parameter values by name.
        start_delays: start delay of each log by its name, s.
        stage: number of finished stages.
        cost: the last stage's mean squared weighted error.
        profile: of the parameters in `PROFILED`, see `profile_fit`.
    """

    values: dict[str, float]
    start_delays: dict[str, float] = dataclasses.field(default_factory=dict)
    stage: int = 0
    cost: float = math.inf
    profile: dict[str, list[float]] = dataclasses.field(default_factory=dict)


PROFILED = (
    "inertia",
    "dead_volume",
    "fill_conductance",
    "coulomb_torque",
    "dwell_travel",
    "valve_lag",
)
"""Parameters whose neighbourhood is searched (`profile_fit`)."""

_PROFILE_FACTOR = 2.0
_PROFILE_RISE = 1.05
_PROFILE_EVALUATIONS = 6

STAGES = ("windows", "runs", "runs", "runs", "runs")
"""What each stage of a fit simulates."""
_STEPS = (2e-2, 1e-2, 5e-3, 5e-3, 2e-3)
_EVALUATIONS = (20, 15, 12, 12, 12)


def fit_logs(
    problem: JointProblem,
    logs: Sequence[RobotLog],
    *,
    state: FitState | None = None,
    stages: int | None = None,
    prior: float = 0.03,
    on_evaluation: Callable[[int, float], None] | None = None,
    on_stage: Callable[[FitState], None] | None = None,
) -> FitState:
    """Fits a joint's parameters to logs.

    Args:
        problem: the joint.
        logs: at least one log.
        state: where a former fit stopped; None: from the beginning.
        stages: how many of `STAGES` to do in all; None: all of them.
        prior: weight of the distance to the starting values, which settles
            what the logs leave open.
        on_evaluation: called as (stage, cost) while the fit goes on.
        on_stage: called with the state after each stage.

    Returns:
        The state after the last stage.

    Raises:
        InputError: without logs.
    """
    if not logs:
        raise InputError("no log to fit to")
    simulator = JointSimulator(problem)
    if state is None:
        state = FitState(values=problem.start())
    end = len(STAGES) if stages is None else stages
    for stage in range(state.stage, end):
        state = _fit_stage(simulator, logs, state, stage, prior, on_evaluation)
        if on_stage is not None:
            on_stage(state)
    return state


def _fit_stage(
    simulator: JointSimulator,
    logs: Sequence[RobotLog],
    state: FitState,
    stage: int,
    prior: float,
    on_evaluation: Callable[[int, float], None] | None,
) -> FitState:
    delays = dict(state.start_delays)
    whole_runs = STAGES[stage] == "runs"

    def update_delays(values: dict[str, float]) -> None:
        for log in logs:
            delays[log.name] = simulator.estimate_start_delay(values, log)

    def report(cost: float) -> None:
        if on_evaluation is not None:
            on_evaluation(stage, cost)

    if whole_runs:
        update_delays(state.values)
    values, cost = _solve(
        simulator,
        logs,
        state.values,
        delays if whole_runs else None,
        prior=prior,
        step=_STEPS[stage],
        evaluations=_EVALUATIONS[stage],
        report=report,
    )
    if whole_runs:
        update_delays(values)
    return FitState(values, delays, stage + 1, cost)


def _solve(
    simulator: JointSimulator,
    logs: Sequence[RobotLog],
    values: dict[str, float],
    delays: dict[str, float] | None,
    *,
    prior: float,
    step: float,
    evaluations: int,
    report: Callable[[float], None],
    fixed: str | None = None,
) -> tuple[dict[str, float], float]:
    """Least squares from `values`, on windows or (with `delays`) on runs.

    Returns:
        The values, and the mean squared weighted error without the prior.
    """
    everything = simulator.problem.parameters()
    parameters = [p for p in everything if p.name != fixed]
    start = np.array([p.encode(values[p.name]) for p in parameters])
    centre = np.array([p.encode(p.start) for p in parameters])
    pulled = np.zeros(start.size)

    def residuals(y: NDArray[np.float64]) -> NDArray[np.float64]:
        trial = {**values, **_decode(parameters, y - 1.0)}
        if delays is None:
            parts = _window_errors(simulator, trial, logs)
        else:
            parts = _run_errors(simulator, trial, logs, delays)
        errors = np.concatenate([part.ravel() for part in parts])
        errors /= math.sqrt(errors.size)
        report(float(np.sum(errors**2)))
        pulled[:] = prior * (y - 1.0 - centre)
        return np.concatenate([errors, pulled])

    # Shifted by one: the optimiser's steps are relative to the size of y.
    solution = least_squares(
        residuals,
        1.0 + np.clip(start, 1e-3, 1.0 - 1e-3),
        bounds=(1.0, 2.0),
        diff_step=step,
        max_nfev=evaluations,
    )
    errors = solution.fun[: -start.size]
    solved = {**values, **_decode(parameters, solution.x - 1.0)}
    return solved, float(np.sum(errors**2))


def _decode(
    parameters: Sequence[FitParameter], fractions: NDArray[np.float64]
) -> dict[str, float]:
    return {
        p.name: p.decode(float(f))
        for p, f in zip(parameters, fractions, strict=True)
    }


def _run_errors(
    simulator: JointSimulator,
    values: dict[str, float],
    logs: Sequence[RobotLog],
    delays: dict[str, float],
) -> list[NDArray[np.float64]]:
    """Weighted errors (N, 3) of each log, free-running in closed loop."""
    return [
        _weighted(
            simulator.run(values, log, start_delay=delays[log.name]).errors(log)
        )
        for log in logs
    ]


def _window_errors(
    simulator: JointSimulator,
    values: dict[str, float],
    logs: Sequence[RobotLog],
) -> list[NDArray[np.float64]]:
    """Weighted errors of the free part of all shooting windows."""
    parts = []
    for log in logs:
        period = (log.t[-1] - log.t[0]) / (log.t.size - 1)
        lead = math.ceil(_LEAD_IN / period)
        rows = lead + max(2, round(_WINDOW / period))
        for first in range(0, log.t.size - rows + 1, rows - lead):
            simulated = simulator.window(values, log, first, rows)
            errors = np.stack(
                [
                    simulated.q - log.q[first : first + rows],
                    simulated.p_a - log.p_a[first : first + rows],
                    simulated.p_b - log.p_b[first : first + rows],
                ],
                axis=1,
            )
            parts.append(_weighted(errors[lead:]))
    return parts


def profile_fit(
    problem: JointProblem,
    logs: Sequence[RobotLog],
    state: FitState,
    *,
    on_evaluation: Callable[[str, float], None] | None = None,
    on_parameter: Callable[[FitState], None] | None = None,
) -> FitState:
    """Searches what the local slopes of a fit do not tell.

    Each parameter in `PROFILED` is halved and doubled, all others are fitted
    anew, and the mean squared error is compared with the fit's. Where it
    hardly rises the others make up for it: the logs do not determine it.

    Args:
        problem: the joint.
        logs: those of the fit.
        state: a finished fit.
        on_evaluation: called as (parameter, ratio) while it goes on.
        on_parameter: called with the state after each parameter.

    Returns:
        The state with `profile` filled: for each parameter the ratios of the
        errors at half and at double its value.
    """
    simulator = JointSimulator(problem)
    base = float(
        np.mean(
            np.concatenate(
                _run_errors(simulator, state.values, logs, state.start_delays)
            )
            ** 2
        )
    )
    profile = dict(state.profile)
    for name in PROFILED:
        if name in profile:
            continue

        def report(cost: float, name: str = name) -> None:
            if on_evaluation is not None:
                on_evaluation(name, cost / base)

        ratios = []
        for factor in (1.0 / _PROFILE_FACTOR, _PROFILE_FACTOR):
            start = {**state.values, name: factor * state.values[name]}
            _, cost = _solve(
                simulator,
                logs,
                start,
                state.start_delays,
                prior=0.0,
                step=1e-2,
                evaluations=_PROFILE_EVALUATIONS,
                report=report,
                fixed=name,
            )
            ratios.append(cost / base)
        profile[name] = ratios
        state = dataclasses.replace(state, profile=profile)
        if on_parameter is not None:
            on_parameter(state)
    return state


@dataclasses.dataclass(frozen=True)
class Uncertainty:
    """How well the logs determine the parameters.

    Attributes:
        std: standard deviation of each parameter, in its unit, from the
            slopes at the fit alone.
        determined: whether the data say more of it than its bounds do, and,
            where it was profiled, another value makes the error grow.
        undetermined: the combinations that the data leave open: for each its
            standard deviation, in fractions of the bounds' distance, and the
            weights of the parameters in it.
    """

    std: dict[str, float]
    determined: dict[str, bool]
    undetermined: list[tuple[float, dict[str, float]]]


def estimate_uncertainty(
    problem: JointProblem, logs: Sequence[RobotLog], state: FitState
) -> Uncertainty:
    """Linear uncertainty of a fit, from the slopes of the whole runs' errors.

    The errors of neighbouring rows are not independent; their number is
    divided by the correlation length. The prior takes no part.
    """
    simulator = JointSimulator(problem)
    parameters = problem.parameters()
    centre = np.array([p.encode(state.values[p.name]) for p in parameters])

    def errors(fractions: NDArray[np.float64]) -> NDArray[np.float64]:
        trial = _decode(parameters, fractions)
        parts = _run_errors(simulator, trial, logs, state.start_delays)
        return np.concatenate([part.ravel() for part in parts])

    base = errors(centre)
    jacobian = np.empty((base.size, centre.size))
    step = 0.01
    for i in range(centre.size):
        ahead, behind = centre.copy(), centre.copy()
        ahead[i] = min(centre[i] + step, 1.0)
        behind[i] = max(centre[i] - step, 0.0)
        jacobian[:, i] = (errors(ahead) - errors(behind)) / (
            ahead[i] - behind[i]
        )
    length = _correlation_length(base.reshape(-1, 3))
    variance = float(np.mean(base**2)) * length
    # A uniform value between the bounds has a variance of 1/12.
    information = jacobian.T @ jacobian / variance
    covariance = np.linalg.inv(information + 12.0 * np.eye(centre.size))
    spread = np.sqrt(np.diag(covariance))
    std = {
        p.name: float(s * p.slope(float(c)))
        for p, s, c in zip(parameters, spread, centre, strict=True)
    }
    # 0.2 of the bounds' distance: two thirds of knowing nothing.
    determined = {
        p.name: bool(s < 0.2) for p, s in zip(parameters, spread, strict=True)
    }
    for name, ratios in state.profile.items():
        determined[name] &= min(ratios) > _PROFILE_RISE
    undetermined = []
    eigenvalues, vectors = np.linalg.eigh(covariance)
    for value, vector in zip(eigenvalues[::-1], vectors.T[::-1], strict=True):
        if math.sqrt(value) < 0.1:
            break
        vector = vector * np.sign(vector[np.argmax(np.abs(vector))])
        weights = {
            p.name: round(float(w), 2)
            for p, w in zip(parameters, vector, strict=True)
            if abs(w) > 0.25
        }
        undetermined.append((float(math.sqrt(value)), weights))
    return Uncertainty(std, determined, undetermined)


def _correlation_length(errors: NDArray[np.float64]) -> float:
    """Rows over which errors (N, 3) stay alike, at least 1."""
    longest = 1.0
    for column in errors.T:
        x = column - np.mean(column)
        power = float(np.dot(x, x))
        if power == 0.0:
            continue
        length = 1.0
        for lag in range(1, x.size // 4):
            r = float(np.dot(x[lag:], x[:-lag])) / power
            if r < 0.05:
                break
            length += 2.0 * r
        longest = max(longest, length)
    return longest
