"""What a pinhole camera sees of points, straight and in a plane mirror.

No Drake: arrays in, arrays out. A pose X_AB is a 4 × 4 homogeneous matrix;
a camera looks along z, with x to the right and y down; a mirror's z is its
normal, out of the reflecting face. Pixel (0, 0) is the centre of the upper
left pixel.
"""

import dataclasses

import numpy as np

Array = np.ndarray


@dataclasses.dataclass(frozen=True)
class View:
    """A pinhole image: its size [pixels] and vertical field of view [rad]."""

    width: int = 320
    height: int = 240
    fov_y: float = 0.8188

    @property
    def focal(self) -> float:
        """Focal length [pixels]."""
        return 0.5 * self.height / float(np.tan(0.5 * self.fov_y))

    def project(self, X_WC: Array, p_W: Array) -> Array:
        """Pixels (..., 2) of points (..., 3); NaN for those behind.

        X_WC (..., 4, 4) has one axis less than `p_W` has points in front of
        its last two: a camera for each row of points, or one for all.
        """
        offset = p_W - X_WC[..., None, :3, 3]
        p_C = offset @ X_WC[..., :3, :3]
        z = np.where(p_C[..., 2] > 1e-6, p_C[..., 2], np.nan)
        centre = 0.5 * np.array([self.width - 1, self.height - 1])
        return self.focal * p_C[..., :2] / z[..., None] + centre

    def inside(self, pixels: Array, margin: float = 0.0) -> Array:
        """Whether pixels (..., 2) lie in the image, `margin` off its edge."""
        low = margin - 0.5
        high = np.array([self.width, self.height]) - 0.5 - margin
        with np.errstate(invalid="ignore"):
            return np.all((pixels >= low) & (pixels <= high), axis=-1)


def disc(centre: Array, radius: float, points: int = 24) -> Array:
    """The rim (..., points, 3) of level discs about centres (..., 3)."""
    angle = np.linspace(0, 2 * np.pi, points, endpoint=False)
    rim = np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=-1)
    return np.asarray(centre, dtype=float)[..., None, :] + radius * rim


def polygon_area(pixels: Array) -> Array:
    """Area [px²] of polygons with corners (..., k, 2)."""
    x, y = pixels[..., 0], pixels[..., 1]
    twice = x * np.roll(y, -1, axis=-1) - y * np.roll(x, -1, axis=-1)
    return 0.5 * np.abs(twice.sum(axis=-1))


def reflect(X_WM: Array, p_W: Array) -> Array:
    """Where points (..., 3) seem to be for whoever looks into the mirror."""
    normal = X_WM[:3, 2]
    distance = (p_W - X_WM[:3, 3]) @ normal
    return p_W - 2 * distance[..., None] * normal


def on_panel(
    X_WM: Array, size: Array, p_eye: Array, p_W: Array, margin: float = 0.0
) -> Array:
    """Whether the eye sees points (..., 3) within the mirror's panel.

    Args:
        size: (2,) extents of the panel along the mirror's x and y [m].
        p_eye: (3,) the eye in world.
        margin: least distance [m] of the reflection from the panel's edge.
    """
    normal = X_WM[:3, 2]
    image = reflect(X_WM, p_W)
    ray = image - p_eye
    height = (p_eye - X_WM[:3, 3]) @ normal
    depth = (p_W - X_WM[:3, 3]) @ normal
    with np.errstate(divide="ignore", invalid="ignore"):
        hit = p_eye + ray * (height / -(ray @ normal))[..., None]
        planar = (hit - X_WM[:3, 3]) @ X_WM[:3, :2]
    within = np.all(np.abs(planar) <= 0.5 * np.asarray(size) - margin, axis=-1)
    return within & (height > 0) & (depth > 0)
