"""The geometry of seeing, on a chain of joints and against projections."""

from hypothesis import given, settings
from hypothesis import strategies as st
import numpy as np
import pytest

from drake_affetto.geometry import optics
from drake_affetto.geometry.kinematics import SerialChain
from drake_affetto.perception.blob import BlobCalibration
from drake_affetto.perception.camera_model import CameraModel, Mirror
from drake_affetto.perception.config import rotation_matrix
from support.trunk_camera import FISHEYE, HEIGHT, MIRROR, PINHOLE, make


def test_a_chain_is_taken_apart_at_the_yaw_joint():
    rng = np.random.default_rng(0)
    n = 4
    axes = np.array([[0, 0, 1], [0, 1, 0], [1, 0, 0], [0, 0, 1]], float)
    X_PJ = np.array(
        [
            optics.make_pose(
                rotation_matrix(rng.uniform(-1, 1, 3)),
                rng.uniform(-0.1, 0.1, 3),
            )
            for _ in range(n)
        ]
    )
    X_JT = optics.make_pose(rotation_matrix([0.3, 0.1, 0.2]), [0.1, 0, 0])
    names = ("a", "b", "c", "d")
    chain = SerialChain(names, X_PJ, axes, X_JT, -np.ones(n), 2 * np.ones(n))
    angles = {"a": 0.2, "b": -0.4, "c": 0.3, "d": 0.9}
    X_FC = optics.make_pose(rotation_matrix([0, 0, 0.5]), [0, 0.02, 0])
    for yaw_joint in names:
        sight = CameraModel.from_chain(
            PINHOLE, chain, yaw_joint, angles, HEIGHT, 0.03, X_FC
        )
        for yaw in (-0.5, 0.0, 0.7):
            q = chain.posture(angles | {yaw_joint: yaw})
            np.testing.assert_allclose(
                sight.camera_pose(yaw), chain.pose(q) @ X_FC, atol=1e-12
            )
        assert (sight.yaw_min, sight.yaw_max) == (-1.0, 2.0)


@pytest.mark.parametrize("camera", [PINHOLE, FISHEYE])
@settings(max_examples=40, deadline=None, derandomize=True)
@given(
    st.floats(0.2, 0.4),
    st.floats(-0.25, 0.25),
    st.floats(-0.4, 0.4),
    st.floats(-0.15, 0.15),
)
def test_the_centering_yaw_centers(camera, x, y, pan, tilt):
    sight = make(camera, pan=pan, tilt=tilt)
    p_W = sight.marker(np.array([x, y]))
    yaw = float(sight.centering_yaw(p_W))
    assert np.isfinite(yaw)
    p_C = optics.transform_points(
        optics.invert_pose(sight.camera_pose(yaw)), p_W
    )
    u = camera.project(p_C)[0]
    assert u == pytest.approx(camera.image_center[0], abs=1e-6)


def test_a_rolled_camera_is_centered_too_by_its_centroid():
    sight = make(roll=0.3)
    yaws, pixels = sight.direct_pixels([[0.28, -0.1], [0.3, 0.12]])
    np.testing.assert_allclose(pixels[:, 0], 159.5, atol=1e-4)
    # What is centered is the centroid: the center is a little off.
    for xy, yaw in zip([[0.28, -0.1], [0.3, 0.12]], yaws, strict=True):
        center = sight.image_of(np.array([xy]), yaw)[0]
        assert 0 < abs(center[0] - 159.5) < 2


def test_direct_task_parameters_are_image_height_and_yaw():
    sight = make()
    box = BlobCalibration(-0.5, 319.5, 50.0, 150.0)
    xy = np.array([[0.25, -0.1], [0.25, 0.0], [0.35, 0.0]])
    tau = sight.direct_task_parameters(xy, box)
    yaws, pixels = sight.direct_pixels(xy)
    np.testing.assert_allclose(tau[:, 1], yaws)
    np.testing.assert_allclose(tau[:, 0], (pixels[:, 1] - 50) / 100)
    # Farther left is more yaw; farther away is higher in the image.
    assert tau[1, 1] > tau[0, 1]
    assert tau[2, 0] < tau[1, 0]


def test_beyond_the_joints_limits_there_is_no_yaw():
    import dataclasses

    sight = dataclasses.replace(make(), yaw_min=-0.3, yaw_max=0.3)
    yaws, pixels = sight.direct_pixels([[0.05, 0.4], [0.3, 0.06]])
    assert np.isnan(yaws[0])
    assert np.all(np.isnan(pixels[0]))
    assert np.isfinite(yaws[1])


@settings(max_examples=40, deadline=None, derandomize=True)
@given(st.floats(0.2, 0.4), st.floats(-0.15, 0.15), st.booleans())
def test_locate_is_the_inverse_of_seeing(x, y, mirrored):
    sight = make()
    yaw = 0.9 if mirrored else 0.0
    mirror = MIRROR if mirrored else None
    xy = np.array([[x, y]])
    uv = sight.image_of(xy, yaw, mirror)
    if np.any(np.isnan(uv)):
        return
    found = sight.locate(uv, yaw, mirror.X_WM if mirror else None)
    np.testing.assert_allclose(found[0], [x, y, HEIGHT], atol=1e-9)


def test_a_marker_is_whole_only_within_image_and_mirror():
    sight = make()
    assert sight.view(np.array([0.3, 0.06]), 0.0).whole == 1.0
    assert sight.view(np.array([0.3, 0.06]), 2.5).whole == 0.0
    views = [
        sight.view(np.array([0.3, 0.06]), yaw, MIRROR).whole
        for yaw in np.linspace(0.0, 1.6, 33)
    ]
    assert max(views) == 1.0
    assert min(views) == 0.0
    assert any(0.0 < whole < 1.0 for whole in views)
    small = Mirror(MIRROR.X_WM, 0.01, 0.01)
    assert sight.view(np.array([0.3, 0.06]), 0.9, small).whole < 1.0


def test_seen_by_takes_the_larger_image():
    sight = make()
    xy = np.array([0.3, 0.0])
    assert sight.seen_by(xy, 0.0, [MIRROR])[0] is None
    best = max(
        np.linspace(0.3, 1.6, 27),
        key=lambda yaw: (
            sight.view(xy, yaw, MIRROR).whole - sight.view(xy, yaw).whole
        ),
    )
    assert sight.seen_by(xy, best, [MIRROR])[0] == 0
