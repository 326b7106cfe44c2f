"""A belief over the mirror's plane that grows by drumming and listening.

The belief is a cloud of planes with weights. Each plane takes the pixel at
which the drum is seen to a place on the table. A stroke that is aimed at a
place is likely heard if the drum is near it: what is heard or not then tells
planes that were right from others (a particle filter; Gordon, Salmond and
Smith 1993; particles are drawn anew with the kernel of Liu and West 2001).
"""

import dataclasses

import numpy as np
from scipy.special import expit

from drake_affetto.calibration.config import EarConfig
from drake_affetto.calibration.knowledge import RobotKnowledge
from drake_affetto.calibration.plane import PlaneEstimate, PlanePrior
from drake_affetto.common.typing import Array, Mask
from drake_affetto.geometry.region import grid_inside, inside_polygon

# Points along the workspace's box where a stroke may be aimed.
_AIMS = 15
# Strokes that are aimed at the places of this many likely planes too.
_LIKELY = 40
# Particles are drawn anew once their weight is that of so few of them.
_FEW = 0.5


@dataclasses.dataclass(frozen=True)
class Stroke:
    """Where a stroke is aimed.

    Attributes:
        place: On the table (2,), m.
        tau: The task parameter (2,) of a drum there in the direct view.
        chance: Probability that it is heard.
    """

    place: Array
    tau: Array
    chance: float


class PlaneBelief:
    """What is believed of the plane, and where to strike by it."""

    def __init__(
        self,
        knowledge: RobotKnowledge,
        planes: Array,
        workspace: Array,
        config: EarConfig,
        rng: np.random.Generator,
    ) -> None:
        """Begins with planes of equal weight.

        Args:
            knowledge: The robot's model of itself.
            planes: (N, 3), told from where its eye is.
            workspace: Corners (k, 2) of where drums stand, m.
            config: How strokes tell.
            rng: Source of randomness.
        """
        self.knowledge = knowledge
        self.planes = np.array(planes, dtype=float)
        self.weights = np.full(len(planes), 1.0 / len(planes))
        self._workspace = np.asarray(workspace, dtype=float)
        self._config, self._rng = config, rng
        self._optical = knowledge.optical_map()
        self._reference = knowledge.eye_position
        self._grid = grid_inside(self._workspace, _AIMS)
        middle = self._workspace.mean(axis=0)
        away = self._workspace - middle
        length = np.linalg.norm(away, axis=1, keepdims=True)
        self._wide = middle + away * (1.0 + config.beyond / length)

    @classmethod
    def from_prior(
        cls,
        knowledge: RobotKnowledge,
        prior: PlanePrior,
        workspace: Array,
        config: EarConfig,
        rng: np.random.Generator,
    ) -> "PlaneBelief":
        """The belief of a robot that has not looked yet.

        Args:
            knowledge: The robot's model of itself.
            prior: Where a mirror may stand.
            workspace: Corners (k, 2) of where drums stand, m.
        """
        planes = prior.draw(config.particles, rng)
        return cls(knowledge, planes, workspace, config, rng)

    @classmethod
    def from_estimate(
        cls,
        knowledge: RobotKnowledge,
        estimate: PlaneEstimate,
        workspace: Array,
        config: EarConfig,
        rng: np.random.Generator,
    ) -> "PlaneBelief":
        """The belief after a calibration, with the covariance it states.

        Args:
            knowledge: The robot's model of itself.
            estimate: Plane and covariance of the calibration.
            workspace: Corners (k, 2) of where drums stand, m.
        """
        told = estimate.from_point(knowledge.eye_position)
        planes = told.draw(config.particles, rng)
        return cls(knowledge, planes, workspace, config, rng)

    @property
    def estimate(self) -> PlaneEstimate:
        """Mean and covariance."""
        mean = self.weights @ self.planes
        off = self.planes - mean
        covariance = (self.weights[:, None] * off).T @ off
        # A cloud that has shrunk to a point still has a covariance.
        covariance += 1e-12 * np.eye(3)
        return PlaneEstimate(mean, covariance, self._reference)

    def places(self, tau: Array) -> Array:
        """Where the drum seen at τ̂ (2,) is by each plane: (N, 2), m.

        NaN by planes in which it would be seen nowhere on the table.

        Args:
            tau: Where the drum is seen in the image (2,).
        """
        pixel = self.knowledge.calibration.pixels(np.asarray(tau))
        return self.knowledge.places(self.planes, self._reference, pixel)

    def plausible(self, tau: Array) -> float:
        """Probability that the drum seen at τ̂ (2,) is in the workspace.

        Args:
            tau: Where the drum is seen in the image (2,).
        """
        return float(self.weights @ self._inside(tau))

    def _inside(self, tau: Array) -> Mask:
        """By which planes (N,) a drum seen at τ̂ (2,) is in the workspace."""
        places = self.places(tau)
        inside = np.isfinite(places[:, 0])
        inside[inside] = inside_polygon(self._wide, places[inside])
        return inside

    def see(self, tau: Array) -> None:
        """Takes in that a drum is seen at τ̂ (2,): it is in the workspace.

        Args:
            tau: Where the drum is seen in the image (2,).
        """
        inside = self._inside(tau)
        self._weigh(np.where(inside, 1.0, self._config.stray))

    def choose(self, tau: Array, explore: float | None = None) -> Stroke:
        """The stroke at a drum seen at τ̂ (2,) that hits, or tells, most.

        Args:
            tau: Task parameter in the mirror's view.
            explore: Weight of what it tells, in nats, against the chance to
                hit; None for the configuration's.
        """
        explore = self._config.explore if explore is None else explore
        places = self.places(tau)
        likely = np.argsort(-self.weights)[:_LIKELY]
        aims = np.vstack([self._grid, self._middle(places), places[likely]])
        aims = aims[np.isfinite(aims).all(axis=1)]
        aims = aims[inside_polygon(self._wide, aims)]
        if len(aims) == 0:
            aims = self._grid
        heard = self._heard(aims, places)
        chance = heard @ self.weights
        told = _entropy(chance) - _entropy(heard) @ self.weights
        for index in np.argsort(-(chance + explore * told)):
            direct = self._optical.source.direct_task_parameters(
                aims[index][None], self._optical.source_calibration
            )[0]
            if np.isfinite(direct).all():
                return Stroke(aims[index], direct, float(chance[index]))
        raise ValueError("no place of the workspace is seen directly")

    def hear(self, tau: Array, stroke: Stroke, heard: bool) -> None:
        """Takes in whether a stroke at the drum seen at τ̂ (2,) was heard.

        Args:
            tau: Where the drum was seen in the image (2,).
            stroke: The stroke.
            heard: Whether the drum sounded.
        """
        chance = self._heard(stroke.place[None], self.places(tau))[0]
        self._weigh(chance if heard else 1.0 - chance)

    def _middle(self, places: Array) -> Array:
        """Mean place (1, 2) of the planes that show the drum somewhere."""
        good = np.isfinite(places[:, 0]) & (self.weights > 0.0)
        if not good.any():
            return np.full((1, 2), np.nan)
        return np.average(places[good], axis=0, weights=self.weights[good])[
            None
        ]

    def _heard(self, aims: Array, places: Array) -> Array:
        """Chance (k, N) that strokes at aims (k, 2) are heard, by plane."""
        config = self._config
        away = np.linalg.norm(aims[:, None] - places, axis=-1)
        away = np.nan_to_num(away, nan=1.0)
        near = expit((config.reach - away) / config.softness)
        return config.luck + (config.surest - config.luck) * near

    def _weigh(self, likelihood: Array) -> None:
        weights = self.weights * likelihood
        self.weights = weights / weights.sum()
        if 1.0 / np.sum(self.weights**2) < _FEW * len(self.planes):
            self._draw_anew()

    def _draw_anew(self) -> None:
        """Particles of equal weight, a little moved, of the same spread."""
        estimate = self.estimate
        count = len(self.planes)
        # Systematic resampling.
        steps = (self._rng.random() + np.arange(count)) / count
        chosen = np.searchsorted(np.cumsum(self.weights), steps)
        planes = self.planes[np.minimum(chosen, count - 1)]
        jitter = self._config.jitter
        pull = np.sqrt(1.0 - jitter**2)
        noise = self._rng.multivariate_normal(
            np.zeros(3), jitter**2 * estimate.covariance, count
        )
        self.planes = pull * planes + (1.0 - pull) * estimate.parameters + noise
        self.planes[:, 2] = np.maximum(self.planes[:, 2], 0.01)
        self.weights = np.full(count, 1.0 / count)


def _entropy(p: Array) -> Array:
    """Of a coin with probabilities p (...), nats."""
    p = np.clip(p, 1e-9, 1.0 - 1e-9)
    return -p * np.log(p) - (1.0 - p) * np.log(1.0 - p)
