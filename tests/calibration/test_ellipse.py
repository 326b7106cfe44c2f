"""The plane from the ellipse of the drum's marker."""

import numpy as np
import pytest

from drake_affetto.calibration.ellipse import (
    estimate_from_ellipses,
    expected_ellipse,
    polygon_moments,
    shape_features,
)
from drake_affetto.calibration.plane import CalibrationFailure
from drake_affetto.geometry.planes import moved
from drake_affetto.geometry.region import spread_inside
from support import mirror_robot
from support.mirror_robot import (
    MIRROR,
    WORKSPACE,
    angle_between,
    sees_ellipse,
)

TRUE = mirror_robot.robot()
SETTINGS = mirror_robot.settings()


def places(count, seed=0):
    return spread_inside(WORKSPACE, count, np.random.default_rng(seed))


def estimate(looks, known=TRUE, errors=None):
    return estimate_from_ellipses(
        known,
        errors or mirror_robot.exact(),
        looks,
        SETTINGS.prior,
        SETTINGS.ellipse,
    )


def test_moments_of_a_polygon():
    box = np.array([[1.0, 2.0], [5.0, 2.0], [5.0, 4.0], [1.0, 4.0]])
    center, moments = polygon_moments(box)
    np.testing.assert_allclose(center, [3.0, 3.0])
    np.testing.assert_allclose(moments, [16 / 12, 0.0, 4 / 12], atol=1e-12)
    c, s = np.cos(0.3), np.sin(0.3)
    turn = np.array([[c, -s], [s, c]])
    _, turned = polygon_moments(box[::-1] @ turn.T)
    expected = turn @ np.diag([16 / 12, 4 / 12]) @ turn.T
    np.testing.assert_allclose(
        turned, [expected[0, 0], expected[0, 1], expected[1, 1]]
    )


def test_features_are_lengths():
    np.testing.assert_allclose(shape_features([4.0, 0.0, 9.0]), [2.0, 0.0, 3.0])
    first = shape_features(np.array([[4.0, 1.0, 9.0]]))[0]
    np.testing.assert_allclose(
        [first[0] ** 2, first[0] * first[1], first[1] ** 2 + first[2] ** 2],
        [4.0, 1.0, 9.0],
    )


def test_blur_adds_to_the_moments():
    sharp, soft = (
        expected_ellipse(TRUE, MIRROR, TRUE.eye_position, np.zeros(2), blur)
        for blur in (0.0, 2.0)
    )
    np.testing.assert_allclose(soft[1] - sharp[1], [4.0, 0.0, 4.0])
    np.testing.assert_allclose(soft[0], sharp[0])


def test_finds_plane_and_places_without_noise():
    xy = places(5)
    found = estimate([sees_ellipse(TRUE, MIRROR, each) for each in xy])
    assert angle_between(found.plane.parameters, MIRROR) < 0.1
    np.testing.assert_allclose(found.plane.parameters, MIRROR, atol=3e-3)
    np.testing.assert_allclose(found.places, xy, atol=3e-3)


def test_the_stated_region_covers_the_truth():
    covered = []
    for seed in range(8):
        rng = np.random.default_rng(seed)
        known = mirror_robot.misjudged(TRUE, SETTINGS.knowledge, seed)
        looks = [
            sees_ellipse(TRUE, MIRROR, each, rng, SETTINGS.ellipse.moment_sd)
            for each in places(6, seed)
        ]
        plane = estimate(looks, known, SETTINGS.knowledge).plane
        assert angle_between(plane.parameters, MIRROR) < 4.0
        covered.append(
            plane.covers(moved(MIRROR, TRUE.eye_position, plane.reference))
        )
    assert np.mean(covered) >= 0.75


def test_a_finer_image_tells_more():
    def stated(height):
        robot = mirror_robot.robot(height)
        looks = [sees_ellipse(robot, MIRROR, each) for each in places(4)]
        return estimate(looks, robot).plane

    coarse, fine = stated(240), stated(480)
    assert fine.angle_sd < 0.6 * coarse.angle_sd


def test_too_few_places_are_told():
    looks = [sees_ellipse(TRUE, MIRROR, each) for each in places(2)]
    with pytest.raises(CalibrationFailure, match="at 2 places, expected at le"):
        estimate(looks)
