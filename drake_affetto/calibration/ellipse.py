"""The mirror's plane from the shape of the drum's marker seen in it.

The marker is a level disc of known size at a known height, at places that are
not known. Its image in the mirror is an ellipse: the size tells how far away
the reflected disc is, the slant how it leans. As the reflection of the
vertical leans by twice the mirror's own lean, towards where the mirror looks,
that determines the plane; for each plane the middle tells the place.
"""

from collections.abc import Sequence
import dataclasses

import numpy as np
from scipy.optimize import least_squares

from drake_affetto.calibration.config import EllipseConfig
from drake_affetto.calibration.knowledge import (
    KnowledgeErrors,
    RobotKnowledge,
)
from drake_affetto.calibration.plane import (
    CalibrationFailure,
    PlaneEstimate,
    PlanePrior,
)
from drake_affetto.common.typing import Array
from drake_affetto.geometry.optics import (
    disc_outline,
    invert_pose,
    transform_points,
)
from drake_affetto.geometry.planes import reflect

# From how many planes of the prior the search may begin, and does begin.
_DRAWN, _STARTS = 200, 4
# About how far the plane moves in a step of a search.
_SCALE = np.array([0.1, 0.1, 0.05])
# So far off, in squared deviations, all shapes are equally wrong.
_GROSS = 400.0
# Of a correction only the camera's part, the first seven numbers, matters.
_CAMERA = 7


@dataclasses.dataclass(frozen=True)
class EllipseLook:
    """The drum's marker in the mirror: all that the robot has of it.

    Attributes:
        center: Its middle (2,), px.
        moments: Variances and covariance of its pixels' places along u, u and
            v, and v (3,), px².
    """

    center: Array
    moments: Array


def shape_features(moments: Array) -> Array:
    """Second moments (..., 3), px², as lengths (..., 3), px.

    The Cholesky factor of their matrix: its noise is about the same for all
    shapes.
    """
    xx, xy, yy = np.moveaxis(np.asarray(moments, dtype=float), -1, 0)
    first = np.sqrt(np.maximum(xx, 1e-9))
    slope = xy / first
    last = np.sqrt(np.maximum(yy - slope**2, 1e-9))
    return np.stack([first, slope, last], axis=-1)


def polygon_moments(uv: Array) -> tuple[Array, Array]:
    """Centroids (..., 2) and second moments (..., 3) of polygons (..., n, 2).

    The moments are variances and covariance about the centroid: along u, u
    and v, and v. By Green's theorem, as the area.
    """
    origin = uv.mean(axis=-2, keepdims=True)
    a = uv - origin
    b = np.roll(a, -1, axis=-2)
    (ax, ay), (bx, by) = np.moveaxis(a, -1, 0), np.moveaxis(b, -1, 0)
    cross = ax * by - bx * ay
    area = 0.5 * cross.sum(axis=-1)
    u = (cross * (ax + bx)).sum(axis=-1) / (6.0 * area)
    v = (cross * (ay + by)).sum(axis=-1) / (6.0 * area)
    uu = (cross * (ax * ax + ax * bx + bx * bx)).sum(axis=-1)
    vv = (cross * (ay * ay + ay * by + by * by)).sum(axis=-1)
    uv_ = cross * (ax * by + 2.0 * ax * ay + 2.0 * bx * by + bx * ay)
    moments = np.stack(
        [
            uu / (12.0 * area) - u * u,
            uv_.sum(axis=-1) / (24.0 * area) - u * v,
            vv / (12.0 * area) - v * v,
        ],
        axis=-1,
    )
    return origin[..., 0, :] + np.stack([u, v], axis=-1), moments


def expected_ellipse(
    knowledge: RobotKnowledge,
    plane: Array,
    reference: Array,
    xy: Array,
    blur: float,
) -> tuple[Array, Array]:
    """The marker's images in the mirror: middles and moments.

    Args:
        knowledge: The robot's model of itself.
        plane: The mirror's plane (3,).
        reference: Its reference point (3,), m.
        xy: Places of the drum (..., 2), m.
        blur: Standard deviation of the image's blur, px.

    Returns:
        Middles (..., 2), px, and moments (..., 3), px², of markers that are
        before the camera; else NaN.
    """
    flat = disc_outline(
        np.array([0.0, 0.0, knowledge.marker_height]),
        np.array([0.0, 0.0, 1.0]),
        knowledge.marker_radius,
    )
    xy = np.asarray(xy, dtype=float)
    outline = np.broadcast_to(flat, (*xy.shape[:-1], *flat.shape)).copy()
    outline[..., :2] += xy[..., None, :]
    image = reflect(plane, reference, outline)
    X_CW = invert_pose(knowledge.eye(knowledge.posture))
    uv = knowledge.camera.project(transform_points(X_CW, image))
    center, moments = polygon_moments(uv)
    return center, moments + blur**2 * np.array([1.0, 0.0, 1.0])


@dataclasses.dataclass(frozen=True)
class EllipseEstimate:
    """What the marker's ellipses tell.

    Attributes:
        plane: The mirror's plane.
        knowledge: The robot's model of itself, corrected.
        places: Where the drum was (m, 2), m.
    """

    plane: PlaneEstimate
    knowledge: RobotKnowledge
    places: Array


def estimate_from_ellipses(
    knowledge: RobotKnowledge,
    errors: KnowledgeErrors,
    looks: Sequence[EllipseLook],
    prior: PlanePrior,
    config: EllipseConfig,
) -> EllipseEstimate:
    """The mirror's plane from ellipses at several places of the drum.

    Args:
        knowledge: The robot's model of itself.
        errors: How exactly it knows itself.
        looks: One at each place of the drum.
        prior: What is taken for granted of the mirror.
        config: Noise and the least number of looks.

    Raises:
        CalibrationFailure: If there are too few looks.
    """
    if len(looks) < config.fewest:
        raise CalibrationFailure(
            f"the drum's marker is seen in the mirror at {len(looks)} places, "
            f"expected at least {config.fewest}"
        )
    reference = knowledge.eye_position
    seen = np.array([look.center for look in looks], dtype=float)
    shape = shape_features(np.array([look.moments for look in looks]))
    deviation = errors.deviation(len(knowledge.joints))[:_CAMERA]
    sought = np.flatnonzero(deviation > 0.0)

    def robot_of(x: Array) -> RobotKnowledge:
        correction = np.zeros(knowledge.corrections)
        correction[sought] = x[6:] * deviation[sought]
        return knowledge.corrected(correction)

    def residuals(x: Array) -> Array:
        robot = robot_of(x)
        places = robot.places(x[:3], reference, seen)
        _, moments = expected_ellipse(
            robot, x[:3], reference, places, config.blur
        )
        # A marker behind the camera is no small ellipse.
        expected = shape_features(np.nan_to_num(moments, nan=0.0))
        expected = expected + config.bias + config.bias_sd * x[3:6]
        return np.concatenate(
            [
                ((expected - shape) / config.moment_sd).ravel(),
                prior.residuals(x[:3]),
                x[3:],
            ]
        )

    drawn = prior.draw(_DRAWN, np.random.default_rng(0))
    # The plane, the images' common error, and the camera's correction.
    starts = np.column_stack([drawn, np.zeros((_DRAWN, 3 + len(sought)))])
    costs = [np.sum(np.minimum(residuals(x) ** 2, _GROSS)) for x in starts]
    scale = np.concatenate([_SCALE, np.ones(3 + len(sought))])
    fits = [
        least_squares(residuals, starts[i], loss="soft_l1", x_scale=scale)
        for i in np.argsort(costs)[:_STARTS]
    ]
    best = min(fits, key=lambda fit: fit.cost)
    fit = least_squares(residuals, best.x, x_scale=scale)
    covariance = np.linalg.inv(fit.jac.T @ fit.jac)[:3, :3]
    # Where the images scatter more than stated, less is known.
    excess = 2.0 * fit.cost / max(1, 3 * len(looks) - 3)
    robot = robot_of(fit.x)
    return EllipseEstimate(
        PlaneEstimate(fit.x[:3], covariance * max(1.0, excess), reference),
        robot,
        robot.places(fit.x[:3], reference, seen),
    )
