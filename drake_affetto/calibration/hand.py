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
    in_image,
)
from drake_affetto.calibration.plane import (
    CalibrationFailure,
    PlaneEstimate,
    PlanePrior,
    reflect,
)
from drake_affetto.common.typing import Array, Mask

# A look that is so many deviations off is left out of the last fit.
_GROSS = 4.0
# From how many planes of the prior the search may begin, and does begin.
_DRAWN, _STARTS = 3000, 4
# Beyond it all images are equally wrong as a search begins, px.
_COARSE = 40.0
# About how far the plane moves in a step of a search.
_SCALE = np.array([0.1, 0.1, 0.05])
# Looks with which the plane is guessed, to choose the next posture by.
_FEWEST_TO_CHOOSE = 3
# Planes that are still possible, for the first choices; noise of an image
# among so few, px, and the share of images that are something else.
_PLANES, _WIDE, _ODD = 6000, 15.0, 0.05
# How much an image that should show the hand and does not speaks against a
# plane: the glass may end before.
_ABSENT = 0.4
# The hand is moved on by so much, at least, while little is known, m.
_APART = 0.06
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


class _Problem:
    """The residuals of plane and correction, as one vector of unknowns."""

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
        return 3 + len(self._sought)

    def correction(self, unknowns: Array) -> Array:
        correction = np.zeros(self.knowledge.corrections)
        correction[self._sought] = unknowns[3:] * self._deviation
        return correction

    def pixels(self, unknowns: Array, readings: Array) -> Array:
        """Where the marker shows (m, 2) at readings (m, n), px."""
        robot = self.knowledge.corrected(self.correction(unknowns))
        image = reflect(unknowns[:3], self.reference, robot.hand(readings))
        uv = robot.pixels(robot.eye(readings), image)
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
    problem = _Problem(knowledge, errors, prior, config.pixel_sd)
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
    problem: _Problem,
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


def _seen(
    looks: Sequence[HandLook], config: HandConfig
) -> tuple[Array, Array]:
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


def _robust_plane(problem: _Problem, readings: Array, pixels: Array) -> Array:
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


class PostureChooser:
    """Chooses the posture of the next look at the hand.

    Candidates hold the trunk still and the hand within a box, out of the
    direct view. While the plane is unknown, what counts is whether the hand
    would show in the mirror under the planes that are still possible; then
    also how much a look there would tell of the plane (least determinant of
    its covariance).
    """

    def __init__(
        self,
        knowledge: RobotKnowledge,
        errors: KnowledgeErrors,
        prior: PlanePrior,
        config: HandConfig,
        rng: np.random.Generator,
    ) -> None:
        """Draws the candidates.

        Raises:
            CalibrationFailure: If no posture keeps the hand in the box.
        """
        self._knowledge, self._errors = knowledge, errors
        self._config, self._prior = config, prior
        self._problem = _Problem(knowledge, errors, prior, config.pixel_sd)
        self.candidates = _candidates(knowledge, config, rng)
        self._hand = knowledge.hand(self.candidates)
        self._planes = prior.draw(_PLANES, rng)
        self._free = np.ones(len(self.candidates), dtype=bool)

    def next(self, looks: Sequence[HandLook]) -> Array:
        """The next posture (n,), rad, after the looks until now."""
        estimate = self._provisional(looks)
        if estimate is None:
            score = self._chance_by_planes(looks)
            # Far from where the hand has been seen already.
            if looks:
                been = self._knowledge.hand(
                    np.array([look.readings for look in looks])
                )
                apart = np.linalg.norm(
                    self._hand[:, None] - been, axis=-1
                ).min(axis=1)
                score = score * np.minimum(apart / _APART, 1.0)
        else:
            score = self._worth(looks, estimate)
        score = np.where(self._free, score, -np.inf)
        best = int(np.argmax(score))
        self._free[best] = False
        return self.candidates[best]

    def _provisional(self, looks: Sequence[HandLook]) -> HandEstimate | None:
        """What the looks tell, however little, to choose the next one by."""
        config = dataclasses.replace(
            self._config,
            fewest=_FEWEST_TO_CHOOSE,
            spread=0.0,
            angle_limit=np.inf,
            distance_limit=np.inf,
        )
        try:
            return estimate_from_hand(
                self._knowledge, self._errors, looks, self._prior, config
            )
        except CalibrationFailure:
            return None

    def _chance_by_planes(self, looks: Sequence[HandLook]) -> Array:
        """(m,), in how many of the possible planes the hand would show."""
        robot, reference = self._knowledge, self._problem.reference
        log = np.zeros(len(self._planes))
        for look in looks:
            image = reflect(self._planes, reference, robot.hand(look.readings))
            uv = robot.pixels(robot.eye(look.readings), image)
            if look.pixel is None:
                log += np.log(_ABSENT) * robot.camera.inside(uv)
            else:
                off = np.nan_to_num(uv - look.pixel, nan=1e3)
                square = np.sum((off / _WIDE) ** 2, axis=-1)
                log += np.log(_ODD + np.exp(-0.5 * square))
        weights = np.exp(log - log.max())
        likely = np.argsort(-weights)[:200]
        weights = weights[likely] / weights[likely].sum()
        X_WC = robot.eye(self.candidates)
        image = reflect(self._planes[likely, None], reference, self._hand)
        uv = robot.pixels(X_WC, image)
        shows = robot.camera.inside(uv, 10.0) * self._near(
            looks, np.nan_to_num(uv, nan=1e4), self._planes[likely]
        )
        return weights @ shows

    def _near(
        self, looks: Sequence[HandLook], uv: Array, planes: Array
    ) -> Array:
        """Chance (..., m) that the marker shows at uv, by past looks.

        Args:
            looks: Past looks.
            uv: Images (..., m, 2), px.
            planes: Planes (..., 3) by which looks that do not show the marker
                should have done so.
        """
        robot = self._knowledge
        yes = np.full(uv.shape[:-1], 0.6)
        no = np.full(uv.shape[:-1], 0.4)
        for look in looks:
            if look.pixel is None:
                image = reflect(
                    planes, self._problem.reference, robot.hand(look.readings)
                )
                at = robot.pixels(robot.eye(look.readings), image)
                at = np.nan_to_num(at, nan=-1e4)[..., None, :]
            else:
                at = look.pixel
            square = np.sum((uv - at) ** 2, axis=-1)
            near = np.exp(-0.5 * square / self._config.visible_width**2)
            if look.pixel is None:
                no += 2.0 * near
            else:
                yes += near
        return yes / (yes + no)

    def _worth(
        self, looks: Sequence[HandLook], estimate: HandEstimate
    ) -> Array:
        """(m,): chance to see the hand times what it would tell."""
        uv = _expected(estimate, self.candidates)
        inside = self._knowledge.camera.inside(uv, 8.0)
        chance = inside * self._near(looks, uv, estimate.plane.parameters)
        unknowns = np.concatenate(
            [
                estimate.plane.parameters,
                np.zeros(self._problem.size - 3),
            ]
        )
        J = self._problem.jacobian(unknowns, self.candidates)
        information = estimate.information + np.swapaxes(J, 1, 2) @ J
        plane = np.linalg.inv(information)[:, :3, :3]
        before = np.linalg.inv(estimate.information)[:3, :3]
        gain = np.linalg.slogdet(before)[1] - np.linalg.slogdet(plane)[1]
        return chance * gain


def _expected(estimate: HandEstimate, readings: Array) -> Array:
    """Pixels (m, 2) at which the hand should show at readings (m, n)."""
    robot = estimate.knowledge
    image = reflect(
        estimate.plane.parameters,
        estimate.plane.reference,
        robot.hand(readings),
    )
    uv = robot.pixels(robot.eye(readings), image)
    return np.nan_to_num(uv, nan=1e4)


def _candidates(
    knowledge: RobotKnowledge, config: HandConfig, rng: np.random.Generator
) -> Array:
    """Postures (m, n) with the hand in the box and out of the direct view."""
    chain = knowledge.hand_chain
    names = list(chain.names)
    trunk = set(knowledge.eye_chain.names)
    drawn = np.tile(knowledge.posture, (40 * config.candidates, 1))
    for i, name in enumerate(knowledge.joints):
        if name in trunk or name not in names:
            continue
        k = names.index(name)
        low = chain.lower[k] + config.joint_margin
        high = chain.upper[k] - config.joint_margin
        drawn[:, i] = rng.uniform(low, high, len(drawn))
    hand = knowledge.hand(drawn)
    good = np.all(
        (hand >= config.space_low) & (hand <= config.space_high), axis=1
    ) & ~in_image(knowledge, drawn, config.clear)
    drawn = drawn[good][: config.candidates]
    if len(drawn) == 0:
        raise CalibrationFailure(
            f"no posture brings the hand's marker between {config.space_low} "
            f"and {config.space_high} m and keeps it out of the direct view"
        )
    return drawn
