"""What following a reference costs."""

import dataclasses

import numpy as np
from numpy.typing import ArrayLike

from drake_affetto.tuning.config import CostWeights
from drake_affetto.tuning.references import Array, Reference


@dataclasses.dataclass(frozen=True)
class JointCosts:
    """What following a reference has cost, each (n,).

    Attributes:
        tracking: rms error, % of the joint's range.
        effort: %; see `CostWeights`.
        oscillation: rms about a slow drift at rest, % of the joint's range.
        total: the weighted sum.
    """

    tracking: Array
    effort: Array
    oscillation: Array
    total: Array

    def mean(self) -> float:
        """The cost of all joints together."""
        return float(np.mean(self.total))


# Time constant of a proportional valve's stroke, in which its movement is
# counted, s; drift slower than this is not oscillation, s.
_STROKE_TIME = 0.1

_DRIFT_TIME = 0.5


def rest_deviation(q: ArrayLike, rest: ArrayLike, sample_rate: float) -> Array:
    """How far joints at rest move about their mean, (n,), in units of q.

    Standard deviation within pieces of at most half a second, so that a slow
    creep towards the goal does not count; rms over the phases.

    Args:
        q: (T, n).
        rest: (T,) whether the joints should be at rest.
        sample_rate: Hz.

    Returns:
        Zeros where there is no phase of rest.
    """
    q, rest = np.asarray(q, dtype=float), np.asarray(rest, dtype=bool)
    edges = np.flatnonzero(np.diff(np.concatenate([[0], rest, [0]])))
    length = max(2, round(_DRIFT_TIME * sample_rate))
    total, count = np.zeros(q.shape[1]), 0
    for begin, end in edges.reshape(-1, 2):
        for first in range(begin, end, length):
            phase = q[first : min(first + length, end)]
            if len(phase) >= length // 2:
                total += len(phase) * phase.var(axis=0)
                count += len(phase)
    return np.sqrt(total / max(count, 1))


# What is left of a joint's rest once integrators have done their work, s.
_LAST_OF_REST = 2.0


def rest_std(q: ArrayLike, rest: ArrayLike, sample_rate: float) -> Array:
    """Greatest standard deviation of joints at rest, (n,), in units of q.

    Of the last two seconds of each phase of rest: a limit cycle shows, a
    creep that ends does not.

    Args:
        q: (T, n).
        rest: (T,) whether the joints should be at rest.
        sample_rate: Hz.
    """
    q, rest = np.asarray(q, dtype=float), np.asarray(rest, dtype=bool)
    edges = np.flatnonzero(np.diff(np.concatenate([[0], rest, [0]])))
    length = round(_LAST_OF_REST * sample_rate)
    stds = [
        q[max(begin, end - length) : end].std(axis=0)
        for begin, end in edges.reshape(-1, 2)
    ]
    return np.max(stds, axis=0) if stds else np.zeros(q.shape[1])


def joint_costs(
    reference: Reference,
    q: ArrayLike,
    opening: ArrayLike,
    span: ArrayLike,
    weights: CostWeights,
) -> JointCosts:
    """The cost of a run along `reference`.

    Args:
        q: (T', n) angles at the reference's times, from the first, rad; T' may
            be less than T.
        opening: (T', n) of the valves, in -1 to 1.
        span: (n,) range of each joint, rad.
        weights: of the cost's parts.
    """
    q, v = np.asarray(q, dtype=float), np.asarray(opening, dtype=float)
    span = np.asarray(span, dtype=float)
    length = len(q)
    counted = reference.counted[:length]
    rest = reference.rest[:length]
    dt = reference.t[1] - reference.t[0]
    error = (q - reference.q[:length])[counted]
    tracking = 100.0 * np.sqrt(np.mean(error**2, axis=0)) / span
    v = v[counted]
    travel = np.mean(np.abs(np.diff(v, axis=0)), axis=0) / dt * _STROKE_TIME
    effort = 100.0 * 0.5 * (np.mean(np.abs(v), axis=0) + travel)
    oscillation = 100.0 * rest_deviation(q, rest, 1.0 / dt) / span
    total = (
        weights.tracking * tracking
        + weights.effort * effort
        + weights.oscillation * oscillation
    )
    return JointCosts(tracking, effort, oscillation, total)
