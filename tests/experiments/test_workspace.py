"""The drum's workspace, and that what it says is so."""

import numpy as np
import pytest

from drake_affetto.common.errors import InputError
from drake_affetto.experiments.workspace import (
    WorkspaceConfig,
    compute_workspace,
    usable_polygon,
)
from drake_affetto.geometry.optics import (
    PinholeCamera,
    disc_outline,
    points_in_frame,
    polygon_area,
    reflect_points,
)
from drake_affetto.perception.camera_model import Mirror, seen_in_mirror
from drake_affetto.scene import world
from drake_affetto.station.scenario import load_scenario

CONFIG = WorkspaceConfig(step=0.03)
CAMERA = PinholeCamera.from_fov(CONFIG.width, CONFIG.height, CONFIG.fov_y)


def project(X_WC, p_W):
    return CAMERA.project(points_in_frame(X_WC, p_W))


def disc(center, radius):
    return disc_outline(center, [0.0, 0.0, 1.0], radius)


@pytest.fixture(scope="module")
def workspace(built_scene):
    built_scene.reset()
    return compute_workspace(built_scene.plant, built_scene.context, CONFIG)


@pytest.fixture(scope="module")
def fine(built_scene):
    built_scene.reset()
    return compute_workspace(
        built_scene.plant, built_scene.context, WorkspaceConfig(step=0.01)
    )


@pytest.fixture(scope="module")
def coarse(built_scene):
    built_scene.reset()
    return compute_workspace(
        built_scene.plant, built_scene.context, WorkspaceConfig(step=0.06)
    )


def test_the_context_is_left_as_it_was(scene):
    plant, context = scene.plant, scene.context
    world.set_drum_position(plant, context, [0.3, 0.1])
    world.set_posture(plant, context, {"neck_yaw": 0.3})
    before = plant.GetPositions(context)
    compute_workspace(plant, context, WorkspaceConfig(step=0.1))
    assert np.all(plant.GetPositions(context) == before)
    assert world.get_drum_position(plant, context) == pytest.approx([0.3, 0.1])


def test_there_is_room_to_drum(workspace):
    assert workspace.usable.sum() * CONFIG.step**2 >= 0.06


def test_the_grid_covers_the_table_and_ends(workspace, scene):
    low, high = world.drum_limits(scene.plant, scene.context)
    assert workspace.x[0] == pytest.approx(low[0])
    assert workspace.y[0] == pytest.approx(low[1])
    assert high[0] - CONFIG.step <= workspace.x[-1] <= high[0]
    # The far corner of the table is beyond the arm, the near part is not.
    assert not workspace.reach[-1, -1]
    assert workspace.reach[1, len(workspace.y) // 3]


def _positions(workspace, mask):
    return [
        (i, j, np.array([workspace.x[i], workspace.y[j]]))
        for i, j in np.argwhere(mask)
    ]


def test_striking_postures_strike(workspace, scene):
    plant, context = scene.plant, scene.context
    low, high = world.joint_limits(plant, CONFIG.active_joints)
    gap = CONFIG.joint_margin * (high - low)
    palm = plant.GetFrameByName("right_palm")
    hand = world.hand_radius(plant, context)
    for i, j, xy in _positions(workspace, workspace.reach)[::7]:
        q = workspace.strike[i, j]
        assert np.all(q >= low + gap - 1e-9)
        assert np.all(q <= high - gap + 1e-9)
        world.set_drum_position(plant, context, xy)
        world.set_posture(
            plant, context, dict(zip(CONFIG.active_joints, q, strict=True))
        )
        X_WP = palm.CalcPoseInWorld(context)
        head = world.head_center_position(plant, context)
        aim = head + [0, 0, hand - CONFIG.press]
        assert np.linalg.norm(X_WP.translation() - aim) < 1e-3
        down = -X_WP.rotation().matrix()[2, 2]
        assert down > np.cos(CONFIG.palm_tilt)


def test_the_yaw_centers_the_marker(workspace, scene):
    plant, context = scene.plant, scene.context
    eye = plant.GetFrameByName("eye_camera")
    low, high = world.joint_limits(plant, [CONFIG.yaw_joint])
    for i, j, xy in _positions(workspace, workspace.sees)[::5]:
        yaw = workspace.yaw[i, j]
        assert low[0] < yaw < high[0]
        world.set_drum_position(plant, context, xy)
        world.set_posture(plant, context, {CONFIG.yaw_joint: yaw})
        X_WC = eye.CalcPoseInWorld(context).GetAsMatrix4()
        marker = world.marker_position(plant, context)
        pixel = project(X_WC, marker[None])[0]
        assert pixel == pytest.approx(workspace.pixels[i, j], abs=1e-6)
        assert pixel[0] == pytest.approx(0.5 * (CONFIG.width - 1), abs=1e-3)
        rim = disc(marker, world.marker_radius(plant, context))
        assert CAMERA.inside(project(X_WC, rim)).all()


def test_looking_into_the_mirror_the_drum_is_out_of_sight(workspace, scene):
    plant, context = scene.plant, scene.context
    world.set_posture(plant, context, CONFIG.mirror_posture)
    eye = plant.GetFrameByName("eye_camera")
    X_WC = eye.CalcPoseInWorld(context).GetAsMatrix4()
    X_WM = plant.GetFrameByName("mirror").CalcPoseInWorld(context)
    X_WM = X_WM.GetAsMatrix4()
    size = world.mirror_size(plant, context)
    region = load_scenario("drumming").drum_region
    hoop_radius = world.drum_radius(plant, context) + 0.004
    for i, j, xy in _positions(workspace, workspace.usable):
        if not region.contains(xy):
            continue
        world.set_drum_position(plant, context, xy)
        head = world.head_center_position(plant, context)
        for level in (head, head - [0, 0, 0.07]):
            hoop = disc(level, hoop_radius)
            assert not CAMERA.inside(project(X_WC, hoop)).any()
        marker = world.marker_position(plant, context)
        rim = disc(marker, world.marker_radius(plant, context))
        assert seen_in_mirror(X_WC[:3, 3], rim, Mirror(X_WM, *size)).all()
        pixels = project(X_WC, reflect_points(X_WM, rim))
        assert CAMERA.inside(pixels, CONFIG.edge).all()
        assert workspace.mirror_area[i, j] >= 100


def test_a_narrow_lens_and_an_averted_head_see_less(scene, coarse):
    config = WorkspaceConfig(
        step=0.06, fov_y=0.3, mirror_posture={"neck_yaw": -0.9}
    )
    less = compute_workspace(scene.plant, scene.context, config)
    assert less.sees.sum() < coarse.sees.sum()
    assert coarse.sees_mirror.any()
    assert not less.sees_mirror.any()


def test_with_two_joints_less_is_reached(scene, coarse):
    config = WorkspaceConfig(
        step=0.06, active_joints=["waist_yaw", "right_shoulder_flexion"]
    )
    few = compute_workspace(scene.plant, scene.context, config)
    assert few.reach.sum() < 0.3 * coarse.reach.sum()
    assert few.strike.shape[-1] == 2


@pytest.mark.parametrize(
    ("field", "value"),
    [
        ("step", 0.0),
        ("fov_y", 4.0),
        ("press", 0.1),
        ("yaw_joint", "neck_yaw"),
        ("direct_posture", {"neck_yaw": 2.0}),
        ("mirror_posture", {"neck": 0.0}),
    ],
)
def test_bad_settings_are_named(scene, field, value):
    config = WorkspaceConfig(**{field: value})
    with pytest.raises(InputError, match=f"workspace.{field}"):
        compute_workspace(scene.plant, scene.context, config)


def test_the_polygon_keeps_its_margin_and_leaves_little_out():
    rng = np.random.default_rng(3)
    x, y = np.arange(0.0, 0.4, 0.01), np.arange(-0.2, 0.2, 0.01)
    X, Y = np.meshgrid(x, y, indexing="ij")
    for _ in range(5):
        center, radius = rng.uniform([0.15, -0.05], [0.25, 0.05]), 0.12
        mask = np.hypot(X - center[0], Y - center[1]) < radius
        corners = usable_polygon(x, y, mask, margin=0.015)
        away = np.linalg.norm(corners - center, axis=1)
        # A place of the grid stands for a square of 1 cm.
        assert np.all(away < radius - 0.015 + 0.008)
        assert polygon_area(corners) > np.pi * (radius - 0.035) ** 2
    assert len(usable_polygon(x, y, np.zeros(X.shape, bool), 0.01)) == 0


def test_the_scenarios_region_is_usable_with_its_margin(fine, scene):
    corners = load_scenario("drumming").drum_region.corners
    assert polygon_area(corners) >= 0.06
    half = 0.5 * (fine.x[1] - fine.x[0])
    edge = np.concatenate(
        [
            np.linspace(a, b, 30)
            for a, b in zip(corners, np.roll(corners, -1, axis=0), strict=True)
        ]
    )
    for direction in np.linspace(0.0, 2.0 * np.pi, 8, endpoint=False):
        # The grid's squares are known to half a step.
        step = [np.cos(direction), np.sin(direction)]
        places = edge + (0.015 - half) * np.array(step)
        i = np.rint((places[:, 0] - fine.x[0]) / (2.0 * half)).astype(int)
        j = np.rint((places[:, 1] - fine.y[0]) / (2.0 * half)).astype(int)
        assert np.all(fine.usable[i, j])
