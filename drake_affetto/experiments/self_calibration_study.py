"""The study of `affetto mirror --self-calibrate`: what is run and compared.

Beside the robot that finds the mirror by itself drum schemes that were given
demonstrations before the same mirror, at the same positions.
"""

from collections.abc import Mapping, Sequence
import dataclasses
from pathlib import Path
from typing import Any

import numpy as np

from drake_affetto.calibration.plane import CalibrationFailure
from drake_affetto.common.typing import Array
from drake_affetto.experiments.bodies import Robots, draw_robots
from drake_affetto.experiments.mirror_setup import judge_plane, pose_matrix
from drake_affetto.experiments.mirror_watch import (
    Watched,
    watch,
    watch_result,
)
from drake_affetto.experiments.plans import SelfCalibrationPlan
from drake_affetto.experiments.results import (
    DemonstrationResult,
    MirrorResults,
    StrikeResult,
)
from drake_affetto.experiments.results.self_calibration import (
    BeliefStep,
    MethodResult,
    PlaneRow,
    SelfCalibrationResults,
)
from drake_affetto.experiments.self_calibration import (
    Calibrated,
    Drum,
    MirroredSkill,
    Repeat,
    SelfCalibration,
    belief_transform,
)
from drake_affetto.experiments.skills import (
    fit_with,
    successful,
    task_parameters,
)
from drake_affetto.experiments.statistics import scheme_cell, success_rate
from drake_affetto.experiments.stroke_courses import (
    Strokes,
    listen,
    strokes_result,
)
from drake_affetto.experiments.trials import (
    MOST_RUNNERS,
    at_mirror,
    demonstration,
    run_trials,
)
from drake_affetto.geometry.planes import normals, plane_parameters
from drake_affetto.runner.executor import TrialExecutor

_TEST, _SAMPLES = range(300, 302)
_BODIES = 307

# Repeats of own bodies that run side by side: a worker keeps a station of each,
# and that of the direct view, in which the last skill was taught.
_TOGETHER = MOST_RUNNERS - 1

# Half the length of a mirror's line in a picture, m.
_REACH = 0.3


@dataclasses.dataclass
class _Group:
    """Repeats that run side by side, and what they came to.

    Attributes:
        study: The repeats.
        methods: Calibration of each repeat by each method.
        by_ear: Strokes by ear, from several beliefs.
        tests: Strokes of everyone at the unseen positions.
        watched: Strokes while mirrors are turned, by repeat.
    """

    study: SelfCalibration
    methods: dict[str, dict[int, Calibrated]]
    by_ear: list[Strokes] = dataclasses.field(default_factory=list)
    tests: dict[Any, StrikeResult | None] = dataclasses.field(
        default_factory=dict
    )
    watched: dict[int, Watched] = dataclasses.field(default_factory=dict)


@dataclasses.dataclass(frozen=True)
class SelfCalibrationOutcome:
    """Results of the study, and what it takes to show one repeat.

    Attributes:
        results: Content of results.json.
        repeat: First repeat that found its mirror by the hand; None if the
            hand found none.
        by_hand: What the hand came to there.
    """

    results: MirrorResults
    repeat: Repeat | None
    by_hand: Calibrated | None


def run_self_calibration(
    executor: TrialExecutor,
    plan: SelfCalibrationPlan,
    folder: Path | None = None,
) -> SelfCalibrationOutcome:
    """Runs the study; see the module.

    Args:
        executor: Executor of the study.
        plan: What the study does.
        folder: Folder of the results; only bodies need it.

    Raises:
        InputError: If the plan or a file does not fit.
        CalibrationFailure: If the robot finds no mirror in any repeat, by its
            hand or by the drum's marker; the message says what is missing.
    """
    plan.check()
    robots = draw_robots(
        plan.bodies, plan.scenario, (plan.seed, _BODIES), folder
    )
    # A station of each body stays in memory while its repeats run.
    size = _TOGETHER if plan.bodies else plan.repeats
    groups = [
        _calibrate(
            SelfCalibration(
                executor,
                plan,
                range(first, min(first + size, plan.repeats)),
                robots,
            )
        )
        for first in range(0, plan.repeats, size)
    ]
    for name in ("hand", "ellipse"):
        _require_some([group.methods[name] for group in groups])
    for group in groups:
        _drum(group)
    shown = next(
        (
            (each, found)
            for group in groups
            for each in group.study.repeats
            if (found := group.methods["hand"][each.number]).plane is not None
        ),
        (None, None),
    )
    return SelfCalibrationOutcome(_results(plan, groups, robots), *shown)


def _calibrate(study: SelfCalibration) -> _Group:
    """Has robots look for their mirrors."""
    study.set_up()
    mirrors = {each.number: each.mirror for each in study.repeats}
    hand = study.by_hand(mirrors)
    return _Group(study, {"hand": hand, "ellipse": study.by_ellipse()})


def _require_some(found: Sequence[Mapping[int, Calibrated]]) -> None:
    """Raises CalibrationFailure if no repeat found its mirror."""
    calibrated = [each for group in found for each in group.values()]
    failures = [each.failure for each in calibrated if each.failure]
    if len(failures) == len(calibrated):
        raise CalibrationFailure(failures[0])


def _drum(group: _Group) -> None:
    """Has robots strike by ear, at unseen positions, and watched."""
    study, methods = group.study, group.methods
    group.by_ear = listen(study, methods["ellipse"])
    methods["ear"] = _from_ear(study, group.by_ear[-1])
    group.tests = _test(study, methods, _demonstrate(study))
    group.watched = watch(study, methods["hand"])


def _results(
    plan: SelfCalibrationPlan, groups: Sequence[_Group], robots: Robots
) -> MirrorResults:
    """The results of all groups together."""
    tests = {key: test for group in groups for key, test in group.tests.items()}
    repeats = [each for group in groups for each in group.study.repeats]
    by_ear = [
        Strokes.joined(parts)
        for parts in zip(*(group.by_ear for group in groups), strict=True)
    ]
    methods = {
        name: _method(
            plan,
            name,
            [
                (each, group.methods[name][each.number])
                for group in groups
                for each in group.study.repeats
            ],
            tests,
            by_ear[-1],
        )
        for name in groups[0].methods
    }
    watched = {i: one for group in groups for i, one in group.watched.items()}
    return MirrorResults.of(
        plan,
        choice="first",
        variability=1.0,
        workspace=1.0,
        schemes={
            name: {
                count: scheme_cell(_table(plan, tests, (name, count)))
                for count in plan.samples
            }
            for name in plan.schemes
        },
        comparisons=[],
        bodies=robots.numbers(),
        self_calibration=SelfCalibrationResults(
            repeats=plan.repeats,
            evaluations=plan.evaluations,
            rotation=plan.rotation,
            translation=plan.translation,
            methods=methods,
            by_ear=[strokes_result(each) for each in by_ear],
            watch=watch_result(plan, watched) if watched else None,
            beliefs=_beliefs(repeats[0], groups[0].methods),
            true_line=list(_line(*_true_plane(repeats[0]))),
        ),
    )


def _from_ear(
    study: SelfCalibration, strokes: Strokes
) -> dict[int, Calibrated]:
    """What the strokes came to, as a calibration."""
    return {
        each.number: Calibrated(
            strokes.beliefs[each.number].estimate,
            each.known,
            belief_transform(strokes.beliefs[each.number]),
            strokes=len(strokes.heard[each.number]),
            steps=strokes.steps if each.number == 0 else [],
        )
        for each in study.repeats
    }


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
                    each.scenario, xy, study.seed(_SAMPLES, each.number, k)
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

    parameters: dict[str, Any] = {}
    if name == "transfer_default":
        optical = repeat.known.optical_map()
        parameters = {
            "mapping": OpticalMapping(**vars(optical)),
            "residual": None,
        }
    return fit_with(
        name,
        repeat.skill,
        task_parameters(samples),
        np.array([each.theta for each in samples]),
        study.scenario.skill,
        **parameters,
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
        (each.number, k): Drum(
            each, each.mirror, xy, study.seed(_TEST, each.number, k)
        )
        for each in study.repeats
        for k, xy in enumerate(each.positions)
    }
    gazes = study.look_at("Looking", drums)
    tests: dict[Any, Any] = {}
    for each in study.repeats:
        movers: dict[Any, Any] = {}
        for name, found in methods.items():
            transform = found[each.number].to_direct
            if transform is not None:
                movers[name] = MirroredSkill(each.skill, transform)
        pool = pools[each.number]
        for name in plan.schemes:
            for count in plan.samples:
                if len(pool) >= count:
                    movers[name, count] = _fit(study, each, name, pool[:count])
        for k in range(plan.evaluations):
            key = each.number, k
            for name, mover in movers.items():
                tests[name, *key] = study.strike_spec(
                    drums[key], gazes[key], mover
                )
    return study.strike("Drumming", tests)


def _table(
    plan: SelfCalibrationPlan,
    tests: Mapping[Any, StrikeResult | None],
    name: Any,
) -> list[list[StrikeResult | None]]:
    """Strikes of a method: a row a repeat, a column a position."""
    return [
        [tests.get((name, number, k)) for k in range(plan.evaluations)]
        for number in range(plan.repeats)
    ]


def _method(
    plan: SelfCalibrationPlan,
    name: str,
    found: Sequence[tuple[Repeat, Calibrated]],
    tests: Mapping[Any, StrikeResult | None],
    by_ear: Strokes,
) -> MethodResult:
    cell = scheme_cell(_table(plan, tests, name))
    rows = [_plane_row(*each) for each in found]
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
        heard=[
            each.tolist() for each in by_ear.heard.values() if name == "ear"
        ],
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


# Pictures


def _beliefs(
    repeat: Repeat, methods: Mapping[str, Mapping[int, Calibrated]]
) -> list[BeliefStep]:
    reference = repeat.known.eye_position
    height = repeat.known.marker_height
    return [
        BeliefStep(
            method=name,
            step=step,
            lines=[_line(plane, reference, height) for plane in planes],
        )
        for name, found in methods.items()
        for step, planes in found[repeat.number].steps
    ]


def _true_plane(repeat: Repeat) -> tuple[Array, Array, float]:
    """The true plane of a repeat, for `_line`."""
    X_WM = pose_matrix(repeat.mirror)
    glass = X_WM[:3, 3]
    return plane_parameters(X_WM, glass), glass, repeat.known.marker_height


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
