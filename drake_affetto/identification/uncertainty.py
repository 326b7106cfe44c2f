"""The uncertainty of a fit: what the logs determine, and what they do not."""

from collections.abc import Callable, Sequence
import dataclasses
import math

import numpy as np

from drake_affetto.common.typing import Array
from drake_affetto.identification.fit import (
    FitState,
    decode,
    run_errors,
    solve,
)
from drake_affetto.identification.problem import JointProblem
from drake_affetto.identification.simulator import (
    JointSimulator,
)
from drake_affetto.robot.log import (
    RobotLog,
)

# Parameters that `profile_fit` halves and doubles.
PROFILED = (
    "inertia",
    "dead_volume",
    "fill_conductance",
    "coulomb_torque",
    "dwell_travel",
    "valve_lag",
)

_PROFILE_FACTOR = 2.0
# Ratio of errors above which another value of a parameter is worse.
_PROFILE_RISE = 1.05
_PROFILE_EVALUATIONS = 6


def profile_fit(
    problem: JointProblem,
    logs: Sequence[RobotLog],
    state: FitState,
    *,
    on_evaluation: Callable[[str, float], None] | None = None,
    on_parameter: Callable[[FitState], None] | None = None,
) -> FitState:
    """Computes the profile of a fit, which local slopes do not show.

    Each parameter in `PROFILED` is halved and doubled, all others are fitted
    again, and the mean squared error is compared with that of the fit. If it
    hardly rises, the others compensate: the logs do not determine the
    parameter.

    Args:
        problem: The joint.
        logs: Logs of the fit.
        state: State of a finished fit.
        on_evaluation: Function of parameter and ratio, called after
            evaluations.
        on_parameter: Function of the state, called after each parameter.

    Returns:
        The state with `profile` filled: for each parameter the ratios of the
        errors at half and at double its value.
    """
    simulator = JointSimulator(problem)
    base = float(
        np.mean(
            np.concatenate(
                run_errors(simulator, state.values, logs, state.start_delays)
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
            _, cost = solve(
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
        std: Standard deviation of each parameter from the local slopes, in
            its unit.
        determined: Whether the logs narrow a parameter more than its bounds
            do and, if it was profiled, other values increase the error.
        undetermined: Combinations of parameters that the logs do not
            determine: standard deviation, as a fraction of the distance of
            the bounds, and weights of the parameters.
    """

    std: dict[str, float]
    determined: dict[str, bool]
    undetermined: list[tuple[float, dict[str, float]]]


def estimate_uncertainty(
    problem: JointProblem, logs: Sequence[RobotLog], state: FitState
) -> Uncertainty:
    """Linear uncertainty of a fit, from the slopes of the whole runs' errors.

    The errors of neighboring rows are not independent: their number is divided
    by the correlation length. The prior is left out.

    Args:
        problem: The joint.
        logs: Logs of the fit.
        state: State of a finished fit.
    """
    simulator = JointSimulator(problem)
    parameters = problem.parameters()
    center = np.array([p.encode(state.values[p.name]) for p in parameters])

    def errors(fractions: Array) -> Array:
        trial = decode(parameters, fractions)
        parts = run_errors(simulator, trial, logs, state.start_delays)
        return np.concatenate([part.ravel() for part in parts])

    # Central differences of all errors.
    base = errors(center)
    jacobian = np.empty((base.size, center.size))
    step = 0.01
    for i in range(center.size):
        ahead, behind = center.copy(), center.copy()
        ahead[i] = min(center[i] + step, 1.0)
        behind[i] = max(center[i] - step, 0.0)
        jacobian[:, i] = (errors(ahead) - errors(behind)) / (
            ahead[i] - behind[i]
        )
    # Covariance with a uniform prior between the bounds, of variance 1/12.
    length = _correlation_length(base.reshape(-1, 3))
    variance = float(np.mean(base**2)) * length
    information = jacobian.T @ jacobian / variance
    covariance = np.linalg.inv(information + 12.0 * np.eye(center.size))
    spread = np.sqrt(np.diag(covariance))
    std = {
        p.name: float(s * p.slope(float(c)))
        for p, s, c in zip(parameters, spread, center, strict=True)
    }
    # 0.2 of the distance of the bounds: two thirds of a uniform prior's.
    determined = {
        p.name: bool(s < 0.2) for p, s in zip(parameters, spread, strict=True)
    }
    for name, ratios in state.profile.items():
        determined[name] &= min(ratios) > _PROFILE_RISE
    # The directions of the greatest uncertainty.
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


def _correlation_length(errors: Array) -> float:
    """Number of rows over which errors (N, 3) are correlated, at least 1."""
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
