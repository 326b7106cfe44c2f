"""An identification study: a fit that continues after a kill, and its files."""

from collections.abc import Sequence
import dataclasses
import json
from pathlib import Path
from typing import Any

from drake_affetto import __version__
from drake_affetto.common.fingerprint import files_digest
from drake_affetto.common.folder_lock import lock_folder
from drake_affetto.common.output import write_json, write_text_atomic
from drake_affetto.common.typed_json import from_plain
from drake_affetto.identification.bands import calibrate_bands, fit_members
from drake_affetto.identification.fit import FIT_STAGES, FitState, fit_logs
from drake_affetto.identification.plots import draw_prediction
from drake_affetto.identification.prediction import predict
from drake_affetto.identification.problem import JointProblem
from drake_affetto.identification.results import (
    actuator_yaml,
    make_results,
    write_band,
    write_csv,
)
from drake_affetto.identification.simulator import ANGLE_SCALE, JointSimulator
from drake_affetto.identification.uncertainty import (
    PROFILED,
    estimate_uncertainty,
    profile_fit,
)
from drake_affetto.robot.log import RobotLog

_STATE_FILE = "state.json"
_ACTUATOR_FILE = "actuator.yaml"
# Increased when a change of the model makes a stored state worthless.
_STATE_VERSION = 1


def fit_key(problem: JointProblem, paths: Sequence[str]) -> str:
    """The digest of everything that determines a fit.

    It is stored beside the fit's state; its names stay as they are, so that
    a stored fit continues.
    """
    parts: list[Any] = [
        _STATE_VERSION,
        __version__,
        {
            "joint": dataclasses.asdict(problem.joint),
            "stack": dataclasses.asdict(problem.controller),
            "supply": dataclasses.asdict(problem.supply),
            "actuator": dataclasses.asdict(problem.actuator),
        },
        [dataclasses.astuple(p) for p in problem.parameters()],
    ]
    text = json.dumps(parts, sort_keys=True)
    return files_digest(paths, text=text, length=None)


def read_state(path: Path, key: str) -> FitState | None:
    """The state of an interrupted fit; None if it is that of another fit."""
    try:
        stored = json.loads(path.read_text(encoding="utf-8"))
        if stored["key"] != key:
            return None
        # A damaged one is no loss: the fit begins anew.
        state = from_plain(FitState, stored["state"])
    except (OSError, ValueError, KeyError, TypeError, RecursionError):
        return None
    return state if 0 <= state.stage <= len(FIT_STAGES) else None


def _fit(
    problem: JointProblem,
    logs: Sequence[RobotLog],
    paths: Sequence[str],
    folder: Path,
    console: Any,
) -> FitState:
    """Fits with a progress display, from where a former run stopped."""
    from rich.progress import (
        BarColumn,
        Progress,
        TextColumn,
        TimeElapsedColumn,
    )

    refits = len(logs) if len(logs) > 1 else 0
    total = len(FIT_STAGES) + len(PROFILED) + refits
    key = fit_key(problem, paths)
    state = read_state(folder / _STATE_FILE, key)
    done = 0 if state is None else _stages_done(state)
    if state is not None:
        console.print(
            f"found {done} of {total} stages done in {folder}, going on from "
            "there",
            highlight=False,
            soft_wrap=True,
        )
    progress = Progress(
        TextColumn("{task.description}"),
        BarColumn(),
        TextColumn("{task.fields[note]}"),
        TimeElapsedColumn(),
        console=console,
    )
    task = progress.add_task("fitting", total=total, completed=done, note="")
    lowest = float("inf")

    def on_evaluation(stage: int, cost: float) -> None:
        nonlocal lowest
        lowest = min(lowest, cost)
        progress.update(
            task,
            description=f"fitting to {FIT_STAGES[stage]}",
            note=f"error {ANGLE_SCALE * lowest**0.5:.2f} % of range",
        )

    def on_profile(name: str, ratio: float) -> None:
        progress.update(
            task,
            description=f"varying {name}",
            note=f"squared error x {ratio:.2f}",
        )

    def on_member(name: str, cost: float) -> None:
        progress.update(
            task,
            description=f"fitting without {name}",
            note=f"error {ANGLE_SCALE * cost**0.5:.2f} % of range",
        )

    def on_stage(reached: FitState) -> None:
        nonlocal lowest
        lowest = float("inf")
        write_json(
            folder / _STATE_FILE,
            {"key": key, "state": dataclasses.asdict(reached)},
        )
        progress.update(task, completed=_stages_done(reached))

    with progress:
        state = fit_logs(
            problem,
            logs,
            state=state,
            on_evaluation=on_evaluation,
            on_stage=on_stage,
        )
        state = fit_members(
            problem,
            logs,
            state,
            on_evaluation=on_member,
            on_member=on_stage,
        )
        return profile_fit(
            problem,
            logs,
            state,
            on_evaluation=on_profile,
            on_parameter=on_stage,
        )


def _stages_done(state: FitState) -> int:
    return state.stage + len(state.members) + len(state.profile)


def run_identification(
    problem: JointProblem,
    fit: Sequence[RobotLog],
    test: Sequence[RobotLog],
    paths: Sequence[str],
    folder: Path,
    console: Any,
) -> dict[str, Any]:
    """Fits the joint to logs, predicts others, and writes the results.

    Args:
        problem: The joint to be identified.
        fit: Logs to fit to.
        test: Logs to predict.
        paths: Files of the logs `fit`, which are a part of the fit's key.
        folder: Folder of the results.
        console: A rich console for progress.

    Returns:
        The content of results.json.

    Raises:
        InputError: If a file cannot be written, or another process works in
            the folder.
    """
    with lock_folder(folder, "affetto identify"):
        # The fit, and both loops of each log under the fitted values.
        state = _fit(problem, fit, paths, folder, console)
        uncertainty = estimate_uncertainty(problem, fit, state)
        simulator = JointSimulator(problem)
        scales = calibrate_bands(simulator, fit, state)
        tested = [predict(simulator, state, log, scales) for log in test]
        fitted = [predict(simulator, state, log, scales) for log in fit]
        results = make_results(problem, state, uncertainty, fitted, tested)
        # The files.
        for prediction in tested:
            stem = prediction.log.name
            write_csv(folder / f"{stem}_closed.csv", prediction.closed_loop)
            write_csv(folder / f"{stem}_open.csv", prediction.open_loop)
            for loop, band in prediction.bands.items():
                write_band(
                    folder / f"{stem}_{loop}_band.csv", prediction.log, band
                )
        for prediction in (*fitted, *tested):
            draw_prediction(folder / f"{prediction.log.name}.png", prediction)
        write_text_atomic(
            folder / _ACTUATOR_FILE,
            actuator_yaml(
                problem, state, uncertainty, [log.name for log in fit]
            ),
        )
        # Last: where results.json is, all the rest is.
        write_json(folder / "results.json", results)
    return results
