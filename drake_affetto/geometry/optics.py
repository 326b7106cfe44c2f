"""Cameras, lenses and planar mirrors as geometry; no Drake, no images.

Frames are in monogram notation: W the world, C a camera (z forward, x right,
y down), M a mirror (z its normal, into the room). A pose X_AB is given as a
4 × 4 homogeneous matrix.

Pixel coordinates (u, v) are integers at the centers of the pixels: (0, 0) is
the center of the top left one, and the image spans [-½, W - ½] × [-½, H - ½].
The engine's own principal point is counted from the image's corner instead:
half a pixel more. `PinholeCamera.center_x`, `center_y` are in the engine's
convention (that of Drake's CameraInfo), so that W/2, H/2 is the middle of the
image; `project` gives pixel coordinates.
"""

import dataclasses
import math

import numpy as np

from drake_affetto.common.errors import require_range
from drake_affetto.common.typing import Array, Mask


def make_pose(R: Array, p: Array) -> Array:
    """The 4 × 4 matrix of a pose of rotation R (3, 3) and origin p (3,).

    Args:
        R: Rotation (3, 3).
        p: Origin (3,), m.
    """
    X = np.eye(4)
    X[:3, :3] = R
    X[:3, 3] = p
    return X


def invert_pose(X_AB: Array) -> Array:
    """X_BA of the rigid transform X_AB.

    Args:
        X_AB: Pose (4, 4) of frame B in frame A.
    """
    R = X_AB[:3, :3].T
    return make_pose(R, -R @ X_AB[:3, 3])


def transform_points(X_AB: Array, p_BQ: Array) -> Array:
    """p_AQ of points p_BQ (..., 3).

    Args:
        X_AB: Pose (4, 4) of frame B in frame A.
        p_BQ: Points in frame B (..., 3), m.
    """
    return np.asarray(p_BQ, dtype=float) @ X_AB[:3, :3].T + X_AB[:3, 3]


def points_in_frame(X_WF: Array, p_W: Array) -> Array:
    """p_F (..., k, 3) of points p_W (..., k, 3) in frames X_WF (..., 4, 4)."""
    return (p_W - X_WF[..., None, :3, 3]) @ X_WF[..., :3, :3]


# Cameras and lenses


@dataclasses.dataclass(frozen=True)
class _ImagePlane:
    """Size and scale of an image, which every camera has.

    Attributes:
        width: image width [pixels].
        height: image height [pixels].
        focal_x: focal length along u [pixels].
        focal_y: focal length along v [pixels].
        center_x: principal point from the image's left edge [pixels].
        center_y: principal point from the image's upper edge [pixels].
    """

    width: int
    height: int
    focal_x: float
    focal_y: float
    center_x: float
    center_y: float

    @property
    def image_center(self) -> Array:
        """Pixel coordinates (2,) of the middle of the image."""
        return np.array([0.5 * (self.width - 1), 0.5 * (self.height - 1)])


@dataclasses.dataclass(frozen=True)
class PinholeCamera(_ImagePlane):
    """A camera without distortion.

    Attributes:
        width, height: size of the image, px.
        focal_x, focal_y: focal lengths along u and v, px.
        center_x, center_y: principal point from the image's left and upper
            edge, px.
    """

    @classmethod
    def from_fov(cls, width: int, height: int, fov_y: float) -> "PinholeCamera":
        """Square pixels and a central principal point; fov_y in rad.

        Args:
            width: Width of the image, pixels.
            height: Height of the image, pixels.
            fov_y: Vertical field of view, rad.

        Raises:
            InputError: For a size below one pixel, or an angle not in (0, π).
        """
        _check_image(width, height, fov_y, 3.14)
        focal = 0.5 * height / math.tan(0.5 * fov_y)
        return cls(width, height, focal, focal, 0.5 * width, 0.5 * height)

    def inside(self, uv: Array, margin: float = 0.0) -> Mask:
        """Whether pixels uv (..., 2) are in the image.

        Args:
            uv: Pixel coordinates; NaN is outside.
            margin: Least distance from the image's edge, px.
        """
        low = margin - 0.5
        high = np.array([self.width, self.height]) - 0.5 - margin
        with np.errstate(invalid="ignore"):
            return np.all((uv >= low) & (uv <= high), axis=-1)

    def project(self, p_C: Array) -> Array:
        """Pixel coordinates (..., 2) of points (..., 3) before the camera.

        Points at or behind the camera's plane give NaN.
        """
        p_C = np.asarray(p_C, dtype=float)
        z = np.where(p_C[..., 2] > 1e-9, p_C[..., 2], np.nan)
        u = self.focal_x * p_C[..., 0] / z + self.center_x - 0.5
        v = self.focal_y * p_C[..., 1] / z + self.center_y - 0.5
        return np.stack([u, v], axis=-1)

    def direction(self, uv: Array) -> Array:
        """Unit vectors (..., 3) in C along which pixels uv (..., 2) look."""
        uv = np.asarray(uv, dtype=float)
        x = (uv[..., 0] + 0.5 - self.center_x) / self.focal_x
        y = (uv[..., 1] + 0.5 - self.center_y) / self.focal_y
        d = np.stack([x, y, np.ones_like(x)], axis=-1)
        return d / np.linalg.norm(d, axis=-1, keepdims=True)

    def crop(self, left: int, top: int, width: int, height: int):
        """The same camera that keeps a rectangle of its image only.

        Args:
            left: First column that is kept.
            top: First row that is kept.
            width: Width that is kept, pixels.
            height: Height that is kept, pixels.
        """
        return dataclasses.replace(
            self,
            width=width,
            height=height,
            center_x=self.center_x - left,
            center_y=self.center_y - top,
        )

    def flipped(self) -> "PinholeCamera":
        """The camera whose image, flipped left to right, is this one's."""
        return dataclasses.replace(self, center_x=self.width - self.center_x)

    def pinhole(self) -> "PinholeCamera":
        """The distortion-free camera to render for this one: itself."""
        return self


@dataclasses.dataclass(frozen=True)
class FisheyeCamera(_ImagePlane):
    """A wide-angle lens: image radius grows with the angle from the axis.

    A ray at angle ϑ from the optical axis meets the image at the radius
    f·ϑ·(1 + k₁ϑ² + k₂ϑ⁴), the equidistant model with the polynomial of
    Kannala and Brandt (IEEE PAMI 28(8), 2006).

    The other attributes are those of `PinholeCamera`.

    Attributes:
        k1: coefficient of ϑ² in the radial polynomial.
        k2: coefficient of ϑ⁴.
    """

    k1: float = 0.0
    k2: float = 0.0

    @classmethod
    def from_fov(
        cls,
        width: int,
        height: int,
        fov_y: float,
        k1: float = 0.0,
        k2: float = 0.0,
    ) -> "FisheyeCamera":
        """Square pixels and a central principal point; fov_y in rad.

        Args:
            width: Width of the image, pixels.
            height: Height of the image, pixels.
            fov_y: Vertical field of view, rad.
            k1: Coefficient of ϑ².
            k2: Coefficient of ϑ⁴.

        Raises:
            InputError: For a size below one pixel, an angle not in (0, 2π), or
                coefficients that are not finite.
        """
        _check_image(width, height, fov_y, 6.28)
        for name, value in (("k1", k1), ("k2", k2)):
            require_range(name, value, -10.0, 10.0)
        unit = cls(width, height, 1.0, 1.0, 0.0, 0.0, k1, k2)
        focal = 0.5 * height / float(unit._radius(np.array(0.5 * fov_y)))
        return dataclasses.replace(
            unit,
            focal_x=focal,
            focal_y=focal,
            center_x=0.5 * width,
            center_y=0.5 * height,
        )

    def _radius(self, theta: Array) -> Array:
        square = theta * theta
        return theta * (1 + square * (self.k1 + self.k2 * square))

    def project(self, p_C: Array) -> Array:
        """Pixel coordinates (..., 2) of points (..., 3) before the camera."""
        p_C = np.asarray(p_C, dtype=float)
        z = np.where(p_C[..., 2] > 1e-9, p_C[..., 2], np.nan)
        r = np.hypot(p_C[..., 0], p_C[..., 1])
        scale = self._radius(np.arctan2(r, z)) / np.where(r > 1e-12, r, 1.0)
        # On the axis the limit of radius / r is 1 / z.
        scale = np.where(r > 1e-12, scale, 1.0 / z)
        u = self.focal_x * p_C[..., 0] * scale + self.center_x - 0.5
        v = self.focal_y * p_C[..., 1] * scale + self.center_y - 0.5
        return np.stack([u, v], axis=-1)

    def direction(self, uv: Array) -> Array:
        """Unit vectors (..., 3) in C along which pixels uv (..., 2) look."""
        uv = np.asarray(uv, dtype=float)
        x = (uv[..., 0] + 0.5 - self.center_x) / self.focal_x
        y = (uv[..., 1] + 0.5 - self.center_y) / self.focal_y
        radius = np.hypot(x, y)
        theta = radius.copy()
        for _ in range(20):  # Newton; the polynomial is monotone in use.
            square = theta * theta
            slope = 1 + square * (3 * self.k1 + 5 * self.k2 * square)
            theta = theta - (self._radius(theta) - radius) / slope
        scale = np.sin(theta) / np.where(radius > 1e-12, radius, 1.0)
        scale = np.where(radius > 1e-12, scale, 1.0)
        return np.stack([x * scale, y * scale, np.cos(theta)], axis=-1)

    def pinhole(self) -> PinholeCamera:
        """The pinhole image that holds all that this camera sees.

        Its pixels are as fine as this camera's in the middle of the image,
        where they are finest on the pinhole's side.
        """
        edge_u = np.arange(-0.5, self.width, 1.0)
        edge_v = np.arange(-0.5, self.height, 1.0)
        border = np.concatenate(
            [
                np.stack([edge_u, np.full_like(edge_u, -0.5)], -1),
                np.stack([edge_u, np.full_like(edge_u, edge_v[-1])], -1),
                np.stack([np.full_like(edge_v, -0.5), edge_v], -1),
                np.stack([np.full_like(edge_v, edge_u[-1]), edge_v], -1),
            ]
        )
        d = self.direction(border)
        x, y = d[:, 0] / d[:, 2], d[:, 1] / d[:, 2]
        left, right = -self.focal_x * x.min(), self.focal_x * x.max()
        upper, lower = -self.focal_y * y.min(), self.focal_y * y.max()
        margin = 2
        cx, cy = math.ceil(left) + margin, math.ceil(upper) + margin
        return PinholeCamera(
            cx + math.ceil(right) + margin,
            cy + math.ceil(lower) + margin,
            self.focal_x,
            self.focal_y,
            float(cx),
            float(cy),
        )

    def remap_grid(self) -> tuple[Array, Array]:
        """Where each pixel of this image lies in that of `pinhole()`.

        Returns:
            Two (height, width) float32 arrays, u and v, as cv2.remap takes
            them.
        """
        u, v = np.meshgrid(np.arange(self.width), np.arange(self.height))
        direction = self.direction(np.stack([u, v], axis=-1))
        uv = self.pinhole().project(direction)
        return uv[..., 0].astype(np.float32), uv[..., 1].astype(np.float32)


Camera = PinholeCamera | FisheyeCamera


# Planar mirrors


def reflection(X_WM: Array) -> Array:
    """The 4 × 4 matrix that reflects points of W in the mirror's plane.

    It is its own inverse; its rotational part has determinant -1.
    """
    n = X_WM[:3, 2]
    S = np.eye(4)
    S[:3, :3] -= 2.0 * np.outer(n, n)
    S[:3, 3] = 2.0 * (n @ X_WM[:3, 3]) * n
    return S


def reflect_points(X_WM: Array, p_W: Array) -> Array:
    """The mirror images (..., 3) of points p_W (..., 3)."""
    return transform_points(reflection(X_WM), p_W)


def reflect_camera(X_WC: Array, X_WM: Array) -> Array:
    """Pose X_WV of the virtual camera behind the mirror.

    Its image, flipped left to right, is what C sees in the mirror. The flip
    of the camera's x axis makes a proper rotation of the reflected pose.
    """
    X_WV = reflection(X_WM) @ X_WC
    X_WV[:3, 0] *= -1.0
    return X_WV


def mirror_corners(X_WM: Array, width: float, height: float) -> Array:
    """Corners (4, 3) in W of the panel: width along x, height along y of M."""
    x, y = 0.5 * width, 0.5 * height
    corners = np.array([[-x, -y, 0], [x, -y, 0], [x, y, 0], [-x, y, 0]])
    return transform_points(X_WM, corners)


def clip_polygon(polygon: Array, plane: Array) -> Array:
    """The part of a convex polygon (n, 3) with a·p + d ≥ 0, plane (a, d).

    One step of the algorithm of Sutherland and Hodgman (1974).
    """
    if len(polygon) == 0:
        return polygon
    distance = polygon @ plane[:3] + plane[3]
    kept = []
    for i in range(len(polygon)):
        j = (i + 1) % len(polygon)
        if distance[i] >= 0:
            kept.append(polygon[i])
        if (distance[i] >= 0) != (distance[j] >= 0):
            t = distance[i] / (distance[i] - distance[j])
            kept.append(polygon[i] + t * (polygon[j] - polygon[i]))
    return np.array(kept).reshape(-1, 3)


def frustum_planes(camera: PinholeCamera, near: float) -> Array:
    """Planes (5, 4) in C that bound what the camera sees from `near` on."""
    left = -camera.center_x / camera.focal_x
    right = (camera.width - camera.center_x) / camera.focal_x
    upper = -camera.center_y / camera.focal_y
    lower = (camera.height - camera.center_y) / camera.focal_y
    return np.array(
        [
            [0.0, 0.0, 1.0, -near],
            [1.0, 0.0, -left, 0.0],
            [-1.0, 0.0, right, 0.0],
            [0.0, 1.0, -upper, 0.0],
            [0.0, -1.0, lower, 0.0],
        ]
    )


@dataclasses.dataclass(frozen=True)
class MirrorView:
    """The part of an image in which a mirror's face can be seen.

    Attributes:
        polygon: outline (n, 2) in pixel coordinates, within the image.
        left, top, width, height: the rectangle of pixels that holds it.
        depth: least depth [m] of the visible face along the optical axis.
            Whatever is nearer to the virtual camera stands behind the mirror.
    """

    polygon: Array
    left: int
    top: int
    width: int
    height: int
    depth: float

    def grown_to_hold(self, x: float, y: float) -> "MirrorView":
        """The view with its rectangle grown so that it holds a point.

        Args:
            x: distance of the point from the image's left edge [pixels].
            y: distance of the point from the image's upper edge [pixels].
        """
        left = min(self.left, math.ceil(x) - 1)
        top = min(self.top, math.ceil(y) - 1)
        right = max(self.left + self.width, math.floor(x) + 1)
        bottom = max(self.top + self.height, math.floor(y) + 1)
        return dataclasses.replace(
            self, left=left, top=top, width=right - left, height=bottom - top
        )


def mirror_view(
    camera: PinholeCamera,
    X_WC: Array,
    X_WM: Array,
    width: float,
    height: float,
    near: float = 0.01,
    margin: int = 0,
) -> MirrorView | None:
    """Where the camera can see the mirror's face; None if nowhere.

    Occlusion by other things is not looked at: this answers whether a mirror
    pass is needed, and for which pixels.

    Args:
        camera: the pinhole camera.
        X_WC: its pose.
        X_WM: the mirror's pose, origin at the middle of the face.
        width: size of the face along Mx [m].
        height: size of the face along My [m].
        near: depth [m] below which nothing is seen.
        margin: pixels to add around the rectangle (kept within the image).
    """
    p_MC = (X_WC[:3, 3] - X_WM[:3, 3]) @ X_WM[:3, 2]
    if p_MC <= 0.0:
        return None  # The camera is behind the mirror's plane.
    X_CW = invert_pose(X_WC)
    polygon = transform_points(X_CW, mirror_corners(X_WM, width, height))
    for plane in frustum_planes(camera, near):
        polygon = clip_polygon(polygon, plane)
    if len(polygon) < 3:
        return None
    uv = camera.project(polygon)
    # Pixel i covers [i - ½, i + ½].
    low = np.floor(uv.min(axis=0) + 0.5).astype(int) - margin
    high = np.ceil(uv.max(axis=0) + 0.5).astype(int) + margin
    left, top = np.maximum(low, 0)
    right, bottom = np.minimum(high, [camera.width, camera.height])
    if right <= left or bottom <= top:
        return None
    return MirrorView(
        uv,
        int(left),
        int(top),
        int(right - left),
        int(bottom - top),
        float(polygon[:, 2].min()),
    )


# The marker


def disc_outline(
    center: Array, normal: Array, radius: float, n: int = 48
) -> Array:
    """Points (n, 3) on a circle's rim.

    The radius is that of the circle of equal area to the polygon, so that
    areas of projections come out unbiased.

    Args:
        center: Center of the circle (3,), m.
        normal: Unit normal of its plane (3,).
        radius: Radius of the circle, m.
        n: Number of points.
    """
    normal = np.asarray(normal, dtype=float) / np.linalg.norm(normal)
    helper = np.eye(3)[np.argmin(np.abs(normal))]
    a = np.cross(normal, helper)
    a /= np.linalg.norm(a)
    b = np.cross(normal, a)
    angle = 2.0 * np.pi * np.arange(n) / n
    # An n-gon inscribed in the unit circle has the area n/2 sin(2π/n).
    scale = radius * math.sqrt(np.pi / (0.5 * n * math.sin(2 * np.pi / n)))
    return np.asarray(center) + scale * (
        np.outer(np.cos(angle), a) + np.outer(np.sin(angle), b)
    )


def polygon_area(uv: Array) -> Array:
    """Area of simple polygons (..., n, 2)."""
    x, y = uv[..., 0], uv[..., 1]
    twice = x * np.roll(y, -1, axis=-1) - y * np.roll(x, -1, axis=-1)
    return 0.5 * np.abs(twice.sum(axis=-1))


def polygon_area_centroid(uv: Array) -> tuple[float, Array]:
    """Area and centroid (2,) of a simple polygon (n, 2)."""
    origin = uv.mean(axis=0)
    x, y = (uv - origin).T
    cross = x * np.roll(y, -1) - np.roll(x, -1) * y
    area = 0.5 * cross.sum()
    if abs(area) < 1e-12:
        return 0.0, origin
    moment = np.array(
        [
            ((x + np.roll(x, -1)) * cross).sum(),
            ((y + np.roll(y, -1)) * cross).sum(),
        ]
    )
    return abs(area), origin + moment / (6.0 * area)


def project_disc(
    camera: Camera,
    X_WC: Array,
    center: Array,
    normal: Array,
    radius: float,
    X_WM: Array | None = None,
) -> tuple[Array, float, Array]:
    """A disc's image, seen directly or (with X_WM) in a mirror.

    The centroid of the projected disc is what moments of the image measure;
    it is not the projection of the disc's center.

    Returns:
        (centroid (2,) [pixels], area [pixels²], outline (n, 2) [pixels]);
        NaN where the disc reaches behind the camera. The area is 0 if the
        disc's painted side faces away.
    """
    outline = disc_outline(center, normal, radius)
    eye = X_WC[:3, 3]
    if X_WM is not None:
        outline = reflect_points(X_WM, outline)
        eye = reflect_points(X_WM, eye)
    uv = camera.project(transform_points(invert_pose(X_WC), outline))
    if not np.all(np.isfinite(uv)):
        return np.full(2, np.nan), 0.0, uv
    area, centroid = polygon_area_centroid(uv)
    if (eye - np.asarray(center)) @ np.asarray(normal) <= 0.0:
        area = 0.0
    return centroid, area, uv


def intersect_plane(
    p: Array, direction: Array, point: Array, normal: Array
) -> Array:
    """Where rays p + s·direction (..., 3), s > 0, meet a plane; else NaN."""
    p, direction = np.asarray(p, dtype=float), np.asarray(direction)
    slope = direction @ normal
    with np.errstate(divide="ignore", invalid="ignore"):
        s = ((np.asarray(point) - p) @ normal) / slope
    s = np.where(s > 0, s, np.nan)
    return p + s[..., None] * direction


def yaw_sensitivity(
    camera: Camera, X_WC: Array, axis_point: Array, axis: Array, p_W: Array
) -> float:
    """∂u/∂yaw [pixels/rad] of a fixed point's image as the camera turns.

    Args:
        camera: the camera.
        X_WC: its pose.
        axis_point: a point (3,) on the axis of the turning joint.
        axis: unit vector (3,) of the axis.
        p_W: the fixed point (3,).
    """
    step = 1e-4

    def u_at(angle: float) -> float:
        # Turning the camera by +angle shows the point turned by -angle.
        rel = np.asarray(p_W) - axis_point
        c, s = math.cos(-angle), math.sin(-angle)
        turned = (
            c * rel
            + s * np.cross(axis, rel)
            + (1 - c) * (np.asarray(axis) @ rel) * np.asarray(axis)
        )
        p_C = transform_points(invert_pose(X_WC), axis_point + turned)
        return float(camera.project(p_C)[0])

    return (u_at(step) - u_at(-step)) / (2 * step)


def _check_image(width: int, height: int, fov_y: float, widest: float) -> None:
    """Raises InputError for an image that no camera has."""
    require_range("width", width, 1, 100_000)
    require_range("height", height, 1, 100_000)
    require_range("fov_y", fov_y, 1e-4, widest)
