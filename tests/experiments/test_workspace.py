"""The drum's workspace, and that what it says is so."""

import numpy as np
import pytest

from drake_affetto.common.errors import InputError
from drake_affetto.experiments.workspace import (
    WorkspaceConfig,
    compute_workspace,
    largest_box,
)
from drake_affetto.geometry.optics import (
    PinholeCamera,
    disc_outline,
    points_in_frame,
    reflect_points,
)
from drake_affetto.perception.camera_model import Mirror, seen_in_mirror
from drake_affetto.scene import world

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
    low, high = largest_box(workspace.x, workspace.y, workspace.usable)
    assert high[0] - low[0] >= 0.12
    assert high[1] - low[1] >= 0.14


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


def test_looking_down_the_mirror_is_out_of_sight(workspace, scene):
    """No light from the mirror disturbs the direct view, however it turns."""
    plant, context = scene.plant, scene.context
    eye = plant.GetFrameByName("eye_camera")
    X_WM = plant.GetFrameByName("mirror").CalcPoseInWorld(context)
    half = 0.5 * world.mirror_size(plant, context) + 0.015
    u, v = np.meshgrid(np.linspace(-1, 1, 21), np.linspace(-1, 1, 21))
    panel = np.stack([half[0] * u, half[1] * v, 0 * u]).reshape(3, -1)
    points = (X_WM @ panel).T
    for yaw in workspace.yaw[workspace.usable]:
        world.set_posture(plant, context, {CONFIG.yaw_joint: yaw})
        X_WC = eye.CalcPoseInWorld(context).GetAsMatrix4()
        assert not CAMERA.inside(project(X_WC, points)).any()


def test_looking_into_the_mirror_the_drum_is_out_of_sight(workspace, scene):
    plant, context = scene.plant, scene.context
    world.set_posture(plant, context, CONFIG.mirror_posture)
    eye = plant.GetFrameByName("eye_camera")
    X_WC = eye.CalcPoseInWorld(context).GetAsMatrix4()
    X_WM = plant.GetFrameByName("mirror").CalcPoseInWorld(context)
    X_WM = X_WM.GetAsMatrix4()
    size = world.mirror_size(plant, context)
    for i, j, xy in _positions(workspace, workspace.usable):
        world.set_drum_position(plant, context, xy)
        head = world.head_center_position(plant, context)
        for level in (head, head - [0, 0, 0.07]):
            hoop = disc(level, 0.068)
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


def test_largest_box_against_all_boxes():
    rng = np.random.default_rng(3)
    x, y = np.linspace(0, 1, 6), np.linspace(0, 2, 7)
    for _ in range(20):
        mask = rng.random((6, 7)) < 0.7
        best = max(
            (x[b] - x[a]) * (y[d] - y[c])
            for a in range(6)
            for b in range(a, 6)
            for c in range(7)
            for d in range(c, 7)
            if mask[a : b + 1, c : d + 1].all()
        )
        low, high = largest_box(x, y, mask)
        if best > 0:
            assert np.prod(high - low) == pytest.approx(best)
            inside = (
                (x[:, None] >= low[0])
                & (x[:, None] <= high[0])
                & (y >= low[1])
                & (y <= high[1])
            )
            assert mask[inside].all()
        shrunk, grown = largest_box(x, y, mask, margin=0.05)
        if not np.isnan(shrunk).any():
            assert shrunk == pytest.approx(low + 0.05)
            assert grown == pytest.approx(high - 0.05)


def test_no_box_in_an_empty_mask():
    low, high = largest_box(np.arange(3.0), np.arange(3.0), np.zeros((3, 3)))
    assert np.isnan(low).all()
    assert np.isnan(high).all()
