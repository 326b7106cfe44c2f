"""The cost of following a reference: tracking, effort, oscillation."""

import dataclasses

import numpy as np
from numpy.typing import ArrayLike

from drake_affetto.common.typing import Array
from drake_affetto.tuning.config import CostWeights
from drake_affetto.tuning.references import Reference


@dataclasses.dataclass(frozen=True)
class JointCosts:
    """The costs of n joints along a reference, each (n,).

    Attributes:
        tracking: Rms tracking error, % of the joint's range.
        effort: Effort of the valves, %; see `CostWeights`.
        oscillation: Rms about a slow drift at rest, % of the joint's range.
        total: Weighted sum of the three.
    """

    tracking: Array
    effort: Array
    oscillation: Array
    total: Array

    def mean(self) -> float:
        """The mean cost of all joints."""
        return float(np.mean(self.total))


# Duration of a proportional valve's stroke, s. The movement of a valve is
# counted in openings per stroke.
_STROKE_TIME = 0.1
# Movement at rest that is slower than this is drift, not oscillation, s.
_DRIFT_TIME = 0.5


def rest_deviation(q: ArrayLike, rest: ArrayLike, sample_rate: float) -> Array:
    """The oscillation of joints at rest, (n,), in units of q.

    It is the standard deviation within pieces of at most half a second, so
    that a slow creep towards the goal does not count, and the rms over the
    pieces.

    Args:
        q: Joint angles, (T, n).
        rest: Whether the joints should be at rest, (T,).
        sample_rate: Rate of the samples, Hz.

    Returns:
        Deviations, (n,); zeros where there is no phase of rest.
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


# The last part of a rest, in which integrators have settled, s.
_LAST_OF_REST = 2.0


def rest_std(q: ArrayLike, rest: ArrayLike, sample_rate: float) -> Array:
    """The greatest standard deviation of joints at rest, (n,), in units of q.

    It is computed in the last two seconds of each phase of rest: a limit cycle
    shows, a creep that has ended does not.

    Args:
        q: Joint angles, (T, n).
        rest: Whether the joints should be at rest, (T,).
        sample_rate: Rate of the samples, Hz.
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
    """The costs of a rollout along `reference`.

    Args:
        reference: The reference, T samples of n joints.
        q: Angles at the reference's times, from the first, (T', n), rad; T'
            may be less than T.
        opening: Openings of the valves, (T', n), in -1 to 1.
        span: Range of each joint, (n,), rad.
        weights: Weights of the cost's parts.
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
