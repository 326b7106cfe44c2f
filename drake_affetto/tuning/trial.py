"""One trial of a tuning study"""

from pathlib import Path

import numpy as np
import optuna
from optuna.trial import TrialState

from drake_affetto.control.pidf import (
    load_control,
)
from drake_affetto.tuning.config import (
    TRAINING,
)
from drake_affetto.tuning.environment import Rollout, environment
from drake_affetto.tuning.plan import (
    TunePlan,
)
from drake_affetto.tuning.search import (
    JointwiseSampler,
    comparable_trials,
    open_study,
    scaled_gains,
)
from drake_affetto.tuning.study import _die_with_parent

_watched = False


def run_trial(out: str, plan: TunePlan, candidate: int) -> int:
    """Runs one candidate as a trial of the study in the folder `out`.

    Args:
        candidate: its number; all earlier generations have finished.

    Returns:
        The candidate's number.
    """
    global _watched
    if not _watched:
        _die_with_parent()
        _watched = True
    robot = environment(plan)
    key = (out, plan)
    if key not in _STUDIES:
        _STUDIES[key] = open_study(Path(out), plan)
    study, sampler = _STUDIES[key]
    sampler.candidate = candidate
    trial = study.ask({**sampler.space})
    trial.set_user_attr("candidate", candidate)
    reference = robot.reference(TRAINING)
    start = load_control(plan.start).for_joints(robot.names)
    where = [robot.names.index(joint) for joint in plan.joints]
    so_far: list[list[float]] = []

    def report(_: float, run: Rollout) -> bool:
        costs = robot.costs(reference, run)
        so_far.append(costs.total[where].tolist())
        trial.report(costs.mean(), len(so_far))
        return trial.should_prune()

    run = robot.run(
        reference,
        scaled_gains(start, robot.names, trial.params),
        report,
        robot.tuning.search.report_every,
    )
    pruned = len(run.q) < len(reference.t)
    costs = robot.costs(reference, run)
    by_joint = costs.total[where]
    if pruned:
        # A part of the trajectory costs more or less than the whole: as much
        # more as it did for the trials that went all the way.
        ratio = [
            np.array(list(other.user_attrs["joint_costs"].values()))
            / np.array(other.user_attrs["so_far"][len(so_far) - 1])
            for other in comparable_trials(study, sampler.search, candidate)
        ]
        by_joint = by_joint * np.median(ratio, axis=0)
    trial.set_user_attr("so_far", so_far)
    trial.set_user_attr(
        "joint_costs", dict(zip(plan.joints, by_joint.tolist(), strict=True))
    )
    if pruned:
        study.tell(trial, state=TrialState.PRUNED)
    else:
        study.tell(trial, costs.mean())
    return candidate


_STUDIES: dict[tuple[str, TunePlan], tuple[optuna.Study, JointwiseSampler]] = {}
