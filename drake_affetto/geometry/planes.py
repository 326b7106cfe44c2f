"""Planes as three numbers each; no Drake.

The parameters p = (ψ, ε, s) are azimuth and elevation [rad] of the normal,
n = (cos ε cos ψ, cos ε sin ψ, sin ε), which points into the room, and the
distance s [m] of a reference point from the plane.
"""

import numpy as np

from drake_affetto.common.typing import Array


def normals(parameters: Array) -> Array:
    """Unit normals (..., 3) of planes (..., 3)."""
    azimuth, elevation = parameters[..., 0], parameters[..., 1]
    level = np.cos(elevation)
    n = np.empty((*azimuth.shape, 3))
    n[..., 0] = level * np.cos(azimuth)
    n[..., 1] = level * np.sin(azimuth)
    n[..., 2] = np.sin(elevation)
    return n


def normal_slopes(parameters: Array) -> Array:
    """∂n/∂(ψ, ε) of planes (..., 3): (..., 3, 2)."""
    azimuth, elevation = parameters[..., 0], parameters[..., 1]
    ca, sa = np.cos(azimuth), np.sin(azimuth)
    ce, se = np.cos(elevation), np.sin(elevation)
    slopes = np.zeros((*azimuth.shape, 3, 2))
    slopes[..., 0, 0], slopes[..., 0, 1] = -ce * sa, -se * ca
    slopes[..., 1, 0], slopes[..., 1, 1] = ce * ca, -se * sa
    slopes[..., 2, 1] = ce
    return slopes


def plane_parameters(X_WM: Array, reference: Array) -> Array:
    """The parameters (3,) of a mirror's plane.

    Args:
        X_WM: Pose (4, 4) of the mirror; its z is the normal.
        reference: Reference point (3,), m.
    """
    n = X_WM[:3, 2]
    return np.array(
        [
            np.arctan2(n[1], n[0]),
            np.arcsin(np.clip(n[2], -1.0, 1.0)),
            (reference - X_WM[:3, 3]) @ n,
        ]
    )


def reflect(parameters: Array, reference: Array, p_W: Array) -> Array:
    """Mirror images (..., 3) of points p_W (..., 3) in planes (..., 3).

    Args:
        parameters: Planes; they broadcast against the points.
        reference: Reference point of the planes (3,), m.
        p_W: Points, m.
    """
    n = normals(np.asarray(parameters, dtype=float))
    away = np.sum((p_W - reference) * n, axis=-1) + parameters[..., 2]
    return p_W - 2.0 * away[..., None] * n


def moved(parameters: Array, reference: Array, other: Array) -> Array:
    """The same planes (..., 3), told from another reference point (3,)."""
    parameters = np.array(parameters, dtype=float)
    parameters[..., 2] += normals(parameters) @ (other - reference)
    return parameters
