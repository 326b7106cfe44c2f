"""Draws over a camera's image: blob, calibration box, workspace, words.

Everything is drawn on an enlarged copy, at pixel coordinates of the original.
"""

import itertools

import cv2
import numpy as np

from drake_affetto.common.typing import Array
from drake_affetto.perception.blob import BlobCalibration

# RGB, told apart also in print and by most who see colors differently.
BLOB = (255, 0, 255)
GRID = (0, 200, 255)
WORKSPACE = (255, 220, 0)
TRUTH = (255, 255, 255)

_FONT = cv2.FONT_HERSHEY_SIMPLEX
_SHIFT = 4  # fractional bits of OpenCV's coordinates


class Canvas:
    """An enlarged copy of an image to draw on."""

    def __init__(self, image: Array, scale: int = 3) -> None:
        """Enlarges `image` (h, w, 3 or 4) of uint8 by a whole factor."""
        self.scale = scale
        self.image = cv2.resize(
            np.ascontiguousarray(image[:, :, :3]),
            None,
            fx=scale,
            fy=scale,
            interpolation=cv2.INTER_NEAREST,
        )

    def _point(self, uv: Array) -> Array:
        """OpenCV's fixed-point coordinates of pixel coordinates (..., 2)."""
        enlarged = (np.asarray(uv, dtype=float) + 0.5) * self.scale - 0.5
        limit = 1e5
        return np.rint(np.clip(enlarged, -limit, limit) * 2**_SHIFT).astype(
            np.int32
        )

    def polyline(
        self,
        uv: Array,
        color: tuple[int, int, int],
        closed: bool = False,
        width: int = 1,
    ) -> None:
        """A line through pixels uv (n, 2); it breaks where they are NaN."""
        uv = np.asarray(uv, dtype=float)
        if closed:
            uv = np.vstack([uv, uv[:1]])
        for a, b in itertools.pairwise(uv):
            if not np.all(np.isfinite([a, b])):
                continue
            cv2.line(
                self.image,
                tuple(map(int, self._point(a))),
                tuple(map(int, self._point(b))),
                color,
                width,
                cv2.LINE_AA,
                _SHIFT,
            )

    def cross(
        self, uv: Array, color: tuple[int, int, int], size: float = 6.0
    ) -> None:
        """An upright cross with its middle at a pixel uv (2,)."""
        for step in (np.array([size, 0.0]), np.array([0.0, size])):
            self.polyline(np.array([uv - step, uv + step]), color, width=2)

    def circle(
        self, uv: Array, radius: float, color: tuple[int, int, int]
    ) -> None:
        """A circle about a pixel uv (2,)."""
        angle = np.linspace(0.0, 2 * np.pi, 49)
        rim = np.stack([np.cos(angle), np.sin(angle)], axis=-1)
        self.polyline(np.asarray(uv) + radius * rim, color, width=2)

    def text(
        self,
        words: str,
        at: tuple[float, float],
        color: tuple[int, int, int] = (255, 255, 255),
    ) -> None:
        """Words whose lower left corner is at a pixel, with a dark rim."""
        x, y = (int(v) >> _SHIFT for v in self._point(np.array(at)))
        size = 0.16 * self.scale
        for shade, width in (((0, 0, 0), 3), (color, 1)):
            cv2.putText(
                self.image,
                words,
                (x, y),
                _FONT,
                size,
                shade,
                width,
                cv2.LINE_AA,
            )

    def calibration(self, box: BlobCalibration, lines: int = 5) -> None:
        """The grid of x_img, y_img from 0 to 1."""
        steps = np.linspace(0.0, 1.0, lines)
        for s in steps:
            ends = box.pixels(np.array([[[s, 0], [s, 1]], [[0, s], [1, s]]]))
            for line in ends:
                self.polyline(line, GRID, width=1)
        height, width = self.image.shape[:2]
        for name, xy, shift in (
            ("0,0", (0.0, 0.0), (1.0, 6.0)),
            ("1,1", (1.0, 1.0), (-16.0, -2.0)),
        ):
            corner = box.pixels(np.array(xy)) + shift
            corner = np.clip(
                corner,
                [1.0, 7.0],
                [width / self.scale - 18.0, height / self.scale - 2.0],
            )
            self.text(name, (corner[0], corner[1]), GRID)

    def blob(self, pixels: Array) -> None:
        """What the blob sensor found (u, v, area, confidence); may be none."""
        u, v, area, _ = pixels
        if area <= 0.0:
            self.text("no marker", (4.0, 12.0), BLOB)
            return
        self.circle(np.array([u, v]), np.sqrt(area / np.pi) + 2.0, BLOB)
        self.cross(np.array([u, v]), BLOB)
