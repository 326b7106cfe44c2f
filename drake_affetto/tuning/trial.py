"""One trial of a tuning study, as a worker runs it."""

from pathlib import Path

import numpy as np
import optuna
from optuna.trial import TrialState

from drake_affetto.common.errors import InputError
from drake_affetto.control.pidf import (
    load_control,
)
from drake_affetto.tuning.config import (
    TRAINING,
)
from drake_affetto.tuning.environment import Rollout, environment
from drake_affetto.tuning.fingerprint import fingerprint
from drake_affetto.tuning.plan import (
    TunePlan,
)
from drake_affetto.tuning.search import (
    JointwiseSampler,
    comparable_trials,
    open_study,
    scaled_gains,
)

# The studies that this process has opened, by folder, plan and fingerprint.
_STUDIES: dict[
    tuple[str, TunePlan, str], tuple[optuna.Study, JointwiseSampler]
] = {}


def forget_studies() -> None:
    """Forgets the studies that this process has opened: one was deleted."""
    _STUDIES.clear()


def run_trial(out: str, plan: TunePlan, candidate: int, mark: str) -> int:
    """Runs one candidate as a trial of the study in the folder `out`.

    Args:
        out: Folder of the study.
        plan: Plan of the study.
        candidate: Number of the candidate; all earlier generations have
            finished.
        mark: The study's fingerprint.

    Returns:
        The candidate's number.

    Raises:
        InputError: If what this process reads is not the study's any more.
    """
    robot = environment(plan)
    if fingerprint(plan) != mark:
        raise InputError(
            f"the scenario {plan.scenario!r} or another file is not the one "
            f"that the study in {out} was begun with"
        )
    key = (out, plan, mark)
    if key not in _STUDIES:
        _STUDIES[key] = open_study(Path(out), plan)
    study, sampler = _STUDIES[key]
    # The sampler gives the candidate's factors of the start's gains.
    sampler.candidate = candidate
    trial = study.ask({**sampler.space})
    trial.set_user_attr("candidate", candidate)
    reference = robot.reference(TRAINING)
    start = load_control(plan.start).for_joints(robot.names)
    where = [robot.names.index(joint) for joint in plan.joints]
    # Follow the training trajectory, unless the pruner stops it.
    so_far: list[list[float]] = []

    def report(_: float, rollout: Rollout) -> bool:
        costs = robot.costs(reference, rollout)
        so_far.append(costs.total[where].tolist())
        trial.report(costs.mean(), len(so_far))
        return trial.should_prune()

    rollout = robot.rollout(
        reference,
        scaled_gains(start, robot.names, trial.params),
        report,
        robot.tuning.search.report_every,
    )
    pruned = len(rollout.q) < len(reference.t)
    costs = robot.costs(reference, rollout)
    by_joint = costs.total[where]
    if pruned:
        # Estimates the cost of the whole trajectory from that of its first
        # part, by the ratio that complete trials had.
        ratio = [
            np.array(list(other.user_attrs["joint_costs"].values()))
            / np.array(other.user_attrs["so_far"][len(so_far) - 1])
            for other in comparable_trials(study, sampler.search, candidate)
        ]
        by_joint = by_joint * np.median(ratio, axis=0)
    # Keep the costs, which the search learns from.
    trial.set_user_attr("so_far", so_far)
    trial.set_user_attr(
        "joint_costs", dict(zip(plan.joints, by_joint.tolist(), strict=True))
    )
    if pruned:
        study.tell(trial, state=TrialState.PRUNED)
    else:
        study.tell(trial, costs.mean())
    return candidate
