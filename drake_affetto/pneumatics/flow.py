"""Air flow through valves, orifices and leaks (ISO 6358).

A flow path is described by its sonic conductance C [m³/(s Pa)] and critical
pressure ratio b. With the upstream pressure p1, the downstream pressure p2
(both absolute) and r = p2/p1 the mass flow rate is

    ṁ = C ρ0 p1 √(T0/T) φ(r),
    φ = 1                            for r ≤ b (choked),
    φ = √(1 - ((r - b)/(1 - b))²)    for b < r ≤ r_lam,
    φ = φ(r_lam)(1 - r)/(1 - r_lam)  for r_lam < r ≤ 1 (laminar),

with the reference state of ISO 8778. The laminar piece makes the slope at
r = 1 finite, where the ellipse's is not.
"""

import math

import numba
import numpy as np
from numpy.typing import ArrayLike, NDArray

from drake_affetto.common.errors import (
    require,
    require_array,
)

GAS_CONSTANT = 287.05
"""Specific gas constant of dry air, J/(kg K)."""
REFERENCE_DENSITY = 1.185
"""Density of air at the reference state of ISO 8778, kg/m³."""
REFERENCE_TEMPERATURE = 293.15
"""Temperature of that state, K."""
LAMINAR_RATIO = 0.995
"""Pressure ratio above which the flow counts as laminar."""

CONDUCTANCE_UNIT = 1e-8
"""One dm³/(s bar), the unit of data sheets, in m³/(s Pa)."""


@numba.njit(cache=True, inline="always")
def flow_function(r: float, b: float) -> tuple[float, float]:
    """φ and its derivative dφ/dr at the pressure ratio `r` in [0, 1]."""
    if r <= b:
        return 1.0, 0.0
    width = 1.0 - b
    lam = max(LAMINAR_RATIO, 0.5 * (1.0 + b))
    if r > lam:
        edge = (lam - b) / width
        slope = -math.sqrt(1.0 - edge * edge) / (1.0 - lam)
        return slope * (r - 1.0), slope
    x = (r - b) / width
    phi = math.sqrt(1.0 - x * x)
    return phi, -x / (width * phi)


@numba.njit(cache=True, inline="always")
def path_flow(
    p_up: float, p_down: float, C: float, b: float, T: float
) -> float:
    """Mass flow rate [kg/s] of one path; negative where it flows back."""
    scale = C * REFERENCE_DENSITY * math.sqrt(REFERENCE_TEMPERATURE / T)
    if p_up >= p_down:
        if p_up <= 0.0:
            return 0.0
        return scale * p_up * flow_function(p_down / p_up, b)[0]
    return -scale * p_down * flow_function(p_up / p_down, b)[0]


@numba.vectorize(cache=True)
def _mass_flow_rate(p_up, p_down, C, b, T):
    return path_flow(p_up, p_down, C, b, T)


def mass_flow_rate(
    p_up: ArrayLike,
    p_down: ArrayLike,
    C: ArrayLike,
    b: ArrayLike,
    T: ArrayLike,
) -> float | NDArray[np.float64]:
    """Mass flow rate through a path by ISO 6358, laminar near equal pressure.

    All arguments broadcast against one another.

    Args:
        p_up: pressure at the path's inlet, Pa absolute.
        p_down: pressure at its outlet, Pa absolute. Where it exceeds `p_up`
            the flow is the reverse one, negative.
        C: sonic conductance, m³/(s Pa).
        b: critical pressure ratio, in [0, 1).
        T: absolute temperature upstream, K.

    Returns:
        The mass flow rate in kg/s, from inlet to outlet.

    Raises:
        InputError: for a negative pressure or conductance, b outside [0, 1),
            a temperature that is not positive, or what is not finite.
    """
    args = [
        require_array(name, value)
        for name, value in zip(
            ("p_up", "p_down", "C", "b", "T"),
            (p_up, p_down, C, b, T),
            strict=True,
        )
    ]
    checks = (
        ("p_up", lambda a: a >= 0.0, "an absolute pressure of at least 0 Pa"),
        ("p_down", lambda a: a >= 0.0, "an absolute pressure of at least 0 Pa"),
        ("C", lambda a: a >= 0.0, "a conductance of at least 0"),
        ("b", lambda a: (a >= 0.0) & (a < 1.0), "a ratio in [0, 1)"),
        ("T", lambda a: a > 0.0, "a temperature above 0 K"),
    )
    for value, (field, holds, expected) in zip(args, checks, strict=True):
        require(bool(np.all(holds(value))), field, value, expected)
    return _mass_flow_rate(*args)
