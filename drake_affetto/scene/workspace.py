"""Where on the table the drum can stand to be drummed, and to be seen.

For a grid of positions of the drum: can the palm strike the head from above,
does the camera see the marker once the upper body has turned to it, and does
it see the marker in the mirror from a fixed yaw.
`analysis/experiments/workspace.py` draws the result.
"""

from collections.abc import Mapping
import dataclasses

import numpy as np
from pydrake.multibody.plant import MultibodyPlant
from pydrake.systems.framework import Context

from drake_affetto.common.errors import require, require_range
from drake_affetto.geometry.kinematics import SerialChain, solve_position
from drake_affetto.scene import world
from drake_affetto.scene.sight import (
    View,
    disc,
    on_panel,
    polygon_area,
    reflect,
)

Array = np.ndarray

# What may touch what when the hand strikes.
_STRIKE = {"affetto::right_hand", "drum::head"}


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
    """What holds at each position (x[i], y[j]) of the drum's centre.

    Attributes:
        x: (nx,) world x [m].
        y: (ny,) world y [m].
        reach: (nx, ny), the hand can strike the head from above, starting
            from the direct posture turned to the drum.
        reach_mirror: the same, starting from the mirror posture.
        sees: the whole marker is in the image, before and after the upper
            body has turned to it; then the mirror is out of the image.
        sees_mirror: the whole marker is in the mirror's image, large enough.
        yaw: (nx, ny) yaw [rad] that centres the marker; NaN if none does.
        pixels: (nx, ny, 2) the marker's centre in the image, once centred.
        mirror_pixels: (nx, ny, 2) the same in the mirror, from the fixed yaw.
        mirror_area: (nx, ny) area [px²] of the marker in the mirror.
        strike: (nx, ny, n) posture [rad] of the active joints with the hand
            pressed into the head.
    """

    x: Array
    y: Array
    reach: Array
    reach_mirror: Array
    sees: Array
    sees_mirror: Array
    yaw: Array
    pixels: Array
    mirror_pixels: Array
    mirror_area: Array
    strike: Array

    @property
    def usable(self) -> Array:
        """(nx, ny), where direct and mirrored drumming are both possible."""
        return self.reach & self.reach_mirror & self.sees & self.sees_mirror


def _full(
    chain: SerialChain, default: Mapping[str, float], change: Mapping
) -> Array:
    return chain.posture({**default, **change})


def _centring_yaw(
    chain: SerialChain, posture: Array, yaw_index: int, targets: Array
) -> Array:
    """Yaw (m,) [rad] that centres targets (m, 3) left to right, else NaN."""

    def sideways(yaw: Array) -> Array:
        q = np.tile(posture, (len(targets), 1))
        q[:, yaw_index] = yaw
        X_WC = chain.pose(q)
        return np.einsum("mi,mi->m", targets - X_WC[:, :3, 3], X_WC[:, :3, 0])

    low = np.full(len(targets), chain.lower[yaw_index])
    high = np.full(len(targets), chain.upper[yaw_index])
    # Turning left moves the target to the right in the image.
    bracketed = (sideways(low) <= 0) & (sideways(high) >= 0)
    for _ in range(40):
        middle = 0.5 * (low + high)
        left = sideways(middle) < 0
        low, high = np.where(left, middle, low), np.where(left, high, middle)
    return np.where(bracketed, 0.5 * (low + high), np.nan)


def _panel(X_WM: Array, size: Array, frame: float = 0.015) -> Array:
    """Points (k, 3) in world all over a mirror and its frame."""
    half = 0.5 * size + frame
    u, v = np.meshgrid(np.linspace(-1, 1, 21), np.linspace(-1, 1, 21))
    flat = np.stack([half[0] * u, half[1] * v, 0 * u], axis=-1).reshape(-1, 3)
    return flat @ X_WM[:3, :3].T + X_WM[:3, 3]


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
        plant: with a world (`world.add_world`), finalized and connected to
            its SceneGraph.
        context: the plant's, in a root context; its posture and the drum's
            position are changed and put back.

    Raises:
        InputError: for a configuration or posture that does not fit.
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
    rise = world.marker_position(plant, context) - [*old_xy, 0.0]
    marker = np.column_stack([xy, np.full(len(xy), rise[2])])
    head_z = world.head_center_position(plant, context)[2]
    default = {
        name: world.get_joint(plant, name).get_default_angle()
        for name in world.joint_names(plant)
    }

    # Sight
    X_WM = plant.GetFrameByName("mirror").CalcPoseInWorld(context)
    X_WM = X_WM.GetAsMatrix4()
    panel = world.mirror_size(plant, context)
    eye = world.serial_chain(plant, "eye_camera")
    view = View(config.width, config.height, config.fov_y)
    rim = disc(marker, world.marker_radius(plant, context))
    posture = _full(eye, default, config.direct_posture)
    turn = eye.names.index(config.yaw_joint)
    yaw = _centring_yaw(eye, posture, turn, marker)
    gap = config.joint_margin * (eye.upper[turn] - eye.lower[turn])
    turned = np.tile(posture, (len(xy), 1))
    turned[:, turn] = np.nan_to_num(yaw)
    X_WC = eye.pose(turned)
    pixels = view.project(X_WC, marker[:, None])[:, 0]
    with np.errstate(invalid="ignore"):
        in_range = (yaw > eye.lower[turn] + gap) & (yaw < eye.upper[turn] - gap)
    sees = (
        in_range
        & view.inside(view.project(X_WC, rim), config.edge).all(axis=-1)
        & view.inside(view.project(eye.pose(posture), rim)).all(axis=-1)
        & ~view.inside(view.project(X_WC, _panel(X_WM, panel))).any(axis=-1)
    )
    X_WC = eye.pose(_full(eye, default, config.mirror_posture))
    image = reflect(X_WM, rim)
    rim_pixels = view.project(X_WC, image)
    area = polygon_area(rim_pixels)
    with np.errstate(invalid="ignore"):
        sees_mirror = (
            view.inside(rim_pixels, config.edge).all(axis=-1)
            & on_panel(X_WM, panel, X_WC[:3, 3], rim).all(axis=-1)
            & (area >= config.area)
        )
    mirror_pixels = view.project(X_WC, reflect(X_WM, marker))

    # Reach
    palm = world.serial_chain(plant, "right_palm")
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
    hand = world.hand_radius(plant, context)
    heights = (hand - config.press, hand + config.hover)
    turn = palm.names.index(config.yaw_joint)
    reaches: list[Array] = []
    strike = np.full((*shape, len(config.active_joints)), np.nan)
    for change in (config.direct_posture, config.mirror_posture):
        rest = np.tile(_full(palm, default, change), (len(xy), 1))
        if change is config.direct_posture:
            rest[:, turn] = np.where(np.isnan(yaw), rest[:, turn], yaw)
        reach = np.ones(len(xy), dtype=bool)
        for height in heights:
            target = np.column_stack([xy, np.full(len(xy), head_z + height)])
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
            if not reaches and height == heights[0]:
                active = palm.indices(config.active_joints)
                strike = q[:, active].reshape(*shape, -1)
        reaches.append(reach)
    world.set_posture(plant, context, old_posture)
    world.set_drum_position(plant, context, old_xy)
    return Workspace(
        x=x,
        y=y,
        reach=reaches[0].reshape(shape),
        reach_mirror=reaches[1].reshape(shape),
        sees=sees.reshape(shape),
        sees_mirror=sees_mirror.reshape(shape),
        yaw=yaw.reshape(shape),
        pixels=pixels.reshape(*shape, 2),
        mirror_pixels=mirror_pixels.reshape(*shape, 2),
        mirror_area=area.reshape(shape),
        strike=strike,
    )


def largest_box(
    x: Array, y: Array, mask: Array, margin: float = 0.0
) -> tuple[Array, Array]:
    """The largest box, by area, of which every grid point is in `mask`.

    Args:
        x: (nx,) grid.
        y: (ny,) grid.
        mask: (nx, ny).
        margin: taken off on all four sides [m].

    Returns:
        Lower and upper corner, (2,) each; both NaN where there is none.
    """
    best = (0.0, 0, 0, 0, 0)
    filled = np.zeros(len(y), dtype=int)
    for i in range(len(x)):
        filled = np.where(mask[i], filled + 1, 0)
        for j in range(len(y)):
            depth = filled[j]
            for k in range(j, -1, -1):
                depth = min(depth, filled[k])
                if depth == 0:
                    break
                first = i - depth + 1
                size = (x[i] - x[first]) * (y[j] - y[k])
                if size > best[0]:
                    best = (size, first, i, k, j)
    size, i0, i1, j0, j1 = best
    lower = np.array([x[i0], y[j0]]) + margin
    upper = np.array([x[i1], y[j1]]) - margin
    if size == 0 or np.any(upper <= lower):
        return np.full(2, np.nan), np.full(2, np.nan)
    return lower, upper
