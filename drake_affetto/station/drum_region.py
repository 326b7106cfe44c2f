"""Where trials put the drum."""

import dataclasses

import numpy as np
from numpy.typing import ArrayLike

from drake_affetto.common.errors import (
    require,
    require_array,
    require_interval,
    require_range,
)
from drake_affetto.common.typing import Array, Mask
from drake_affetto.geometry.optics import (
    polygon_area,
    polygon_area_centroid,
)
from drake_affetto.geometry.region import (
    crosses_itself,
    inside_polygon,
)

# The smallest region that a drum is put into, m².
_LEAST_REGION = 1e-4


@dataclasses.dataclass
class DrumRegion:
    """Where trials put the drum's center: on the table, in the world frame.

    Attributes:
        x: lower and upper limit of a box, m.
        y: lower and upper limit of a box, m.
        polygon: corners [x, y] in order, m; where there are any, they are the
            region and the box is not used.
    """

    x: list[float] = dataclasses.field(default_factory=lambda: [0.2, 0.27])
    y: list[float] = dataclasses.field(default_factory=lambda: [-0.15, -0.03])
    polygon: list[list[float]] = dataclasses.field(default_factory=list)

    def check(self, where: str) -> None:
        """Raises InputError for what is no interval or no polygon."""
        for name in ("x", "y"):
            limits = getattr(self, name)
            require_interval(f"{where}.{name}", limits)
            for i, limit in enumerate(limits):
                require_range(f"{where}.{name}[{i}]", limit, -10.0, 10.0)
        if not self.polygon:
            return
        where = f"{where}.polygon"
        for i, corner in enumerate(self.polygon):
            require_array(f"{where}[{i}]", corner, (2,), low=-10.0, high=10.0)
        require(
            len(self.polygon) >= 3
            and bool(polygon_area(self.corners) > _LEAST_REGION)
            and not crosses_itself(self.corners),
            where,
            self.polygon,
            "three corners or more around at least 1 cm², in order",
        )

    @property
    def corners(self) -> Array:
        """(k, 2), in order, m."""
        if self.polygon:
            return np.array(self.polygon, dtype=float)
        (x0, x1), (y0, y1) = self.x, self.y
        return np.array([[x0, y0], [x1, y0], [x1, y1], [x0, y1]])

    @property
    def middle(self) -> Array:
        """Center of its area (2,), m."""
        return polygon_area_centroid(self.corners)[1]

    def contains(self, xy: ArrayLike) -> Mask:
        """Whether places (..., 2), m, are in the region or on its border."""
        return inside_polygon(self.corners, xy)
