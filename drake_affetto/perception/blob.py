"""Finding the colored marker in an image, to a fraction of a pixel.

The marker is told by its hue in CIE Lab, a space in which a hue is an angle
that changes little with the amount of light; area and shape decide among what
has that hue. Pixel coordinates are those of `optics`: integers at the centers
of the pixels.
"""

from collections.abc import Sequence
import dataclasses
import itertools
import math
from typing import Any

import cv2
import numpy as np

from drake_affetto.common.errors import InputError, require, require_range
from drake_affetto.common.fields import check_ranges, number
from drake_affetto.common.typing import Array, Image
from drake_affetto.perception.config import require_vector
from drake_affetto.perception.ellipses import (
    ON_RIM,
    Ellipse,
    find_rim,
    fit_arcs,
    fit_outline,
)
from drake_affetto.perception.hue_gate import coarse_gate, gate, marker_lab


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
        InputError: if the marker was seen at fewer than 3 places, or an
            argument does not fit.
    """
    uv = np.asarray(uv, dtype=float)
    require(
        uv.ndim == 2 and uv.shape[1] == 2,
        "uv",
        f"an array of shape {uv.shape}",
        "pixels (n, 2)",
    )
    require_range("margin", margin, 0.0, 10.0)
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
            ellipse that its rim is part of, and parts of one are put together.
        min_confidence: least confidence of a blob that is reported.
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
    min_confidence: float = number(0.35, 0.0, 1.0)
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
LEAST_TO_COMPLETE = 60.0
# How far a whole marker's rim is off its ellipse, at most of it [pixels].
_ROUGH = 0.68
# The same of a large one, by the root of its area, for lens and lattice.
_ROUGHER = 0.03
# How far a rim is outside of the ellipse that it is a part of [pixels].
_BEYOND = 0.75
# How far a small whole rim is off, where beside it there is more of its hue
# [pixels], and what is small [pixels²].
_CLEAN = 0.55
_SMALL = 150.0
# Of a whole that is completed from its parts, the share that is seen, and of
# one put together the share of its rim.
LEAST_SEEN = 0.5
_LEAST_COVERED = 0.65
# Parts that are looked at, and of those the ones that may belong together.
_MOST_PARTS = 8
_MOST_JOINED = 6
# What becomes of the confidence in a part whose whole is not found.
_DOUBT = 0.3


def _require_image(image: Image) -> None:
    """Raises InputError unless it is a color image of 8 bits."""
    expected = "an array (h, w, 3 or 4) of uint8: red, green, blue (, alpha)"
    require(isinstance(image, np.ndarray), "image", type(image), expected)
    fits = image.ndim == 3 and image.shape[2] in (3, 4)
    require(
        fits and image.dtype == np.uint8,
        "image",
        f"an array {image.shape} of {image.dtype}",
        expected,
    )


def find_candidates(
    image: Image, config: BlobConfig
) -> tuple[int, int, int, int] | None:
    """The rectangle (left, top, right, bottom) worth a closer look.

    All pixels that `segment` could mark lie in it; None if there are none.

    Raises:
        InputError: If `image` is no color image of 8 bits.
    """
    _require_image(image)
    hsv = cv2.cvtColor(image, cv2.COLOR_RGB2HSV)
    mask: Image | None = None
    for low, high in coarse_gate(
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
    table = gate(tuple(config.color), config.hue_tolerance, config.chroma)
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

    Raises:
        InputError: If `image` is no such image.
    """
    _require_image(image)
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
        (b for b in blobs if b.confidence >= config.min_confidence),
        key=lambda b: b.confidence * math.sqrt(b.area),
        default=None,
    )
    if best is None:
        return None
    return dataclasses.replace(best, u=best.u + x0, v=best.v + y0)


@dataclasses.dataclass(frozen=True)
class _Part:
    """A connected part of the marker's hue.

    Attributes:
        moments: Area, centroid and central moments, see `_refine`.
        rim: Its outer rim (n, 2) [pixels], in order.
    """

    moments: tuple[float, float, float, float, float, float]
    rim: Array

    @property
    def area(self) -> float:
        """[pixels²]."""
        return self.moments[0]


def _moment_blobs(
    lab: Image, mask: Image, config: BlobConfig, image_area: int
) -> list[Blob]:
    if not mask.any():
        return []
    _, labels, stats, _ = cv2.connectedComponentsWithStats(mask, connectivity=8)
    areas = stats[:, cv2.CC_STAT_AREA]
    parts = []
    for i in (np.argsort(-areas[1:]) + 1)[:_MOST_PARTS]:
        if (
            not 0.5 * config.min_area
            <= areas[i]
            <= (config.max_area * image_area)
        ):
            continue
        x, y, w, h = (int(value) for value in stats[i, :4])
        inside = (labels[y : y + h, x : x + w] == i).astype(np.uint8)
        parts.append(
            _Part(
                _refine(lab, labels, int(i), (x, y, w, h)),
                find_rim(inside, (x, y)),
            )
        )
    blobs = []
    if config.complete:
        joined, parts = _join(parts, config)
        blobs += joined
    for part in parts:
        blob = _judge(part.moments, config)
        if blob is None:
            continue
        if config.complete:
            blob = _complete(blob, part, parts, config)
        blobs.append(blob)
    return blobs


def _join(
    parts: Sequence[_Part], config: BlobConfig
) -> tuple[list[Blob], list[_Part]]:
    """Puts parts together that are of one ellipse, as an arm may lie across it.

    Returns:
        The blobs that are put together, and the parts that are not.
    """
    if len(parts) < 2:
        return [], list(parts)
    best: tuple[float, Blob, tuple[_Part, ...]] | None = None
    for count in (2, 3, 4):
        for group in itertools.combinations(parts[:_MOST_JOINED], count):
            found = _join_group(group, config)
            if found is not None and (best is None or found[0] > best[0]):
                best = (*found, group)
    if best is None:
        return [], list(parts)
    rest = [part for part in parts if part not in best[2]]
    more, rest = _join(rest, config)
    return [best[1], *more], rest


def _join_group(
    group: Sequence[_Part], config: BlobConfig
) -> tuple[float, Blob] | None:
    """The blob of parts that are of one ellipse, and how well they fit it."""
    found = fit_outline([part.rim for part in group])
    if found is None:
        return None
    ellipse, outer = found
    area = sum(part.area for part in group)
    # The fit is to pixels half a pixel within the edge.
    axes = ellipse.axes + 0.5
    seen = area / (math.pi * float(axes[0] * axes[1]))
    aspect = float(axes[0] / axes[1])
    rim = np.concatenate([part.rim for part in group])
    covered = ellipse.covered(outer)
    if (
        area < config.min_area
        or aspect > config.max_aspect
        or not LEAST_SEEN <= seen < 1.1
        or covered < _LEAST_COVERED
        or ellipse.beyond(rim) > max(_BEYOND, _ROUGHER * math.sqrt(area))
    ):
        return None
    for part in group:
        # Each has a share in the rim, or it is something else inside.
        own = np.abs(ellipse.distance(part.rim)) < 1.5 * ON_RIM
        if own.mean() < 0.2:
            return None
    size = min(1.0, area / (2.0 * config.min_area))
    u, v = ellipse.center
    confidence = size * min(1.0, seen) * min(1.0, covered + 0.1)
    whole = Blob(float(u), float(v), area, confidence, ellipse.filled_moments())
    return seen * covered, whole


def _complete(
    blob: Blob, part: _Part, parts: Sequence[_Part], config: BlobConfig
) -> Blob:
    """The middle of the whole ellipse where a part of it is hidden.

    A part that is no ellipse, and that none is found around, is hardly
    believed: its middle is not that of the whole.
    """
    area, u, v, xx, xy, yy = part.moments
    doubtful = dataclasses.replace(blob, confidence=_DOUBT * blob.confidence)
    if area < LEAST_TO_COMPLETE or len(part.rim) < 16:
        # Too small to tell: unless more of it may be beside it.
        return doubtful if _has_company(part, parts) else blob
    # A filled ellipse's axes are twice its standard deviations; the rim's
    # pixels lie, in the mean, half a pixel within.
    own = Ellipse(
        np.array([u, v]),
        np.linalg.inv(4.0 * np.array([[xx, xy], [xy, yy]])),
    )
    distance = own.distance(part.rim)
    off = np.quantile(np.abs(distance - np.median(distance)), 0.95)
    if off <= max(_ROUGH, _ROUGHER * math.sqrt(area)):
        clean = off <= _CLEAN or area > _SMALL or not _has_company(part, parts)
        return blob if clean else doubtful
    # A bite out of it, or a slot in it.
    slotted = _join_group((part,), config)
    if slotted is not None:
        doubtful = slotted[1]
    found = fit_arcs(part.rim)
    if found is None:
        return doubtful
    ellipse, on_it = found
    size = ellipse.axes + 0.5
    seen = area / (math.pi * float(size[0] * size[1]))
    aspect = float(size[0] / size[1])
    shift = float(np.linalg.norm(ellipse.center - [u, v]))
    if (
        not LEAST_SEEN < seen < 1.1
        or aspect > config.max_aspect
        or shift > float(size[0])
        or ellipse.beyond(part.rim) > max(_BEYOND, _ROUGHER * math.sqrt(area))
    ):
        return doubtful
    return Blob(
        float(ellipse.center[0]),
        float(ellipse.center[1]),
        area,
        # What is seen, and how much of its rim tells the ellipse.
        min(1.0, area / (2.0 * config.min_area))
        * min(1.0, seen)
        * min(1.0, len(on_it) / len(part.rim) + 0.2),
        ellipse.filled_moments(),
    )


def _has_company(part: _Part, parts: Sequence[_Part]) -> bool:
    """Whether another part, not much smaller, is as near as it is long."""
    reach = float(np.ptp(part.rim, axis=0).max()) + 1.0
    for other in parts:
        if other is part or other.area < 0.1 * part.area:
            continue
        apart = np.linalg.norm(part.rim[:, None] - other.rim, axis=-1)
        if float(apart.min()) < reach:
            return True
    return False


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
