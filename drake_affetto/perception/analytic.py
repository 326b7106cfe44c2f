"""The marker's image without rendering: a twin of camera and blob detection.

The disc's outline is projected, cut by the mirror's face and by the image's
border, and what the robot's body hides is taken away; area and centroid are
those of what is left. To that come the errors that the rendered chain has,
with the sizes that it showed (see `analysis/benchmarks/bench_perception.py`):

- of the raster: the centroid of a disc drawn with whole pixels depends on
  where on the raster it lies. This error is a fixed function of the place, so
  that it does not average out over images of a scene that stands still;
- of the pixels' noise, new in each image. It acts along the rim, so that it
  goes with the noise and with area^(-1/4);
- the raised rim of the marker, which shifts the centroid down a little.
"""

import dataclasses
import math

import numpy as np

from drake_affetto.common.typing import Array, Mask
from drake_affetto.geometry import optics
from drake_affetto.geometry.optics import Camera
from drake_affetto.perception.blob import LEAST_SEEN, LEAST_TO_COMPLETE, Blob
from drake_affetto.perception.camera_model import Mirror

# Fitted to 117 rendered places, direct and mirrored, at 320 × 240 pixels.
_RASTER = 0.055  # standard deviation in u and in v [pixels]
_SHIFT = np.array([-0.006, 0.066])  # mean error in u and v [pixels]
_NOISE = 0.0095  # standard deviation at area 1 per level of noise [pixels]
# Side of the squares in which the raster's error is the same [pixels].
_RASTER_STEP = 0.5
# The rim's part in the area that is found: area · (1 + _RIM / √area).
_RIM = 0.09

# Error of a completed marker: standard deviation for all hidden at area 1.
_COMPLETION = 30.0

_SAMPLES = 60


@dataclasses.dataclass(frozen=True)
class Occluders:
    """Ellipsoids that may hide the marker.

    Attributes:
        X_WE: poses (k, 4, 4) of their axes.
        radii: half lengths (k, 3) of their axes [m].
        on_camera: (k,) whether each is part of what carries the camera.
    """

    X_WE: Array
    radii: Array
    on_camera: Mask


def visible_marker(
    camera: Camera,
    X_WC: Array,
    X_WD: Array,
    radius: float,
    mirror: Mirror | None = None,
    occluders: Occluders | None = None,
    near: float = 0.01,
) -> tuple[float, Array]:
    """Area [pixels²] and centroid (2,) [pixels] of what is seen of the disc.

    Args:
        camera: geometry of the image.
        X_WC: pose (4, 4) of the camera.
        X_WD: pose (4, 4) of the disc, its painted side along +z.
        radius: of the disc [m].
        mirror: in which it is seen; None for the direct view.
        occluders: what may stand in the way.
        near: depth [m] below which nothing is seen.
    """
    nothing = 0.0, np.full(2, np.nan)
    center, normal = X_WD[:3, 3], X_WD[:3, 2]
    eye = X_WC[:3, 3]
    seen_from = eye
    if mirror is not None:
        seen_from = optics.reflect_points(mirror.X_WM, eye)
        n = mirror.X_WM[:3, 2]
        if (
            min(
                (eye - mirror.X_WM[:3, 3]) @ n,
                (center - mirror.X_WM[:3, 3]) @ n,
            )
            <= 0
        ):
            return nothing
    if (seen_from - center) @ normal <= 0.0:
        return nothing
    outline = optics.disc_outline(center, normal, radius)
    if mirror is not None:
        outline = optics.reflect_points(mirror.X_WM, outline)
    X_CW = optics.invert_pose(X_WC)
    polygon = optics.transform_points(X_CW, outline)
    polygon = optics.clip_polygon(polygon, np.array([0.0, 0.0, 1.0, -near]))
    for plane in _window_planes(X_CW, mirror):
        polygon = optics.clip_polygon(polygon, plane)
    if len(polygon) < 3:
        return nothing
    uv = _clip_to_image(camera, camera.project(polygon))
    if len(uv) < 3:
        return nothing
    area, centroid = optics.polygon_area_centroid(uv)
    if area > 0.0 and occluders is not None:
        return _take_away_hidden(
            area, centroid, camera, X_WC, X_WD, radius, mirror, occluders
        )
    return area, centroid


def _window_planes(X_CW: Array, mirror: Mirror | None) -> list[Array]:
    """Planes through the camera and the edges of the mirror's face, in C."""
    if mirror is None:
        return []
    corners = optics.transform_points(
        X_CW, optics.mirror_corners(mirror.X_WM, mirror.width, mirror.height)
    )
    middle = corners.mean(axis=0)
    planes = []
    for a, b in zip(corners, np.roll(corners, -1, axis=0), strict=True):
        normal = np.cross(a, b)
        if normal @ middle < 0:
            normal = -normal
        planes.append(np.append(normal, 0.0))
    return planes


def _clip_to_image(camera: Camera, uv: Array) -> Array:
    """The part (m, 2) of a convex outline (n, 2) within the image."""
    polygon = np.column_stack([uv, np.zeros(len(uv))])
    for plane in (
        [1.0, 0.0, 0.0, 0.5],
        [-1.0, 0.0, 0.0, camera.width - 0.5],
        [0.0, 1.0, 0.0, 0.5],
        [0.0, -1.0, 0.0, camera.height - 0.5],
    ):
        polygon = optics.clip_polygon(polygon, np.array(plane))
    return polygon[:, :2]


def _sunflower(n: int) -> Array:
    """n points (n, 2) spread evenly over the unit disc (Vogel 1979)."""
    k = np.arange(n) + 0.5
    r, angle = np.sqrt(k / n), k * math.pi * (3.0 - math.sqrt(5.0))
    return np.stack([r * np.cos(angle), r * np.sin(angle)], axis=-1)


def _take_away_hidden(
    area: float,
    centroid: Array,
    camera: Camera,
    X_WC: Array,
    X_WD: Array,
    radius: float,
    mirror: Mirror | None,
    occluders: Occluders,
) -> tuple[float, Array]:
    """Area and centroid without the part that something stands before."""
    eye = X_WC[:3, 3]
    flat = radius * _sunflower(_SAMPLES)
    p_W = optics.transform_points(X_WD, np.column_stack([flat, 0 * flat[:, 0]]))
    image = p_W
    legs: list[tuple[Array, Array, bool]]
    if mirror is None:
        legs = [(p_W, np.broadcast_to(eye, p_W.shape), True)]
    else:
        image = optics.reflect_points(mirror.X_WM, p_W)
        hit = optics.intersect_plane(
            np.broadcast_to(eye, image.shape),
            image - eye,
            mirror.X_WM[:3, 3],
            mirror.X_WM[:3, 2],
        )
        legs = [(p_W, hit, False), (hit, np.broadcast_to(eye, hit.shape), True)]
    hidden = np.zeros(len(p_W), dtype=bool)
    for start, end, to_eye in legs:
        near = _near_segment(occluders, start.mean(axis=0), end.mean(axis=0))
        if to_eye:
            # What carries the camera is nearer than what it shows.
            near &= ~occluders.on_camera
        for index in np.flatnonzero(near):
            hidden |= _hits(
                occluders.X_WE[index], occluders.radii[index], start, end
            )
    if not hidden.any():
        return area, centroid
    uv = camera.project(
        optics.transform_points(optics.invert_pose(X_WC), image)
    )
    size = np.array([camera.width, camera.height])
    seen = np.all((uv >= -0.5) & (uv <= size - 0.5), axis=1)
    if mirror is not None:
        local = optics.transform_points(optics.invert_pose(mirror.X_WM), hit)
        half = 0.5 * np.array([mirror.width, mirror.height])
        seen &= np.all(np.abs(local[:, :2]) <= half, axis=1)
    left = seen & ~hidden
    if not left.any():
        return 0.0, np.full(2, np.nan)
    # The samples are of equal area on the disc; the image of so small a disc
    # is nearly affine, so that they are in the image, too.
    shift = uv[left].mean(axis=0) - uv[seen].mean(axis=0)
    return area * float(left.sum() / seen.sum()), centroid + shift


def _near_segment(
    occluders: Occluders, a: Array, b: Array, margin: float = 0.06
) -> Mask:
    """Which ellipsoids (k,) may come near the way from a to b."""
    c, d = occluders.X_WE[:, :3, 3], b - a
    s = np.clip((c - a) @ d / max(float(d @ d), 1e-12), 0.0, 1.0)
    distance = np.linalg.norm(a + s[:, None] * d - c, axis=1)
    return distance <= occluders.radii.max(axis=1) + margin


def _hits(X_WE: Array, radii: Array, start: Array, end: Array) -> Mask:
    """Which segments (n, 3) – (n, 3) meet an ellipsoid."""
    X_EW = optics.invert_pose(X_WE)
    a = optics.transform_points(X_EW, start) / radii
    d = optics.transform_points(X_EW, end) / radii - a
    dd = np.einsum("ij,ij->i", d, d)
    s = np.clip(-np.einsum("ij,ij->i", a, d) / np.maximum(dd, 1e-12), 0, 1)
    nearest = a + s[:, None] * d
    return np.einsum("ij,ij->i", nearest, nearest) < 1.0


def too_little_seen(area: float, whole_area: float) -> bool:
    """Whether so little is seen that the blob detection believes no middle.

    Args:
        area: of what is seen [pixels²].
        whole_area: of the whole marker's image [pixels²].
    """
    return LEAST_TO_COMPLETE <= area < LEAST_SEEN * whole_area


def completed(
    area: float,
    centroid: Array,
    whole_area: float,
    whole_centroid: Array,
    seed: int,
) -> Array:
    """The centroid (2,) that is found of a marker that is seen in part.

    The blob detection completes the ellipse if at least half of it is seen,
    and is off the more of it is hidden.

    Args:
        area: of what is seen [pixels²].
        centroid: of what is seen (2,) [pixels].
        whole_area: of the whole marker's image [pixels²].
        whole_centroid: of the whole marker's image (2,) [pixels].
        seed: of the error.
    """
    hidden = 1.0 - area / max(whole_area, 1e-9)
    small = area < LEAST_TO_COMPLETE
    if hidden < 0.01 or small or hidden > 1.0 - LEAST_SEEN:
        return centroid
    cell = np.floor(np.asarray(centroid) / _RASTER_STEP).astype(int)
    rng = np.random.default_rng([*(cell + 2**20), seed, 1])
    error = _COMPLETION * hidden / math.sqrt(area) * rng.standard_normal(2)
    return np.asarray(whole_centroid) + error


def measured_blob(
    area: float,
    centroid: Array,
    min_area: float,
    max_area: float,
    noise: float,
    seed: int,
    time: float,
) -> Blob | None:
    """What the blob detection would say of an image of the marker.

    Args:
        area: of what is seen [pixels²].
        centroid: of what is seen (2,) [pixels].
        min_area: least area that is found [pixels²].
        max_area: greatest area that is found [pixels²].
        noise: standard deviation of a pixel's noise [levels].
        seed: of all that is random.
        time: of the image [s]; noise is the same for the same seed and time.
    """
    found_area = area * (1.0 + _RIM / math.sqrt(max(area, 1.0)))
    if not min_area <= found_area <= max_area:
        return None
    # Errors of the raster belong to the place, not to the trial.
    cell = np.floor(np.asarray(centroid) / _RASTER_STEP).astype(int)
    size = round(4.0 * math.sqrt(area))
    place = np.random.default_rng([*(cell + 2**20), size])
    raster = _RASTER * place.standard_normal(2)
    error = _SHIFT + raster
    if noise > 0.0:
        rng = np.random.default_rng([seed, round(time * 1e6)])
        error = error + noise * _NOISE * area**-0.25 * rng.standard_normal(2)
    confidence = min(1.0, 0.2 + 0.8 * min(1.0, area / (2.0 * min_area)))
    u, v = np.asarray(centroid) + error
    return Blob(float(u), float(v), found_area, confidence)
