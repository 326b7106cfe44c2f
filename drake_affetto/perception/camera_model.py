"""What the robot's camera sees of the marker, by geometry alone.

The camera turns with one joint, the yaw of the upper body; the other joints
stand. With A and B constant, X_WC = A · Rot(axis, yaw) · B. From that follow
the yaw at which the marker is centered, the task parameters of the direct and
of the mirrored view, and where the marker lies if it is seen at a pixel.
"""

from collections.abc import Sequence
import dataclasses

import numpy as np

from drake_affetto.common.typing import Array, Mask
from drake_affetto.geometry import optics
from drake_affetto.geometry.kinematics import SerialChain
from drake_affetto.geometry.optics import Camera
from drake_affetto.perception.blob import BlobCalibration


@dataclasses.dataclass(frozen=True)
class Mirror:
    """A planar mirror: pose X_WM (4, 4), z its normal, and its size [m].

    Attributes:
        X_WM: Pose in the world (4, 4).
        width: Width of the glass, m.
        height: Height of the glass, m.
    """

    X_WM: Array
    width: float
    height: float


@dataclasses.dataclass(frozen=True)
class MarkerImage:
    """One image of the marker.

    Attributes:
        uv: centroid (2,) of its outline [pixels]; NaN if behind the camera.
        area: area [pixels²] of the whole outline, as if nothing cut it.
        whole: part of the outline that is within the image and, if mirrored,
            within the mirror; 1 if all of it.
    """

    uv: Array
    area: float
    whole: float


@dataclasses.dataclass(frozen=True)
class CameraModel:
    """The camera on its turning joint, and the marker.

    Attributes:
        camera: geometry of the image.
        X_WA: pose (4, 4) of the joint's frame at yaw 0.
        axis: unit vector (3,) of the joint's axis in A.
        X_AC: pose (4, 4) of the camera in A at yaw 0.
        marker_height: height [m] of the marker's center in W; it lies level.
        marker_radius: its radius [m].
        yaw_min: lower limit [rad] of the joint.
        yaw_max: upper limit [rad].
    """

    camera: Camera
    X_WA: Array
    axis: Array
    X_AC: Array
    marker_height: float
    marker_radius: float
    yaw_min: float = -np.pi
    yaw_max: float = np.pi

    @classmethod
    def from_chain(
        cls,
        camera: Camera,
        chain: SerialChain,
        yaw_joint: str,
        posture: dict[str, float],
        marker_height: float,
        marker_radius: float,
        X_FC: Array | None = None,
    ) -> "CameraModel":
        """Takes the camera's chain of joints apart at the yaw joint.

        Args:
            camera: geometry of the image.
            chain: joints from the world to the camera's frame F.
            yaw_joint: the one that turns.
            posture: joint -> angle [rad] of all others.
            marker_height: height [m] of the marker in W.
            marker_radius: its radius [m].
            X_FC: pose of the camera in F.
        """
        index = chain.names.index(yaw_joint)
        q = chain.posture(posture)
        q[index] = 0.0
        X_WF = chain.pose(q)
        X_WA = np.eye(4)
        for i in range(index):
            X_WA = X_WA @ chain.X_PJ[i] @ _turn(chain.axes[i], q[i])
        X_WA = X_WA @ chain.X_PJ[index]
        X_WC = X_WF if X_FC is None else X_WF @ X_FC
        return cls(
            camera,
            X_WA,
            np.asarray(chain.axes[index], dtype=float),
            optics.invert_pose(X_WA) @ X_WC,
            marker_height,
            marker_radius,
            float(chain.lower[index]),
            float(chain.upper[index]),
        )

    def camera_pose(self, yaw: float) -> Array:
        """X_WC (4, 4) at a yaw [rad]."""
        return self.X_WA @ _turn(self.axis, yaw) @ self.X_AC

    def marker(self, xy: Array) -> Array:
        """p_W (..., 3) of the marker's center over a place (..., 2)."""
        xy = np.asarray(xy, dtype=float)
        z = np.full((*xy.shape[:-1], 1), self.marker_height)
        return np.concatenate([xy, z], axis=-1)

    def view(
        self, xy: Array, yaw: float, mirror: Mirror | None = None
    ) -> MarkerImage:
        """The marker's image, seen directly or in a mirror.

        Args:
            mirror: Mirror to look into; None looks directly.
        """
        X_WC = self.camera_pose(yaw)
        return view_disc(
            self.camera,
            X_WC,
            self.marker(xy),
            np.array([0.0, 0.0, 1.0]),
            self.marker_radius,
            mirror,
        )

    def image_of(
        self, xy: Array, yaw: float, mirror: Mirror | None = None
    ) -> Array:
        """Pixels (n, 2) of points at the marker's level over xy (n, 2).

        NaN where a point is behind the camera or not within the mirror.

        Args:
            mirror: Mirror to look into; None looks directly.
        """
        p_W = self.marker(xy)
        X_WC = self.camera_pose(yaw)
        seen = p_W
        if mirror is not None:
            seen = optics.reflect_points(mirror.X_WM, p_W)
        uv = self.camera.project(
            optics.transform_points(optics.invert_pose(X_WC), seen)
        )
        if mirror is not None:
            uv[~seen_in_mirror(X_WC[:3, 3], p_W, mirror)] = np.nan
        return uv

    def centering_yaw(self, p_W: Array) -> Array:
        """The yaw [rad] at which points (..., 3) are at the image's middle u.

        In closed form for a pinhole, whose pixels of equal u are a plane
        through the camera: with the point in the joint's frame turned by
        -yaw, a·cos(yaw) + b·sin(yaw) + c = 0. The root with the point before
        the camera is taken; NaN where there is none. For the fisheye the same
        plane is that of its middle column.
        """
        p_A = optics.transform_points(optics.invert_pose(self.X_WA), p_W)
        # The plane of the middle column: n·p_C = 0.
        middle = self.camera.image_center
        above, below = self.camera.direction(
            np.stack([middle - [0, 20.0], middle + [0, 20.0]])
        )
        n_A = self.X_AC[:3, :3] @ np.cross(above, below)
        origin = self.X_AC[:3, 3]
        axis = self.axis
        along = p_A @ axis
        across = p_A - along[..., None] * axis
        a = across @ n_A
        b = -np.cross(axis, across) @ n_A
        c = along * (axis @ n_A) - origin @ n_A
        size = np.hypot(a, b)
        with np.errstate(invalid="ignore"):
            spread = np.arccos(-c / size)
        base = np.arctan2(b, a)
        best = np.full(np.shape(a), np.nan)
        for candidate in (base + spread, base - spread):
            yaw = np.mod(candidate + np.pi, 2 * np.pi) - np.pi
            turned = turn_points(self.axis, -yaw, p_A)
            p_C = optics.transform_points(optics.invert_pose(self.X_AC), turned)
            good = (p_C[..., 2] > 0) & ~(np.abs(best) <= np.abs(yaw))
            best = np.where(good, yaw, best)
        return best

    def direct_pixels(self, xy: Array) -> tuple[Array, Array]:
        """(yaw (n,), uv (n, 2)) once the marker at xy (n, 2) is centered.

        What is centered, as by the gaze servo, is the centroid of the
        marker's image, which is not its center's image.
        """
        xy = np.atleast_2d(np.asarray(xy, dtype=float))
        yaws = self.centering_yaw(self.marker(xy))
        pixels = np.full((len(xy), 2), np.nan)
        for i, place in enumerate(xy):
            if not np.isfinite(yaws[i]):
                continue
            for _ in range(4):  # Newton on the centroid's u.
                uv = self.view(place, yaws[i]).uv
                ahead = self.view(place, yaws[i] + 1e-4).uv
                slope = (ahead[0] - uv[0]) / 1e-4
                yaws[i] -= (uv[0] - self.camera.image_center[0]) / slope
            pixels[i] = self.view(place, yaws[i]).uv
        outside = (yaws < self.yaw_min) | (yaws > self.yaw_max)
        yaws[outside] = np.nan
        pixels[outside] = np.nan
        return yaws, pixels

    def direct_task_parameters(
        self, xy: Array, calibration: BlobCalibration
    ) -> Array:
        """τ = [y_img, q₃*] (n, 2) of drums at xy (n, 2); NaN if unseen.

        Args:
            calibration: The box that the image coordinates are scaled by.
        """
        yaws, pixels = self.direct_pixels(xy)
        y = calibration.normalize(pixels)[:, 1]
        return np.stack([y, yaws], axis=-1)

    def seen_by(
        self, xy: Array, yaw: float, mirrors: Sequence[Mirror] = ()
    ) -> tuple[int | None, MarkerImage]:
        """Where the marker shows largest: which mirror (None: directly).

        That is the image that the blob sensor takes.

        Args:
            mirrors: The mirrors of the scene.
        """
        views: list[tuple[int | None, MarkerImage]] = [
            (None, self.view(xy, yaw))
        ]
        for index, mirror in enumerate(mirrors):
            views.append((index, self.view(xy, yaw, mirror)))
        return max(views, key=lambda item: item[1].whole * item[1].area)

    def fixed_yaw_pixels(
        self,
        xy: Array,
        yaw: float,
        mirrors: Sequence[Mirror] = (),
        least: float = 1.0,
    ) -> Array:
        """Centroids uv (n, 2) from a fixed yaw; NaN where not wholly seen.

        Args:
            mirrors: The mirrors of the scene.
            least: Share of the marker that must be seen.
        """
        xy = np.atleast_2d(np.asarray(xy, dtype=float))
        pixels = np.full((len(xy), 2), np.nan)
        for i, place in enumerate(xy):
            _, view = self.seen_by(place, yaw, mirrors)
            if view.whole >= least and view.area > 0.0:
                pixels[i] = view.uv
        return pixels

    def locate(self, uv: Array, yaw: float, X_WM: Array | None = None) -> Array:
        """p_W (..., 3) of the marker that is seen at pixels uv (..., 2).

        With X_WM it is seen in a mirror. NaN where the ray does not meet the
        marker's level.
        """
        X_WC = self.camera_pose(yaw)
        d = self.camera.direction(uv) @ X_WC[:3, :3].T
        eye = X_WC[:3, 3]
        if X_WM is not None:
            # A ray that is reflected comes from the camera's mirror image.
            eye = optics.reflect_points(X_WM, eye)
            d = d @ optics.reflection(X_WM)[:3, :3]
        level = np.array([0.0, 0.0, self.marker_height])
        return optics.intersect_plane(
            np.broadcast_to(eye, d.shape), d, level, np.array([0.0, 0.0, 1.0])
        )


def view_disc(
    camera: Camera,
    X_WC: Array,
    center: Array,
    normal: Array,
    radius: float,
    mirror: Mirror | None = None,
) -> MarkerImage:
    """The image of a disc, directly or in a mirror, and how much is seen."""
    X_WM = None if mirror is None else mirror.X_WM
    uv, area, outline = optics.project_disc(
        camera, X_WC, center, normal, radius, X_WM
    )
    if area <= 0.0 or not np.all(np.isfinite(outline)):
        return MarkerImage(np.full(2, np.nan), 0.0, 0.0)
    size = np.array([camera.width, camera.height])
    inside = np.all((outline >= -0.5) & (outline <= size - 0.5), axis=1)
    if mirror is not None:
        inside &= seen_in_mirror(
            X_WC[:3, 3], optics.disc_outline(center, normal, radius), mirror
        )
    return MarkerImage(uv, area, float(inside.mean()))


def seen_in_mirror(eye: Array, p_W: Array, mirror: Mirror) -> Mask:
    """Whether the eye (3,) sees points (n, 3) within the mirror's face."""
    X_WM = mirror.X_WM
    image = optics.reflect_points(X_WM, p_W)
    hit = optics.intersect_plane(
        np.broadcast_to(eye, image.shape),
        image - eye,
        X_WM[:3, 3],
        X_WM[:3, 2],
    )
    local = optics.transform_points(optics.invert_pose(X_WM), hit)
    before = ((p_W - X_WM[:3, 3]) @ X_WM[:3, 2] > 0) & (
        (eye - X_WM[:3, 3]) @ X_WM[:3, 2] > 0
    )
    half = 0.5 * np.array([mirror.width, mirror.height])
    with np.errstate(invalid="ignore"):
        return before & np.all(np.abs(local[..., :2]) <= half, axis=-1)


def _turn(axis: Array, angle: float) -> Array:
    """The 4 × 4 matrix of a turn by `angle` about a unit axis (3,)."""
    x, y, z = axis
    K = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    X = np.eye(4)
    X[:3, :3] += np.sin(angle) * K + (1 - np.cos(angle)) * (K @ K)
    return X


def turn_points(axis: Array, angle: Array, p: Array) -> Array:
    """Points (..., 3), each turned by its angle (...) about an axis (3,)."""
    c, s = np.cos(angle)[..., None], np.sin(angle)[..., None]
    along = (p @ axis)[..., None] * axis
    return c * (p - along) + s * np.cross(axis, p) + along
