"""Projection and reflection of points."""

from hypothesis import given
from hypothesis import strategies as st
import numpy as np
import pytest

from drake_affetto.scene.sight import (
    View,
    disc,
    on_panel,
    polygon_area,
    reflect,
)

number = st.floats(-1.0, 1.0)
VIEW = View(320, 240, 0.8)


def pose(rotation, translation):
    X = np.eye(4)
    X[:3, :3], X[:3, 3] = rotation, translation
    return X


def test_the_axis_meets_the_middle_and_the_field_of_view_the_edge():
    X_WC = np.eye(4)
    edge = np.tan(0.4)
    points = np.array([[0, 0, 2.0], [0, 2 * edge, 2.0], [0, 0, -1.0]])
    pixels = VIEW.project(X_WC, points)
    assert pixels[0] == pytest.approx([159.5, 119.5])
    assert pixels[1] == pytest.approx([159.5, 239.5])
    assert np.all(np.isnan(pixels[2]))
    assert VIEW.inside(pixels).tolist() == [True, True, False]
    assert VIEW.inside(pixels, margin=1).tolist() == [True, False, False]


def test_one_camera_for_each_row_of_points():
    X = np.stack([np.eye(4), np.eye(4)])
    X[1, 0, 3] = 0.1
    points = np.full((2, 3, 3), [0.0, 0.0, 1.0])
    pixels = VIEW.project(X, points)
    assert pixels[0, :, 0] == pytest.approx(159.5)
    assert pixels[1, :, 0] == pytest.approx(159.5 - 0.1 * VIEW.focal)


@given(st.tuples(number, number, number), st.tuples(number, number))
def test_reflection_is_an_involution_that_keeps_distances(point, tilt):
    c, s = np.cos(tilt[0]), np.sin(tilt[0])
    R = np.array([[1, 0, 0], [0, c, -s], [0, s, c]])
    X_WM = pose(R, [tilt[1], 0.2, -0.1])
    p = np.array([point, [0.0, 0.5, 0.3]])
    image = reflect(X_WM, p)
    assert reflect(X_WM, image) == pytest.approx(p, abs=1e-12)
    assert np.linalg.norm(image[0] - image[1]) == pytest.approx(
        np.linalg.norm(p[0] - p[1]), abs=1e-12
    )
    middle = 0.5 * (p + image) - X_WM[:3, 3]
    assert middle @ X_WM[:3, 2] == pytest.approx(0.0, abs=1e-12)


def test_the_panel_shows_what_the_law_of_reflection_says():
    # Mirror in the plane z = 0, eye and point at equal heights: the ray
    # meets the glass half way between them.
    X_WM, size = np.eye(4), [0.2, 0.1]
    eye = np.array([-0.3, 0.0, 0.5])
    points = np.array(
        [[0.3, 0, 0.5], [0.49, 0, 0.5], [0.51, 0, 0.5], [0.3, 0, -0.5]]
    )
    assert on_panel(X_WM, size, eye, points).tolist() == [
        True,
        True,
        False,
        False,
    ]
    near_edge = on_panel(X_WM, size, eye, points, margin=0.01)
    assert near_edge.tolist() == [True, False, False, False]
    behind = on_panel(X_WM, size, -eye, points)
    assert not behind.any()


def test_the_area_of_a_disc_seen_from_above():
    X_WC = pose(np.diag([1.0, -1.0, -1.0]), [0, 0, 1.0])
    rim = disc([[0.1, 0.0, 0.0]], 0.03, 200)
    area = polygon_area(VIEW.project(X_WC, rim))
    assert area[0] == pytest.approx(np.pi * (0.03 * VIEW.focal) ** 2, rel=1e-3)
