"""Cameras and mirrors as geometry, against elementary optics."""

from hypothesis import given, settings
from hypothesis import strategies as st
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from drake_affetto.geometry import optics
from drake_affetto.geometry.optics import FisheyeCamera, PinholeCamera
from drake_affetto.perception.config import rotation_matrix

PINHOLE = PinholeCamera(320, 240, 260.0, 255.0, 158.0, 123.5)
FISHEYE = FisheyeCamera(320, 240, 180.0, 178.0, 161.0, 119.0, -0.02, 0.004)


def random_pose(seed, spread=0.3):
    rng = np.random.default_rng(seed)
    return optics.make_pose(
        Rotation.random(rng=rng).as_matrix(), rng.uniform(-spread, spread, 3)
    )


seeds = st.integers(0, 10_000)


@given(seeds)
def test_reflection_keeps_distances_and_is_its_own_inverse(seed):
    X_WM = random_pose(seed)
    points = np.random.default_rng(seed).normal(size=(5, 3))
    image = optics.reflect_points(X_WM, points)
    np.testing.assert_allclose(
        optics.reflect_points(X_WM, image), points, atol=1e-12
    )
    np.testing.assert_allclose(
        np.linalg.norm(image[0] - image[1]),
        np.linalg.norm(points[0] - points[1]),
    )
    # The mirror's plane halves the way between a point and its image.
    middle = 0.5 * (points + image) - X_WM[:3, 3]
    np.testing.assert_allclose(middle @ X_WM[:3, 2], 0, atol=1e-12)


@given(seeds)
def test_light_is_reflected_at_equal_angles(seed):
    """Fermat: the way over the mirror is the straight way to the image."""
    rng = np.random.default_rng(seed)
    X_WM = random_pose(seed)
    n = X_WM[:3, 2]
    # Two points before the mirror.
    p, q = optics.transform_points(
        X_WM, rng.uniform([-1, -1, 0.1], [1, 1, 1], (2, 3))
    )
    image = optics.reflect_points(X_WM, q)
    hit = optics.intersect_plane(p, image - p, X_WM[:3, 3], n)
    incoming = (hit - p) / np.linalg.norm(hit - p)
    outgoing = (q - hit) / np.linalg.norm(q - hit)
    assert incoming @ n == pytest.approx(-(outgoing @ n), abs=1e-9)
    np.testing.assert_allclose(
        np.cross(incoming, n), np.cross(outgoing, n), atol=1e-9
    )


@given(seeds)
def test_virtual_camera_sees_what_the_mirror_shows(seed):
    """Flipped image of the virtual camera = image of the reflected point."""
    rng = np.random.default_rng(seed)
    X_WC, X_WM = random_pose(seed), random_pose(seed + 1)
    X_WV = optics.reflect_camera(X_WC, X_WM)
    R = X_WV[:3, :3]
    np.testing.assert_allclose(R @ R.T, np.eye(3), atol=1e-12)
    assert np.linalg.det(R) == pytest.approx(1.0)

    p_C = rng.uniform([-0.4, -0.3, 0.3], [0.4, 0.3, 1.0], (4, 3))
    seen = PINHOLE.project(p_C)
    p_W = optics.reflect_points(X_WM, optics.transform_points(X_WC, p_C))
    virtual = PINHOLE.flipped().project(
        optics.transform_points(optics.invert_pose(X_WV), p_W)
    )
    np.testing.assert_allclose(PINHOLE.width - 1 - virtual[:, 0], seen[:, 0])
    np.testing.assert_allclose(virtual[:, 1], seen[:, 1])


@pytest.mark.parametrize("camera", [PINHOLE, FISHEYE])
def test_direction_is_the_inverse_of_projection(camera):
    rng = np.random.default_rng(1)
    uv = rng.uniform([0, 0], [319, 239], (200, 2))
    direction = camera.direction(uv)
    np.testing.assert_allclose(np.linalg.norm(direction, axis=1), 1.0)
    depth = rng.uniform(0.1, 3.0, (200, 1))
    np.testing.assert_allclose(camera.project(depth * direction), uv, atol=1e-7)


def test_pixel_coordinates_are_integers_at_pixel_centers():
    camera = PinholeCamera.from_fov(320, 240, 0.9)
    np.testing.assert_allclose(camera.project([0, 0, 1]), [159.5, 119.5])
    np.testing.assert_allclose(camera.image_center, [159.5, 119.5])
    # The upper edge of the image lies at half the field of view.
    np.testing.assert_allclose(
        camera.project([0, -np.tan(0.45), 1])[1], -0.5, atol=1e-9
    )


def test_fisheye_with_little_angle_is_a_pinhole():
    fisheye = FisheyeCamera(320, 240, 200.0, 200.0, 160.0, 120.0)
    pinhole = PinholeCamera(320, 240, 200.0, 200.0, 160.0, 120.0)
    near_axis = np.array([[0, 0, 1.0], [0.01, -0.005, 1.0]])
    np.testing.assert_allclose(
        fisheye.project(near_axis), pinhole.project(near_axis), atol=1e-3
    )
    # Equidistant: 45° is at f·π/4, which a pinhole shows at f.
    np.testing.assert_allclose(
        fisheye.project([1, 0, 1])[0] - 159.5, 200 * np.pi / 4
    )


def test_pinhole_of_a_fisheye_holds_all_it_sees():
    u, v = FISHEYE.remap_grid()
    pinhole = FISHEYE.pinhole()
    assert u.min() >= 0
    assert u.max() <= pinhole.width - 1
    assert v.min() >= 0
    assert v.max() <= pinhole.height - 1


def test_points_behind_the_camera_have_no_image():
    assert np.all(np.isnan(PINHOLE.project([0.1, 0.1, -0.5])))
    assert np.all(np.isnan(FISHEYE.project([0.1, 0.1, 0.0])))


@given(st.integers(0, 200), st.integers(0, 150), st.integers(8, 90), seeds)
def test_crop_and_flip_move_pixels_as_images_move(left, top, size, seed):
    rng = np.random.default_rng(seed)
    p_C = rng.uniform([-0.5, -0.5, 0.2], [0.5, 0.5, 1.0], (3, 3))
    uv = PINHOLE.project(p_C)
    crop = PINHOLE.crop(left, top, size, size)
    np.testing.assert_allclose(crop.project(p_C), uv - [left, top])
    flipped = crop.flipped().project(p_C * [-1, 1, 1])
    np.testing.assert_allclose(size - 1 - flipped[:, 0], uv[:, 0] - left)


def brute_force_view(X_WC, X_WM, size):
    """Pixels whose rays meet the mirror's front, one by one."""
    u, v = np.meshgrid(np.arange(320), np.arange(240))
    d = PINHOLE.direction(np.stack([u, v], -1).reshape(-1, 2)) @ X_WC[:3, :3].T
    hit = optics.intersect_plane(X_WC[:3, 3], d, X_WM[:3, 3], X_WM[:3, 2])
    local = optics.transform_points(optics.invert_pose(X_WM), hit)
    front = d @ X_WM[:3, 2] < 0
    with np.errstate(invalid="ignore"):
        on = np.all(np.abs(local[:, :2]) <= 0.5 * np.array(size), axis=1)
    return (on & front).reshape(240, 320)


@settings(max_examples=40, deadline=None, derandomize=True)
@given(seeds)
def test_mirror_view_holds_every_pixel_that_sees_the_mirror(seed):
    rng = np.random.default_rng(seed)
    X_WC = random_pose(seed, 0.0)
    # A mirror somewhere before the camera, or well beside it.
    X_CM = random_pose(seed + 7)
    X_CM[:3, 3] += [rng.uniform(-0.8, 0.8), rng.uniform(-0.6, 0.6), 0.6]
    X_WM = X_WC @ X_CM
    size = rng.uniform(0.05, 0.6, 2)
    sees = brute_force_view(X_WC, X_WM, size)
    view = optics.mirror_view(PINHOLE, X_WC, X_WM, *size)
    if view is None:
        assert sees.sum() <= 1
        return
    assert view.left >= 0
    assert view.left + view.width <= 320
    outside = sees.copy()
    outside[
        view.top : view.top + view.height, view.left : view.left + view.width
    ] = False
    assert not outside.any()
    # The rectangle is hardly larger than needed; pointed corners hold no
    # pixel's center.
    if sees.sum() > 2000:
        columns = np.flatnonzero(sees.any(axis=0))
        assert view.left >= columns[0] - 8
        assert view.left + view.width <= columns[-1] + 9


@settings(max_examples=40, deadline=None, derandomize=True)
@given(seeds)
def test_nothing_before_the_mirror_is_nearer_than_its_depth(seed):
    """Cutting off at `depth` takes away only what is behind the mirror."""
    X_CM = random_pose(seed)
    X_CM[:3, 3] += [0, 0, 0.6]
    view = optics.mirror_view(PINHOLE, np.eye(4), X_CM, 0.3, 0.2)
    if view is None:
        return
    d = PINHOLE.direction(view.polygon)
    hit = optics.intersect_plane(np.zeros(3), d, X_CM[:3, 3], X_CM[:3, 2])
    assert np.nanmin(hit[:, 2]) >= view.depth - 1e-6


def test_mirror_is_not_seen_from_behind_or_beside():
    facing = optics.make_pose(rotation_matrix([np.pi, 0, 0]), [0, 0, 0.5])
    away = optics.make_pose(np.eye(3), [0, 0, 0.5])
    beside = optics.make_pose(rotation_matrix([np.pi, 0, 0]), [3, 0, 0.5])
    behind = optics.make_pose(np.eye(3), [0, 0, -0.5])
    eye = np.eye(4)
    assert optics.mirror_view(PINHOLE, eye, facing, 0.1, 0.1) is not None
    assert optics.mirror_view(PINHOLE, eye, away, 0.1, 0.1) is None
    assert optics.mirror_view(PINHOLE, eye, beside, 0.1, 0.1) is None
    assert optics.mirror_view(PINHOLE, eye, behind, 0.1, 0.1) is None


def test_mirror_view_grows_to_hold_a_point():
    facing = optics.make_pose(rotation_matrix([np.pi, 0, 0]), [0.25, 0, 0.5])
    view = optics.mirror_view(PINHOLE, np.eye(4), facing, 0.1, 0.1)
    assert view is not None
    grown = view.grown_to_hold(158.0, 123.5)
    assert grown.left < 158.0 < grown.left + grown.width
    assert grown.top < 123.5 < grown.top + grown.height
    assert grown.left + grown.width == view.left + view.width


def test_disc_image_from_straight_above_is_a_circle():
    camera = PinholeCamera(400, 400, 300.0, 300.0, 200.0, 200.0)
    # The disc faces the camera, 0.5 m before it and off the axis.
    centroid, area, _ = optics.project_disc(
        camera, np.eye(4), np.array([0.05, -0.02, 0.5]), [0, 0, -1], 0.02
    )
    np.testing.assert_allclose(centroid, [199.5 + 30, 199.5 - 12], atol=1e-9)
    assert area == pytest.approx(np.pi * 12.0**2, rel=1e-9)


@given(seeds)
@settings(max_examples=30, deadline=None, derandomize=True)
def test_disc_centroid_is_that_of_its_filled_image(seed):
    rng = np.random.default_rng(seed)
    normal = np.array([*rng.uniform(-0.8, 0.8, 2), -1.0])
    center = np.array([*rng.uniform(-0.1, 0.1, 2), 0.4])
    centroid, area, _ = optics.project_disc(
        PINHOLE, np.eye(4), center, normal, 0.03
    )
    # Fine sampling of the image plane: a ray hits the disc or not.
    step = 0.25
    u, v = np.meshgrid(
        np.arange(centroid[0] - 40, centroid[0] + 40, step),
        np.arange(centroid[1] - 40, centroid[1] + 40, step),
    )
    d = PINHOLE.direction(np.stack([u, v], -1))
    normal = normal / np.linalg.norm(normal)
    hit = optics.intersect_plane(np.zeros(3), d, center, normal)
    inside = np.linalg.norm(hit - center, axis=-1) <= 0.03
    assert area == pytest.approx(inside.sum() * step**2, rel=0.02)
    np.testing.assert_allclose(
        centroid, [u[inside].mean(), v[inside].mean()], atol=0.05
    )


def test_disc_seen_from_below_has_no_area():
    _, area, _ = optics.project_disc(
        PINHOLE, np.eye(4), np.array([0, 0, 0.5]), [0, 0, 1], 0.03
    )
    assert area == 0


def test_turning_the_camera_moves_the_image_by_the_sensitivity():
    X_WC = optics.make_pose(rotation_matrix([-2.2, 0, -1.5]), [0.1, 0.02, 0.4])
    p_W = np.array([0.3, -0.05, 0.0])
    axis_point, axis = np.array([0.02, 0.0, 0.1]), np.array([0.0, 0.0, 1.0])
    rate = optics.yaw_sensitivity(PINHOLE, X_WC, axis_point, axis, p_W)

    def u_after(angle):
        turn = optics.make_pose(rotation_matrix([0, 0, angle]), np.zeros(3))
        to = optics.make_pose(np.eye(3), axis_point)
        moved = to @ turn @ optics.invert_pose(to) @ X_WC
        p_C = optics.transform_points(optics.invert_pose(moved), p_W)
        return PINHOLE.project(p_C)[0]

    difference = (u_after(1e-3) - u_after(-1e-3)) / 2e-3
    assert rate == pytest.approx(difference, rel=1e-4)
    # Turning left moves the image to the right.
    assert rate > 0


def test_the_image_ends_at_its_edge():
    camera = PinholeCamera.from_fov(320, 240, 0.8)
    uv = np.array([[-0.5, 0.0], [319.5, 239.5], [319.6, 0.0], [np.nan, 0.0]])
    assert camera.inside(uv).tolist() == [True, True, False, False]
    assert camera.inside(uv, margin=1).tolist() == [False] * 4


def test_points_are_taken_into_the_frame_of_each_row():
    X = np.stack([np.eye(4), np.eye(4)])
    X[1, 0, 3] = 0.1
    points = np.full((2, 3, 3), [0.0, 0.0, 1.0])
    found = optics.points_in_frame(X, points)
    assert found[0, :, 0] == pytest.approx(0.0)
    assert found[1, :, 0] == pytest.approx(-0.1)
    one = optics.points_in_frame(X[1], points[1])
    assert one == pytest.approx(
        optics.transform_points(optics.invert_pose(X[1]), points[1])
    )


def test_areas_of_polygons_agree_with_the_moments():
    rng = np.random.default_rng(0)
    angles = np.sort(rng.uniform(0, 2 * np.pi, (5, 9)), axis=1)
    polygons = np.stack([np.cos(angles), np.sin(angles)], axis=-1)
    for polygon, area in zip(
        polygons, optics.polygon_area(polygons), strict=True
    ):
        expected, _ = optics.polygon_area_centroid(polygon)
        assert area == pytest.approx(expected)
