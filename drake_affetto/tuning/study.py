"""A tuning study: searches the controllers' gains on the whole robot.

Trials are simulations of the station, which follows the training trajectory.
They are kept in an Optuna study in SQLite as they finish, and a study that was
killed continues from there.
"""

import itertools
from pathlib import Path
from typing import Any

import optuna
from optuna.trial import TrialState

from drake_affetto.common.errors import InputError
from drake_affetto.common.folder_lock import lock_folder
from drake_affetto.common.output import write_json, write_text_atomic
from drake_affetto.control.pidf import load_control
from drake_affetto.runner.workers import WorkerPool
from drake_affetto.tuning.cma_es import JointwiseCmaEs
from drake_affetto.tuning.environment import environment
from drake_affetto.tuning.evaluation import evaluate, make_details, make_results
from drake_affetto.tuning.fingerprint import fingerprint
from drake_affetto.tuning.gains_file import overlay_text, rounded_gains
from drake_affetto.tuning.plan import TunePlan
from drake_affetto.tuning.results import DETAILS_FILE, TuningResults
from drake_affetto.tuning.search import (
    STUDY_FILE,
    finished_trials,
    open_study,
    scaled_gains,
)
from drake_affetto.tuning.trial import forget_studies, run_trial


def _prepare_study(
    out: Path, plan: TunePlan, restart: bool
) -> tuple[optuna.Study, JointwiseCmaEs]:
    """Opens the study and marks the trials that a kill interrupted as failed.

    Raises:
        InputError: If the file holds another study, or none at all.
    """
    path = out / STUDY_FILE
    if restart:
        forget_studies()
        for suffix in ("", "-wal", "-shm", "-journal"):
            Path(f"{path}{suffix}").unlink(missing_ok=True)
        for old in ("results.json", "gains.yaml", "study.html", DETAILS_FILE):
            (out / old).unlink(missing_ok=True)
    mark = fingerprint(plan)
    try:
        study, sampler = open_study(out, plan)
        known = study.user_attrs.get("fingerprint")
        if known is None:
            study.set_user_attr("fingerprint", mark)
            study.set_user_attr("joints", list(plan.joints))
            known = mark
        # No other process works here: a running trial was interrupted.
        for trial in study.get_trials(
            deepcopy=False, states=(TrialState.RUNNING,)
        ):
            if known == mark:
                study.tell(trial.number, state=TrialState.FAIL)
    except Exception as error:
        # The database raises errors of many kinds for a file of another kind.
        text = str(error).splitlines()[0]
        raise InputError(f"cannot keep a study in {path}: {text}") from error
    if known != mark:
        raise InputError(
            f"{out} holds a study of other joints, seed or models; take "
            "another --out, or --restart to throw it away"
        )
    return study, sampler.search


def _run_trials(
    out: Path,
    plan: TunePlan,
    trials: int,
    pool: WorkerPool,
    workers: int,
    restart: bool,
    console: Any,
) -> optuna.Study:
    """Runs what is missing of `trials`, one generation after the other.

    Returns:
        The study.
    """
    from drake_affetto.runner.progress import make_progress

    study, search = _prepare_study(out, plan, restart)
    mark = study.user_attrs["fingerprint"]
    finished = set(finished_trials(study))
    if console is not None and finished:
        console.print(f"{len(finished)} trials were there already")
    progress = make_progress(note=True, console=console, quiet=console is None)
    bar = progress.add_task(
        "Tuning", total=trials, completed=len(finished), note=_note(study)
    )

    def keep(candidate: int, _: object) -> None:
        finished.add(candidate)
        progress.update(bar, completed=len(finished), note=_note(study))

    def on_death(dead: str) -> None:
        progress.console.print(f"{dead} died; its trial is tried again")
        # Its trial is marked as failed, and what others finished is read.
        reopened, _ = _prepare_study(out, plan, restart=False)
        finished.update(finished_trials(reopened))

    # A generation needs all earlier ones. The start comes before all others,
    # which are compared with it.
    size = search.generation_size
    bounds = {0, min(1, trials), *range(size, trials, size), trials}
    with progress:
        for first, end in itertools.pairwise(sorted(bounds)):
            generation = range(first, end)

            def remaining(
                generation: range = generation,
            ) -> dict[int, tuple[str, TunePlan, int, str]]:
                return {
                    candidate: (str(out), plan, candidate, mark)
                    for candidate in generation
                    if candidate not in finished
                }

            pool.run(
                run_trial,
                remaining,
                keep,
                label="Tuning",
                on_death=on_death,
                ahead=max(1, workers),
            )
    return study


def _note(study: optuna.Study) -> str:
    """The best cost so far, for the progress display."""
    try:
        return f"best cost {study.best_value:.3f}"
    except ValueError:  # none has finished
        return ""


def run_tune(
    out: Path,
    plan: TunePlan,
    *,
    trials: int = 216,
    workers: int = 2,
    restart: bool = False,
    console: Any = None,
) -> TuningResults:
    """Runs the study in the folder `out` until it has `trials` trials.

    Args:
        out: Folder of the study.
        plan: Plan of the study, from `load_plan`.
        trials: Number of finished trials, those of earlier runs included.
        workers: Number of worker processes; 0 for this one.
        restart: Whether to throw away what an earlier run has left.
        console: A rich console for progress; None for silence.

    Returns:
        The results, as results.json holds them.

    Raises:
        InputError: If the folder holds another study, or another process
            works in it.
    """
    with lock_folder(out, "affetto tune"), WorkerPool(workers) as pool:
        study = _run_trials(out, plan, trials, pool, workers, restart, console)
        # Start and best gains follow all references, the held-out ones too.
        if console is not None:
            console.print("Following the held-out trajectories ...")
        robot = environment(plan)
        start = load_control(plan.start).for_joints(robot.names)
        best = study.best_trial
        gains = rounded_gains(scaled_gains(start, robot.names, best.params))
        evaluation = evaluate(plan, gains, pool.executor)
        results = make_results(plan, study, best, gains, evaluation)
        heading = (
            f"Gains from `affetto tune`: trial {best.number} of "
            f"{results.trials.finished}, seed {plan.seed}.\n"
            f"Cost on the training trajectory {results.best.cost:.3f}; of "
            f"the hand-tuned gains {results.hand_tuned.cost:.3f}.\n"
            "A scenario takes them up with: control: {overlays: [THIS FILE]}"
        )
        write_text_atomic(
            out / "gains.yaml",
            overlay_text(plan, robot.names, gains, heading),
        )
        write_json(out / DETAILS_FILE, make_details(plan, study, evaluation))
        # Last: where results.json is, all the rest is.
        write_json(out / "results.json", results)
    return results
