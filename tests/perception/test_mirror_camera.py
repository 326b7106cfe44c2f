"""The rendered images, direct and mirrored, against pure geometry."""

import cv2
import numpy as np
from pydrake.math import RigidTransform, RollPitchYaw
from pydrake.systems.framework import DiagramBuilder
import pytest

from drake_affetto.common.errors import InputError
from drake_affetto.geometry import optics
from drake_affetto.perception.config import (
    CameraConfig,
    LensConfig,
    LightConfig,
    MirrorConfig,
    RenderConfig,
)
from drake_affetto.perception.imaging import ImageEffects
from drake_affetto.perception.mirror_camera import MirrorCamera
from support import perception_scene as scene
from support.camera_world import World


@pytest.fixture(scope="module")
def world():
    return World()


@pytest.fixture(autouse=True)
def rest(request):
    """Puts the shared world back to where it began."""
    if "world" in request.fixturenames:
        shared = request.getfixturevalue("world")
        shared.set(yaw=0.0, rod=2.5, drum=[0.3, 0.0])


def within(outline, image, margin=3):
    size = np.array(image.shape[1::-1])
    return bool(np.all(outline > margin) and np.all(outline < size - margin))


def errors(world, n, seed):
    """Rendered against geometric centroids, direct and mirrored [pixels]."""
    rng = np.random.default_rng(seed)
    direct, mirrored = [], []
    for _ in range(n):
        world.set(
            yaw=rng.uniform(-0.7, 0.3),
            drum=rng.uniform([0.2, -0.15], [0.36, 0.1]),
        )
        image = world.image()
        for X_WM, out in ((None, direct), (world.mirror(), mirrored)):
            centroid, area, outline = world.marker(X_WM)
            if area < 25 or not within(outline, image):
                continue
            if X_WM is not None and not world.mirrored_marker_is_whole(
                outline, X_WM
            ):
                continue
            blob = world.blob_near(image, outline)
            assert blob is not None
            out.append([blob.u - centroid[0], blob.v - centroid[1]])
    return np.array(direct), np.array(mirrored)


@pytest.mark.parametrize("size", [(320, 240), (640, 480)])
def test_centroids_agree_with_geometry(size):
    world = World(width=size[0], height=size[1])
    direct, mirrored = errors(world, 40 if size[0] == 320 else 15, 1)
    for found, least in ((direct, 12), (mirrored, 5)):
        assert len(found) >= least
        distance = np.hypot(*found.T)
        assert np.quantile(distance, 0.95) < 0.5
        # No half pixel is lost between the two conventions.
        assert np.all(np.abs(found.mean(axis=0)) < 0.3)


def test_centroids_agree_through_a_wide_angle_lens():
    world = World(fov_y=1.4, lens=LensConfig(k1=-0.02, k2=0.0))
    direct, mirrored = errors(world, 25, 2)
    assert len(direct) >= 10
    assert len(mirrored) >= 5
    assert np.quantile(np.hypot(*direct.T), 0.95) < 0.5
    assert np.quantile(np.hypot(*mirrored.T), 0.95) < 0.5


def test_without_a_mirror_in_view_it_is_the_plain_sensors_image():
    world = World(n_mirrors=1, rgbd=True)
    world.set(yaw=0.5)
    rgbd = world.rgbd.GetMyContextFromRoot(world.root)
    assert (
        optics.mirror_view(
            world.camera.camera_model,
            world.pose(),
            world.mirror(),
            *scene.MIRROR_SIZE,
        )
        is None
    )
    np.testing.assert_array_equal(
        world.image(),
        world.rgbd.color_image_output_port().Eval(rgbd).data[:, :, :3],
    )
    world.set(yaw=-0.2)
    np.testing.assert_array_equal(
        world.labels(),
        world.rgbd.label_image_output_port().Eval(rgbd).data[:, :, 0],
    )
    # Now the mirror is in view: outside of it all is as it was.
    plain = world.rgbd.color_image_output_port().Eval(rgbd).data[:, :, :3]
    panel = int(world.plant.GetBodyByName("panel").index())
    other = world.labels() != panel
    np.testing.assert_array_equal(world.image()[other], plain[other])
    assert np.any(world.image() != plain)


def test_what_stands_before_the_mirror_hides_the_reflection(world):
    """Rod between camera and mirror: its own pixels, as without mirror."""
    world.set(yaw=-0.3, rod=-0.6)
    labels = world.labels()
    rod = int(world.plant.GetBodyByName("rod").index())
    view = optics.mirror_view(
        world.camera.camera_model,
        world.pose(),
        world.mirror(),
        *scene.MIRROR_SIZE,
    )
    assert view is not None
    inside = np.zeros(labels.shape, dtype=np.uint8)
    cv2.fillConvexPoly(inside, np.rint(view.polygon).astype(np.int32), 1)
    before = cv2.erode(
        ((labels == rod) & (inside > 0)).astype(np.uint8), np.ones((3, 3))
    )
    assert before.sum() > 200
    # The rod is yellow: red and green far above blue, whatever its shade.
    red, green, blue = world.image()[before > 0].astype(int).T
    assert np.all(red > 2 * blue)
    assert np.all(green > 2 * blue)


def test_the_drum_is_hidden_in_the_mirror_behind_the_rod(world):
    """The rod stands between mirror and drum: direct view free, mirror not."""
    world.set(yaw=-0.45, drum=[0.26, 0.02])
    X_WM = world.mirror()
    _, area, outline = world.marker(X_WM)
    assert area > 25
    assert within(outline, world.image())
    assert world.mirrored_marker_is_whole(outline, X_WM)
    free = world.blob_near(world.image(), outline)
    assert free is not None
    # Turn the rod step by step; where its reflection crosses the line of
    # sight, the mirrored marker goes and the true one stays.
    hidden = []
    for angle in np.linspace(-1.3, 0.3, 17):
        world.set(rod=angle)
        image = world.image()
        _, _, direct = world.marker()
        seen = world.blob_near(image, outline)
        true = world.blob_near(image, direct)
        hidden.append(seen is None or seen.area < 0.7 * free.area)
        if hidden[-1] and true is not None:
            # By geometry: a sight line to the mirrored marker meets the rod.
            assert rod_hides(world, X_WM)
    assert any(hidden)
    assert not all(hidden)


def rod_hides(world, X_WM):
    """Whether the way mirror–marker passes near the rod's axis."""
    marker = world.plant.GetFrameByName("marker").CalcPoseInWorld(
        world.plant_context
    )
    eye = world.pose()[:3, 3]
    p = marker.translation()
    image = optics.reflect_points(X_WM, p)
    hit = optics.intersect_plane(eye, image - eye, X_WM[:3, 3], X_WM[:3, 2])
    X_WR = world.plant.GetBodyByName("rod").EvalPoseInWorld(world.plant_context)
    axis = X_WR.multiply(np.array([[0.01, 0.31], [0, 0], [0, 0]]))
    s, t = np.meshgrid(np.linspace(0, 1, 200), np.linspace(0, 1, 200))
    for a, b in ((hit, p), (eye, hit)):
        on_ray = a + s[..., None] * (b - a)
        on_rod = axis[:, 0] + t[..., None] * (axis[:, 1] - axis[:, 0])
        if np.linalg.norm(on_ray - on_rod, axis=-1).min() < 0.012 + 0.03:
            return True
    return False


def test_light_is_the_same_in_both_views(world):
    """The table's color near the drum, direct and in the mirror."""
    world.set(yaw=-0.45, drum=[0.3, 0.1])
    X_WM = world.mirror()
    p_W = np.array([0.26, -0.02, 0.0])
    X_CW = optics.invert_pose(world.pose())
    image = world.image().astype(int)
    colors = []
    for p in (p_W, optics.reflect_points(X_WM, p_W)):
        u, v = world.camera.camera_model.project(
            optics.transform_points(X_CW, p)
        )
        assert 0 < u < 319
        assert 0 < v < 239
        colors.append(image[round(v), round(u)])
    # The surface is matt, so that its color does not depend on the view.
    np.testing.assert_allclose(colors[0], colors[1], atol=6)


def test_two_mirrors_are_both_drawn():
    world = World(n_mirrors=2)
    for index, yaw in ((0, -0.5), (1, 0.5)):
        world.set(yaw=yaw, drum=[0.28, 0.0])
        image = world.image()
        X_WM = world.mirror(index)
        centroid, area, outline = world.marker(X_WM)
        assert area > 25
        assert within(outline, image)
        blob = world.blob_near(image, outline)
        assert blob is not None
        assert np.hypot(blob.u - centroid[0], blob.v - centroid[1]) < 0.6


def test_the_image_follows_the_context(world):
    """Nothing is held from an earlier evaluation, or from construction."""
    world.set(yaw=-0.1)
    first, labels = world.image(), world.labels()
    world.set(yaw=0.2)
    assert np.any(world.image() != first)
    assert np.any(world.labels() != labels)
    world.set(yaw=-0.1, drum=[0.25, 0.05])
    assert np.any(world.image() != first)
    # The mirror is moved through its frame in the plant's context.
    frame = world.plant.GetFrameByName("mirror_pose0")
    X_WP = frame.GetPoseInParentFrame(world.plant_context)
    before = world.mirror()
    frame.SetPoseInParentFrame(
        world.plant_context, RigidTransform([0.02, 0, 0]) @ X_WP
    )
    np.testing.assert_allclose(
        world.mirror()[:3, 3], before[:3, 3] + [0.02, 0, 0]
    )
    frame.SetPoseInParentFrame(world.plant_context, X_WP)
    world.set(drum=[0.3, 0.0])
    np.testing.assert_array_equal(world.image(), first)


def test_camera_and_mirror_can_be_moved_on_their_bodies(world):
    context = world.diagram.CreateDefaultContext()
    sub = world.camera.GetMyContextFromRoot(context)
    X = world.camera.camera_pose(sub)
    roll = RigidTransform(RollPitchYaw(0, 0, 0.2), [0, 0, 0])
    X_BC = sub.get_abstract_parameter(0).get_value()
    world.camera.set_camera_pose_in_body(sub, X_BC @ roll)
    assert world.camera.camera_pose(sub).IsNearlyEqualTo(X @ roll, 1e-12)
    X_WM = world.camera.mirrors(sub)[0][0]
    world.camera.set_mirror_pose_in_body(
        sub, 0, RigidTransform([0.0, 0.01, 0.0])
    )
    moved = world.camera.mirrors(sub)[0][0]
    assert moved.IsNearlyEqualTo(X_WM @ RigidTransform([0, 0.01, 0]), 1e-12)
    pose = world.camera.get_body_pose_in_world_output_port().Eval(sub)
    assert pose.IsNearlyEqualTo(X @ roll, 1e-12)


def test_noise_depends_on_seed_and_time_alone(world):
    context = world.diagram.CreateDefaultContext()
    sub = world.camera.GetMyContextFromRoot(context)
    port = world.camera.get_color_image_output_port()
    clean = port.Eval(sub).data.copy()
    world.camera.set_effects(sub, ImageEffects(noise=4.0))
    assert world.camera.effects(sub).noise == 4.0
    noisy = port.Eval(sub).data.copy()
    assert (noisy.astype(int) - clean)[:, :, :3].std() == pytest.approx(
        4.0, rel=0.1
    )
    context.SetTime(0.1)
    later = port.Eval(sub).data.copy()
    assert np.any(later != noisy)
    world.camera.set_seed(sub, 5)
    assert np.any(port.Eval(sub).data != later)
    world.camera.set_seed(sub, 0)
    context.SetTime(0.0)
    np.testing.assert_array_equal(port.Eval(sub).data, noisy)


def test_a_mirrors_size_is_that_of_its_panel(world):
    builder = DiagramBuilder()
    plant, scene_graph = scene.add_scene(builder)
    camera = MirrorCamera.AddToBuilder(
        builder=builder,
        plant=plant,
        scene_graph=scene_graph,
        config=CameraConfig(frame="camera"),
        mirrors=[
            MirrorConfig("mirror0::mirror"),
            MirrorConfig("mirror0::mirror", height=0.1),
            MirrorConfig("robot::base"),
        ],
    )
    diagram = builder.Build()
    context = camera.GetMyContextFromRoot(diagram.CreateDefaultContext())
    with pytest.raises(InputError, match=r"mirrors\[2\]\.width"):
        camera.mirrors(context)
    camera._mirrors[2].width = camera._mirrors[2].height = 0.2
    sizes = [size for _, *size in camera.mirrors(context)]
    np.testing.assert_allclose(
        sizes, [scene.MIRROR_SIZE, [scene.MIRROR_SIZE[0], 0.1], [0.2, 0.2]]
    )


def test_tint_and_blur_change_the_reflection_only():
    world = World()
    world.set(yaw=-0.3)
    perfect = world.image()
    tinted = World()
    tinted.set(yaw=-0.3)
    tinted.camera._mirrors[0].tint = [0.5, 0.8, 0.8]
    tinted.camera._mirrors[0].blur = 1.5
    image = tinted.image()
    panel = int(world.plant.GetBodyByName("panel").index())
    mirror = world.labels() == panel
    np.testing.assert_array_equal(image[~mirror], perfect[~mirror])
    assert image[mirror][:, 0].mean() < 0.85 * perfect[mirror][:, 0].mean()


def test_settings_that_do_not_fit_are_named():
    builder = DiagramBuilder()
    plant, _ = scene.add_scene(builder)
    with pytest.raises(InputError, match=r"camera\.frame is 'head::eye'"):
        MirrorCamera(plant, CameraConfig(frame="head::eye"))
    with pytest.raises(InputError, match=r"camera\.width is 2"):
        MirrorCamera(plant, CameraConfig(frame="camera", width=2))
    with pytest.raises(InputError, match=r"mirrors\[0\]\.blur"):
        MirrorCamera(
            plant,
            CameraConfig(frame="camera"),
            [MirrorConfig("mirror0::mirror", blur=-1.0)],
        )
    with pytest.raises(InputError, match=r"lights\[0\]\.type"):
        RenderConfig(lights=[LightConfig(type="candle")]).check("rendering")


def test_two_cameras_stand_in_one_diagram():
    builder = DiagramBuilder()
    plant, scene_graph = scene.add_scene(builder, n_mirrors=1)
    cameras = [
        MirrorCamera.AddToBuilder(
            builder=builder,
            plant=plant,
            scene_graph=scene_graph,
            config=CameraConfig(frame="camera", fov_y=fov_y),
            mirrors=[MirrorConfig("mirror0::mirror", *scene.MIRROR_SIZE)],
            name=name,
        )
        for name, fov_y in (("wide", 1.3), ("narrow", 0.6))
    ]
    root = builder.Build().CreateDefaultContext()
    wide, narrow = (
        camera.get_color_image_output_port()
        .Eval(camera.GetMyContextFromRoot(root))
        .data.copy()
        for camera in cameras
    )
    assert wide.shape == narrow.shape
    assert np.any(wide != narrow)
