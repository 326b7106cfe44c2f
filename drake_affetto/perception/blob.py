"""Finding the colored marker in an image, to a fraction of a pixel.

The marker is told by its hue in CIE Lab, a space in which a hue is an angle
that changes little with the amount of light; area and shape decide among what
has that hue. Pixel coordinates are those of `optics`: integers at the centers
of the pixels.
"""

import dataclasses
import functools
import math
from typing import Any

import cv2
import numpy as np

from drake_affetto.common.errors import InputError, require, require_range
from drake_affetto.common.fields import check_ranges, number
from drake_affetto.common.typing import Array, Image
from drake_affetto.perception.config import require_vector


@dataclasses.dataclass
class BlobCalibration:
    """The box of pixels that is mapped to [0, 1] × [0, 1].

    Attributes:
        u_min: u [pixels] that is x_img = 0.
        u_max: u [pixels] that is x_img = 1.
        v_min: v [pixels] that is y_img = 0.
        v_max: v [pixels] that is y_img = 1.
    """

    u_min: float = -0.5
    u_max: float = 319.5
    v_min: float = -0.5
    v_max: float = 239.5

    def check(self, where: str) -> None:
        """Raises InputError if the box is empty."""
        for name, low, high in (
            ("u", self.u_min, self.u_max),
            ("v", self.v_min, self.v_max),
        ):
            require_range(f"{where}.{name}_min", low, -1e5, 1e5)
            require_range(f"{where}.{name}_max", high, -1e5, 1e5)
            require(
                high - low >= 1.0,
                f"{where}.{name}_max",
                high,
                f"at least one pixel more than {name}_min ({low:g})",
            )

    def to_vector(self) -> Array:
        """(u_min, u_max, v_min, v_max) as an array (4,)."""
        return np.array([self.u_min, self.u_max, self.v_min, self.v_max])

    def normalize(self, uv: Array) -> Array:
        """(x_img, y_img) (..., 2) of pixels (..., 2); beyond [0, 1] outside."""
        low = np.array([self.u_min, self.v_min])
        high = np.array([self.u_max, self.v_max])
        return (np.asarray(uv) - low) / (high - low)

    def pixels(self, xy: Array) -> Array:
        """Pixel coordinates (..., 2) of (x_img, y_img) (..., 2)."""
        low = np.array([self.u_min, self.v_min])
        high = np.array([self.u_max, self.v_max])
        return low + np.asarray(xy) * (high - low)


def calibrate(
    uv: Array,
    margin: float = 0.05,
    image_width: int | None = None,
) -> BlobCalibration:
    """The box around the marker's images over a workspace.

    Args:
        uv: where the marker is seen (n, 2) [pixels] at places that span the
            workspace; rows with NaN (not seen) are left out.
        margin: what to add on each side, as a fraction of the box.
        image_width: if given, x spans the whole image instead (direct view:
            the gaze centers the marker, so that its x says nothing).

    Raises:
        InputError: if the marker was seen at fewer than 3 places.
    """
    uv = np.asarray(uv, dtype=float)
    seen = uv[np.all(np.isfinite(uv), axis=1)]
    if len(seen) < 3:
        raise InputError(
            f"the marker is seen at {len(seen)} of {len(uv)} places of the "
            "workspace, expected at least 3"
        )
    low, high = seen.min(axis=0), seen.max(axis=0)
    add = margin * np.maximum(high - low, 1.0)
    low, high = low - add, high + add
    if image_width is not None:
        low[0], high[0] = -0.5, image_width - 0.5
    return BlobCalibration(
        float(low[0]), float(high[0]), float(low[1]), float(high[1])
    )


@dataclasses.dataclass
class BlobConfig:
    """How the marker looks and what an image of it must satisfy.

    Attributes:
        color: the marker's red, green and blue in [0, 1].
        hue_tolerance: half width of the hue gate in the Lab plane [deg].
        chroma: least chroma, as a fraction of the marker's own.
        min_area: least area [pixels²].
        max_area: greatest area, as a fraction of the image.
        min_fill: least ratio of the area to that of the ellipse with the
            same second moments (1 for any ellipse).
        max_aspect: greatest ratio of that ellipse's axes.
        region: part of the image to look at: left, upper, right, lower edge
            as fractions of width and height.
        complete: whether a marker that is hidden in part is completed to the
            ellipse that its rim is part of.
        detector: "moments", or "simple" for OpenCV's SimpleBlobDetector.
        calibration: the pixels that are x_img, y_img = 0 and 1.
    """

    color: list[float] = dataclasses.field(
        default_factory=lambda: [0.05, 0.75, 0.15]
    )
    hue_tolerance: float = number(24.0, 1.0, 90.0)
    chroma: float = number(0.4, 0.05, 1.0)
    min_area: float = number(12.0, 3.0, 1e5)
    max_area: float = number(0.2, 1e-4, 1.0)
    min_fill: float = number(0.7, 0.0, 1.0)
    max_aspect: float = number(6.0, 1.0, 100.0)
    region: list[float] = dataclasses.field(
        default_factory=lambda: [0.0, 0.0, 1.0, 1.0]
    )
    complete: bool = True
    detector: str = "moments"
    calibration: BlobCalibration = dataclasses.field(
        default_factory=BlobCalibration
    )

    def check(self, where: str) -> None:
        """Raises InputError if a value is out of range."""
        require_vector(f"{where}.color", self.color, 3, 0.0, 1.0)
        require_vector(f"{where}.region", self.region, 4, 0.0, 1.0)
        left, upper, right, lower = self.region
        require(
            left < right and upper < lower,
            f"{where}.region",
            self.region,
            "left < right and upper < lower",
        )
        chroma = marker_lab(self.color)[1]
        require(
            chroma >= 20.0,
            f"{where}.color",
            self.color,
            "a color that is told from gray (Lab chroma of at least 20)",
        )
        check_ranges(self, where)
        require(
            self.detector in ("moments", "simple"),
            f"{where}.detector",
            self.detector,
            "'moments' or 'simple'",
        )
        self.calibration.check(f"{where}.calibration")


@dataclasses.dataclass(frozen=True)
class Blob:
    """The marker in an image.

    Attributes:
        u, v: centroid [pixels].
        area: area [pixels²], partly covered pixels counted by their part.
        confidence: from 0 to 1: how well hue, shape and size fit.
        moments: variances and covariance of its pixels' places along u, u and
            v, and v [pixels²]; zeros where they were not measured.
    """

    u: float
    v: float
    area: float
    confidence: float
    moments: tuple[float, float, float] = (0.0, 0.0, 0.0)


# Rims of fewer pixels do not tell an ellipse from another [pixels²].
_LEAST_TO_COMPLETE = 60.0
# How far a whole marker's rim is off its ellipse, at most of it [pixels].
_ROUGH = 0.75
# What lies this near to an ellipse is on it [pixels].
_ON_RIM = 0.6


def marker_lab(color: list[float]) -> tuple[float, float, float]:
    """(lightness, chroma, hue [rad]) of a color, in OpenCV's 8-bit Lab."""
    rgb = np.array([[color]], dtype=float)
    pixel = np.rint(255 * rgb).astype(np.uint8)
    lab = cv2.cvtColor(pixel, cv2.COLOR_RGB2Lab)[0, 0].astype(float)
    a, b = lab[1] - 128.0, lab[2] - 128.0
    return float(lab[0]), math.hypot(a, b), math.atan2(b, a)


@functools.lru_cache(maxsize=32)
def _gate(
    color: tuple[float, ...], hue_tolerance: float, chroma: float
) -> Image:
    """Table (256 · 256,) over (a, b): 255 where a color may be the marker."""
    _, marker_chroma, marker_hue = marker_lab(list(color))
    a, b = np.meshgrid(
        np.arange(256) - 128.0, np.arange(256) - 128.0, indexing="ij"
    )
    difference = np.arctan2(b, a) - marker_hue
    difference = np.abs((difference + np.pi) % (2 * np.pi) - np.pi)
    inside = (difference <= math.radians(hue_tolerance)) & (
        np.hypot(a, b) >= chroma * marker_chroma
    )
    return np.where(inside, 255, 0).astype(np.uint8).ravel()


@functools.lru_cache(maxsize=32)
def _coarse_gate(
    color: tuple[float, ...], hue_tolerance: float, chroma: float
) -> tuple[tuple[Image, Image], ...]:
    """Boxes of OpenCV's HSV that hold all that passes the gate in Lab.

    HSV takes a quarter of the time of Lab; it says where Lab is worth it.
    """
    level = np.append(np.arange(0, 256, 6), 255).astype(np.uint8)
    rgb = np.stack(np.meshgrid(level, level, level), axis=-1).reshape(1, -1, 3)
    lab = cv2.cvtColor(rgb, cv2.COLOR_RGB2Lab)[0].astype(int)
    inside = _gate(color, hue_tolerance, chroma)[256 * lab[:, 1] + lab[:, 2]]
    hsv = cv2.cvtColor(rgb, cv2.COLOR_RGB2HSV)[0][inside > 0].astype(int)
    pixel = np.rint(255 * np.array([[color]])).astype(np.uint8)
    middle = int(cv2.cvtColor(pixel, cv2.COLOR_RGB2HSV)[0, 0, 0])
    difference = (hsv[:, 0] - middle + 90) % 180 - 90
    low = middle + difference.min() - 2
    high = middle + difference.max() + 2
    saturation = max(0, hsv[:, 1].min() - 6)
    value = max(0, hsv[:, 2].min() - 6)
    ranges = [(max(low, 0), min(high, 179))]
    if low < 0:
        ranges.append((low + 180, 179))
    if high > 179:
        ranges.append((0, high - 180))
    return tuple(
        (
            np.array([a, saturation, value], dtype=float),
            np.array([b, 255, 255], dtype=float),
        )
        for a, b in ranges
    )


def find_candidates(
    image: Image, config: BlobConfig
) -> tuple[int, int, int, int] | None:
    """The rectangle (left, top, right, bottom) worth a closer look.

    All pixels that `segment` could mark lie in it; None if there are none.
    """
    hsv = cv2.cvtColor(image, cv2.COLOR_RGB2HSV)
    mask: Image | None = None
    for low, high in _coarse_gate(
        tuple(config.color), config.hue_tolerance, config.chroma
    ):
        part = cv2.inRange(hsv, low, high)
        mask = part if mask is None else cv2.bitwise_or(mask, part)
    assert mask is not None
    left, top, width, height = cv2.boundingRect(cv2.medianBlur(mask, 3))
    if width == 0:
        return None
    pad = 6
    return (
        max(left - pad, 0),
        max(top - pad, 0),
        min(left + width + pad, image.shape[1]),
        min(top + height + pad, image.shape[0]),
    )


def segment(lab: Image, config: BlobConfig) -> Image:
    """Mask (h, w) of uint8: 255 where a pixel has the marker's hue."""
    table = _gate(tuple(config.color), config.hue_tolerance, config.chroma)
    index = lab[:, :, 1].astype(np.uint16)
    index <<= 8
    index |= lab[:, :, 2]
    mask = table.take(index)
    # The majority of 3 × 3: single pixels of noise go, edges stay.
    return cv2.medianBlur(mask, 3)


def _refine(
    lab: Image, labels: Image, label: int, box: tuple[int, int, int, int]
) -> tuple[float, float, float, float, float, float]:
    """Weighted moments of one component: area, centroid, central moments.

    A pixel on the edge is partly marker and partly what is around it; where
    it stands between the two along the marker's chroma is how much of it is
    marker.
    """
    height, width = labels.shape
    left, top, w, h = box
    pad = 3
    x0, y0 = max(left - pad, 0), max(top - pad, 0)
    x1, y1 = min(left + w + pad, width), min(top + h + pad, height)
    inside = (labels[y0:y1, x0:x1] == label).astype(np.uint8)
    ab = lab[y0:y1, x0:x1, 1:].astype(np.float32) - 128.0
    kernel = np.ones((3, 3), dtype=np.uint8)
    near = cv2.dilate(inside, kernel) > 0
    core = cv2.erode(inside, kernel, borderValue=1) > 0
    if not core.any():
        core = inside > 0
    outside = ~near
    marker = np.median(ab[core], axis=0)
    around = (
        np.median(ab[outside], axis=0)
        if outside.any()
        else np.zeros(2, dtype=np.float32)
    )
    axis = marker - around
    weight = (ab - around) @ (axis / max(float(axis @ axis), 1e-6))
    weight = np.where(near, np.clip(weight, 0.0, 1.0), 0.0)
    weight[core] = 1.0
    weight[weight < 0.1] = 0.0
    m = cv2.moments(weight.astype(np.float32))
    area = max(m["m00"], 1e-9)
    return (
        area,
        x0 + m["m10"] / area,
        y0 + m["m01"] / area,
        m["mu20"] / area,
        m["mu11"] / area,
        m["mu02"] / area,
    )


def detect(image: Image, config: BlobConfig) -> Blob | None:
    """The marker in an RGB(A) image (h, w, 3 or 4) of uint8; None if unseen.

    What passes the gates of hue, chroma, area and shape with the highest
    confidence · √area is the marker.
    """
    height, width = image.shape[:2]
    region = config.region
    x0, x1 = round(region[0] * width), round(region[2] * width)
    y0, y1 = round(region[1] * height), round(region[3] * height)
    part = image[y0:y1, x0:x1]
    if part.size == 0:
        return None
    candidates = find_candidates(part, config)
    if candidates is None:
        return None
    left, top, right, bottom = candidates
    part = part[top:bottom, left:right]
    x0, y0 = x0 + left, y0 + top
    lab = cv2.cvtColor(part, cv2.COLOR_RGB2Lab)
    mask = segment(lab, config)
    blobs = (
        _simple_blobs(lab, mask, config, width * height)
        if config.detector == "simple"
        else _moment_blobs(lab, mask, config, width * height)
    )
    best = max(
        blobs, key=lambda b: b.confidence * math.sqrt(b.area), default=None
    )
    if best is None:
        return None
    return dataclasses.replace(best, u=best.u + x0, v=best.v + y0)


def _moment_blobs(
    lab: Image, mask: Image, config: BlobConfig, image_area: int
) -> list[Blob]:
    if not mask.any():
        return []
    _, labels, stats, _ = cv2.connectedComponentsWithStats(mask, connectivity=8)
    areas = stats[:, cv2.CC_STAT_AREA]
    largest = [
        i
        for i in (np.argsort(-areas[1:]) + 1)[:8]
        if 0.5 * config.min_area <= areas[i] <= config.max_area * image_area
    ]
    blobs = []
    for i in largest:
        x, y, w, h = (int(value) for value in stats[i, :4])
        moments = _refine(lab, labels, int(i), (x, y, w, h))
        blob = _judge(moments, config)
        if blob is None:
            continue
        if config.complete and blob.area >= _LEAST_TO_COMPLETE:
            part = (labels[y : y + h, x : x + w] == i).astype(np.uint8)
            blob = _complete(blob, moments, part, (x, y), config)
        blobs.append(blob)
    return blobs


def _complete(
    blob: Blob,
    moments: tuple[float, float, float, float, float, float],
    part: Image,
    corner: tuple[int, int],
    config: BlobConfig,
) -> Blob:
    """The middle of the whole ellipse where a part of it is hidden.

    An ellipse that fits most of the rim is looked for from arcs of it, as
    what hides the marker cuts its rim on one side.
    """
    contours, _ = cv2.findContours(
        np.pad(part, 1), cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE
    )
    rim = max(contours, key=len)[:, 0].astype(np.float64)
    rim += np.array(corner) - 1.0
    n = len(rim)
    if n < 16:
        return blob
    area, u, v, xx, xy, yy = moments
    covariance = np.array([[xx, xy], [xy, yy]])
    # A filled ellipse's axes are twice its standard deviations; the rim's
    # pixels lie, in the mean, half a pixel within.
    inverse = np.linalg.inv(4.0 * covariance)
    offset = rim - [u, v]
    if _off_rim(offset, inverse) <= max(_ROUGH, 0.04 * math.sqrt(area)):
        return blob
    best: tuple[float, Image, Image] | None = None
    for length in (0.45, 0.6, 0.75):
        for start in range(0, n, max(1, n // 12)):
            arc = np.take(
                rim, np.arange(start, start + round(length * n)), 0, mode="wrap"
            )
            fit = _fit_ellipse(arc)
            if fit is None:
                continue
            near = np.abs(_distance(rim - fit[0], fit[1])) < _ON_RIM
            score = float(near.mean())
            if best is None or score > best[0]:
                best = score, rim[near], fit[0]
    if best is None or best[0] < 0.5 or len(best[1]) < 8:
        return blob
    final = _fit_ellipse(best[1])
    if final is None:
        return blob
    middle, shape = final
    # The fit is to pixels half a pixel within the edge.
    size = np.sqrt(1.0 / np.linalg.eigvalsh(shape)) + 0.5
    whole = math.pi * float(size[0] * size[1])
    aspect = float(max(size) / min(size))
    seen = area / whole
    if not 0.45 < seen < 1.1 or aspect > config.max_aspect:
        return blob
    shift = float(np.linalg.norm(middle - [u, v]))
    if shift > max(size):
        return blob
    # Of a filled ellipse; the half pixel is that of the size above.
    inner = np.linalg.inv(shape) / 4.0
    grown = inner * (whole / (math.pi * 4.0 * math.sqrt(np.linalg.det(inner))))
    return Blob(
        float(middle[0]),
        float(middle[1]),
        area,
        blob.confidence * min(1.0, seen),
        (float(grown[0, 0]), float(grown[0, 1]), float(grown[1, 1])),
    )


def _distance(offset: Array, shape: Array) -> Array:
    """Signed distance (n,) [pixels], about, of points (n, 2) off an ellipse.

    The ellipse is xᵀ·shape·x = 1 about the origin.
    """
    r = np.sqrt(
        np.maximum(np.einsum("ni,ij,nj->n", offset, shape, offset), 1e-12)
    )
    return np.linalg.norm(offset, axis=1) * (1.0 - 1.0 / r)


def _off_rim(offset: Array, shape: Array) -> float:
    """How far the rim is off the ellipse, at most of its pixels [pixels]."""
    distance = _distance(offset, shape)
    return float(np.quantile(np.abs(distance - np.median(distance)), 0.95))


def _fit_ellipse(points: Array) -> tuple[Array, Array] | None:
    """Center (2,) and shape (2, 2) of the ellipse nearest to points (n, 2)."""
    if len(points) < 6:
        return None
    origin = points.mean(axis=0)
    found = cv2.fitEllipseDirect((points - origin).astype(np.float32))
    (u, v), (width, height), angle = found
    if not (math.isfinite(u) and min(width, height) > 2.0):
        return None
    if max(width, height) > 1e3:
        return None
    c, s = math.cos(math.radians(angle)), math.sin(math.radians(angle))
    turn = np.array([[c, -s], [s, c]])
    scale = np.diag([4.0 / width**2, 4.0 / height**2])
    return origin + [u, v], turn @ scale @ turn.T


def _judge(
    moments: tuple[float, float, float, float, float, float],
    config: BlobConfig,
) -> Blob | None:
    """A Blob, if area and shape pass."""
    area, u, v, xx, xy, yy = moments
    if area < config.min_area:
        return None
    mean, spread = 0.5 * (xx + yy), math.hypot(0.5 * (xx - yy), xy)
    major, minor = mean + spread, max(mean - spread, 1e-9)
    aspect = math.sqrt(major / minor)
    # A pixel's own extent adds 1/12 to the variance of a sampled shape; that
    # matters where a blob is a few pixels wide.
    fill = area / (4.0 * math.pi * math.sqrt(major * minor))
    if fill < config.min_fill or aspect > config.max_aspect:
        return None
    shape = min(1.0, max(0.0, 1.0 - 4.0 * abs(1.0 - fill)))
    size = min(1.0, area / (2.0 * config.min_area))
    return Blob(u, v, area, 0.2 + 0.8 * shape * size, (xx, xy, yy))


def _simple_blobs(
    lab: Image, mask: Image, config: BlobConfig, image_area: int
) -> list[Blob]:
    """OpenCV's SimpleBlobDetector on the mask."""
    module: Any = cv2
    params = module.SimpleBlobDetector_Params()
    params.minThreshold, params.maxThreshold = 100, 156
    params.thresholdStep, params.minRepeatability = 50, 1
    params.filterByColor, params.blobColor = True, 255
    params.filterByArea = True
    params.minArea = config.min_area
    params.maxArea = config.max_area * image_area
    params.filterByCircularity = False
    params.filterByInertia = True
    params.minInertiaRatio = 1.0 / config.max_aspect**2
    params.filterByConvexity = True
    params.minConvexity = config.min_fill
    keypoints = module.SimpleBlobDetector_create(params).detect(mask)
    blobs = []
    for keypoint in keypoints:
        area = math.pi * (0.5 * keypoint.size) ** 2
        u, v = keypoint.pt
        blobs.append(Blob(u, v, area, min(1.0, area / 25.0)))
    return blobs
