"""What is known of a mirror's plane.

Its three parameters are those of `drake_affetto.geometry.planes`. With the
camera as the reference point they are those of `OpticalMap`.
"""

import dataclasses

import numpy as np

from drake_affetto.common.fields import check_ranges, number
from drake_affetto.common.typing import Array
from drake_affetto.geometry.planes import moved, normal_slopes

# 95 % of a chi-squared variable of three degrees of freedom.
CHI2_95 = 7.8147


class CalibrationFailure(Exception):
    """The mirror could not be found; the message says what is missing."""


@dataclasses.dataclass
class PlanePrior:
    """What is taken for granted of the plane: "somewhere on my left".

    Attributes:
        azimuth: Mean azimuth of the normal, rad.
        elevation: Mean elevation of the normal, rad.
        distance: Mean distance from the camera, m.
        azimuth_sd: Standard deviation of the azimuth, rad.
        elevation_sd: Standard deviation of the elevation, rad.
        distance_sd: Standard deviation of the distance, m.
    """

    azimuth: float = number(-1.57, -3.2, 3.2)
    elevation: float = number(-0.15, -1.5, 1.5)
    distance: float = number(0.35, 0.01, 5.0)
    azimuth_sd: float = number(0.35, 1e-4, 3.2)
    elevation_sd: float = number(0.2, 1e-4, 1.5)
    distance_sd: float = number(0.12, 1e-4, 5.0)

    def check(self, where: str) -> None:
        """Raises InputError naming the first field out of range."""
        check_ranges(self, where)

    @property
    def mean(self) -> Array:
        """(3,)."""
        return np.array([self.azimuth, self.elevation, self.distance])

    @property
    def deviation(self) -> Array:
        """(3,)."""
        return np.array([self.azimuth_sd, self.elevation_sd, self.distance_sd])

    def draw(self, count: int, rng: np.random.Generator) -> Array:
        """Planes (count, 3); none of them is behind the camera.

        Args:
            count: Number of planes.
        """
        drawn = self.mean + self.deviation * rng.standard_normal((count, 3))
        drawn[:, 2] = np.maximum(np.abs(drawn[:, 2]), 0.05)
        return drawn

    def residuals(self, parameters: Array) -> Array:
        """How far planes (..., 3) are off the mean, in deviations.

        Args:
            parameters: Three numbers of each plane (..., 3).
        """
        return (parameters - self.mean) / self.deviation


@dataclasses.dataclass(frozen=True)
class PlaneEstimate:
    """What is believed of a mirror's plane.

    Attributes:
        parameters: (3,), see the module.
        covariance: (3, 3) of the parameters.
        reference: Reference point (3,), m.
    """

    parameters: Array
    covariance: Array
    reference: Array

    @property
    def angle_sd(self) -> float:
        """Root mean square of the normal's angle from the true one, rad."""
        level = np.cos(self.parameters[1])
        variance = np.diag(self.covariance)
        return float(np.sqrt(level**2 * variance[0] + variance[1]))

    @property
    def distance_sd(self) -> float:
        """Standard deviation of the distance, m."""
        return float(np.sqrt(self.covariance[2, 2]))

    def from_point(self, reference: Array) -> "PlaneEstimate":
        """The same, told from another reference point (3,).

        Args:
            reference: Point of reference (3,), m.
        """
        by = reference - self.reference
        J = np.eye(3)
        J[2, :2] = by @ normal_slopes(self.parameters)
        return PlaneEstimate(
            moved(self.parameters, self.reference, reference),
            J @ self.covariance @ J.T,
            reference,
        )

    def draw(self, count: int, rng: np.random.Generator) -> Array:
        """Planes (count, 3) as they are believed possible.

        Args:
            count: Number of planes.
        """
        return rng.multivariate_normal(self.parameters, self.covariance, count)

    def distance2(self, parameters: Array) -> float:
        """Squared distance of a plane (3,) in deviations (Mahalanobis).

        Args:
            parameters: The plane's three numbers.
        """
        off = np.asarray(parameters) - self.parameters
        off[0] = (off[0] + np.pi) % (2 * np.pi) - np.pi
        return float(off @ np.linalg.solve(self.covariance, off))

    def covers(self, parameters: Array) -> bool:
        """Whether a plane (3,) is in the region of 95 %.

        Args:
            parameters: The plane's three numbers.
        """
        return self.distance2(parameters) <= CHI2_95
