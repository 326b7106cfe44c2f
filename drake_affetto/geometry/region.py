"""Polygons on the table: what is inside, and points spread there."""

import numpy as np
from numpy.typing import ArrayLike

from drake_affetto.common.errors import require, require_array, require_range
from drake_affetto.common.typing import Array, Mask
from drake_affetto.geometry.optics import polygon_area


def inside_polygon(corners: ArrayLike, points: ArrayLike) -> Mask:
    """Whether points are inside a polygon or on its border.

    Args:
        corners: (k, 2), in order around the polygon, which may be concave.
        points: (..., 2).

    Returns:
        (...,).
    """
    a = np.asarray(corners, dtype=float)
    b = np.roll(a, -1, axis=0)
    p = np.asarray(points, dtype=float)[..., None, :]
    side, way = b - a, p - a
    cross = side[:, 0] * way[..., 1] - side[:, 1] * way[..., 0]
    # A ray along +x crosses the sides that span the point's height.
    spans = (a[:, 1] > p[..., 1]) != (b[:, 1] > p[..., 1])
    crossed = spans & ((cross > 0.0) == (side[:, 1] > 0.0))
    # On a side: no distance from its line, and between its ends.
    length = np.linalg.norm(side, axis=-1)
    along = (way * side).sum(axis=-1)
    slack = 1e-9 * length
    on = (
        (np.abs(cross) <= slack)
        & (along >= -slack)
        & (along <= length**2 + slack)
    )
    return (crossed.sum(axis=-1) % 2 == 1) | on.any(axis=-1)


def crosses_itself(corners: ArrayLike) -> bool:
    """Whether two sides of a polygon (k, 2) that are no neighbors meet."""
    a = np.asarray(corners, dtype=float)
    b = np.roll(a, -1, axis=0)
    count = len(a)

    def turn(p: Array, q: Array, r: Array) -> float:
        return float(
            (q[0] - p[0]) * (r[1] - p[1]) - (q[1] - p[1]) * (r[0] - p[0])
        )

    for i in range(count):
        for j in range(i + 2, count):
            if (j + 1) % count == i:
                continue
            if (
                turn(a[i], b[i], a[j]) * turn(a[i], b[i], b[j]) <= 0.0
                and turn(a[j], b[j], a[i]) * turn(a[j], b[j], b[i]) <= 0.0
            ):
                return True
    return False


def grid_inside(corners: ArrayLike, n: int) -> Array:
    """Points of an n × n grid over a polygon's box that are inside (m, 2).

    The corners themselves come with them, so that no extreme is missed.

    Raises:
        InputError: For corners that are no polygon, or n below 2.
    """
    polygon = _polygon(corners)
    require_range("n", n, 2, 10_000)
    low, high = polygon.min(axis=0), polygon.max(axis=0)
    axes = (np.linspace(low[i], high[i], n) for i in range(2))
    grid = np.stack(np.meshgrid(*axes, indexing="ij"), -1).reshape(-1, 2)
    points = np.vstack([grid[inside_polygon(polygon, grid)], polygon])
    _, first = np.unique(points.round(9), axis=0, return_index=True)
    return np.asarray(points[np.sort(first)])


def spread_inside(
    corners: ArrayLike, count: int, rng: np.random.Generator
) -> Array:
    """Random points (count, 2) in a polygon, without gaps or clusters.

    Those of a scrambled Sobol sequence over the polygon's box that lie
    inside.

    Args:
        corners: (k, 2), of a polygon with an area above 0.
        count: number of points.
        rng: source of randomness.

    Raises:
        InputError: For corners that are no polygon with an area, or no count.
    """
    from scipy.stats import qmc

    polygon = _polygon(corners)
    require_range("count", count, 0, 1_000_000)
    low, high = polygon.min(axis=0), polygon.max(axis=0)
    area = float(polygon_area(polygon))
    require(area > 0.0, "corners", polygon.tolist(), "a polygon with an area")
    share = area / float(np.prod(high - low))
    bits = max(1, int(np.ceil(np.log2(max(count / share, 2)))))
    while True:
        points = low + qmc.Sobol(2, rng=rng).random_base2(bits) * (high - low)
        points = points[inside_polygon(polygon, points)]
        if len(points) >= count:
            return np.asarray(points[:count])
        bits += 1


def _polygon(corners: ArrayLike) -> Array:
    """Corners (k, 2), k at least 3; raises InputError for others."""
    polygon = require_array("corners", corners, (None, 2))
    require(len(polygon) >= 3, "corners", polygon.tolist(), "at least three")
    return polygon
