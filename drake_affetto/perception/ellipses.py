"""Ellipses in an image: fits to rims that are seen in part.

An ellipse is its center and a shape (2, 2): points p with
(p - center)ᵀ · shape · (p - center) = 1.
"""

from collections.abc import Sequence
import dataclasses
import math

import cv2
import numpy as np

from drake_affetto.common.typing import Array, Image

# What lies this near to an ellipse is on it [pixels].
ON_RIM = 0.6
# Sectors of an ellipse in which its rim is looked for.
_SECTORS = 24


@dataclasses.dataclass(frozen=True)
class Ellipse:
    """An ellipse.

    Attributes:
        center: (2,) [pixels].
        shape: (2, 2) [1/pixels²].
    """

    center: Array
    shape: Array

    @property
    def axes(self) -> Array:
        """Half axes (2,) [pixels], the longer one first."""
        return np.sqrt(1.0 / np.linalg.eigvalsh(self.shape))

    def distance(self, points: Array) -> Array:
        """Signed distance (n,) [pixels], about, of points (n, 2) off it."""
        offset = points - self.center
        r = np.sqrt(
            np.maximum(
                np.einsum("ni,ij,nj->n", offset, self.shape, offset), 1e-12
            )
        )
        return np.linalg.norm(offset, axis=1) * (1.0 - 1.0 / r)

    def filled_moments(self) -> tuple[float, float, float]:
        """Variance along u, covariance, and variance along v of its pixels.

        For an ellipse through the pixels of a rim, half a pixel within it.
        """
        a, b = self.axes
        inner = np.linalg.inv(self.shape) / 4.0
        inner *= (a + 0.5) * (b + 0.5) / (a * b)
        return float(inner[0, 0]), float(inner[0, 1]), float(inner[1, 1])

    def beyond(self, rim: Array) -> float:
        """How far points (n, 2) of a rim are outside, at most of it [pixels].

        What hides a marker takes away, and adds nothing.
        """
        return float(np.quantile(self.distance(rim), 0.97))

    def covered(self, points: Array) -> float:
        """Share of its rim, in sectors, at which there is one of points."""
        size, axes = np.linalg.eigh(self.shape)
        around = ((points - self.center) @ axes) * np.sqrt(size)
        angle = np.arctan2(around[:, 1], around[:, 0]) / (2.0 * math.pi)
        sectors = np.floor(angle * _SECTORS).astype(int) % _SECTORS
        return len(np.unique(sectors)) / _SECTORS


def fit_ellipse(points: Array) -> Ellipse | None:
    """The ellipse nearest to points (n, 2); None where there is no such."""
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
    return Ellipse(origin + [u, v], turn @ scale @ turn.T)


def find_rim(part: Image, corner: tuple[int, int]) -> Array:
    """The outer rim (n, 2) [pixels] of a part of an image, in order.

    Args:
        part: Mask (h, w) of uint8, above 0 on the part.
        corner: u and v of the mask's first pixel.
    """
    contours, _ = cv2.findContours(
        np.pad(part, 1), cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE
    )
    rim = max(contours, key=len)[:, 0].astype(np.float64)
    return rim + (np.array(corner) - 1.0)


def fit_arcs(rim: Array) -> tuple[Ellipse, Array] | None:
    """The ellipse that most of a rim lies on, with the points that do.

    It is looked for from arcs of the rim, as what hides a round thing cuts
    its rim on one side.

    Args:
        rim: (n, 2) [pixels], in order.
    """
    n = len(rim)
    best: tuple[float, Array] | None = None
    for length in (0.45, 0.6, 0.75):
        for start in range(0, n, max(1, n // 12)):
            arc = np.take(
                rim, np.arange(start, start + round(length * n)), 0, mode="wrap"
            )
            fit = fit_ellipse(arc)
            if fit is None:
                continue
            near = np.abs(fit.distance(rim)) < ON_RIM
            score = float(near.mean())
            if best is None or score > best[0]:
                best = score, rim[near]
    if best is None or best[0] < 0.5 or len(best[1]) < 8:
        return None
    final = fit_ellipse(best[1])
    return None if final is None else (final, best[1])


def fit_outline(rims: Sequence[Array]) -> tuple[Ellipse, Array] | None:
    """The ellipse around several parts, with the points that lie on it.

    What lies across a round thing leaves parts whose outer rims are those of
    the whole, and lie on the hull of all.

    Args:
        rims: Of each part, (n, 2) [pixels].
    """
    rim = np.concatenate(rims)
    hull = cv2.convexHull(rim.astype(np.float32))[:, 0].astype(float)
    side = np.roll(hull, -1, axis=0) - hull
    length = np.maximum(np.linalg.norm(side, axis=1), 1e-9)
    way = rim[:, None] - hull
    cross = side[:, 0] * way[..., 1] - side[:, 1] * way[..., 0]
    outer = rim[(np.abs(cross) / length).min(axis=1) < 1.0]
    fit = fit_ellipse(outer)
    for _ in range(3):
        if fit is None:
            return None
        near = np.abs(fit.distance(rim)) < 1.5 * ON_RIM
        if near.sum() < 8:
            return None
        outer = rim[near]
        fit = fit_ellipse(outer)
    return None if fit is None else (fit, outer)
