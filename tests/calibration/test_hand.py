"""The plane from the hand seen in the mirror: synthetic looks."""

import dataclasses

import numpy as np
import pytest

from drake_affetto.calibration.hand import (
    HandLook,
    HandProblem,
    estimate_from_hand,
)
from drake_affetto.calibration.plane import CalibrationFailure
from drake_affetto.calibration.postures import PostureChooser
from drake_affetto.geometry.planes import moved
from support import mirror_robot
from support.mirror_robot import MIRROR, angle_between, sees_hand

TRUE = mirror_robot.robot()
SETTINGS = mirror_robot.settings()


def postures(count: int, seed: int = 0) -> np.ndarray:
    chooser = PostureChooser(
        TRUE,
        mirror_robot.exact(),
        SETTINGS.prior,
        SETTINGS.hand,
        np.random.default_rng(seed),
    )
    seen = [
        q
        for q in chooser.candidates
        if sees_hand(TRUE, MIRROR, q).pixel is not None
    ]
    return np.array(seen[:count])


def estimate(looks, known=TRUE, errors=None, **changes):
    config = dataclasses.replace(SETTINGS.hand, **changes)
    return estimate_from_hand(
        known, errors or mirror_robot.exact(), looks, SETTINGS.prior, config
    )


def test_finds_the_plane_without_noise():
    found = estimate([sees_hand(TRUE, MIRROR, q) for q in postures(8)])
    np.testing.assert_allclose(found.plane.parameters, MIRROR, atol=3e-4)
    assert found.used.all()
    assert found.plane.covers(MIRROR)


def test_one_gross_outlier_and_missing_looks_do_no_harm():
    rng = np.random.default_rng(1)
    looks = [sees_hand(TRUE, MIRROR, q, rng, 0.5) for q in postures(10)]
    looks[2] = HandLook(looks[2].readings, looks[2].pixel + [35.0, -20.0])
    looks[5] = HandLook(looks[5].readings, None)
    found = estimate(looks)
    assert angle_between(found.plane.parameters, MIRROR) < 0.6
    assert abs(found.plane.parameters[2] - MIRROR[2]) < 0.006
    assert found.used.tolist() == [i != 2 for i in range(9)]


def test_the_stated_region_covers_the_truth():
    """A robot that knows itself a little wrong, other errors each time."""
    covered, angles = [], []
    for seed in range(20):
        rng = np.random.default_rng(seed)
        known = mirror_robot.misjudged(TRUE, SETTINGS.knowledge, seed)
        looks = [
            sees_hand(TRUE, MIRROR, q, rng, SETTINGS.hand.pixel_sd)
            for q in postures(9, seed)
        ]
        plane = estimate(looks, known, SETTINGS.knowledge).plane
        truth = moved(MIRROR, TRUE.eye_position, plane.reference)
        covered.append(plane.covers(truth))
        angles.append(angle_between(plane.parameters, MIRROR))
        # Not by stating nothing: the region is of the errors' size.
        assert np.degrees(plane.angle_sd) < 1.5
    assert np.mean(covered) >= 0.8
    assert np.median(angles) < 1.0


def test_without_the_errors_in_mind_the_region_is_too_small():
    """The corrections are what makes the covariance honest."""
    covered = []
    for seed in range(8):
        rng = np.random.default_rng(seed)
        known = mirror_robot.misjudged(TRUE, SETTINGS.knowledge, seed)
        looks = [
            sees_hand(TRUE, MIRROR, q, rng, 0.1) for q in postures(9, seed)
        ]
        try:
            plane = estimate(looks, known, pixel_sd=1.0).plane
        except CalibrationFailure:
            continue
        covered.append(
            plane.covers(moved(MIRROR, TRUE.eye_position, plane.reference))
        )
    assert np.mean(covered) < 0.8


def test_scattering_images_widen_the_region():
    looks = [sees_hand(TRUE, MIRROR, q) for q in postures(10)]
    calm = estimate(looks).plane
    rng = np.random.default_rng(0)
    noisy = [
        HandLook(look.readings, look.pixel + 1.4 * rng.normal(size=2))
        for look in looks
    ]
    assert estimate(noisy).plane.angle_sd > 1.2 * calm.angle_sd


@pytest.mark.parametrize("count", [0, 5])
def test_a_marker_that_is_never_seen_is_told(count):
    looks = [HandLook(q, None) for q in postures(count)] if count else []
    with pytest.raises(CalibrationFailure, match="not seen in the mirror at"):
        estimate(looks)


def test_too_few_looks_are_told():
    looks = [sees_hand(TRUE, MIRROR, q) for q in postures(3)]
    with pytest.raises(CalibrationFailure, match="at 3 of 3 postures, expect"):
        estimate(looks)


def test_places_in_one_line_are_told():
    a, b = postures(2)
    step = np.linspace(0.0, 0.1, 6)[:, None]
    looks = [sees_hand(TRUE, MIRROR, q) for q in a + step * (b - a)]
    with pytest.raises(CalibrationFailure, match="all in one line"):
        estimate(looks)


def test_looks_that_do_not_agree_are_told():
    rng = np.random.default_rng(2)
    looks = [HandLook(q, rng.uniform([0, 0], [320, 240])) for q in postures(6)]
    with pytest.raises(CalibrationFailure, match="agree on one mirror"):
        estimate(looks)


def test_postures_that_say_too_little_are_told():
    looks = [sees_hand(TRUE, MIRROR, q) for q in postures(8)]
    with pytest.raises(CalibrationFailure, match="too much alike"):
        estimate(looks, angle_limit=1e-4)


def test_the_jacobian_is_that_of_the_pixels():
    problem = HandProblem(TRUE, SETTINGS.knowledge, SETTINGS.prior, 0.5)
    q = postures(3)
    at = np.concatenate([MIRROR, np.zeros(problem.size - 3)])
    step = 1e-4 * np.random.default_rng(0).normal(size=problem.size)
    change = problem.pixels(at + step, q) - problem.pixels(at - step, q)
    np.testing.assert_allclose(
        problem.jacobian(at, q) @ (2 * step),
        change / 0.5,
        rtol=2e-3,
        atol=1e-5,
    )
