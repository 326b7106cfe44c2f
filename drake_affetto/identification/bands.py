"""Prediction intervals: how far a log will be from its prediction.

The parameters are fitted again without each log in turn (`fit_members`), and
each log is predicted by the fit that has not seen it. Its errors are measured
in units of a scale that knows where a prediction is worth little: where the
fits differ, and where the course is steep, so that an error in time counts. The
factor of that scale is such that a further log's own share of samples inside is
expected to be `LEVEL` or more with the probability `CONFIDENCE`: logs are few,
and the samples of one are not independent. (The jackknife+ of Barber et al.,
Annals of Statistics 49(1), 2021, with normalized errors.)
"""

from collections.abc import Callable, Mapping, Sequence
import dataclasses

import numpy as np
from scipy import stats

from drake_affetto.common.errors import require
from drake_affetto.common.typing import Array
from drake_affetto.identification.fit import (
    FIT_STAGES,
    FitState,
    fit_logs,
)
from drake_affetto.identification.problem import JointProblem
from drake_affetto.identification.simulator import (
    JUDGED_FROM,
    JointSimulator,
    Simulated,
)
from drake_affetto.robot.log import RobotLog

LEVEL = 0.95
"""Share of the samples that a band is to contain."""
CONFIDENCE = 0.9
"""Probability with which a further log's share is to reach it."""

# An error in time that is always possible: one reading of the sensors, s.
_TIMING = 0.01
# Least square of the floor, as a share of the mean squared error.
_LEAST_FLOOR = 0.04
# Stages of a fit without a log: the last ones change little.
_MEMBER_STAGES = 3

LOOPS = ("closed", "open")


@dataclasses.dataclass(frozen=True)
class Band:
    """A prediction interval over a log's rows.

    Attributes:
        lower: Lower ends (N, 3): of the angle, %, and of p_a and p_b, kPa.
        upper: Upper ends (N, 3).
    """

    lower: Array
    upper: Array

    def coverage(self, log: RobotLog) -> Array:
        """Shares (3,) of the judged samples of `log` that lie inside."""
        measured = np.stack([log.q, log.p_a, log.p_b], axis=1)
        inside = (measured >= self.lower) & (measured <= self.upper)
        return np.mean(inside[log.t >= JUDGED_FROM], axis=0)

    def half_width(self, log: RobotLog) -> Array:
        """Median half widths (3,) over the judged rows of `log`."""
        half = 0.5 * (self.upper - self.lower)
        return np.median(half[log.t >= JUDGED_FROM], axis=0)


@dataclasses.dataclass(frozen=True)
class BandScale:
    """What turns a prediction of one loop into a band.

    Attributes:
        floor: Part of the scale that is always there (3,): what the errors of
            the logs left out have beyond differences of the fits.
        factor: Half width of the band in units of the scale (3,).
    """

    floor: Array
    factor: Array

    def band(self, center: Simulated, members: Sequence[Simulated]) -> Band:
        """The band about `center`, with what each member predicts.

        Args:
            members: What each member of the ensemble predicts.
        """
        half = self.factor * error_scale(center, members, self.floor)
        middle = as_rows(center)
        lower, upper = middle - half, middle + half
        # The sensor reads no angle beyond its range.
        lower[:, 0] = np.clip(lower[:, 0], 0.0, 100.0)
        upper[:, 0] = np.clip(upper[:, 0], 0.0, 100.0)
        return Band(lower, upper)


def fit_members(
    problem: JointProblem,
    logs: Sequence[RobotLog],
    state: FitState,
    *,
    on_evaluation: Callable[[str, float], None] | None = None,
    on_member: Callable[[FitState], None] | None = None,
) -> FitState:
    """Fits the parameters without each log in turn.

    Each fit begins where the whole one began: one that began where that ended
    would have seen the log, in what the others leave open.

    Args:
        problem: The joint.
        logs: Logs of the fit; with a single one there is nothing to do.
        state: State of a finished fit.
        on_evaluation: Function of the log's name and the cost, called after
            evaluations.
        on_member: Function of the state, called after each log.

    Returns:
        The state with `members` filled.
    """
    if len(logs) < 2:
        return state
    for left_out in logs:
        if left_out.name in state.members:
            continue

        def report(_: int, cost: float, name: str = left_out.name) -> None:
            if on_evaluation is not None:
                on_evaluation(name, cost)

        member = fit_logs(
            problem,
            [log for log in logs if log is not left_out],
            stages=min(_MEMBER_STAGES, len(FIT_STAGES)),
            on_evaluation=report,
        )
        members = {**state.members, left_out.name: member.values}
        state = dataclasses.replace(state, members=members)
        if on_member is not None:
            on_member(state)
    return state


def as_rows(simulated: Simulated) -> Array:
    """Angle, % and both pressures, kPa, of a simulation (N, 3)."""
    return np.stack([simulated.q, simulated.p_a, simulated.p_b], axis=1)


def error_scale(
    center: Simulated, members: Sequence[Simulated], floor: Array
) -> Array:
    """How large errors are expected to be (N, 3), up to a factor.

    Args:
        center: The prediction.
        members: What fits without one of the logs predict.
        floor: Part that is always there (3,).
    """
    rows = np.stack([as_rows(each) for each in members])
    count = len(members)
    # The jackknife's standard deviation of a prediction.
    spread = (count - 1) * np.mean((rows - rows.mean(axis=0)) ** 2, axis=0)
    rate = np.gradient(as_rows(center), center.t, axis=0)
    return np.sqrt(floor**2 + spread + (_TIMING * rate) ** 2)


def member_courses(
    simulator: JointSimulator, state: FitState, log: RobotLog
) -> dict[str, dict[str, Simulated]]:
    """What each member predicts of `log`, by loop and by the log left out."""
    courses: dict[str, dict[str, Simulated]] = {loop: {} for loop in LOOPS}
    for name, values in state.members.items():
        delay = simulator.estimate_start_delay(values, log)
        for loop in LOOPS:
            courses[loop][name] = simulator.run(
                values,
                log,
                start_delay=delay,
                closed_loop=loop == "closed",
            )
    return courses


def calibrate_bands(
    simulator: JointSimulator, logs: Sequence[RobotLog], state: FitState
) -> dict[str, BandScale]:
    """The scale of the bands of each loop, from the logs left out.

    Args:
        simulator: Simulator of the joint.
        logs: Logs of the fit.
        state: State with `members`.

    Returns:
        The scales by loop; nothing where there are no members.
    """
    if not state.members:
        return {}
    courses = {log.name: member_courses(simulator, state, log) for log in logs}
    scales = {}
    for loop in LOOPS:
        own = {log.name: courses[log.name][loop] for log in logs}
        scales[loop] = calibrate_loop(logs, own)
    return scales


def calibrate_loop(
    logs: Sequence[RobotLog],
    courses: Mapping[str, Mapping[str, Simulated]],
) -> BandScale:
    """The scale of one loop's bands.

    Args:
        logs: Logs of the fit, at least two.
        courses: For each log by name, what each member predicts of it, by the
            name of the log that the member has not seen.
    """
    require(len(logs) >= 2, "logs", f"{len(logs)} logs", "at least two")
    judged = {log.name: log.t >= JUDGED_FROM for log in logs}
    errors, doubts = {}, {}
    for log in logs:
        own = courses[log.name]
        errors[log.name] = own[log.name].errors(log)
        doubts[log.name] = error_scale(
            own[log.name], list(own.values()), np.zeros(3)
        )

    def pooled(rows: Mapping[str, Array]) -> Array:
        squares = [
            np.mean(rows[log.name][judged[log.name]] ** 2, axis=0)
            for log in logs
        ]
        return np.mean(squares, axis=0)

    # What the errors have beyond what differences of the fits explain.
    total = pooled(errors)
    floor = np.sqrt(np.maximum(total - pooled(doubts), _LEAST_FLOOR * total))
    quantiles = []
    for log in logs:
        scale = np.sqrt(floor**2 + doubts[log.name] ** 2)
        # An error of nothing in all rows has no scale, and needs none.
        relative = np.abs(errors[log.name]) / np.maximum(scale, 1e-9)
        quantiles.append(np.quantile(relative[judged[log.name]], LEVEL, axis=0))
    return BandScale(floor, further_quantile(np.array(quantiles)))


def further_quantile(quantiles: Array) -> Array:
    """What a further log's quantile stays below, (3,).

    A prediction bound for one more draw of a log-normal distribution, with the
    probability `CONFIDENCE`.

    Args:
        quantiles: Quantiles of the logs (L, 3), L at least two.
    """
    logs = np.log(np.maximum(quantiles, 1e-9))
    count = len(logs)
    width = stats.t.ppf(CONFIDENCE, count - 1) * np.sqrt(1.0 + 1.0 / count)
    return np.exp(logs.mean(axis=0) + width * logs.std(axis=0, ddof=1))
