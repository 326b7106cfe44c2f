"""Exact transitions of a damped spring."""

import numpy as np

from drake_affetto.common.typing import Array


def spring_transition(t: Array, stiffness: float, damping: float) -> Array:
    """exp(A t) for A = [[0, 1], [-k, -d]]: t (...) to (..., 2, 2)."""
    half = 0.5 * damping
    root = np.emath.sqrt(half**2 - stiffness)
    scaled = root * t
    slow = np.exp(scaled - half * t)
    fast = np.exp(-scaled - half * t)
    cosh = np.real(slow + fast) / 2.0
    # sinh(root t) / root; by its own series where the difference would lose
    # digits: there the damping is nearly critical, or t small.
    small = np.abs(scaled) < 0.1
    divisor = np.where(small, 1.0, 2.0 * scaled)
    square = np.real(scaled**2)
    series = 1.0 + square / 6.0 * (
        1.0 + square / 20.0 * (1.0 + square / 42.0 * (1.0 + square / 72.0))
    )
    sinh = t * np.where(
        small, series * np.exp(-half * t), np.real((slow - fast) / divisor)
    )
    result = np.empty((*np.shape(t), 2, 2))
    result[..., 0, 0] = cosh + half * sinh
    result[..., 0, 1] = sinh
    result[..., 1, 0] = -stiffness * sinh
    result[..., 1, 1] = cosh - half * sinh
    return result
