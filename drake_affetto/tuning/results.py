"""The results of a tuning study: start and best gains on all references."""

from collections.abc import Sequence
from concurrent.futures import Executor
import dataclasses

import numpy as np
import optuna
from optuna.trial import FrozenTrial, TrialState
import yaml

from drake_affetto import __version__
from drake_affetto.common.typing import Array
from drake_affetto.control.pidf import (
    PidfGains,
    load_control,
)
from drake_affetto.tuning.config import (
    HELD_OUT,
    REST,
    TRAINING,
)
from drake_affetto.tuning.costs import JointCosts, rest_std
from drake_affetto.tuning.environment import Rollout, environment, run_reference
from drake_affetto.tuning.plan import (
    GAINS,
    TunePlan,
)
from drake_affetto.tuning.references import Reference


@dataclasses.dataclass(frozen=True)
class TrajectoryResult:
    """The costs of one set of gains on one reference, by joint.

    Attributes:
        cost: Mean cost of all joints.
        tracking_error_deg: Rms tracking error, degrees.
        tracking_percent: Rms tracking error, % of the joint's range.
        effort_percent: Effort of the valves, %.
        oscillation_percent: Oscillation at rest, % of the joint's range.
    """

    cost: float
    tracking_error_deg: dict[str, float]
    tracking_percent: dict[str, float]
    effort_percent: dict[str, float]
    oscillation_percent: dict[str, float]


@dataclasses.dataclass(frozen=True)
class GainsResult:
    """The performance of one set of gains.

    Attributes:
        cost: Cost on the training trajectory.
        gains: Gains by joint and name.
        trajectories: Costs by reference.
        rest_oscillation_percent: Greatest standard deviation at rest in any of
            several postures, by joint, % of the joint's range.
    """

    cost: float
    gains: dict[str, dict[str, float]]
    trajectories: dict[str, TrajectoryResult]
    rest_oscillation_percent: dict[str, float]


@dataclasses.dataclass(frozen=True)
class TrialCounts:
    """Numbers of trials.

    Attributes:
        finished: Number of complete and pruned trials.
        complete: Number of trials that followed the whole trajectory.
        pruned: Number of trials that were stopped early.
        interrupted: Number of trials whose process was killed.
        best: Number by which the study knows the best trial.
    """

    finished: int
    complete: int
    pruned: int
    interrupted: int
    best: int


@dataclasses.dataclass(frozen=True)
class TuningResults:
    """The content of results.json.

    Attributes:
        study: Kind of the study: "tune".
        version: Version that made the results.
        seed: Seed of the search.
        scenario: Name or file of the scenario.
        start: File of the gains that the search started from.
        tuning: File of references, cost and search.
        joints: Joints whose gains were searched.
        trials: Numbers of trials.
        hand_tuned: Performance of the start.
        best: Performance of the best gains.
        improvement: Decrease of the cost on the training trajectory, as a part
            of the start's cost.
        held_out_improvement: The same for each held-out reference.
    """

    study: str
    version: str
    seed: int
    scenario: str
    start: str
    tuning: str
    joints: list[str]
    trials: TrialCounts
    hand_tuned: GainsResult
    best: GainsResult
    improvement: float
    held_out_improvement: dict[str, float]


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


def contralateral(joint: str) -> str | None:
    """The same joint of the other side of the body, or None."""
    for side, other in (("right_", "left_"), ("left_", "right_")):
        if joint.startswith(side):
            return other + joint.removeprefix(side)
    return None


def overlay_text(
    plan: TunePlan, names: Sequence[str], gains: PidfGains, heading: str
) -> str:
    """An overlay of `ControlParameters` with the gains that were searched.

    Both arms get the same gains: the contralateral joints too, unless they
    were searched themselves.

    Args:
        plan: Plan of the study.
        names: Names of the n joints of `gains`.
        gains: Gains of n joints.
        heading: Comment at the top of the file.
    """
    rows: dict[str, list[str]] = {}
    array = gains.to_array()
    for i, joint in enumerate(names):
        if joint in plan.joints:
            rows[joint] = [f"{value:.3e}" for value in array[:, i]]
    for joint in list(rows):
        other = contralateral(joint)
        if other is not None and other not in rows:
            rows[other] = rows[joint]
    lines = [f"# {line}".rstrip() for line in heading.splitlines()]
    lines.append("gains:")
    for joint, row in rows.items():
        pairs = ", ".join(f"{g}: {v}" for g, v in zip(GAINS, row, strict=True))
        lines.append(f"  {joint}: {{{pairs}}}")
    text = "\n".join(lines) + "\n"
    # Guards the text that is put together by hand.
    assert set(yaml.safe_load(text)["gains"]) == set(rows)
    return text


def rounded_gains(gains: PidfGains) -> PidfGains:
    """The gains, rounded as `overlay_text` writes them."""
    return PidfGains.from_array(
        [[float(f"{v:.3e}") for v in row] for row in gains.to_array()]
    )


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
    return TuningResults(
        study="tune",
        version=__version__,
        seed=plan.seed,
        scenario=plan.scenario,
        start=plan.start,
        tuning=plan.tuning,
        joints=list(plan.joints),
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
