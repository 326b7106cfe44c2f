"""Planes as three numbers."""

import numpy as np
import pytest

from drake_affetto.calibration.plane import PlaneEstimate, PlanePrior
from drake_affetto.common.errors import InputError
from drake_affetto.geometry.planes import moved, normals

PLANE = np.array([-1.9, -0.2, 0.3])
EYE = np.array([0.1, 0.0, 0.4])


def test_the_covariance_moves_with_the_point():
    rng = np.random.default_rng(2)
    covariance = np.diag([0.01, 0.02, 0.003]) ** 2
    estimate = PlaneEstimate(PLANE, covariance, EYE)
    other = np.array([-0.5, 0.4, 0.0])
    told = estimate.from_point(other)
    drawn = moved(
        rng.multivariate_normal(PLANE, covariance, 200_000), EYE, other
    )
    scale = np.sqrt(np.diag(told.covariance))
    np.testing.assert_allclose(
        np.cov(drawn.T) / np.outer(scale, scale),
        told.covariance / np.outer(scale, scale),
        atol=0.02,
    )


def test_its_region_holds_19_of_20():
    rng = np.random.default_rng(3)
    A = rng.normal(size=(3, 3)) * [[0.01], [0.02], [0.003]]
    estimate = PlaneEstimate(PLANE, A @ A.T, EYE)
    drawn = rng.multivariate_normal(PLANE, A @ A.T, 4000)
    share = np.mean([estimate.covers(each) for each in drawn])
    assert 0.935 < share < 0.965
    # All the way round is the same direction.
    assert estimate.covers(PLANE + [2 * np.pi, 0.0, 0.0])
    assert not estimate.covers(PLANE + [0.5, 0.0, 0.0])


def test_the_angle_is_that_of_the_normals():
    covariance = np.diag([0.02, 0.01, 1e-6]) ** 2
    estimate = PlaneEstimate(PLANE, covariance, EYE)
    drawn = np.random.default_rng(4).multivariate_normal(
        PLANE, covariance, 20_000
    )
    angle = np.arccos(np.clip(normals(drawn) @ normals(PLANE), -1, 1))
    assert estimate.angle_sd == pytest.approx(
        np.sqrt(np.mean(angle**2)), rel=0.02
    )


def test_the_prior_draws_mirrors_before_the_camera():
    prior = PlanePrior(distance=0.1, distance_sd=0.3)
    drawn = prior.draw(5000, np.random.default_rng(0))
    assert drawn[:, 2].min() > 0.0
    assert drawn[:, 0].std() == pytest.approx(prior.azimuth_sd, rel=0.05)


def test_a_prior_out_of_range_is_told():
    with pytest.raises(InputError, match=r"prior\.elevation is 3, expected"):
        PlanePrior(elevation=3).check("prior")
