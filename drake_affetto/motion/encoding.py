"""Encoding a demonstration as the weights of a movement primitive."""

import math
from typing import Any, NamedTuple

import numpy as np
from scipy.interpolate import BSpline
from scipy.linalg import cho_factor, cho_solve

from drake_affetto.common.errors import (
    InputError,
    require,
    require_array,
)
from drake_affetto.common.typing import Array

# Gauss-Legendre nodes and weights for the forcing term within one step, on
# [0, 1]. Four of them leave an error below 1e-12 rad for steps up to a quarter
# of the standard deviation of a basis function.
_POINTS, _AREAS = np.polynomial.legendre.leggauss(4)
NODES: Array = (_POINTS + 1.0) / 2.0
WEIGHTS: Array = _AREAS / 2.0


class Design(NamedTuple):
    """θ = (gram + ridge)⁻¹ operator (q - g - decay [q0 - g, q̇0])."""

    operator: Array  # (K, N)
    gram: Array  # (K, K), without the ridge
    decay: Array  # (N, 2)
    factor: Any  # of gram with the ridge


def factorize(gram: Array) -> Any:
    try:
        return cho_factor(gram, check_finite=False)
    except np.linalg.LinAlgError:
        raise InputError(
            "dmp.ridge is too small for so few samples: the policy parameters "
            "are not determined"
        ) from None


def smoothing_operator(t: Array, smoothing: float) -> tuple[list[Array], Array]:
    """A penalised spline fit, and its derivatives at the samples.

    The spline S, of degree 5, minimizes the mean of (y - S(t))² plus
    smoothing⁶ times the mean of its third derivative squared: it follows
    oscillations slower than 1/smoothing (rad/s) and flattens faster ones.

    Args:
        t: (N,), s, increasing.
        smoothing: s.

    Returns:
        Three arrays (N, M) that take the M spline coefficients to S, Ṡ and S̈
        at t; and one (M, N) that takes the samples y to those coefficients.
    """
    degree = 5
    pieces = max(1, math.ceil(1.5 * (t[-1] - t[0]) / smoothing))
    pieces = min(pieces, 4 * len(t))
    breaks = np.linspace(t[0], t[-1], pieces + 1)
    knots = np.concatenate(
        [np.full(degree, t[0]), breaks, np.full(degree, t[-1])]
    )
    spline = BSpline(knots, np.eye(len(knots) - degree - 1), degree)
    derivatives = [spline(t, nu) for nu in range(3)]
    middle = breaks[:-1, None] + np.diff(breaks)[:, None] * NODES
    third = spline(middle.ravel(), 3)
    weights = np.tile(WEIGHTS / pieces, pieces)
    penalty = smoothing**6 * third.T @ (weights[:, None] * third)
    gram = derivatives[0].T @ derivatives[0] / len(t) + penalty
    scale = np.trace(gram) / len(gram)
    gram[np.diag_indices_from(gram)] += 1e-13 * scale
    fit = cho_solve(cho_factor(gram), derivatives[0].T / len(t))
    return derivatives, fit


def pair_demonstrations(t: Any, q: Any) -> list[tuple[Array, Array]]:
    """One demonstration or a list of them as a list of pairs of arrays."""
    several = isinstance(t, (list, tuple)) and len(t) > 0 and np.ndim(t[0]) > 0
    if not several:
        t, q = [t], [q]
    require(
        len(t) == len(q),
        "the number of demonstrations",
        len(q),
        f"{len(t)}, one for each array of times",
    )
    pairs = [
        (require_array("t", a), require_array("q", b))
        for a, b in zip(t, q, strict=True)
    ]
    widths = {b.shape[-1] if b.ndim else 0 for _, b in pairs}
    require(
        len(widths) == 1, "q.shape[1]", sorted(widths), "the same joints in all"
    )
    return pairs
