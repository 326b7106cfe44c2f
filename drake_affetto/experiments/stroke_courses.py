"""Strokes by ear at drums seen in a mirror, one after another.

What is heard, and what is not, teaches the robot where the mirror is.
"""

from collections.abc import Iterable, Iterator, Mapping
import copy
import dataclasses
from typing import Any

import numpy as np

from drake_affetto.calibration.belief import PlaneBelief, Stroke
from drake_affetto.common.typing import Array, Mask
from drake_affetto.experiments.results import GazeResult
from drake_affetto.experiments.results.self_calibration import StrokesResult
from drake_affetto.experiments.self_calibration import (
    PICTURED,
    Calibrated,
    Drum,
    SelfCalibration,
)
from drake_affetto.experiments.statistics import sounded, success_rate
from drake_affetto.experiments.trials import Movement

_STROKES = 302

# Strokes that are counted, by the belief with which the robot begins.
LATE = {"ellipse": (7, 12), "prior": (13, 24)}
# After these strokes the first repeat's belief is kept for the picture.
_SHOWN = (0, 1, 2, 4, 6, 9, 12, 18, 24)


@dataclasses.dataclass
class Strokes:
    """Strokes by ear in some repeats.

    Attributes:
        start: With what belief they began.
        heard: Whether each stroke was heard (strokes,), by repeat.
        chance: The same for the first belief (late strokes,), by repeat.
        beliefs: Belief after the last stroke, by repeat.
        steps: Planes of the first repeat's belief after so many strokes.
    """

    start: str
    heard: dict[int, Mask]
    chance: dict[int, Mask]
    beliefs: dict[int, PlaneBelief]
    steps: list[tuple[int, Array]]

    @classmethod
    def joined(cls, parts: Iterable["Strokes"]) -> "Strokes":
        """The strokes of several groups of repeats as one."""
        first, *others = parts
        whole = dataclasses.replace(
            first,
            heard=dict(first.heard),
            chance=dict(first.chance),
            beliefs=dict(first.beliefs),
            steps=list(first.steps),
        )
        for each in others:
            whole.heard |= each.heard
            whole.chance |= each.chance
            whole.beliefs |= each.beliefs
            whole.steps += each.steps
        return whole


def listen(
    study: SelfCalibration, ellipse: Mapping[int, Calibrated]
) -> list[Strokes]:
    """Strokes at drums seen in the mirror; each is heard or not.

    The same drums serve for each belief with which the robot may begin, and
    for strokes by these first beliefs, from which nothing is learned.
    """
    courses = [
        _Course(start, study.first_beliefs(start, ellipse)) for start in LATE
    ]
    count = max(high for _, high in LATE.values())
    places = {
        each.number: study.positions(count, _STROKES, each.number)
        for each in study.repeats
    }
    for k in range(count):
        drums = {
            each.number: Drum(
                each,
                each.mirror,
                places[each.number][k],
                study.seed(_STROKES, each.number, k),
            )
            for each in study.repeats
        }
        gazes = study.look_at(f"Looking for stroke {k + 1}", drums)
        # Drum by drum: strokes at one drum share the search.
        strokes = {
            key: stroke
            for i, gaze in gazes.items()
            if gaze.found
            for course in courses
            for key, stroke in course.strokes(i, k, np.array(gaze.tau))
        }
        struck = study.strike(
            f"Striking by ear, {k + 1}",
            {
                key: aimed_spec(study, drums[key[0]], gazes[key[0]], stroke)
                for key, stroke in strokes.items()
            },
        )
        for key, stroke in strokes.items():
            i, start, learns = key
            course = next(each for each in courses if each.start == start)
            tau = np.array(gazes[i].tau)
            course.take_in(i, k, tau, stroke, learns, sounded(struck[key]))
    return [course.result() for course in courses]


class _Course:
    """Strokes by ear that begin with one kind of belief."""

    def __init__(self, start: str, beliefs: dict[int, PlaneBelief]) -> None:
        self.start, self._beliefs = start, beliefs
        self._first = copy.deepcopy(beliefs)
        self._low, self._high = LATE[start]
        self._heard = {i: np.zeros(self._high, dtype=bool) for i in beliefs}
        late = self._high - self._low + 1
        self._chance = {i: np.zeros(late, dtype=bool) for i in beliefs}
        self._steps = [(0, _shown(beliefs[0]))] if 0 in beliefs else []

    def strokes(
        self, i: int, k: int, tau: Array
    ) -> Iterator[tuple[tuple[int, str, bool], Stroke]]:
        """Strokes of repeat i at its drum k, with whether they teach."""
        if k >= self._high:
            return
        belief = self._beliefs[i]
        belief.see(tau)
        yield (i, self.start, True), belief.choose(tau)
        if k + 1 >= self._low:
            yield (i, self.start, False), self._first[i].choose(tau, 0.0)

    def take_in(
        self,
        i: int,
        k: int,
        tau: Array,
        stroke: Stroke,
        learns: bool,
        heard: bool,
    ) -> None:
        """Takes in whether a stroke was heard."""
        if not learns:
            self._chance[i][k + 1 - self._low] = heard
            return
        self._heard[i][k] = heard
        self._beliefs[i].hear(tau, stroke, heard)
        if i == 0 and k + 1 in _SHOWN:
            self._steps.append((k + 1, _shown(self._beliefs[0])))

    def result(self) -> Strokes:
        """All strokes."""
        return Strokes(
            self.start, self._heard, self._chance, self._beliefs, self._steps
        )


def aimed_spec(
    study: SelfCalibration, drum: Drum, gaze: GazeResult, stroke: Stroke
) -> Any:
    """The spec of a stroke that is aimed already."""
    theta = drum.repeat.skill.predict([stroke.tau])[0]
    return study.strike_spec(drum, gaze, Movement(theta))


def strokes_result(strokes: Strokes) -> StrokesResult:
    """What strokes of all repeats came to, for `results.json`."""
    low, high = LATE[strokes.start]
    heard = np.array(list(strokes.heard.values()))
    return StrokesResult(
        start=strokes.start,
        by_stroke=heard.mean(axis=0).tolist(),
        late=success_rate(heard[:, low - 1 :]),
        late_from=low,
        late_to=high,
        chance=success_rate(np.array(list(strokes.chance.values()))),
    )


def _shown(belief: PlaneBelief) -> Array:
    """Some planes of a belief (PICTURED, 3)."""
    rng = np.random.default_rng(0)
    chosen = rng.choice(len(belief.planes), PICTURED, p=belief.weights)
    return belief.planes[chosen]
