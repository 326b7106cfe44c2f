"""Planes as three numbers, against mirrors as poses."""

import numpy as np

from drake_affetto.geometry import optics
from drake_affetto.geometry.planes import (
    moved,
    normal_slopes,
    normals,
    plane_parameters,
    reflect,
)

PLANE = np.array([-1.9, -0.2, 0.3])
EYE = np.array([0.1, 0.0, 0.4])


def pose() -> np.ndarray:
    n = normals(PLANE)
    x = np.cross([0.0, 0.0, 1.0], n)
    x /= np.linalg.norm(x)
    R = np.column_stack([x, np.cross(n, x), n])
    return optics.make_pose(R, EYE - PLANE[2] * n)


def test_reflects_as_the_mirror_at_that_pose():
    p = np.random.default_rng(0).normal(size=(5, 3))
    np.testing.assert_allclose(
        reflect(PLANE, EYE, p), optics.reflect_points(pose(), p)
    )
    # Many planes at once.
    both = np.stack([PLANE, PLANE + [0.1, 0.0, 0.02]])
    image = reflect(both[:, None], EYE, p)
    np.testing.assert_allclose(image[0], reflect(PLANE, EYE, p))
    np.testing.assert_allclose(image[1], reflect(both[1], EYE, p))


def test_a_plane_is_the_same_from_another_point():
    other = np.array([-0.2, 0.1, 0.0])
    p = np.random.default_rng(1).normal(size=(4, 3))
    np.testing.assert_allclose(
        reflect(moved(PLANE, EYE, other), other, p), reflect(PLANE, EYE, p)
    )


def test_the_parameters_are_those_of_the_pose():
    np.testing.assert_allclose(plane_parameters(pose(), EYE), PLANE)
    # A point of the glass itself has no distance.
    glass = pose()[:3, 3]
    np.testing.assert_allclose(
        plane_parameters(pose(), glass), [*PLANE[:2], 0.0], atol=1e-15
    )


def test_slopes_are_the_derivative_of_the_normals():
    planes = np.random.default_rng(2).normal(size=(4, 3))
    slopes = normal_slopes(planes)
    for k in range(2):
        step = 1e-6 * np.eye(3)[k]
        change = normals(planes + step) - normals(planes - step)
        np.testing.assert_allclose(slopes[..., k], change / 2e-6, atol=1e-9)
