"""The evaluation of a tuning study: start and best gains on all references."""

from collections.abc import Sequence
from concurrent.futures import Executor
import dataclasses

import numpy as np
import optuna
from optuna.trial import FrozenTrial, TrialState

from drake_affetto.common.typing import Array
from drake_affetto.control.pidf import PidfGains, load_control
from drake_affetto.tuning.config import HELD_OUT, REST, TRAINING
from drake_affetto.tuning.costs import JointCosts, rest_std
from drake_affetto.tuning.environment import (
    Rollout,
    environment,
    run_reference,
)
from drake_affetto.tuning.plan import GAINS, TunePlan, parameter_names
from drake_affetto.tuning.references import Reference
from drake_affetto.tuning.results import (
    GainsResult,
    ReferenceTraces,
    TrajectoryResult,
    TrialCounts,
    TrialRow,
    TuningDetails,
    TuningResults,
)

# Rate of the stored joint angles, Hz.
_TRACE_RATE = 25.0
# Complete trials from which importances are computed.
_ENOUGH_TRIALS = 20


@dataclasses.dataclass(frozen=True)
class Evaluation:
    """Rollouts of start and best gains along all references.

    Attributes:
        references: References by name.
        runs: Rollouts of the start and of the best gains, by reference.
        costs: Costs of these rollouts.
    """

    references: dict[str, Reference]
    runs: dict[str, tuple[Rollout, Rollout]]
    costs: dict[str, tuple[JointCosts, JointCosts]]


def evaluate(plan: TunePlan, best: PidfGains, executor: Executor) -> Evaluation:
    """Simulates start and best gains along all references.

    Args:
        plan: Plan of the study.
        best: Gains to compare with the start.
        executor: Executor of the simulations.
    """
    robot = environment(plan)
    start = load_control(plan.start).for_joints(robot.names)
    names = (TRAINING, *HELD_OUT, REST)
    references = {name: robot.reference(name) for name in names}
    jobs = {
        name: [
            executor.submit(run_reference, plan, name, gains.to_array())
            for gains in (start, best)
        ]
        for name in names
    }
    runs = {
        name: (pair[0].result(), pair[1].result())
        for name, pair in jobs.items()
    }
    costs = {
        name: (
            robot.costs(references[name], pair[0]),
            robot.costs(references[name], pair[1]),
        )
        for name, pair in runs.items()
    }
    return Evaluation(references, runs, costs)


def make_results(
    plan: TunePlan,
    study: optuna.Study,
    best: FrozenTrial,
    gains: PidfGains,
    evaluation: Evaluation,
) -> TuningResults:
    """Gathers the results of a finished study.

    Args:
        plan: Plan of the study.
        study: The study.
        best: Its best trial.
        gains: Gains of that trial, as they were evaluated.
        evaluation: Evaluation of start and `gains`.
    """
    start = load_control(plan.start).for_joints(environment(plan).names)
    before = _performance(plan, evaluation, 0, start)
    after = _performance(plan, evaluation, 1, gains)
    count = dict.fromkeys(TrialState, 0)
    for trial in study.get_trials(deepcopy=False):
        count[trial.state] += 1
    return TuningResults.of(
        plan,
        trials=TrialCounts(
            finished=count[TrialState.COMPLETE] + count[TrialState.PRUNED],
            complete=count[TrialState.COMPLETE],
            pruned=count[TrialState.PRUNED],
            interrupted=count[TrialState.FAIL],
            best=best.number,
        ),
        hand_tuned=before,
        best=after,
        improvement=1.0 - after.cost / before.cost,
        held_out_improvement={
            name: 1.0
            - after.trajectories[name].cost / before.trajectories[name].cost
            for name in HELD_OUT
        },
    )


def _performance(
    plan: TunePlan, evaluation: Evaluation, which: int, gains: PidfGains
) -> GainsResult:
    """The performance of the start (`which` 0) or the best gains (1)."""
    robot = environment(plan)
    degrees = np.degrees(1.0) * robot.span / 100.0

    def by_joint(values: Array) -> dict[str, float]:
        return dict(zip(robot.names, values.tolist(), strict=True))

    trajectories = {}
    for name in (TRAINING, *HELD_OUT):
        costs = evaluation.costs[name][which]
        trajectories[name] = TrajectoryResult(
            cost=costs.mean(),
            tracking_error_deg=by_joint(costs.tracking * degrees),
            tracking_percent=by_joint(costs.tracking),
            effort_percent=by_joint(costs.effort),
            oscillation_percent=by_joint(costs.oscillation),
        )
    at_rest = rest_std(
        evaluation.runs[REST][which].q,
        evaluation.references[REST].rest,
        robot.tuning.sample_rate,
    )
    return GainsResult(
        cost=evaluation.costs[TRAINING][which].mean(),
        gains={
            joint: dict(zip(GAINS, column.tolist(), strict=True))
            for joint, column in zip(
                robot.names, gains.to_array().T, strict=True
            )
        },
        trajectories=trajectories,
        rest_oscillation_percent=by_joint(100.0 * at_rest / robot.span),
    )


def make_details(
    plan: TunePlan, study: optuna.Study, evaluation: Evaluation
) -> TuningDetails:
    """Gathers what the report's charts show.

    Args:
        plan: Plan of the study.
        study: The study.
        evaluation: Evaluation of start and best gains.
    """
    rows = []
    for trial in study.get_trials(
        deepcopy=False, states=(TrialState.COMPLETE, TrialState.PRUNED)
    ):
        cost = trial.value
        if trial.state == TrialState.PRUNED:
            cost = list(trial.intermediate_values.values())[-1]
        if cost is not None:
            pruned = trial.state == TrialState.PRUNED
            rows.append(TrialRow(trial.number, pruned, cost))
    names = environment(plan).names
    return TuningDetails(
        trials=rows,
        importance=importances(study, plan.joints),
        references={
            name: _traces(names, reference, evaluation.runs[name])
            for name, reference in evaluation.references.items()
        },
    )


def _traces(
    names: Sequence[str],
    reference: Reference,
    runs: tuple[Rollout, Rollout],
) -> ReferenceTraces:
    step = max(
        1, round(1.0 / (_TRACE_RATE * (reference.t[1] - reference.t[0])))
    )

    def by_joint(q: Array) -> dict[str, list[float]]:
        degrees = np.degrees(q[::step]).round(2)
        return dict(zip(names, degrees.T.tolist(), strict=True))

    return ReferenceTraces(
        t=reference.t[::step].round(3).tolist(),
        desired=by_joint(reference.q),
        hand_tuned=by_joint(runs[0].q),
        tuned=by_joint(runs[1].q),
    )


def importances(
    study: optuna.Study, joints: Sequence[str]
) -> dict[str, dict[str, float]] | None:
    """The importance of each gain for the cost of its joint.

    It is the gain's share of the variance of the logarithm of the joint's own
    cost over the joint's own gains (functional ANOVA).

    Args:
        study: The study.
        joints: Joints whose gains were searched.

    Returns:
        Shares by joint and gain, which add to 1 for each joint; None after
        too few trials.
    """
    complete = study.get_trials(deepcopy=False, states=(TrialState.COMPLETE,))
    if len(complete) < _ENOUGH_TRIALS:
        return None
    shares = {}
    for joint in joints:

        def cost(trial: FrozenTrial, joint: str = joint) -> float:
            return float(np.log(trial.user_attrs["joint_costs"][joint]))

        found = optuna.importance.get_param_importances(
            study,
            evaluator=optuna.importance.FanovaImportanceEvaluator(seed=0),
            params=parameter_names([joint]),
            target=cost,
        )
        shares[joint] = {gain: found[f"{joint}.{gain}"] for gain in GAINS}
    return shares
