"""What stands before a camera that should not, drawn into its image.

Images are uint8 arrays (height, width, 3 or 4) in RGB(A).
"""

import math

import cv2
import numpy as np

from drake_affetto.common.typing import Array, Image
from drake_affetto.geometry.optics import (
    Camera,
    disc_outline,
    invert_pose,
    transform_points,
)
from drake_affetto.perception.blob import BlobConfig, find_candidates, segment

# The color of what hides the marker: a dark sleeve.
_SLEEVE = (62, 58, 66)
# A bar that hides is so many radii of the marker long to both sides.
_REACH = 1.6


def outline_in_image(
    camera: Camera, X_WC: Array, center: Array, radius: float
) -> Array | None:
    """Pixels (m, 2) of the rim of a level disc; None if it is not in view.

    Args:
        camera: Geometry of the image.
        X_WC: Pose of the camera (4, 4).
        center: Center of the disc (3,), m in the world.
        radius: Its radius, m.
    """
    rim = disc_outline(center, np.array([0.0, 0.0, 1.0]), radius)
    p_C = transform_points(invert_pose(X_WC), rim)
    if np.any(p_C[:, 2] <= 1e-3):
        return None
    uv = np.asarray(camera.project(p_C))
    size = np.array([camera.width, camera.height])
    if np.any(np.all(uv < 0.0, axis=0) | np.all(uv > size, axis=0)):
        return None
    return uv


def hide(image: Image, outline: Array, share: float, angle: float) -> None:
    """Draws a sleeve over a share of the width of what has that outline.

    Args:
        image: The image; changed in place.
        outline: Rim of the marker (m, 2), px.
        share: Share of its width that is hidden.
        angle: Direction from which it is hidden, rad.
    """
    middle = outline.mean(axis=0)
    ahead = np.array([math.cos(angle), math.sin(angle)])
    across = np.array([-ahead[1], ahead[0]])
    depth = (outline - middle) @ ahead
    width = np.abs((outline - middle) @ across).max()
    near = depth.max() - share * np.ptp(depth)
    far = depth.max() + 0.5 * np.ptp(depth) + 4.0
    corners = [
        middle + d * ahead + _REACH * w * across
        for d, w in ((near, -width), (near, width), (far, width), (far, -width))
    ]
    _fill(image, np.array(corners), _SLEEVE)


def put_disc(image: Image, outline: Array, color: list[float]) -> None:
    """Draws a disc of that outline (m, 2), px, and color in [0, 1]."""
    _fill(image, outline, tuple(round(255 * value) for value in color))


def _fill(image: Image, corners: Array, color: tuple[int, ...]) -> None:
    """Fills a polygon (m, 2) to a sixteenth of a pixel, with soft edges."""
    fixed = np.rint(16.0 * corners).astype(np.int32)
    solid = (*color, 255)[: image.shape[2]]
    cv2.fillPoly(image, [fixed], solid, cv2.LINE_AA, 4)


# Entries of `image_statistics`.
MEAN, CONTRAST, SATURATED, SHARPNESS, DIGEST, HUE_AREA = range(6)
STATISTICS = 6


def image_statistics(image: Image, config: BlobConfig) -> Array:
    """What an image is like, (STATISTICS,).

    Its mean and standard deviation in levels of gray, the share of pixels with
    a color at its upper end, the strength of its strongest edges [levels], a
    digest that only equal images share, and the area of the marker's hue, px².

    Args:
        image: (height, width, 3 or 4), uint8.
        config: How the marker looks.
    """
    gray = cv2.cvtColor(
        np.ascontiguousarray(image[..., :3]), cv2.COLOR_RGB2GRAY
    )
    mean, deviation = cv2.meanStdDev(gray)
    full = cv2.inRange(image[..., :3].max(axis=2), 255, 255)
    # Of half the size each pixel's noise is half as well; edges stay.
    half = cv2.resize(gray, None, fx=0.5, fy=0.5, interpolation=cv2.INTER_AREA)
    edges = cv2.Laplacian(half, cv2.CV_32F)
    # Edges are few: their strength is that of the strongest hundredth.
    strongest = np.partition(np.abs(edges).ravel(), -edges.size // 100)
    digest = float(cv2.sumElems(gray[::2].astype(np.float32))[0])
    digest += 1e-3 * float(cv2.sumElems(gray[1::2, ::3])[0])
    return np.array(
        [
            float(mean[0, 0]),
            float(deviation[0, 0]),
            cv2.countNonZero(full) / full.size,
            float(strongest[-edges.size // 100]),
            digest,
            _hue_area(image, config),
        ]
    )


def _hue_area(image: Image, config: BlobConfig) -> float:
    """How many pixels have the marker's hue."""
    box = find_candidates(image, config)
    if box is None:
        return 0.0
    left, top, right, bottom = box
    part = np.ascontiguousarray(image[top:bottom, left:right, :3])
    return float(
        cv2.countNonZero(segment(cv2.cvtColor(part, cv2.COLOR_RGB2Lab), config))
    )
