"""`affetto drum`: learning to drum from demonstrations (paper Figs. 3b, 3c).

Demonstrations are learned one by one, in random order and, on request, in the
order in which the skill itself would ask for them. After each, the skill drums
at unseen positions; every trial is simulated in full and judged by its sound.
"""

from collections.abc import Sequence
import copy
import dataclasses
from typing import Any

import numpy as np

from drake_affetto import __version__
from drake_affetto.common.errors import require_range
from drake_affetto.experiments.skills import (
    make_skill,
    stack_prototypes,
    teach_places,
)
from drake_affetto.experiments.statistics import success_rate
from drake_affetto.experiments.trials import (
    draw_positions,
    look,
    strike,
    trial_seed,
)
from drake_affetto.runner.executor import Result, Spec, TrialExecutor
from drake_affetto.sound.config import load_sound_config
from drake_affetto.sound.separation import separation
from drake_affetto.station.scenario import Scenario, SkillConfig, load_scenario

# What a seed of the study is for. Other studies that learn the same skill use
# those of the demonstrations and the skill too.
_TESTS, SOURCE, _ORDER, HIDDEN, _LOOKS, _STRIKES = range(6)

# A curve has arrived where it stays at this rate or above.
_ARRIVED = 0.9


@dataclasses.dataclass(frozen=True)
class DrumPlan:
    """How much the study does.

    Attributes:
        demonstrations: how many are taught.
        evaluations: unseen positions, the same throughout the study.
        repeats: how often all of it is done, with other demonstrations.
        active: whether the skill's own choice of order is tried too.
        after: after which demonstrations the skill is tried; after each where
            it is empty. After the last it always is.
        scenario: by name or path.
        seed: of everything that is random.
    """

    demonstrations: int = 25
    evaluations: int = 10
    repeats: int = 1
    active: bool = False
    after: tuple[int, ...] = ()
    scenario: str = "drumming"
    seed: int = 0

    def check(self) -> None:
        """Raises InputError for the first number that does not fit."""
        require_range("--demonstrations", self.demonstrations, 3, 1000)
        require_range("--evaluations", self.evaluations, 1, 1000)
        require_range("--repeats", self.repeats, 1, 1000)
        for number in self.after:
            require_range("--after", number, 1, self.demonstrations)

    @property
    def tried_after(self) -> list[int]:
        """After which demonstrations the skill is tried, in order."""
        every = range(1, self.demonstrations + 1)
        return sorted({*(self.after or every), self.demonstrations})


def active_order(
    config: SkillConfig, tau: np.ndarray, first: int, seed: int
) -> list[int]:
    """The order in which a skill would ask for demonstrations.

    Each time that place is asked for without which its predictions would stay
    least certain, all places taken together: the sum of the leverages that
    are left is the least. For that the robot need only have looked there.

    Args:
        tau: (N, 2) task parameters of the places.
        first: the place that is taught first.
        seed: of the skill's hidden layer.

    Returns:
        A permutation of 0 ... N - 1.
    """
    skill = make_skill(config, seed)
    order = [first]
    # What was demonstrated does not matter to how certain a prediction is.
    nothing = np.zeros((1, 1))
    skill.partial_fit(tau[[first]], nothing)
    while len(order) < len(tau):
        rest = [i for i in range(len(tau)) if i not in order]
        uncertain = []
        for i in rest:
            wiser = copy.deepcopy(skill).partial_fit(tau[[i]], nothing)
            uncertain.append(wiser.leverage(tau).sum())
        order.append(rest[int(np.argmin(uncertain))])
        skill.partial_fit(tau[[order[-1]]], nothing)
    return order


def learning_course(
    config: SkillConfig, lessons: Sequence[Result], seed: int
) -> list[Any]:
    """The skill after each of the demonstrations."""
    skill = make_skill(config, seed)
    course = []
    for result, arrays in lessons:
        skill.partial_fit([result["tau"]], [arrays["theta"]])
        course.append(copy.deepcopy(skill))
    return course


def run_drum(executor: TrialExecutor, plan: DrumPlan) -> dict[str, Any]:
    """Runs the study and returns its results; see the module.

    Raises:
        InputError: if the plan does not fit, or too few demonstrations
            succeed.
    """
    plan.check()
    scenario = load_scenario(plan.scenario)
    tests = draw_positions(
        scenario, plan.evaluations, np.random.default_rng([plan.seed, _TESTS])
    )
    taught = [
        teach_places(
            executor,
            f"Teaching by hand, {repeat + 1} of {plan.repeats}",
            plan.scenario,
            plan.demonstrations,
            (plan.seed, SOURCE, repeat),
        )
        for repeat in range(plan.repeats)
    ]
    seen = executor.run(
        "Looking at unseen positions",
        {
            (repeat, place): look(
                plan.scenario, xy, trial_seed(plan.seed, _LOOKS, repeat, place)
            )
            for repeat in range(plan.repeats)
            for place, xy in enumerate(tests)
        },
    )

    specs: dict[tuple, Spec] = {}
    rows: list[dict[str, Any]] = []
    for repeat, lessons in enumerate(taught):
        prototypes = stack_prototypes(lessons)
        for order, sequence in _orders(plan, scenario, lessons, repeat).items():
            course = learning_course(
                scenario.skill,
                [lessons[i] for i in sequence],
                trial_seed(plan.seed, HIDDEN, repeat),
            )
            for n in plan.tried_after:
                if order == "active" and n in (1, plan.demonstrations):
                    # First and last, both orders know the same.
                    continue
                skill = course[n - 1]
                for place, xy in enumerate(tests):
                    view, _ = seen[repeat, place]
                    row = {
                        "order": order,
                        "repeat": repeat,
                        "n": n,
                        "place": place,
                        "tau": view["tau"],
                    }
                    rows.append(row)
                    if view["found"]:
                        specs[order, repeat, n, place] = strike(
                            plan.scenario,
                            xy,
                            trial_seed(plan.seed, _STRIKES, repeat, place),
                            skill.predict([view["tau"]])[0],
                            prototypes,
                        )
    outcomes = executor.run("Drumming at unseen positions", specs)
    # A drum that was not found is not struck.
    missed: Any = ({"reward": 0.0, "success": False, "impulse": 0.0}, None)
    for row in rows:
        key = (row["order"], row["repeat"], row["n"], row["place"])
        outcome, row["course"] = outcomes.get(key, missed)
        row.update(outcome)
        row["xy"] = tests[row["place"]].tolist()
    return _gather(plan, scenario, taught, rows)


def _orders(
    plan: DrumPlan, scenario: Scenario, lessons: Sequence[Result], repeat: int
) -> dict[str, list[int]]:
    rng = np.random.default_rng([plan.seed, _ORDER, repeat])
    orders = {"random": rng.permutation(len(lessons)).tolist()}
    if plan.active:
        orders["active"] = active_order(
            scenario.skill,
            np.array([result["tau"] for result, _ in lessons]),
            orders["random"][0],
            trial_seed(plan.seed, HIDDEN, repeat),
        )
    return orders


def _curve(
    plan: DrumPlan, rows: Sequence[dict[str, Any]]
) -> list[dict[str, Any]]:
    """Success after each demonstration."""
    curve = []
    for n in sorted({row["n"] for row in rows}):
        table = np.array(
            [
                [
                    row["success"]
                    for row in rows
                    if row["n"] == n and row["repeat"] == repeat
                ]
                for repeat in range(plan.repeats)
            ]
        )
        curve.append(
            {
                "n": n,
                "success_rate": success_rate(table),
                "per_repeat": table.mean(axis=1).tolist(),
            }
        )
    return curve


def demonstrations_needed(curve: Sequence[dict[str, Any]]) -> int | None:
    """After how many the success stays at 90 % or more; None if it does not."""
    needed = None
    for point in reversed(curve):
        if point["success_rate"]["mean"] < _ARRIVED:
            break
        needed = point["n"]
    return needed


def _gather(
    plan: DrumPlan,
    scenario: Scenario,
    taught: Sequence[Sequence[Result]],
    rows: Sequence[dict[str, Any]],
) -> dict[str, Any]:
    sound = load_sound_config(scenario.sound)
    last = [row for row in rows if row["n"] == plan.demonstrations]
    curves = {
        "random": _curve(plan, [r for r in rows if r["order"] == "random"])
    }
    if plan.active:
        curves["active"] = _curve(
            plan,
            [
                row
                for row in rows
                if row["order"] == "active"
                or row["n"] in (1, plan.demonstrations)
            ],
        )
    impulse = sound.hit_impulse
    hits = np.array([row["impulse"] > impulse for row in rows])
    told = separation(
        [row["reward"] for row in rows], hits, sound.reward.threshold
    )
    lessons = [lesson for each in taught for lesson in each]
    active = None
    if plan.active:
        active = {
            "by_demonstrations": curves["active"],
            "n_to_90": demonstrations_needed(curves["active"]),
        }
    return {
        "study": "drum",
        "version": __version__,
        "seed": plan.seed,
        "scenario": plan.scenario,
        "demonstrations": plan.demonstrations,
        "evaluations": plan.evaluations,
        "repeats": plan.repeats,
        "taught": [
            {
                "repeat": repeat,
                "xy": result["xy"],
                **{
                    name: result[name]
                    for name in ("tau", "attempts", "reward", "max_pull")
                },
            }
            for repeat, each in enumerate(taught)
            for result, _ in each
        ],
        "first_try": float(
            np.mean([result["attempts"] == 1 for result, _ in lessons])
        ),
        "by_demonstrations": curves["random"],
        "n_to_90": demonstrations_needed(curves["random"]),
        "active": active,
        "final": {
            "success_rate": float(np.mean([row["success"] for row in last])),
            "positions": [
                {
                    "repeat": row["repeat"],
                    "xy": row["xy"],
                    "tau": row["tau"],
                    "reward": row["reward"],
                    "success": row["success"],
                    "contact_impulse": row["impulse"],
                }
                for row in last
            ],
        },
        "separation": {
            # Without both hits and misses there is nothing to separate.
            "auc": told.auc if 0 < told.hits < len(rows) else None,
            "threshold": told.threshold,
            "false_hits": told.false_hits,
            "missed_hits": told.missed_hits,
            "impulse_threshold": impulse,
            "trials": len(rows),
            "hits": told.hits,
        },
        "rewards": [
            {
                name: row[name]
                for name in ("order", "repeat", "n", "xy", "reward", "impulse")
            }
            for row in rows
        ],
        "similarity": _similarity(rows, sound.reward.hop),
    }


def _similarity(
    rows: Sequence[dict[str, Any]], hop: float
) -> dict[str, Any] | None:
    """How the similarity went in a hit and in a miss (Fig. 3b)."""
    heard = [row for row in rows if row["course"] is not None]
    hits = sorted(
        (row for row in heard if row["success"]), key=lambda r: r["reward"]
    )
    misses = sorted(
        (row for row in heard if row["impulse"] == 0.0),
        key=lambda r: r["reward"],
    )
    if not hits or not misses:
        return None
    shown = {
        name: each[len(each) // 2]["course"]["reward_over_time"]
        for name, each in (("hit", hits), ("miss", misses))
    }
    return {
        "t": (hop * np.arange(len(shown["hit"]))).tolist(),
        **{
            name: course.astype(float).tolist()
            for name, course in shown.items()
        },
    }
