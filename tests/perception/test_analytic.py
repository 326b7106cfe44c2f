"""The renderer-free twin against geometry and against rendered images."""

import numpy as np
import pytest

from drake_affetto.geometry import optics
from drake_affetto.geometry.optics import PinholeCamera
from drake_affetto.perception.analytic import (
    Occluders,
    measured_blob,
    visible_marker,
)
from drake_affetto.perception.camera_model import Mirror
from drake_affetto.perception.config import rotation_matrix

CAMERA = PinholeCamera.from_fov(320, 240, 0.9)
EYE = np.eye(4)


def facing(x=0.0, y=0.0, z=0.5, tilt=0.0):
    """X_WD of a disc before the camera that faces it."""
    return optics.make_pose(rotation_matrix([np.pi + tilt, 0, 0]), [x, y, z])


def test_a_whole_disc_is_its_projection():
    X_WD = facing(0.03, -0.02, tilt=0.6)
    area, uv = visible_marker(CAMERA, EYE, X_WD, 0.03)
    expected, expected_area, _ = optics.project_disc(
        CAMERA, EYE, X_WD[:3, 3], X_WD[:3, 2], 0.03
    )
    np.testing.assert_allclose(uv, expected)
    assert area == pytest.approx(expected_area)


def test_half_a_disc_at_the_images_border():
    # Its center is on the image's left edge.
    x = -160.0 / CAMERA.focal_x * 0.5
    area, uv = visible_marker(CAMERA, EYE, facing(x), 0.03)
    radius = 0.03 / 0.5 * CAMERA.focal_x
    assert area == pytest.approx(0.5 * np.pi * radius**2, rel=0.01)
    # The centroid of a half disc is 4 r / (3 π) off its straight edge.
    assert uv[0] == pytest.approx(-0.5 + 4 * radius / (3 * np.pi), abs=0.2)
    area, _ = visible_marker(CAMERA, EYE, facing(2 * x), 0.03)
    assert area == 0.0


def test_a_disc_seen_from_behind_is_not_seen():
    X_WD = optics.make_pose(np.eye(3), [0, 0, 0.5])
    assert visible_marker(CAMERA, EYE, X_WD, 0.03)[0] == 0.0


def test_half_a_disc_at_the_mirrors_edge():
    # A mirror straight before the camera; the disc is beside the camera.
    face = optics.make_pose(rotation_matrix([np.pi, 0, 0]), [0, 0, 0.5])
    # The light from (0.2, 0, 0.1) meets the mirror at x = 0.5/0.9 · 0.2.
    x = 0.2 * 0.5 / 0.9
    X_WD = optics.make_pose(np.eye(3), [0.2, 0, 0.1])
    for width, part in ((4 * x, 1.0), (2 * x, 0.5), (x, 0.0)):
        mirror = Mirror(face, width, 0.4)
        whole, _ = visible_marker(
            CAMERA, EYE, X_WD, 0.02, Mirror(face, 1.0, 1.0)
        )
        area, _ = visible_marker(CAMERA, EYE, X_WD, 0.02, mirror)
        assert area == pytest.approx(part * whole, rel=0.02, abs=1e-9)


def sphere(center, radius, on_camera=False):
    return Occluders(
        optics.make_pose(np.eye(3), center)[None],
        np.full((1, 3), radius),
        np.array([on_camera]),
    )


def test_what_stands_in_the_way_takes_its_part():
    whole, uv = visible_marker(CAMERA, EYE, facing(), 0.03)
    # A large ball that the optical axis just touches.
    half = sphere([0.1, 0.0, 0.25], 0.1)
    hit, seen = visible_marker(CAMERA, EYE, facing(), 0.03, None, half)
    assert 0.3 * whole < hit < 0.75 * whole
    assert seen[0] < uv[0] - 2.0
    assert seen[1] == pytest.approx(uv[1], abs=0.5)
    # All of it; nothing, as it is beside; nothing, as it carries the camera.
    for occluders, part in (
        (sphere([0, 0, 0.25], 0.1), 0.0),
        (sphere([0.3, 0, 0.25], 0.1), 1.0),
        (sphere([0, 0, 0.7], 0.1), 1.0),
        (sphere([0, 0, 0.25], 0.1, on_camera=True), 1.0),
    ):
        area, _ = visible_marker(CAMERA, EYE, facing(), 0.03, None, occluders)
        assert area == pytest.approx(part * whole)


def test_a_hider_before_the_mirror_or_behind_it_in_the_image():
    face = optics.make_pose(rotation_matrix([np.pi, 0, 0]), [0, 0, 0.5])
    mirror = Mirror(face, 1.0, 1.0)
    X_WD = optics.make_pose(np.eye(3), [0.2, 0, 0.1])
    whole, _ = visible_marker(CAMERA, EYE, X_WD, 0.02, mirror)
    hit = np.array([0.2 * 0.5 / 0.9, 0, 0.5])
    for center, part in (
        (0.5 * hit, 0.0),  # between eye and mirror
        (0.5 * (hit + X_WD[:3, 3]), 0.0),  # between mirror and marker
        (np.array([-0.1, 0, 0.3]), 1.0),
    ):
        area, _ = visible_marker(
            CAMERA, EYE, X_WD, 0.02, mirror, sphere(center, 0.04)
        )
        assert area == pytest.approx(part * whole)


def measure(centroid=(100.2, 80.7), area=400.0, noise=0.0, seed=0, time=0.0):
    return measured_blob(
        area, np.array(centroid), 12.0, 15000.0, noise, seed, time
    )


def test_errors_of_the_raster_belong_to_the_place():
    first = measure(seed=0, time=0.0)
    assert first == measure(seed=3, time=1.0)
    others = [measure((100.2 + k, 80.7)) for k in range(300)]
    errors = np.array(
        [[b.u - 100.2 - k, b.v - 80.7] for k, b in enumerate(others)]
    )
    assert errors.std(axis=0) == pytest.approx([0.055, 0.055], rel=0.15)


def test_noise_is_new_in_each_image_and_less_for_larger_markers():
    spread = []
    for area in (100.0, 1600.0):
        found = [
            measure(area=area, noise=4.0, time=0.1 * k) for k in range(300)
        ]
        spread.append(np.std([b.u for b in found]))
    assert spread[0] == pytest.approx(4 * 0.0095 * 100**-0.25, rel=0.15)
    assert spread[0] / spread[1] == pytest.approx(2.0, rel=0.2)
    assert measure(noise=4.0, time=0.3) == measure(noise=4.0, time=0.3)
    assert measure(noise=4.0, seed=1) != measure(noise=4.0, seed=2)


def test_too_small_and_too_large_are_lost():
    assert measure(area=8.0) is None
    assert measure(area=2e4) is None
    assert measure(area=30.0) is not None
