"""The study of `affetto mirror --self-calibrate`: what is run and compared.

Beside the robot that finds the mirror by itself drum schemes that were given
demonstrations before the same mirror, at the same positions.
"""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from drake_affetto.calibration.plane import CalibrationFailure
from drake_affetto.common.typing import Array
from drake_affetto.experiments.mirror_setup import (
    judge_plane,
    pose_matrix,
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
    watch,
)
from drake_affetto.experiments.trials import (
    at_mirror,
    demonstration,
    run_trials,
)
from drake_affetto.geometry.planes import normals, plane_parameters
from drake_affetto.runner.executor import TrialExecutor

_TEST, _SAMPLES = range(300, 302)

# Half the length of a mirror's line in a picture, m.
_REACH = 0.3


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
    by_ear = listen(study, ellipse)
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
                count: scheme_cell(_table(study, tests, (name, count)))
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
            by_ear=[strokes_result(each) for each in by_ear],
            watch=watch(study, hand),
            beliefs=_beliefs(study, methods),
            true_line=list(_line(*_true_plane(study.repeats[0]))),
        ),
    )


def _require_some(found: Mapping[int, Calibrated]) -> None:
    """Raises CalibrationFailure if no repeat found its mirror."""
    failures = [each.failure for each in found.values() if each.failure]
    if len(failures) == len(found):
        raise CalibrationFailure(failures[0])


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


def _method(
    study: SelfCalibration,
    name: str,
    found: Mapping[int, Calibrated],
    tests: Mapping[Any, StrikeResult | None],
    by_ear: Sequence[Strokes],
) -> MethodResult:
    cell = scheme_cell(_table(study, tests, name))
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


# Pictures


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
