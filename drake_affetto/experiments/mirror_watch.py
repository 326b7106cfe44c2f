"""Strokes by the hand's calibration, while somebody turns the mirror.

The robot notices by strokes that should be heard and are not, and by drums
that are seen where none can stand. It then looks at its hand again, which
decides. What strokes alone would have told is counted beside.
"""

from collections.abc import Collection, Iterable, Mapping
import dataclasses

import numpy as np

from drake_affetto.calibration.belief import PlaneBelief, Stroke
from drake_affetto.calibration.recheck import HandRecheck
from drake_affetto.calibration.watch import StrokeWatch
from drake_affetto.experiments.plans import SelfCalibrationPlan
from drake_affetto.experiments.results import GazeResult, StrikeResult
from drake_affetto.experiments.results.self_calibration import WatchResult
from drake_affetto.experiments.self_calibration import (
    Calibrated,
    Drum,
    MirroredSkill,
    Repeat,
    SelfCalibration,
)
from drake_affetto.experiments.statistics import sounded, success_rate
from drake_affetto.experiments.stroke_courses import aimed_spec
from drake_affetto.runner.executor import Spec
from drake_affetto.scene.world import FramePose

_WATCH, _AGAIN, _QUIET, _RECHECK = range(303, 307)

# A turned mirror should be noticed within so many strokes; after so many more
# it is given up; and so many show whether the robot found it again.
_IN_TIME, _GIVEN_UP, _AFTER = 6, 10, 4
# Drums that are in the workspace with less probability are strange.
_STRANGE = 0.05


class _Watching:
    """One robot that strikes, and watches what comes of it.

    Attributes:
        repeat: Its repeat.
        alarm: Whether it takes its belief to be wrong now.
        alarm_by_strokes: Whether strokes alone would say so.
        recheck: Looks at the hand that decide, where it suspects something.
    """

    def __init__(
        self, study: SelfCalibration, repeat: Repeat, found: Calibrated
    ) -> None:
        assert found.plane is not None
        self._found, self._config = found, study.settings.watch
        self.repeat = repeat
        self._belief = PlaneBelief.from_estimate(
            found.known,
            found.plane,
            study.scenario.drum_region.corners,
            study.settings.ear,
            study.rng(_WATCH, repeat.number),
        )
        self._strokes = StrokeWatch(self._config)
        self._suspicion = StrokeWatch(self._config, self._config.suspicion)
        self.alarm = self.alarm_by_strokes = False
        self.recheck: HandRecheck | None = None

    def choose(self, gaze: GazeResult) -> Stroke | None:
        """The stroke at a drum; None where it is not found."""
        if not gaze.found:
            return None
        return self._belief.choose(np.array(gaze.tau), 0.0)

    def take_in(
        self,
        gaze: GazeResult,
        stroke: Stroke | None,
        struck: StrikeResult | None,
    ) -> None:
        """Takes in a stroke, and what was heard.

        A drum that is not found is not struck, but is as strange as one that
        is seen where none can stand.
        """
        seen = gaze.found and (
            self._belief.plausible(np.array(gaze.tau)) > _STRANGE
        )
        alarms = []
        for watch in (self._strokes, self._suspicion):
            alarm = watch.see(seen)
            if stroke is not None:
                alarm |= watch.add(stroke.chance, sounded(struck))
            alarms.append(alarm)
        self.alarm_by_strokes, suspects = alarms
        found = self._found
        assert found.plane is not None
        self.recheck = (
            HandRecheck(found.known, found.plane, found.seen, self._config)
            if suspects
            else None
        )

    def decide(self) -> None:
        """Takes in what the looks at the hand have decided."""
        self.alarm = self.recheck is not None and bool(self.recheck.moved)
        if self.recheck is not None:
            self._suspicion.reset()

    @property
    def looks(self) -> int:
        """Number of looks at its hand after the last stroke."""
        return 0 if self.recheck is None else self.recheck.looks

    def go_on(self) -> None:
        """Goes on after an alarm, as after a calibration."""
        if self.alarm_by_strokes:
            self._strokes.reset()

    def begin_anew(self) -> None:
        """Begins as after a calibration: nothing speaks against the belief."""
        self._strokes.reset()
        self._suspicion.reset()


@dataclasses.dataclass(frozen=True)
class Watched:
    """What watching came to in one repeat.

    Attributes:
        delay: Strokes after the turn until it was noticed; None if never.
        delay_by_strokes: The same by strokes alone.
        false_alarms: Alarms while nothing had moved.
        false_alarms_by_strokes: The same by strokes alone.
        quiet_strokes: Number of strokes while nothing had moved.
        quiet_looks: Number of looks at the hand in these.
        recovered: Whether each stroke after calibrating again was heard.
    """

    delay: int | None
    delay_by_strokes: int | None
    false_alarms: int
    false_alarms_by_strokes: int
    quiet_strokes: int
    quiet_looks: int
    recovered: list[bool]


def watch(
    study: SelfCalibration, hand: Mapping[int, Calibrated]
) -> dict[int, Watched]:
    """Strokes before mirrors that stay, then before ones that are turned.

    Args:
        study: The repeats.
        hand: Calibration of each by the hand; one that found nothing is not
            watched.
    """
    plan = study.plan
    robots = {
        each.number: _Watching(study, each, hand[each.number])
        for each in study.repeats
        if hand[each.number].plane is not None
    }
    quiet = plan.quiet + plan.turned_after
    places = {i: study.positions(quiet + _GIVEN_UP, _WATCH, i) for i in robots}

    def strike(going: Collection[_Watching], k: int, *, turned: bool) -> None:
        drums = {}
        for robot in going:
            each, i = robot.repeat, robot.repeat.number
            mirror = each.turned if turned else each.mirror
            seed = study.seed(_WATCH, i, k)
            drums[i] = Drum(each, mirror, places[i][k], seed)
        _stroke(study, going, drums, k)

    false = dict.fromkeys(robots, 0)
    false_by_strokes = dict.fromkeys(robots, 0)
    looks = dict.fromkeys(robots, 0)
    for k in range(quiet):
        strike(robots.values(), k, turned=False)
        for i, robot in robots.items():
            false[i] += robot.alarm
            false_by_strokes[i] += robot.alarm_by_strokes
            looks[i] += robot.looks
            robot.go_on()
            if k + 1 == plan.quiet:
                robot.begin_anew()
    delays: dict[int, int | None] = dict.fromkeys(robots)
    by_strokes: dict[int, int | None] = dict.fromkeys(robots)
    for k in range(1, _GIVEN_UP + 1):
        going = [
            robot
            for i, robot in robots.items()
            if delays[i] is None or by_strokes[i] is None
        ]
        if not going:
            break
        strike(going, quiet + k - 1, turned=True)
        for robot in going:
            i = robot.repeat.number
            if robot.alarm and delays[i] is None:
                delays[i] = k
            if robot.alarm_by_strokes and by_strokes[i] is None:
                by_strokes[i] = k
    noticed = [i for i, delay in delays.items() if delay is not None]
    recovered = _recovered(study, noticed)
    return {
        i: Watched(
            delays[i],
            by_strokes[i],
            false[i],
            false_by_strokes[i],
            quiet,
            looks[i],
            recovered.get(i, []),
        )
        for i in robots
    }


def _stroke(
    study: SelfCalibration,
    robots: Collection[_Watching],
    drums: Mapping[int, Drum],
    k: int,
) -> None:
    """Each of these robots strikes once, and looks at its hand if need be."""
    gazes = study.look_at(f"Looking, watched, {k + 1}", drums)
    strokes = {
        robot.repeat.number: robot.choose(gazes[robot.repeat.number])
        for robot in robots
    }
    tests: dict[int, Spec | None] = {
        i: aimed_spec(study, drums[i], gazes[i], stroke)
        for i, stroke in strokes.items()
        if stroke is not None
    }
    struck = study.strike(f"Striking, watched, {k + 1}", tests)
    for robot in robots:
        i = robot.repeat.number
        robot.take_in(gazes[i], strokes[i], struck.get(i))
    _look_again(study, robots, drums, k)
    for robot in robots:
        robot.decide()


def _look_again(
    study: SelfCalibration,
    robots: Iterable[_Watching],
    drums: Mapping[int, Drum],
    k: int,
) -> None:
    """Robots that suspect something look at their hands until it is clear."""
    suspects = {
        robot.repeat.number: robot.recheck
        for robot in robots
        if robot.recheck is not None
    }
    for number in range(study.settings.watch.recheck_looks):
        open_ = {i: one for i, one in suspects.items() if one.moved is None}
        if not open_:
            return
        looks = study.look_at_hands(
            f"Looking at the hand after stroke {k + 1}, {number + 1}",
            {
                i: (
                    drums[i].mirror,
                    study.seed(_RECHECK, i, k, number),
                    one.next_posture(),
                )
                for i, one in open_.items()
            },
        )
        for i, look in looks.items():
            open_[i].add(look)


def _recovered(
    study: SelfCalibration, numbers: Collection[int]
) -> dict[int, list[bool]]:
    """Strokes at unseen positions after calibrating again, by the hand."""
    mirrors: dict[int, FramePose] = {i: study.repeat(i).turned for i in numbers}
    if not mirrors:
        return {}
    found = study.by_hand(mirrors, use=1)
    count = min(_AFTER, study.plan.evaluations)
    drums = {
        (i, k): Drum(
            study.repeat(i),
            mirror,
            study.repeat(i).positions[k],
            study.seed(_AGAIN, i, k),
        )
        for i, mirror in mirrors.items()
        for k in range(count)
    }
    gazes = study.look_at("Looking, calibrated again", drums)
    tests: dict[tuple[int, int], Spec | None] = {}
    for (i, k), drum in drums.items():
        transform = found[i].to_direct
        tests[i, k] = None
        if transform is not None:
            mover = MirroredSkill(drum.repeat.skill, transform)
            tests[i, k] = study.strike_spec(drum, gazes[i, k], mover)
    struck = study.strike("Drumming, calibrated again", tests)
    return {i: [sounded(struck[i, k]) for k in range(count)] for i in mirrors}


def watch_result(
    plan: SelfCalibrationPlan, watched: Mapping[int, Watched]
) -> WatchResult:
    """What watching came to in all repeats, for `results.json`."""
    found = list(watched.values())
    recovered = [each.recovered for each in found if each.recovered]

    def in_time(delays: Iterable[int | None]) -> list[bool]:
        return [each is not None and each <= _IN_TIME for each in delays]

    return WatchResult(
        turned_by=abs(plan.turned_by),
        turned_after=plan.turned_after,
        delays=[each.delay for each in found],
        noticed=success_rate([in_time(each.delay for each in found)]),
        false_alarms=sum(each.false_alarms for each in found),
        quiet_strokes=sum(each.quiet_strokes for each in found),
        recovered=success_rate(recovered) if recovered else None,
        quiet_looks=sum(each.quiet_looks for each in found),
        noticed_by_strokes=success_rate(
            [in_time(each.delay_by_strokes for each in found)]
        ),
        false_alarms_by_strokes=sum(
            each.false_alarms_by_strokes for each in found
        ),
    )
