"""Where on the table the drum can stand to be drummed, and to be seen.

For a grid of positions of the drum: can the palm strike the head from above,
does the camera see the marker once the upper body has turned to it, and does
it see the marker in the mirror from a fixed yaw.
`analysis/experiments/workspace.py` draws the result.
"""

from collections.abc import Mapping
import dataclasses

import cv2
import numpy as np
from pydrake.multibody.plant import MultibodyPlant
from pydrake.systems.framework import Context

from drake_affetto.common.errors import require, require_range
from drake_affetto.common.typing import Array, Mask
from drake_affetto.geometry.kinematics import SerialChain, solve_position
from drake_affetto.geometry.optics import (
    PinholeCamera,
    disc_outline,
    points_in_frame,
    polygon_area,
    reflect_points,
)
from drake_affetto.perception.camera_model import (
    CameraModel,
    Mirror,
    seen_in_mirror,
)
from drake_affetto.scene import world
from drake_affetto.scene.parts import find_frame

# Bodies that may touch each other when the hand strikes.
_STRIKE = {"affetto::right_hand", "drum::head"}

_UP = np.array([0.0, 0.0, 1.0])


@dataclasses.dataclass
class WorkspaceConfig:
    """What is asked of a position of the drum.

    Attributes:
        active_joints: the joints that may move to reach it.
        yaw_joint: the one that turns the gaze.
        direct_posture: joint -> angle [rad] while looking straight at the
            drum, where it differs from the plant's default posture.
        mirror_posture: the same while looking into the mirror; the yaw that
            it gives is the fixed one.
        width: of the image [pixels].
        height: of the image [pixels].
        fov_y: vertical field of view [rad].
        step: of the grid [m].
        press: how deep the hand is pressed into the head [m].
        hover: height of the palm's lowest point above the head, before and
            after the stroke [m].
        joint_margin: part of each joint's range to keep off its limits.
        palm_tilt: greatest angle between the palm's normal and straight down
            as it strikes [rad].
        edge: least distance of the marker's rim from the image's edge
            [pixels].
        area: least area of the marker in the mirror [px²].
        arm_weight, trunk_weight: how freely arm and trunk move.
    """

    active_joints: list[str] = dataclasses.field(
        default_factory=lambda: list(world.ACTIVE_JOINTS)
    )
    yaw_joint: str = "waist_yaw"
    direct_posture: dict[str, float] = dataclasses.field(default_factory=dict)
    mirror_posture: dict[str, float] = dataclasses.field(
        default_factory=lambda: {
            "waist_yaw": 0.12,
            "neck_yaw": 0.72,
            "neck_pitch": -0.10,
        }
    )
    width: int = 320
    height: int = 240
    fov_y: float = 0.8188
    step: float = 0.01
    press: float = 0.015
    hover: float = 0.06
    joint_margin: float = 0.04
    palm_tilt: float = 1.0
    edge: float = 3.0
    area: float = 100.0
    arm_weight: float = 1.0
    trunk_weight: float = 0.15

    def check(self, where: str) -> None:
        """Raises InputError naming the first field that does not fit."""
        require(
            self.yaw_joint in self.active_joints,
            f"{where}.yaw_joint",
            self.yaw_joint,
            "one of the active joints",
        )
        for name, low, high in (
            ("width", 16, 4096),
            ("height", 16, 4096),
            ("fov_y", 0.05, 2.6),
            ("step", 1e-3, 0.1),
            ("press", 0.0, 0.025),
            ("hover", 0.0, 0.2),
            ("joint_margin", 0.0, 0.4),
            ("palm_tilt", 0.0, np.pi),
            ("edge", 0.0, 1000.0),
            ("area", 0.0, 1e6),
            ("arm_weight", 1e-6, 10.0),
            ("trunk_weight", 0.0, 10.0),
        ):
            require_range(f"{where}.{name}", getattr(self, name), low, high)


@dataclasses.dataclass(frozen=True)
class Workspace:
    """What holds at each position (x[i], y[j]) of the drum's center.

    Attributes:
        x: (nx,) world x [m].
        y: (ny,) world y [m].
        reach: (nx, ny), the hand can strike the head from above, starting
            from the direct posture turned to the drum.
        reach_mirror: the same, starting from the mirror posture.
        sees: the whole marker is in the image once the upper body has turned
            to it; a gaze that searches finds it from anywhere.
        sees_mirror: the whole marker is in the mirror's image, large enough.
        yaw: (nx, ny) yaw [rad] that centers the marker; NaN if none does.
        pixels: (nx, ny, 2) the marker's center in the image, once centered.
        mirror_pixels: (nx, ny, 2) the same in the mirror, from the fixed yaw.
        mirror_area: (nx, ny) area [px²] of the marker in the mirror.
        strike: (nx, ny, n) posture [rad] of the active joints with the hand
            pressed into the head.
    """

    x: Array
    y: Array
    reach: Mask
    reach_mirror: Mask
    sees: Mask
    sees_mirror: Mask
    yaw: Array
    pixels: Array
    mirror_pixels: Array
    mirror_area: Array
    strike: Array

    @property
    def usable(self) -> Mask:
        """(nx, ny), where direct and mirrored drumming are both possible."""
        return self.reach & self.reach_mirror & self.sees & self.sees_mirror


def _collides(plant: MultibodyPlant, context: Context) -> bool:
    """Whether anything but the hand and the drum's head touches."""
    query = plant.get_geometry_query_input_port().Eval(context)
    inspector = query.inspector()

    def body_name(geometry) -> str:
        frame = inspector.GetFrameId(geometry)
        return plant.GetBodyFromFrameId(frame).scoped_name()

    return any(
        {str(body_name(pair.id_A)), str(body_name(pair.id_B))} != _STRIKE
        for pair in query.ComputePointPairPenetration()
    )


def compute_workspace(
    plant: MultibodyPlant, context: Context, config: WorkspaceConfig
) -> Workspace:
    """Examines a grid of drum positions over the whole table.

    Args:
        plant: Plant with a world (`world.add_world`), finalized and connected
            to its SceneGraph.
        context: Context of the plant, in a root context; its posture and the
            drum's position are changed and put back.
        config: What is asked of a position.

    Raises:
        InputError: If the configuration or a posture does not fit.
    """
    config.check("workspace")
    for name in ("direct_posture", "mirror_posture"):
        world.check_posture(plant, getattr(config, name), f"workspace.{name}")
    lower, upper = world.table_extents(plant, context)
    radius = world.drum_radius(plant, context)
    x = np.arange(lower[0] + radius, upper[0] - radius + 1e-9, config.step)
    y = np.arange(lower[1] + radius, upper[1] - radius + 1e-9, config.step)
    shape = (len(x), len(y))
    xy = np.stack(np.meshgrid(x, y, indexing="ij"), axis=-1).reshape(-1, 2)
    old_xy = world.get_drum_position(plant, context)
    old_posture = world.get_posture(plant, context)
    default = {
        name: world.get_joint(plant, name).get_default_angle()
        for name in world.joint_names(plant)
    }
    direct = default | config.direct_posture
    facing = default | config.mirror_posture
    seen = _see(plant, context, config, xy, direct, facing)
    turned = _Postures(direct, config.yaw_joint, seen.yaw)
    reach, strike = _reach(plant, context, config, xy, turned)
    reach_mirror, _ = _reach(plant, context, config, xy, _Postures(facing))
    world.set_posture(plant, context, old_posture)
    world.set_drum_position(plant, context, old_xy)
    return Workspace(
        x=x,
        y=y,
        reach=reach.reshape(shape),
        reach_mirror=reach_mirror.reshape(shape),
        sees=seen.direct.reshape(shape),
        sees_mirror=seen.mirrored.reshape(shape),
        yaw=seen.yaw.reshape(shape),
        pixels=seen.pixels.reshape(*shape, 2),
        mirror_pixels=seen.mirror_pixels.reshape(*shape, 2),
        mirror_area=seen.mirror_area.reshape(shape),
        strike=strike.reshape(*shape, -1),
    )


@dataclasses.dataclass(frozen=True)
class _Seen:
    """How the marker is seen at m positions of the drum.

    Attributes:
        direct: Whether it is seen well directly (m,).
        mirrored: Whether it is seen well in the mirror (m,).
        yaw: Yaw that centers it (m,), rad; NaN if none does.
        pixels: Its center once centered (m, 2), px.
        mirror_pixels: Its center in the mirror (m, 2), px.
        mirror_area: Its area in the mirror (m,), px².
    """

    direct: Mask
    mirrored: Mask
    yaw: Array
    pixels: Array
    mirror_pixels: Array
    mirror_area: Array


def _see(
    plant: MultibodyPlant,
    context: Context,
    config: WorkspaceConfig,
    xy: Array,
    direct: Mapping[str, float],
    facing: Mapping[str, float],
) -> _Seen:
    """How the marker is seen in both postures."""
    eye = world.serial_chain(plant, "affetto::eye_camera")
    rise = world.marker_position(plant, context)[2]
    radius = world.marker_radius(plant, context)
    camera = PinholeCamera.from_fov(config.width, config.height, config.fov_y)
    model = CameraModel.from_chain(
        camera, eye, config.yaw_joint, dict(direct), rise, radius
    )
    marker = model.marker(xy)
    rim = marker[:, None] + disc_outline(np.zeros(3), _UP, radius)
    X_WM = find_frame(plant, "mirror::mirror").CalcPoseInWorld(context)
    X_WM = X_WM.GetAsMatrix4()
    size = world.mirror_size(plant, context)

    def project(X_WC: Array, p_W: Array) -> Array:
        return camera.project(points_in_frame(X_WC, p_W))

    # Directly, before and after the upper body has turned to the marker.
    yaw = model.centering_yaw(marker)
    gap = config.joint_margin * (model.yaw_max - model.yaw_min)
    with np.errstate(invalid="ignore"):
        yaw[(yaw < model.yaw_min) | (yaw > model.yaw_max)] = np.nan
        in_range = (yaw > model.yaw_min + gap) & (yaw < model.yaw_max - gap)
    X_WC = np.stack([model.camera_pose(each) for each in np.nan_to_num(yaw)])
    sees = in_range & camera.inside(project(X_WC, rim), config.edge).all(
        axis=-1
    )
    # In the mirror, from the posture that faces it.
    facing_eye = eye.pose(eye.posture(facing))
    rim_pixels = project(facing_eye, reflect_points(X_WM, rim))
    area = polygon_area(rim_pixels)
    mirror = Mirror(X_WM, *size)
    with np.errstate(invalid="ignore"):
        sees_mirror = (
            camera.inside(rim_pixels, config.edge).all(axis=-1)
            & seen_in_mirror(facing_eye[:3, 3], rim, mirror).all(axis=-1)
            & (area >= config.area)
        )
    return _Seen(
        direct=sees,
        mirrored=sees_mirror,
        yaw=yaw,
        pixels=project(X_WC, marker[:, None])[:, 0],
        mirror_pixels=project(facing_eye, reflect_points(X_WM, marker)),
        mirror_area=area,
    )


@dataclasses.dataclass(frozen=True)
class _Postures:
    """Postures from which the hand sets out, one for each position.

    Attributes:
        posture: Angle of each joint, rad.
        turning: Joint that has turned to the drum; empty for none.
        angle: Its angle at each position (m,), rad; NaN where it stays.
    """

    posture: Mapping[str, float]
    turning: str = ""
    angle: Array | None = None

    def of(self, chain: SerialChain, count: int) -> Array:
        """Postures (count, n) of the chain's joints, rad."""
        rest = np.tile(chain.posture(self.posture), (count, 1))
        if self.angle is not None:
            turn = chain.names.index(self.turning)
            rest[:, turn] = np.where(
                np.isnan(self.angle), rest[:, turn], self.angle
            )
        return rest


def _reach(
    plant: MultibodyPlant,
    context: Context,
    config: WorkspaceConfig,
    xy: Array,
    postures: _Postures,
) -> tuple[Mask, Array]:
    """Where the hand can strike the head from above.

    Returns:
        Whether it can (m,), and the striking postures of the active joints
        (m, n), rad.
    """
    palm = world.serial_chain(plant, "affetto::right_palm")
    weights = np.array(
        [
            0.0
            if name not in config.active_joints
            else config.arm_weight
            if name.startswith("right_")
            else config.trunk_weight
            for name in palm.names
        ]
    )
    middle = 0.5 * (palm.lower + palm.upper)
    rest = postures.of(palm, len(xy))
    head = world.head_center_position(plant, context)[2]
    hand = world.hand_radius(plant, context)
    reach = np.ones(len(xy), dtype=bool)
    struck = []
    # Pressed into the head, and above it before and after the stroke.
    for height in (hand - config.press, hand + config.hover):
        target = np.column_stack([xy, np.full(len(xy), head + height)])
        q, left = solve_position(
            palm, target, rest, weights, margin=config.joint_margin
        )
        # A joint that stuck at its limit may need another beginning.
        again = np.flatnonzero(left > 1e-3)
        q[again], left[again] = solve_position(
            palm,
            target[again],
            rest[again],
            weights,
            start=np.where(weights > 0, middle, rest[again]),
            margin=config.joint_margin,
            comfort=0.0,
        )
        down = -palm.pose(q)[:, 2, 2]
        reach &= (left < 1e-3) & (down > np.cos(config.palm_tilt))
        for i in np.flatnonzero(reach):
            for name, angle in zip(palm.names, q[i], strict=True):
                world.get_joint(plant, name).set_angle(context, angle)
            world.set_drum_position(plant, context, xy[i])
            reach[i] = not _collides(plant, context)
        struck.append(q[:, palm.indices(config.active_joints)])
    return reach, struck[0]


def usable_polygon(
    x: Array, y: Array, mask: Mask, margin: float, tolerance: float = 0.008
) -> Array:
    """A polygon around the largest part of a mask, a margin inside its border.

    Args:
        x: (nx,) grid, even [m].
        y: (ny,) grid, as even as x [m].
        mask: (nx, ny).
        margin: least distance of the polygon from where the mask ends [m].
        tolerance: how far a corner may be cut [m], inwards or outwards; the
            margin is kept all the same.

    Returns:
        Corners (k, 2) in order [m]; none where nothing is left.
    """
    fine = 10
    step = (x[1] - x[0]) / fine
    # Each place of the grid stands for a square; one more all around is empty.
    squares = np.pad(mask, 1).astype(np.uint8)
    image = np.kron(squares, np.ones((fine, fine), np.uint8))
    distance = cv2.distanceTransform(image, cv2.DIST_L2, cv2.DIST_MASK_PRECISE)
    kept = (distance * step >= margin + tolerance).astype(np.uint8)
    outlines, _ = cv2.findContours(
        kept, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE
    )
    if not outlines:
        return np.zeros((0, 2))
    largest = max(outlines, key=cv2.contourArea)
    corners = cv2.approxPolyDP(largest, tolerance / step, closed=True)[:, 0]
    # Columns of the image run along y.
    place = (corners[:, ::-1] - 1.5 * fine + 0.5) * step
    return np.asarray(place + [x[0], y[0]])
