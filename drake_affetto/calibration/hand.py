"""The mirror's plane from the robot's own hand, seen in it.

Each look gives where the hand's marker is by the joints' readings, and the
pixel at which it is seen in the mirror. Of the plane, a camera that is a
little turned and moved, joints whose zeros are a little off and a marker that
sits a little elsewhere on the hand, the most probable together are sought,
each held by how exactly it is known beforehand.
"""

from collections.abc import Sequence
import dataclasses

import numpy as np
from scipy.optimize import least_squares

from drake_affetto.calibration.config import HandConfig
from drake_affetto.calibration.knowledge import (
    KnowledgeErrors,
    RobotKnowledge,
)
from drake_affetto.calibration.plane import (
    CalibrationFailure,
    PlaneEstimate,
    PlanePrior,
)
from drake_affetto.common.typing import Array, Mask
from drake_affetto.geometry.planes import reflect

# A look that is so many deviations off is left out of the last fit.
_GROSS = 4.0
# From how many planes of the prior the search may begin, and does begin.
_DRAWN, _STARTS = 3000, 4
# Beyond it all images are equally wrong as a search begins, px.
_COARSE = 40.0
# About how far the plane moves in a step of a search.
_SCALE = np.array([0.1, 0.1, 0.05])
# Steps of numerical derivatives, of the plane and of a correction.
_STEP = 1e-5
# Corrections that are known exactly are not sought.
_EXACT = 1e-12


@dataclasses.dataclass(frozen=True)
class HandLook:
    """One look into the mirror: all that the robot has of it.

    Attributes:
        readings: Angles of its joints (n,) by its own sensors, rad.
        pixel: Where it sees its hand's marker (2,), px; None if it does not.
    """

    readings: Array
    pixel: Array | None


@dataclasses.dataclass(frozen=True)
class HandEstimate:
    """What looks at the hand tell.

    Attributes:
        plane: The mirror's plane.
        knowledge: The robot's model of itself, corrected.
        used: Which of the looks that show the marker agree (m,).
        information: (P, P), inverse covariance of plane and corrections.
        correction: The correction of the model.
    """

    plane: PlaneEstimate
    knowledge: RobotKnowledge
    used: Mask
    information: Array
    correction: Array


def hand_pixels(
    robot: RobotKnowledge, planes: Array, reference: Array, readings: Array
) -> Array:
    """Where the hand's marker shows in mirrors (..., 2), px; NaN: nowhere.

    Args:
        robot: The robot's model of itself.
        planes: Mirrors' planes (..., 3).
        reference: Their reference point (3,), m.
        readings: Readings of the joints (..., n), rad.
    """
    image = reflect(planes, reference, robot.hand(readings))
    return robot.pixels(robot.eye(readings), image)


class HandProblem:
    """Where the hand shows, by a plane and a correction of the model.

    The unknowns (P,) are the plane's three parameters, then the correction's
    numbers that are not known exactly, each in units of its deviation.

    Attributes:
        knowledge: The robot's model of itself.
        reference: Reference point of planes (3,), m: where its eye is.
    """

    def __init__(
        self,
        knowledge: RobotKnowledge,
        errors: KnowledgeErrors,
        prior: PlanePrior,
        pixel_sd: float,
    ) -> None:
        self.knowledge = knowledge
        self.prior = prior
        self.pixel_sd = pixel_sd
        self.reference = knowledge.eye_position
        deviation = errors.deviation(len(knowledge.joints))
        self._sought = np.flatnonzero(deviation > _EXACT)
        self._deviation = deviation[self._sought]

    @property
    def size(self) -> int:
        """P."""
        return 3 + len(self._sought)

    def correction(self, unknowns: Array) -> Array:
        """The correction of the model in unknowns (P,)."""
        correction = np.zeros(self.knowledge.corrections)
        correction[self._sought] = unknowns[3:] * self._deviation
        return correction

    def pixels(self, unknowns: Array, readings: Array) -> Array:
        """Where the marker shows (m, 2) at readings (m, n), px."""
        robot = self.knowledge.corrected(self.correction(unknowns))
        uv = hand_pixels(robot, unknowns[:3], self.reference, readings)
        return np.where(np.isfinite(uv), uv, 1e4)

    def beforehand(self, unknowns: Array) -> Array:
        """Residuals of what is known beforehand."""
        return np.concatenate(
            [self.prior.residuals(unknowns[:3]), unknowns[3:]]
        )

    def jacobian(self, unknowns: Array, readings: Array) -> Array:
        """∂pixels/∂unknowns (m, 2, P), in units of the pixels' noise."""
        columns = []
        for i in range(self.size):
            step = np.zeros(self.size)
            # A correction's unit is its deviation.
            step[i] = _STEP if i < 3 else 1e-3
            ahead = self.pixels(unknowns + step, readings)
            behind = self.pixels(unknowns - step, readings)
            columns.append((ahead - behind) / (2.0 * step[i]))
        return np.stack(columns, axis=-1) / self.pixel_sd

    def information(self, unknowns: Array, readings: Array) -> Array:
        """(P, P), what looks at readings (m, n) and all else tell."""
        J = self.jacobian(unknowns, readings).reshape(-1, self.size)
        before = np.ones(self.size)
        before[:3] = 1.0 / self.prior.deviation**2
        return J.T @ J + np.diag(before)


def estimate_from_hand(
    knowledge: RobotKnowledge,
    errors: KnowledgeErrors,
    looks: Sequence[HandLook],
    prior: PlanePrior,
    config: HandConfig,
) -> HandEstimate:
    """The mirror's plane from looks at the hand in it.

    A robust search (soft L1) from several planes finds which looks agree; of
    these a last fit makes the estimate, and its Jacobian the covariance.

    Args:
        knowledge: The robot's model of itself.
        errors: How exactly it knows itself.
        looks: The looks, also those that do not show the marker.
        prior: What is taken for granted of the mirror.
        config: Noise and limits.

    Raises:
        CalibrationFailure: If the looks do not determine the plane; the
            message says what is missing.
    """
    readings, pixels = _seen(looks, config)
    problem = HandProblem(knowledge, errors, prior, config.pixel_sd)
    coarse = _robust_plane(problem, readings, pixels)
    unknowns = np.concatenate([coarse, np.zeros(problem.size - 3)])
    used = np.ones(len(pixels), dtype=bool)
    unknowns = _fit(problem, readings, pixels, unknowns, "soft_l1")
    for _ in range(5):
        off = problem.pixels(unknowns, readings) - pixels
        agree = np.linalg.norm(off, axis=1) < _GROSS * config.pixel_sd
        if agree.sum() < config.fewest:
            raise CalibrationFailure(
                f"only {int(agree.sum())} of {len(used)} looks at the hand "
                f"agree on one mirror, expected at least {config.fewest}"
            )
        same, used = np.array_equal(agree, used), agree
        unknowns = _fit(
            problem, readings[used], pixels[used], unknowns, "linear"
        )
        if same:
            break
    _require_spread(knowledge, readings[used], config)
    information = problem.information(unknowns, readings[used])
    # Where the images scatter more than stated, less is known.
    off = (problem.pixels(unknowns, readings[used]) - pixels[used]).ravel()
    excess = float(np.mean((off / problem.pixel_sd) ** 2))
    covariance = np.linalg.inv(information)[:3, :3] * max(1.0, excess)
    plane = PlaneEstimate(unknowns[:3], covariance, problem.reference)
    if (
        plane.angle_sd > config.angle_limit
        or plane.distance_sd > config.distance_limit
    ):
        raise CalibrationFailure(
            f"the looks at the hand leave the mirror uncertain by "
            f"{np.degrees(plane.angle_sd):.1f} degrees and "
            f"{1e3 * plane.distance_sd:.0f} mm: the postures are too much "
            "alike"
        )
    correction = problem.correction(unknowns)
    return HandEstimate(
        plane, knowledge.corrected(correction), used, information, correction
    )


def _fit(
    problem: HandProblem,
    readings: Array,
    pixels: Array,
    start: Array,
    loss: str,
) -> Array:
    """The unknowns (P,) that fit looks (m, n), (m, 2) and prior best."""

    def residuals(x: Array) -> Array:
        off = (problem.pixels(x, readings) - pixels) / problem.pixel_sd
        return np.concatenate([off.ravel(), problem.beforehand(x)])

    scale = np.concatenate([_SCALE, np.ones(problem.size - 3)])
    return least_squares(
        residuals, start, loss=loss, x_scale=scale, ftol=1e-7, max_nfev=60
    ).x


def _seen(looks: Sequence[HandLook], config: HandConfig) -> tuple[Array, Array]:
    """Readings (m, n) and pixels (m, 2) of the looks that show the marker."""
    seen = [look for look in looks if look.pixel is not None]
    if not seen:
        raise CalibrationFailure(
            f"the hand's marker is not seen in the mirror at any of "
            f"{len(looks)} postures"
        )
    if len(seen) < config.fewest:
        raise CalibrationFailure(
            f"the hand's marker is seen in the mirror at {len(seen)} of "
            f"{len(looks)} postures, expected at least {config.fewest}"
        )
    return (
        np.array([look.readings for look in seen]),
        np.array([look.pixel for look in seen], dtype=float),
    )


def _require_spread(
    knowledge: RobotKnowledge, readings: Array, config: HandConfig
) -> None:
    """Raises CalibrationFailure where the hand was always on one line."""
    hand = knowledge.hand(readings)
    across = np.linalg.svd(hand - hand.mean(axis=0), compute_uv=False)[1]
    across /= np.sqrt(len(hand))
    if across < config.spread:
        raise CalibrationFailure(
            "the hand was seen at places that are all in one line: they "
            f"scatter by {1e3 * across:.0f} mm across it, expected at least "
            f"{1e3 * config.spread:.0f} mm"
        )


def _robust_plane(
    problem: HandProblem, readings: Array, pixels: Array
) -> Array:
    """The plane alone (3,) on which most looks agree."""
    hand = problem.knowledge.hand(readings)
    X_WC = problem.knowledge.eye(readings)

    def off(planes: Array) -> Array:
        """Differences (..., m, 2), px."""
        image = reflect(planes[..., None, :], problem.reference, hand)
        uv = problem.knowledge.pixels(X_WC, image)
        return np.where(np.isfinite(uv), uv, 1e4) - pixels

    drawn = problem.prior.draw(_DRAWN, np.random.default_rng(0))
    far = np.linalg.norm(off(drawn), axis=-1)
    order = np.argsort(np.minimum(far, _COARSE).sum(axis=-1))
    fits = [
        least_squares(
            lambda x: np.concatenate(
                [
                    off(x).ravel() / problem.pixel_sd,
                    problem.prior.residuals(x),
                ]
            ),
            drawn[i],
            loss="cauchy",
            x_scale=_SCALE,
            ftol=1e-4,
            max_nfev=40,
        )
        for i in order[:_STARTS]
    ]
    return min(fits, key=lambda fit: fit.cost).x
