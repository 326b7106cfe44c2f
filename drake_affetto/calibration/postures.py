"""Which posture of the hand tells most of the mirror, and when to end."""

from collections.abc import Sequence
import dataclasses

import numpy as np

from drake_affetto.calibration.config import HandConfig
from drake_affetto.calibration.hand import (
    HandEstimate,
    HandLook,
    HandProblem,
    estimate_from_hand,
    hand_pixels,
)
from drake_affetto.calibration.knowledge import (
    KnowledgeErrors,
    RobotKnowledge,
    in_image,
)
from drake_affetto.calibration.plane import CalibrationFailure, PlanePrior
from drake_affetto.common.typing import Array
from drake_affetto.geometry.planes import reflect

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
# Looking goes on until at least so many looks agree.
_ENOUGH = 6


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
        self._problem = HandProblem(knowledge, errors, prior, config.pixel_sd)
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
                apart = np.linalg.norm(self._hand[:, None] - been, axis=-1).min(
                    axis=1
                )
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
            uv = hand_pixels(robot, self._planes, reference, look.readings)
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
                at = hand_pixels(
                    robot, planes, self._problem.reference, look.readings
                )
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
    plane = estimate.plane
    uv = hand_pixels(
        estimate.knowledge, plane.parameters, plane.reference, readings
    )
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


class HandCalibration:
    """The robot's looks at its own hand, one after another."""

    def __init__(
        self,
        knowledge: RobotKnowledge,
        errors: KnowledgeErrors,
        prior: PlanePrior,
        config: HandConfig,
        rng: np.random.Generator,
    ) -> None:
        """See `PostureChooser`.

        Args:
            knowledge: The robot's model of itself, before it has looked.
            errors: How wrong that model may be.
            prior: Where a mirror may stand.

        Raises:
            CalibrationFailure: If no posture keeps the hand in the box.
        """
        self._known = knowledge, errors
        self._prior, self._config = prior, config
        self._chooser = PostureChooser(knowledge, errors, prior, config, rng)
        self.looks: list[HandLook] = []
        # What the looks until now tell, once it has been asked for.
        self._outcome: HandEstimate | CalibrationFailure | None = None

    @property
    def done(self) -> bool:
        """Whether the plane is known well enough, or looks are used up."""
        if len(self.looks) >= self._config.looks:
            return True
        if sum(look.pixel is not None for look in self.looks) < _ENOUGH:
            return False
        try:
            estimate = self.estimate()
        except CalibrationFailure:
            return False
        return (
            int(estimate.used.sum()) >= _ENOUGH
            and estimate.plane.angle_sd <= self._config.angle_goal
            and estimate.plane.distance_sd <= self._config.distance_goal
        )

    def next_posture(self) -> Array:
        """Angles of the joints (n,) at which to look next, rad."""
        return self._chooser.next(self.looks)

    def add(self, look: HandLook) -> None:
        """Takes in a look.

        Args:
            look: Readings of the joints, and the pixel of the marker, if it was
                seen.
        """
        self.looks.append(look)
        self._outcome = None

    def estimate(self) -> HandEstimate:
        """What the looks tell.

        Raises:
            CalibrationFailure: If they do not determine the plane.
        """
        if self._outcome is None:
            try:
                self._outcome = estimate_from_hand(
                    *self._known, self.looks, self._prior, self._config
                )
            except CalibrationFailure as failure:
                self._outcome = failure
        if isinstance(self._outcome, CalibrationFailure):
            raise self._outcome
        return self._outcome

    def agreeing(self) -> list[HandLook]:
        """The looks that show the hand where the estimate has it.

        Raises:
            CalibrationFailure: If the looks do not determine the plane.
        """
        seen = [look for look in self.looks if look.pixel is not None]
        used = self.estimate().used
        return [look for look, good in zip(seen, used, strict=True) if good]
