"""The study of `affetto mirror --self-calibrate`: what is run and compared.

Beside the robot that finds the mirror by itself drum schemes that were given
demonstrations before the same mirror, at the same positions.
"""

from collections.abc import Iterator, Mapping, Sequence
import copy
import dataclasses
from typing import Any
import warnings

import numpy as np

from drake_affetto.calibration.belief import PlaneBelief, Stroke
from drake_affetto.calibration.plane import CalibrationFailure, normals
from drake_affetto.calibration.watch import StrokeWatch
from drake_affetto.common.typing import Array
from drake_affetto.experiments.mirror_setup import (
    judge_plane,
    pose_matrix,
    turned,
)
from drake_affetto.experiments.plans import SelfCalibrationPlan
from drake_affetto.experiments.results import (
    DemonstrationResult,
    GazeResult,
    MirrorResults,
    SchemeCell,
    StrikeResult,
)
from drake_affetto.experiments.results.self_calibration import (
    BeliefStep,
    MethodResult,
    PlaneRow,
    SelfCalibrationResults,
    StrokesResult,
    WatchResult,
)
from drake_affetto.experiments.self_calibration import (
    Calibrated,
    MirroredSkill,
    Repeat,
    SelfCalibration,
    belief_transform,
)
from drake_affetto.experiments.skills import successful, task_parameters
from drake_affetto.experiments.statistics import success_rate
from drake_affetto.experiments.trials import (
    Movement,
    at_mirror,
    demonstration,
    run_trials,
)
from drake_affetto.runner.executor import TrialExecutor
from drake_affetto.scene.world import FramePose
from drake_affetto.station.scenario import load_scenario

_TEST, _SAMPLES, _STROKES, _WATCH, _AGAIN = range(300, 305)

# Strokes that are counted, by the belief with which the robot begins.
LATE = {"ellipse": (7, 12), "prior": (13, 24)}
# A turned mirror should be noticed within so many strokes; after so many more
# it is given up; and so many show whether the robot found it again.
_IN_TIME, _GIVEN_UP, _AFTER = 6, 10, 4
# After these strokes the first repeat's belief is kept for the picture.
_SHOWN = (0, 1, 2, 4, 6, 9, 12, 18, 24)
# Planes in a picture of a belief, and half the length of their lines, m.
_LINES, _REACH = 40, 0.3


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


def run_self_calibration(
    executor: TrialExecutor, plan: SelfCalibrationPlan
) -> MirrorResults:
    """Runs the study; see the module.

    Raises:
        InputError: If the plan or a file does not fit.
        CalibrationFailure: If the robot finds no mirror in any repeat, by its
            hand or by the drum's marker; the message says what is missing.
    """
    study = SelfCalibration(executor, plan)
    study.set_up()
    mirrors = {each.number: each.mirror for each in study.repeats}
    hand = study.by_hand(mirrors)
    _require_some(hand)
    ellipse = study.by_ellipse()
    _require_some(ellipse)
    by_ear = _listen(study, ellipse)
    heard = _from_ear(study, by_ear[-1])
    methods = {"hand": hand, "ellipse": ellipse, "ear": heard}
    pools = _demonstrate(study)
    tests = _test(study, methods, pools)
    return MirrorResults.of(
        plan,
        choice="first",
        variability=1.0,
        workspace=1.0,
        schemes={
            name: {
                count: _cell(study, tests, (name, count))
                for count in plan.samples
            }
            for name in plan.schemes
        },
        comparisons=[],
        self_calibration=SelfCalibrationResults(
            repeats=plan.repeats,
            evaluations=plan.evaluations,
            rotation=plan.rotation,
            translation=plan.translation,
            methods={
                name: _method(study, name, found, tests, by_ear)
                for name, found in methods.items()
            },
            by_ear=[_strokes_result(each) for each in by_ear],
            watch=_watch(study, hand),
            beliefs=_beliefs(study, methods),
            true_line=list(_line(*_true_plane(study.repeats[0]))),
        ),
    )


def _require_some(found: Mapping[int, Calibrated]) -> None:
    """Raises CalibrationFailure if no repeat found its mirror."""
    failures = [each.failure for each in found.values() if each.failure]
    if len(failures) == len(found):
        raise CalibrationFailure(failures[0])


# By ear


def _listen(
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
            course.take_in(i, k, tau, stroke, learns, _success(struck[key]))
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


def _success(strike: StrikeResult | None) -> bool:
    return strike is not None and strike.success


def _from_ear(
    study: SelfCalibration, strokes: Strokes
) -> dict[int, Calibrated]:
    """What the strokes came to, as a calibration."""
    return {
        each.number: Calibrated(
            strokes.beliefs[each.number].estimate,
            each.known,
            belief_transform(strokes.beliefs[each.number]),
            strokes=strokes.heard.shape[1],
            steps=strokes.steps if each.number == 0 else [],
        )
        for each in study.repeats
    }


def _strokes_result(strokes: Strokes) -> StrokesResult:
    low, high = LATE[strokes.start]
    return StrokesResult(
        start=strokes.start,
        by_stroke=strokes.heard.mean(axis=0).tolist(),
        late=success_rate(strokes.heard[:, low - 1 :]),
        late_from=low,
        late_to=high,
        chance=success_rate(strokes.chance),
    )


# Beside: schemes with demonstrations


def _demonstrate(
    study: SelfCalibration,
) -> dict[int, list[DemonstrationResult]]:
    """Demonstrations before each repeat's mirror."""
    plan = study.plan
    asked = plan.pool_size + 2
    taught = run_trials(
        study.executor,
        study.title("Kinesthetic teaching"),
        {
            (each.number, k): at_mirror(
                demonstration(
                    plan.scenario, xy, study.seed(_SAMPLES, each.number, k)
                ),
                each.mirror,
            )
            for each in study.repeats
            for k, xy in enumerate(
                study.positions(asked, _SAMPLES, each.number)
            )
        },
    )
    return {
        each.number: successful(taught[each.number, k] for k in range(asked))[
            : plan.pool_size
        ]
        for each in study.repeats
    }


def _fit(
    study: SelfCalibration,
    repeat: Repeat,
    name: str,
    samples: Sequence[DemonstrationResult],
) -> Any:
    """A scheme, fitted to the samples; it knows the robot as badly."""
    from drake_affetto.skill.optical import OpticalMapping
    from drake_affetto.skill.schemes import make_scheme

    loaded = load_scenario(study.plan.scenario)
    scheme = make_scheme(
        name, repeat.skill, input_range=loaded.skill.input_range
    )
    if name == "transfer_default":
        optical = repeat.known.optical_map()
        scheme.set_params(
            mapping=OpticalMapping(**vars(optical)), residual=None
        )
    with warnings.catch_warnings():
        # That few samples do not determine the map is what is studied.
        warnings.simplefilter("ignore", UserWarning)
        return scheme.fit(
            task_parameters(samples),
            np.array([each.theta for each in samples]),
        )


# Unseen positions


def _test(
    study: SelfCalibration,
    methods: Mapping[str, Mapping[int, Calibrated]],
    pools: Mapping[int, list[DemonstrationResult]],
) -> dict[Any, StrikeResult | None]:
    """Everyone's strokes at the unseen positions of all repeats."""
    plan = study.plan
    drums = {
        (each.number, k): (
            each.mirror,
            xy,
            study.seed(_TEST, each.number, k),
        )
        for each in study.repeats
        for k, xy in enumerate(each.positions)
    }
    gazes = study.look_at("Looking", drums)
    tests: dict[Any, Any] = {}
    for each in study.repeats:
        movers: dict[Any, Any] = {
            name: MirroredSkill(each.skill, found[each.number].to_direct)
            for name, found in methods.items()
            if found[each.number].to_direct is not None
        }
        pool = pools[each.number]
        for name in plan.schemes:
            for count in plan.samples:
                if len(pool) >= count:
                    movers[name, count] = _fit(study, each, name, pool[:count])
        for k in range(plan.evaluations):
            key = each.number, k
            for name, mover in movers.items():
                tests[name, *key] = study.strike_spec(
                    each, *drums[key], gazes[key], mover
                )
    return study.strike("Drumming", tests)


def _table(
    study: SelfCalibration, tests: Mapping[Any, StrikeResult | None], name: Any
) -> list[list[StrikeResult | None]]:
    """Strikes of a method: a row a repeat, a column a position."""
    return [
        [
            tests.get((name, each.number, k))
            for k in range(study.plan.evaluations)
        ]
        for each in study.repeats
    ]


def _cell(
    study: SelfCalibration, tests: Mapping[Any, StrikeResult | None], name: Any
) -> SchemeCell:
    strikes = _table(study, tests, name)
    success = np.array([[_success(s) for s in row] for row in strikes], float)
    flat = [strike for row in strikes for strike in row]
    return SchemeCell(
        success_rate(success),
        success.mean(axis=1).tolist(),
        [s.reward if s else 0.0 for s in flat],
        [s.landing if s else None for s in flat],
        float(np.mean([s.graze if s else False for s in flat])),
    )


def _method(
    study: SelfCalibration,
    name: str,
    found: Mapping[int, Calibrated],
    tests: Mapping[Any, StrikeResult | None],
    by_ear: Sequence[Strokes],
) -> MethodResult:
    cell = _cell(study, tests, name)
    rows = [_plane_row(each, found[each.number]) for each in study.repeats]
    covered = [row.covered for row in rows if row.covered is not None]
    return MethodResult(
        success_rate=cell.success_rate,
        per_repeat=cell.per_repeat,
        looks=float(np.mean([row.looks for row in rows])),
        strokes=float(np.mean([row.strokes for row in rows])),
        angle_error=_median([row.angle_error for row in rows]),
        offset_error=_median([row.offset_error for row in rows]),
        coverage=success_rate([covered]) if covered else None,
        planes=rows,
        heard=by_ear[-1].heard.tolist() if name == "ear" else [],
    )


def _median(values: Sequence[float | None]) -> float | None:
    known = [value for value in values if value is not None]
    return float(np.median(known)) if known else None


def _plane_row(repeat: Repeat, found: Calibrated) -> PlaneRow:
    if found.plane is None:
        return PlaneRow(
            parameters=None,
            covariance=None,
            angle_error=None,
            offset_error=None,
            covered=None,
            looks=found.looks,
            strokes=found.strokes,
            failure=found.failure,
        )
    judged = judge_plane(found.plane, repeat.mirror)
    return PlaneRow(
        parameters=found.plane.parameters.tolist(),
        covariance=found.plane.covariance.tolist(),
        angle_error=float(np.degrees(judged.angle)),
        offset_error=1e3 * judged.offset,
        covered=judged.covered,
        looks=found.looks,
        strokes=found.strokes,
    )


# A mirror that is turned in between


def _watch(
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
        chances, heard = _watched_strokes(study, going, drums, k)
        for i in list(going):
            if not going[i][1].add(chances[i], heard[i]):
                continue
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
) -> tuple[dict[int, float], dict[int, bool]]:
    """What is expected of a stroke in each repeat, and whether it is heard.

    A drum that is not found is not struck; as it should have been seen, that
    counts as a stroke that was not heard.
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
    expected = study.settings.watch.hit_when_right
    return (
        {i: strokes[i].chance if i in strokes else expected for i in gazes},
        {i: _success(struck.get(i)) for i in gazes},
    )


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
            [_success(strike) for (j, _), strike in struck.items() if j == i]
            for i in mirrors
        ]
    )


# Pictures


def _shown(belief: PlaneBelief) -> Array:
    """Some planes of a belief (40, 3)."""
    rng = np.random.default_rng(0)
    chosen = rng.choice(len(belief.planes), _LINES, p=belief.weights)
    return belief.planes[chosen]


def _beliefs(
    study: SelfCalibration, methods: Mapping[str, Mapping[int, Calibrated]]
) -> list[BeliefStep]:
    repeat = study.repeats[0]
    reference = repeat.known.eye_position
    height = repeat.known.marker_height
    return [
        BeliefStep(
            method=name,
            step=step,
            lines=[_line(plane, reference, height) for plane in planes],
        )
        for name, found in methods.items()
        for step, planes in found[0].steps
    ]


def _true_plane(repeat: Repeat) -> tuple[Array, Array, float]:
    """The true plane of a repeat, for `_line`."""
    X_WM = pose_matrix(repeat.mirror)
    n = X_WM[:3, 2]
    plane = np.array([np.arctan2(n[1], n[0]), np.arcsin(n[2]), 0.0])
    return plane, X_WM[:3, 3], repeat.known.marker_height


def _line(plane: Array, reference: Array, height: float) -> Any:
    """Where a plane meets a height: two points, x and y, m."""
    n = normals(plane)
    # n_x (x - x_r) + n_y (y - y_r) = -(s + n_z (height - z_r)).
    level = np.linalg.norm(n[:2])
    right = -(plane[2] + n[2] * (height - reference[2])) / level
    across = n[:2] / level
    along = np.array([-across[1], across[0]])
    foot = reference[:2] + right * across
    return tuple(
        (float(x), float(y))
        for x, y in (foot - _REACH * along, foot + _REACH * along)
    )
