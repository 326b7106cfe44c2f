"""Ellipses are found again from parts of their rims."""

from hypothesis import given
from hypothesis import strategies as st
import numpy as np

from drake_affetto.perception.ellipses import (
    Ellipse,
    find_rim,
    fit_arcs,
    fit_ellipse,
    fit_outline,
)


def rim_of(center, axes, turn, angles):
    c, s = np.cos(turn), np.sin(turn)
    local = np.stack(
        [axes[0] * np.cos(angles), axes[1] * np.sin(angles)], axis=1
    )
    return np.array(center) + local @ np.array([[c, s], [-s, c]])


CENTERS = st.tuples(st.floats(-50, 300), st.floats(-50, 300))
AXES = st.floats(12.0, 40.0).flatmap(
    lambda a: st.tuples(st.just(a), st.floats(0.5 * a, 0.95 * a))
)
TURNS = st.floats(0.0, np.pi)


@given(CENTERS, AXES, TURNS)
def test_a_whole_rim_gives_its_ellipse(center, axes, turn):
    rim = rim_of(center, axes, turn, np.linspace(0, 2 * np.pi, 80))
    found = fit_ellipse(rim)
    assert found is not None
    np.testing.assert_allclose(found.center, center, atol=0.05)
    np.testing.assert_allclose(found.axes, axes, rtol=0.01)
    assert np.abs(found.distance(rim)).max() < 0.1
    assert found.covered(rim) == 1.0


@given(CENTERS, AXES, TURNS, st.floats(0, 6.2))
def test_a_rim_with_a_bite_gives_the_whole(center, axes, turn, at):
    """A quarter of the rim is a chord instead."""
    angles = at + np.linspace(0, 1.5 * np.pi, 90)
    seen = rim_of(center, axes, turn, angles)
    share = np.linspace(0, 1, 22)[1:-1, None]
    chord = seen[-1] + share * (seen[0] - seen[-1])
    found = fit_arcs(np.concatenate([seen, chord]))
    assert found is not None
    np.testing.assert_allclose(found[0].center, center, atol=0.8)
    np.testing.assert_allclose(found[0].axes, axes, atol=0.8)


@given(CENTERS, AXES, TURNS, st.floats(0, 6.2))
def test_two_halves_give_the_whole(center, axes, turn, at):
    rims = [
        rim_of(center, axes, turn, at + start + np.linspace(0, 2.6, 60))
        for start in (0.0, np.pi)
    ]
    found = fit_outline(rims)
    assert found is not None
    np.testing.assert_allclose(found[0].center, center, atol=0.3)
    np.testing.assert_allclose(found[0].axes, axes, rtol=0.03)


def test_distance_is_signed_and_about_right():
    circle = Ellipse(np.array([5.0, 7.0]), np.eye(2) / 100.0)
    points = np.array([[5.0, 20.0], [5.0, 15.0], [15.0, 7.0]])
    np.testing.assert_allclose(circle.distance(points), [3.0, -2.0, 0.0])
    np.testing.assert_allclose(circle.axes, [10.0, 10.0])


def test_what_is_no_rim_gives_no_ellipse():
    line = np.stack([np.arange(20.0), np.zeros(20)], axis=1)
    for points in (line, line[:3], np.zeros((9, 2))):
        assert fit_ellipse(points) is None
        assert fit_arcs(points) is None
        assert fit_outline([points]) is None


def test_the_rim_is_where_the_part_is():
    part = np.zeros((5, 6), np.uint8)
    part[1:4, 2:5] = 1
    rim = find_rim(part, (10, 20))
    assert sorted(map(tuple, rim)) == [
        (u, v) for u in (12, 13, 14) for v in (21, 22, 23) if (u, v) != (13, 22)
    ]
