"""The map that knows optics, against the geometry of seeing."""

import dataclasses
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.optimize import least_squares

from drake_affetto.perception.blob import BlobCalibration
from drake_affetto.perception.optical_map import OpticalMap, PlaneExpectation
from drake_affetto.skill.elm import ElmRegressor
from drake_affetto.skill.mappings import Domain
from drake_affetto.skill.optical import OpticalMapping
from drake_affetto.skill.transfer import TransferRegressor
from support.trunk_camera import FISHEYE, MIRROR, make

YAW = 0.9
DIRECT = BlobCalibration(-0.5, 319.5, 40.0, 180.0)
MIRRORED = BlobCalibration(60.0, 200.0, 40.0, 120.0)
WIDE = dataclasses.replace(MIRROR, width=9.0, height=9.0)


def optical(target=None, **options):
    source = make()
    return OpticalMap(
        target or source, MIRRORED, YAW, source, DIRECT, **options
    )


def samples(the_map, n, seed=0):
    """(τ̂ (n, 2), τ (n, 2), xy (n, 2)) by the images of points."""
    xy = np.random.default_rng(seed).uniform([0.2, -0.1], [0.34, 0.08], (n, 2))
    uv = the_map.target.image_of(xy, YAW, WIDE)
    p_W = the_map.source.marker(xy)
    yaws = the_map.source.centering_yaw(p_W)
    v = [
        the_map.source.image_of(place[None], yaw)[0, 1]
        for place, yaw in zip(xy, yaws, strict=True)
    ]
    y = (np.array(v) - DIRECT.v_min) / (DIRECT.v_max - DIRECT.v_min)
    return MIRRORED.normalize(uv), np.stack([y, yaws], -1), xy


@pytest.mark.parametrize("camera", [None, FISHEYE])
def test_with_the_true_mirror_it_is_exact(camera):
    the_map = optical(make(camera) if camera else None)
    X, tau, xy = samples(the_map, 30)
    parameters = the_map.parameters_of(MIRROR.X_WM)
    np.testing.assert_allclose(the_map.apply(parameters, X), tau, atol=1e-9)
    np.testing.assert_allclose(the_map.place(parameters, X), xy, atol=1e-9)


def test_derivative_is_that_of_the_map():
    the_map = optical(make(tilt=0.1))
    X, _, _ = samples(the_map, 12)
    base = the_map.parameters_of(MIRROR.X_WM)
    for seed in range(4):
        p = base + np.random.default_rng(seed).normal(size=3) * 0.1
        derivative = the_map.derivative(p, X)
        for k in range(3):
            step = 1e-6 * np.eye(3)[k]
            difference = (
                the_map.apply(p + step, X) - the_map.apply(p - step, X)
            ) / 2e-6
            np.testing.assert_allclose(
                derivative[:, :, k], difference, rtol=1e-4, atol=1e-6
            )


def test_it_stays_finite_wherever_a_search_strays():
    the_map = optical()
    X, _, _ = samples(the_map, 10)
    rng = np.random.default_rng(0)
    for _ in range(200):
        p = rng.normal(size=3) * 2.0
        assert np.all(np.isfinite(the_map.apply(p, X)))
        assert np.all(np.isfinite(the_map.derivative(p, X)))


def test_two_samples_tell_the_mirror():
    """3 unknowns: two samples of two numbers each are enough."""
    the_map = optical()
    X, tau, _ = samples(the_map, 40)
    domains = [SimpleNamespace(mean=v.mean(axis=0)) for v in (X, tau)]
    starts = the_map.starts(*domains, 6, None)
    assert len({name for name, _ in starts}) == 6
    few = [0, 7]
    fits = [
        least_squares(
            lambda p: (the_map.apply(p, X[few]) - tau[few]).ravel(),
            start,
            lambda p: the_map.derivative(p, X[few]).reshape(-1, 3),
        )
        for _, start in starts
    ]
    best = min(fits, key=lambda fit: fit.cost)
    np.testing.assert_allclose(
        best.x, the_map.parameters_of(MIRROR.X_WM), atol=1e-4
    )
    np.testing.assert_allclose(the_map.apply(best.x, X), tau, atol=1e-4)


def test_starts_map_the_middle_to_the_middle():
    the_map = optical()
    X, tau, _ = samples(the_map, 40)
    domains = Domain.of_samples(X), Domain.of_samples(tau)
    for _, start in the_map.starts(*domains, 5, None):
        np.testing.assert_allclose(
            the_map.apply(start, domains[0].mean[None])[0],
            domains[1].mean,
            atol=1e-6,
        )


def test_it_is_a_map_for_transfer():
    source = make()
    mapping = OpticalMapping(source, MIRRORED, YAW, source, DIRECT)
    assert mapping.count(2, 2) == 3
    X, tau, _ = samples(mapping, 5)
    p = mapping.parameters_of(MIRROR.X_WM)
    np.testing.assert_allclose(
        mapping.apply_many(np.array([p, p]), X), [tau, tau], atol=1e-9
    )
    with pytest.raises(ValueError, match="not 3 to 2"):
        mapping.count(3, 2)


def test_transfer_learns_the_mirror_from_three_samples():
    """Through a skill: only the policy parameters of the samples are known."""
    mapping = OpticalMapping(
        *[getattr(optical(), f.name) for f in dataclasses.fields(OpticalMap)]
    )
    X, tau, _ = samples(mapping, 60)

    def skill(tau):
        """Policy parameters that differ all over the workspace."""
        y, yaw = tau.T
        return np.stack([yaw, y, np.sin(2 * y + 3 * yaw), y * yaw], axis=-1)

    elm = ElmRegressor(
        n_hidden=50,
        alpha=1e-6,
        input_range=[[0.0, 2.0], [-1.0, 0.5]],
        random_state=0,
    ).fit(tau, skill(tau))
    transfer = TransferRegressor(
        elm,
        mapping,
        domain=[[0.0, 2.0], [-1.0, 0.5]],
        n_starts=8,
        random_state=0,
    ).fit(X[:3], skill(tau[:3]))
    # The skill's own errors are the skill's; the map may add little to them.
    error = transfer.predict(X) - elm.predict(tau)
    assert np.abs(error).max() < 2e-3
    np.testing.assert_allclose(
        transfer.parameters_, mapping.parameters_of(MIRROR.X_WM), atol=0.02
    )


def _skilled(tau_range, skill):
    rng = np.random.default_rng(1)
    tau = rng.uniform(*np.transpose(tau_range), (60, 2))
    return ElmRegressor(
        n_hidden=50, alpha=1e-6, input_range=tau_range, random_state=0
    ).fit(tau, skill(tau))


def test_one_sample_and_where_a_mirror_may_stand_are_enough():
    known = optical()
    X, tau, _ = samples(known, 60)
    limits = [[0.0, 2.0], [-1.0, 0.5]]

    def skill(tau):
        y, yaw = tau.T
        return np.stack([yaw, y, np.sin(2 * y + 3 * yaw), y * yaw], axis=-1)

    elm = _skilled(limits, skill)
    # The mirror's own middle is on its plane, and it leans as it leans.
    n = MIRROR.X_WM[:3, 2]
    lean = float(np.arcsin(n[2]))
    worst = []
    for shift in (0.0, 0.1):
        foot = (MIRROR.X_WM[:3, 3] + shift * n).tolist()
        plane = PlaneExpectation(foot, 0.01, lean, 0.01)
        mapping = OpticalMapping(**vars(known) | {"plane": plane})
        with pytest.warns(UserWarning, match="1 samples determine"):
            transfer = TransferRegressor(elm, mapping, domain=limits).fit(
                X[:1], skill(tau[:1])
            )
        error = transfer.predict(X) - elm.predict(tau)
        worst.append(np.abs(error).max())
    assert worst[0] < 0.05 < worst[1]


def test_what_is_expected_of_the_plane_is_its_distance_and_its_lean():
    plane = PlaneExpectation([0.35, 0.3, 0.0], 0.1, -0.1, 0.2)
    mapping = OpticalMapping(**vars(optical()) | {"plane": plane})
    assert optical().unexpected(np.zeros((1, 3))) is None
    p = np.random.default_rng(0).normal(size=(5, 3))
    residual, slope = mapping.expectation(p)
    eye = mapping.target.camera_pose(YAW)[:3, 3]
    for row, (azimuth, elevation, s) in zip(residual, p, strict=True):
        n = np.array(
            [
                np.cos(elevation) * np.cos(azimuth),
                np.cos(elevation) * np.sin(azimuth),
                np.sin(elevation),
            ]
        )
        foot = np.array(plane.foot) - (eye - s * n)
        np.testing.assert_allclose(
            row, [foot @ n / 0.1, (elevation + 0.1) / 0.2], atol=1e-12
        )
    for k in range(3):
        step = 1e-6 * np.eye(3)[k]
        change = mapping.expectation(p + step)[0]
        change = change - mapping.expectation(p - step)[0]
        np.testing.assert_allclose(slope[:, :, k], change / 2e-6, atol=1e-7)
