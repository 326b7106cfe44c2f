"""What a tuning study does, and what came of it."""

from collections.abc import Sequence
from concurrent.futures import Executor
import dataclasses
from typing import Any

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
class Evaluation:
    """How two sets of gains do on all references.

    Attributes:
        references: by name.
        runs: by reference's name, the hand-tuned and the best gains' run.
        costs: as `runs`.
    """

    references: dict[str, Reference]
    runs: dict[str, tuple[Rollout, Rollout]]
    costs: dict[str, tuple[JointCosts, JointCosts]]


def evaluate(plan: TunePlan, best: PidfGains, executor: Executor) -> Evaluation:
    """Runs start and best gains along all references."""
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
    """The joint's counterpart on the other side, or None."""
    for side, other in (("right_", "left_"), ("left_", "right_")):
        if joint.startswith(side):
            return other + joint.removeprefix(side)
    return None


def overlay_text(
    plan: TunePlan, names: Sequence[str], gains: PidfGains, heading: str
) -> str:
    """An overlay of `ControlParameters` with the gains that were searched.

    Both arms get the same: the other side's joints are contralateral, unless they
    were searched themselves.
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
    # The file must be what the reader makes of it.
    assert set(yaml.safe_load(text)["gains"]) == set(rows)
    return text


def rounded_gains(gains: PidfGains) -> PidfGains:
    """The gains as `overlay_text` writes them."""
    return PidfGains.from_array(
        [[float(f"{v:.3e}") for v in row] for row in gains.to_array()]
    )


def make_results(
    plan: TunePlan,
    study: optuna.Study,
    best: FrozenTrial,
    gains: PidfGains,
    evaluation: Evaluation,
) -> dict[str, Any]:
    """What results.json holds."""
    robot = environment(plan)
    names = robot.names
    start = load_control(plan.start).for_joints(names)
    degrees = np.degrees(1.0) * robot.span / 100.0

    def side(which: int, values: PidfGains) -> dict[str, Any]:
        array = values.to_array()
        result: dict[str, Any] = {
            "cost": evaluation.costs[TRAINING][which].mean(),
            "gains": {
                joint: dict(zip(GAINS, array[:, i].tolist(), strict=True))
                for i, joint in enumerate(names)
            },
            "trajectories": {},
        }
        for name in (TRAINING, *HELD_OUT):
            costs = evaluation.costs[name][which]
            error = costs.tracking * degrees
            result["trajectories"][name] = {
                "cost": costs.mean(),
                "tracking_error_deg": _by(names, error),
                "tracking_percent": _by(names, costs.tracking),
                "effort_percent": _by(names, costs.effort),
                "oscillation_percent": _by(names, costs.oscillation),
            }
        reference = evaluation.references[REST]
        q = evaluation.runs[REST][which].q
        result["rest_oscillation_percent"] = _by(
            names,
            100.0
            * rest_std(q, reference.rest, robot.tuning.sample_rate)
            / robot.span,
        )
        return result

    hand, tuned = side(0, start), side(1, gains)
    count = dict.fromkeys(TrialState, 0)
    for trial in study.get_trials(deepcopy=False):
        count[trial.state] += 1
    return {
        "study": "tune",
        "version": __version__,
        "seed": plan.seed,
        "scenario": plan.scenario,
        "start": plan.start,
        "tuning": plan.tuning,
        "joints": list(plan.joints),
        "trials": {
            "finished": count[TrialState.COMPLETE] + count[TrialState.PRUNED],
            "complete": count[TrialState.COMPLETE],
            "pruned": count[TrialState.PRUNED],
            "interrupted": count[TrialState.FAIL],
            "best": best.number,
        },
        "hand_tuned": hand,
        "best": tuned,
        "improvement": 1.0 - tuned["cost"] / hand["cost"],
        "held_out_improvement": {
            name: 1.0
            - tuned["trajectories"][name]["cost"]
            / hand["trajectories"][name]["cost"]
            for name in HELD_OUT
        },
    }


def _by(names: Sequence[str], values: Array) -> dict[str, float]:
    return dict(zip(names, np.asarray(values).tolist(), strict=True))
