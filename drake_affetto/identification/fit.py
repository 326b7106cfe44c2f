"""The fit of a joint's parameters to logs of the robot.

It has two kinds of stage:

1. windows (shooting): many short windows, each started from the measured state,
   under the logged commands. Errors cannot accumulate, so that a poor start
   does no harm;
2. runs: whole logs in closed loop under the robot's own PID law.
"""

from collections.abc import Callable, Sequence
import dataclasses
import math

import numpy as np
from scipy.optimize import least_squares

from drake_affetto.common.errors import InputError
from drake_affetto.common.typing import Array
from drake_affetto.identification.problem import FitParameter, JointProblem
from drake_affetto.identification.simulator import (
    LEAD_IN,
    JointSimulator,
    weighted_errors,
)
from drake_affetto.robot.log import (
    RobotLog,
)

# Length of the part of a window that is fitted, s.
_WINDOW = 0.8


@dataclasses.dataclass
class FitState:
    """The state of a fit after a stage.

    Attributes:
        values: Parameter values by name.
        start_delays: Start delay of each log by the log's name, s.
        stage: Number of finished stages.
        cost: Mean squared weighted error of the last stage.
        profile: Ratios of errors by parameter, see `profile_fit`.
        members: Values of the fits without one log, by that log's name, see
            `fit_members`.
    """

    values: dict[str, float]
    start_delays: dict[str, float] = dataclasses.field(default_factory=dict)
    stage: int = 0
    cost: float = math.inf
    profile: dict[str, list[float]] = dataclasses.field(default_factory=dict)
    members: dict[str, dict[str, float]] = dataclasses.field(
        default_factory=dict
    )


# What each stage of a fit simulates; its step of finite differences; its
# greatest number of evaluations.
FIT_STAGES = ("windows", "runs", "runs", "runs", "runs")
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
        problem: The joint.
        logs: Logs, at least one.
        state: State of an interrupted fit; None for the beginning.
        stages: Number of stages in all; None for all of `FIT_STAGES`.
        prior: Weight of the distance to the starting values, which determines
            what the logs leave open.
        on_evaluation: Function of stage and cost, called after evaluations.
        on_stage: Function of the state, called after each stage.

    Returns:
        The state after the last stage.

    Raises:
        InputError: If there is no log.
    """
    if not logs:
        raise InputError("no log to fit to")
    simulator = JointSimulator(problem)
    if state is None:
        state = FitState(values=problem.start())
    end = len(FIT_STAGES) if stages is None else stages
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
    """Runs one stage; start delays are estimated before and after runs."""
    delays = dict(state.start_delays)
    whole_runs = FIT_STAGES[stage] == "runs"

    def update_delays(values: dict[str, float]) -> None:
        for log in logs:
            delays[log.name] = simulator.estimate_start_delay(values, log)

    def report(cost: float) -> None:
        if on_evaluation is not None:
            on_evaluation(stage, cost)

    if whole_runs:
        update_delays(state.values)
    values, cost = solve(
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


def solve(
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

    Args:
        simulator: Simulator of the joint.
        logs: Logs to fit to.
        values: Values to begin with.
        delays: Start delay of each log, s; None to fit windows.
        prior: Weight of the distance to the starting values.
        step: Step of the finite differences, as a fraction of the bounds.
        evaluations: Greatest number of evaluations.
        report: Function of the cost, called after each evaluation.
        fixed: Name of a parameter that keeps its value.

    Returns:
        The values, and the mean squared weighted error without the prior.
    """
    everything = simulator.problem.parameters()
    parameters = [p for p in everything if p.name != fixed]
    start = np.array([p.encode(values[p.name]) for p in parameters])
    center = np.array([p.encode(p.start) for p in parameters])
    pulled = np.zeros(start.size)

    def residuals(y: Array) -> Array:
        trial = {**values, **decode(parameters, y - 1.0)}
        if delays is None:
            parts = _window_errors(simulator, trial, logs)
        else:
            parts = run_errors(simulator, trial, logs, delays)
        errors = np.concatenate([part.ravel() for part in parts])
        errors /= math.sqrt(errors.size)
        report(float(np.sum(errors**2)))
        pulled[:] = prior * (y - 1.0 - center)
        return np.concatenate([errors, pulled])

    # Shifted by one, for the step of the differences is relative to y.
    solution = least_squares(
        residuals,
        1.0 + np.clip(start, 1e-3, 1.0 - 1e-3),
        bounds=(1.0, 2.0),
        diff_step=step,
        max_nfev=evaluations,
    )
    errors = solution.fun[: -start.size]
    solved = {**values, **decode(parameters, solution.x - 1.0)}
    return solved, float(np.sum(errors**2))


def decode(
    parameters: Sequence[FitParameter], fractions: Array
) -> dict[str, float]:
    """Values by name of `fractions` between the bounds, (parameters,)."""
    return {
        p.name: p.decode(float(f))
        for p, f in zip(parameters, fractions, strict=True)
    }


def run_errors(
    simulator: JointSimulator,
    values: dict[str, float],
    logs: Sequence[RobotLog],
    delays: dict[str, float],
) -> list[Array]:
    """Weighted errors (N, 3) of each log in closed loop."""
    return [
        weighted_errors(
            simulator.run(values, log, start_delay=delays[log.name]).errors(log)
        )
        for log in logs
    ]


def _window_errors(
    simulator: JointSimulator,
    values: dict[str, float],
    logs: Sequence[RobotLog],
) -> list[Array]:
    """Weighted errors of all windows, without their lead-in."""
    parts = []
    for log in logs:
        period = (log.t[-1] - log.t[0]) / (log.t.size - 1)
        lead = math.ceil(LEAD_IN / period)
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
            parts.append(weighted_errors(errors[lead:]))
    return parts
