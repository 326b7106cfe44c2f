"""Polygons on the table, against matplotlib's and against sums over points."""

from matplotlib.path import Path
import numpy as np
import pytest

from drake_affetto.geometry.region import (
    crosses_itself,
    grid_inside,
    inside_polygon,
    spread_inside,
)

CONCAVE = np.array([[0, 0], [4, 0], [4, 3], [2, 1], [0, 3]], dtype=float)
BOW_TIE = np.array([[0, 0], [1, 1], [1, 0], [0, 1]], dtype=float)


def test_inside_is_what_matplotlib_says():
    points = np.random.default_rng(0).uniform(-1.0, 5.0, (5000, 2))
    for corners in (CONCAVE, CONCAVE[::-1]):
        np.testing.assert_array_equal(
            inside_polygon(corners, points),
            Path(corners).contains_points(points),
        )


def test_the_border_belongs_to_it():
    middles = 0.5 * (CONCAVE + np.roll(CONCAVE, -1, axis=0))
    assert inside_polygon(CONCAVE, np.vstack([CONCAVE, middles])).all()
    assert not inside_polygon(CONCAVE, [2.0, 1.01])
    assert not inside_polygon(CONCAVE, [5.0, 0.0])


def test_sides_that_cross_are_told():
    assert crosses_itself(BOW_TIE)
    assert not crosses_itself(CONCAVE)
    assert not crosses_itself(CONCAVE[::-1])


def test_a_grid_keeps_to_the_polygon_and_has_its_corners():
    points = grid_inside(CONCAVE, 9)
    assert inside_polygon(CONCAVE, points).all()
    for corner in CONCAVE:
        assert np.any(np.all(np.isclose(points, corner), axis=1))
    assert len(np.unique(points, axis=0)) == len(points)


@pytest.mark.parametrize("count", [1, 7, 200])
def test_spread_points_are_inside_even_and_repeatable(count):
    first, again, other = (
        spread_inside(CONCAVE, count, np.random.default_rng(seed))
        for seed in (1, 1, 2)
    )
    assert first.shape == (count, 2)
    assert inside_polygon(CONCAVE, first).all()
    np.testing.assert_array_equal(first, again)
    assert not np.array_equal(first, other)
    if count == 200:
        # Half of the polygon is left of its axis of symmetry.
        assert np.mean(first[:, 0] < 2.0) == pytest.approx(0.5, abs=0.04)
