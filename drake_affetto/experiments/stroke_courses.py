"""Strokes at drums seen in a mirror, one after another.

By ear: what is heard teaches the robot where the mirror is. Watched: what is
not heard tells it that somebody has turned the mirror.
"""

from collections.abc import Iterator, Mapping
import copy
import dataclasses
from typing import Any

import numpy as np

from drake_affetto.calibration.belief import PlaneBelief, Stroke
from drake_affetto.calibration.watch import StrokeWatch
from drake_affetto.common.typing import Array
from drake_affetto.experiments.mirror_setup import turned
from drake_affetto.experiments.results import GazeResult
from drake_affetto.experiments.results.self_calibration import (
    StrokesResult,
    WatchResult,
)
from drake_affetto.experiments.self_calibration import (
    PICTURED,
    Calibrated,
    MirroredSkill,
    SelfCalibration,
)
from drake_affetto.experiments.statistics import sounded, success_rate
from drake_affetto.experiments.trials import Movement
from drake_affetto.scene.world import FramePose

_STROKES, _WATCH, _AGAIN = range(302, 305)

# Strokes that are counted, by the belief with which the robot begins.
LATE = {"ellipse": (7, 12), "prior": (13, 24)}
# A turned mirror should be noticed within so many strokes; after so many more
# it is given up; and so many show whether the robot found it again.
_IN_TIME, _GIVEN_UP, _AFTER = 6, 10, 4
# Drums that are in the workspace with less probability are strange.
_STRANGE = 0.05
# After these strokes the first repeat's belief is kept for the picture.
_SHOWN = (0, 1, 2, 4, 6, 9, 12, 18, 24)


@dataclasses.dataclass
class Strokes:
    """Strokes by ear in each repeat.

    Attributes:
        start: With what belief they began.
        heard: (repeats, strokes) whether each was heard.
        chance: (repeats, late strokes) the same for the first belief.
        beliefs: Of each repeat after the last stroke.
        steps: Planes of the first repeat's belief after so many strokes.
    """

    start: str
    heard: Array
    chance: Array
    beliefs: dict[int, PlaneBelief]
    steps: list[tuple[int, Array]]


def listen(
    study: SelfCalibration, ellipse: Mapping[int, Calibrated]
) -> list[Strokes]:
    """Strokes at drums seen in the mirror; each is heard or not.

    The same drums serve for each belief with which the robot may begin, and
    for strokes by these first beliefs, from which nothing is learned.
    """
    courses = [
        _Course(study, start, study.first_beliefs(start, ellipse))
        for start in LATE
    ]
    count = max(high for _, high in LATE.values())
    places = {
        each.number: study.positions(count, _STROKES, each.number)
        for each in study.repeats
    }
    for k in range(count):
        drums = {
            each.number: (
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
                key: _spec(study, key[0], drums[key[0]], gazes[key[0]], stroke)
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

    def __init__(
        self,
        study: SelfCalibration,
        start: str,
        beliefs: dict[int, PlaneBelief],
    ) -> None:
        self.start, self._beliefs = start, beliefs
        self._first = copy.deepcopy(beliefs)
        self._low, self._high = LATE[start]
        repeats = len(study.repeats)
        self._heard = np.zeros((repeats, self._high), dtype=bool)
        late = self._high - self._low + 1
        self._chance = np.zeros((repeats, late), dtype=bool)
        self._steps = [(0, _shown(beliefs[0]))]

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
            self._chance[i, k + 1 - self._low] = heard
            return
        self._heard[i, k] = heard
        self._beliefs[i].hear(tau, stroke, heard)
        if i == 0 and k + 1 in _SHOWN:
            self._steps.append((k + 1, _shown(self._beliefs[0])))

    def result(self) -> Strokes:
        """All strokes."""
        return Strokes(
            self.start, self._heard, self._chance, self._beliefs, self._steps
        )


def _spec(
    study: SelfCalibration,
    number: int,
    drum: tuple[FramePose, Any, int],
    gaze: GazeResult,
    stroke: Stroke,
) -> Any:
    """The spec of a stroke that is aimed already."""
    repeat = study.repeats[number]
    mover = Movement(repeat.skill.predict([stroke.tau])[0])
    return study.strike_spec(repeat, *drum, gaze, mover)


def strokes_result(strokes: Strokes) -> StrokesResult:
    low, high = LATE[strokes.start]
    return StrokesResult(
        start=strokes.start,
        by_stroke=strokes.heard.mean(axis=0).tolist(),
        late=success_rate(strokes.heard[:, low - 1 :]),
        late_from=low,
        late_to=high,
        chance=success_rate(strokes.chance),
    )


def watch(
    study: SelfCalibration, hand: Mapping[int, Calibrated]
) -> WatchResult:
    """Strokes by the hand's calibration, while somebody turns the mirror."""
    plan = study.plan
    corners = study.scenario.drum_region.corners
    going: dict[int, tuple[PlaneBelief, StrokeWatch]] = {}
    for i, found in hand.items():
        if found.plane is not None:
            belief = PlaneBelief.from_estimate(
                found.known,
                found.plane,
                corners,
                study.settings.ear,
                study.rng(_WATCH, i),
            )
            going[i] = belief, StrokeWatch(study.settings.watch)
    watched = sorted(going)
    after = {
        i: turned(plan, study.repeats[i].mirror, study.rng(_WATCH, i, 1))
        for i in watched
    }
    count = plan.turned_after + _GIVEN_UP
    places = {i: study.positions(count, _WATCH, i) for i in watched}
    delays: dict[int, int | None] = dict.fromkeys(watched)
    alarms = 0
    for k in range(count):
        is_turned = k >= plan.turned_after
        drums = {
            i: (
                after[i] if is_turned else study.repeats[i].mirror,
                places[i][k],
                study.seed(_WATCH, i, k),
            )
            for i in going
        }
        for i in _watched_strokes(study, going, drums, k):
            if is_turned:
                delays[i] = k + 1 - plan.turned_after
                del going[i]
            else:
                alarms += 1
                going[i][1].reset()
    noticed = [
        delay is not None and delay <= _IN_TIME for delay in delays.values()
    ]
    again = {i: after[i] for i, delay in delays.items() if delay is not None}
    return WatchResult(
        turned_by=abs(plan.turned_by),
        turned_after=plan.turned_after,
        delays=list(delays.values()),
        noticed=success_rate([noticed]),
        false_alarms=alarms,
        quiet_strokes=plan.turned_after * len(watched),
        recovered=_recovered(study, again) if again else None,
    )


def _watched_strokes(
    study: SelfCalibration,
    going: Mapping[int, tuple[PlaneBelief, StrokeWatch]],
    drums: Mapping[int, tuple[FramePose, Any, int]],
    k: int,
) -> list[int]:
    """One stroke in each repeat; those in which the robot raises alarm.

    A drum that is not found is not struck, but is as strange as one that is
    seen where none can stand.
    """
    gazes = study.look_at(f"Looking, watched, {k + 1}", drums)
    strokes = {
        i: going[i][0].choose(np.array(gaze.tau), 0.0)
        for i, gaze in gazes.items()
        if gaze.found
    }
    struck = study.strike(
        f"Striking, watched, {k + 1}",
        {
            i: _spec(study, i, drums[i], gazes[i], stroke)
            for i, stroke in strokes.items()
        },
    )
    alarms = []
    for i, gaze in gazes.items():
        belief, observer = going[i]
        seen = gaze.found and belief.plausible(np.array(gaze.tau)) > _STRANGE
        alarm = observer.see(seen)
        if i in strokes:
            alarm |= observer.add(strokes[i].chance, sounded(struck[i]))
        if alarm:
            alarms.append(i)
    return alarms


def _recovered(study: SelfCalibration, mirrors: Mapping[int, FramePose]) -> Any:
    """Success at unseen positions after calibrating again, by the hand."""
    found = study.by_hand(mirrors, use=1)
    drums = {
        (i, k): (
            mirror,
            study.repeats[i].positions[k],
            study.seed(_AGAIN, i, k),
        )
        for i, mirror in mirrors.items()
        for k in range(min(_AFTER, study.plan.evaluations))
    }
    gazes = study.look_at("Looking, calibrated again", drums)
    tests: dict[Any, Any] = {}
    for (i, k), drum in drums.items():
        transform = found[i].to_direct
        tests[i, k] = None
        if transform is not None:
            repeat = study.repeats[i]
            tests[i, k] = study.strike_spec(
                repeat,
                *drum,
                gazes[i, k],
                MirroredSkill(repeat.skill, transform),
            )
    struck = study.strike("Drumming, calibrated again", tests)
    return success_rate(
        [
            [sounded(strike) for (j, _), strike in struck.items() if j == i]
            for i in mirrors
        ]
    )


def _shown(belief: PlaneBelief) -> Array:
    """Some planes of a belief (PICTURED, 3)."""
    rng = np.random.default_rng(0)
    chosen = rng.choice(len(belief.planes), PICTURED, p=belief.weights)
    return belief.planes[chosen]
