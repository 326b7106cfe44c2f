"""`affetto mirror`: a learned skill in a changed view (paper Fig. 5).

The skill has been learned with the drum in direct view. Now it is seen in the
mirror, or with a camera that was moved; a few demonstrations are given there,
each scheme makes of them what it can, and drums at unseen positions. Every
trial is simulated in full and judged by its sound.
"""

from collections.abc import Sequence
import dataclasses
from pathlib import Path
from typing import Any

import numpy as np

from drake_affetto import __version__
from drake_affetto.common.errors import require, require_range
from drake_affetto.experiments.drumming import HIDDEN, SOURCE
from drake_affetto.experiments.skills import (
    fit_scheme,
    learn_skill,
    stack_prototypes,
    teach_places,
)
from drake_affetto.experiments.statistics import compare, success_rate
from drake_affetto.experiments.trials import (
    draw_positions,
    look,
    strike,
    trial_seed,
)
from drake_affetto.runner.executor import Result, Spec, TrialExecutor
from drake_affetto.station.scenario import load_scenario

# What the seeds of this study are for; the skill's are those of the drum study.
_TARGET, _TESTS, _CHOICE, _LOOKS, _STRIKES = range(100, 105)

# (i) to (iv) of the paper, then (v) the library's default and (vi) a Gaussian
# process on the few samples.
SCHEMES = (
    "unchanged",
    "relearn",
    "continue",
    "transfer",
    "transfer_default",
    "gaussian_process",
)

# A map's grid in the report.
_GRID = 11


@dataclasses.dataclass(frozen=True)
class MirrorPlan:
    """What is compared, and how often.

    Attributes:
        scenario: of the changed view, by name or path.
        samples: numbers of demonstrations the schemes are given.
        repeats: how often all of it is done, each time with another skill,
            other demonstrations and other positions.
        evaluations: unseen positions of a repeat.
        demonstrations: from which the skill is learned in direct view.
        pool: demonstrations in the changed view, from which samples are drawn;
            None for the paper's 6, or as many as the most samples.
        schemes: which of `SCHEMES`.
        choice: how samples are chosen, at "random" or "spread" out.
        variability: how much more than the scenario says the teacher varies.
        workspace: share of the region's length and width that is used.
        direct: the scenario in which the skill is learned.
        name: of this plan among others in one store; it is shown.
        seed: of everything that is random.
    """

    scenario: str = "mirror"
    samples: tuple[int, ...] = (3, 4, 5)
    repeats: int = 10
    evaluations: int = 6
    demonstrations: int = 25
    pool: int | None = None
    schemes: tuple[str, ...] = SCHEMES
    choice: str = "random"
    variability: float = 1.0
    workspace: float = 1.0
    direct: str = "drumming"
    name: str = ""
    seed: int = 0

    @property
    def pool_size(self) -> int:
        """How many demonstrations there are to choose from."""
        return max(6, *self.samples) if self.pool is None else self.pool

    def check(self) -> None:
        """Raises InputError for the first number that does not fit."""
        require_range("--repeats", self.repeats, 1, 1000)
        require_range("--evaluations", self.evaluations, 1, 1000)
        require_range("--demonstrations", self.demonstrations, 3, 1000)
        for number in self.samples:
            require_range("--samples", number, 2, 100)
        require(
            len(set(self.samples)) == len(self.samples) > 0,
            "--samples",
            list(self.samples),
            "numbers of samples, each once",
        )
        require_range("pool", self.pool_size, max(self.samples), 1000)
        require(
            self.choice in ("random", "spread"),
            "choice",
            self.choice,
            "'random' or 'spread'",
        )
        require_range("workspace", self.workspace, 0.05, 1.0)
        require_range("variability", self.variability, 0.0, 10.0)


def changed_views() -> list[str]:
    """The scenarios of changed views that come with the package."""
    from drake_affetto.experiments.view_maps import CHANGED_VIEWS

    return list(CHANGED_VIEWS)


@dataclasses.dataclass
class MirrorOutcome:
    """What the study found, and what of its first repeat can be shown.

    Attributes:
        results: for results.json.
        skill: the source skill of the first repeat.
        schemes: by name, fitted with the most samples.
        prototypes: (N, bands, frames).
        tests: (evaluations, 2) unseen positions, m.
    """

    results: dict[str, Any]
    skill: Any
    schemes: dict[str, Any]
    prototypes: np.ndarray
    tests: np.ndarray


def choose(
    tau: np.ndarray, count: int, how: str, rng: np.random.Generator
) -> np.ndarray:
    """Which of the samples at tau (N, d) a scheme is given.

    Args:
        count: how many.
        how: at "random"; or "spread": each is farthest from those before it,
            the first being chosen at random.
    """
    order = rng.permutation(len(tau))
    if how == "random":
        return order[:count]
    scaled = (tau - tau.mean(axis=0)) / np.maximum(tau.std(axis=0), 1e-9)
    chosen = [int(order[0])]
    while len(chosen) < count:
        apart = np.linalg.norm(scaled[:, None] - scaled[chosen], axis=-1)
        chosen.append(int(np.argmax(apart.min(axis=1))))
    return np.array(chosen)


def run_mirror(executor: TrialExecutor, plan: MirrorPlan) -> MirrorOutcome:
    """Runs the study of one scenario; see the module.

    Raises:
        InputError: if the plan does not fit, or too few demonstrations
            succeed.
    """
    plan.check()
    direct = load_scenario(plan.direct)
    target = load_scenario(plan.scenario)
    # Stages are told apart by their names.
    among = f", {plan.name}" if plan.name else ""
    title = Path(plan.scenario).stem + among
    skills: list[Any] = []
    prototypes: list[np.ndarray] = []
    # Of the first repeat, with the most samples: what can be shown.
    shown: dict[str, Any] = {}
    shown_lessons: list[Result] = []
    rows: list[dict[str, Any]] = []
    specs: dict[tuple, Spec] = {}
    lessons_there: list[list[Result]] = []
    tests: list[np.ndarray] = []
    for repeat in range(plan.repeats):
        of = f"{repeat + 1} of {plan.repeats}"
        lessons = teach_places(
            executor,
            f"Teaching by hand{among}, {of}",
            plan.direct,
            plan.demonstrations,
            (plan.seed, SOURCE, repeat),
            variability=plan.variability,
            workspace=plan.workspace,
        )
        there = teach_places(
            executor,
            f"Teaching, {title}, {of}",
            plan.scenario,
            plan.pool_size,
            (plan.seed, _TARGET, repeat),
            variability=plan.variability,
            workspace=plan.workspace,
        )
        skills.append(
            learn_skill(
                direct.skill, lessons, trial_seed(plan.seed, HIDDEN, repeat)
            )
        )
        prototypes.append(stack_prototypes(lessons))
        lessons_there.append(there)
        tests.append(
            draw_positions(
                target,
                plan.evaluations,
                np.random.default_rng([plan.seed, _TESTS, repeat]),
                plan.workspace,
            )
        )
    views = executor.run(
        f"Looking, {title}",
        {
            (repeat, place): look(
                plan.scenario, xy, trial_seed(plan.seed, _LOOKS, repeat, place)
            )
            for repeat in range(plan.repeats)
            for place, xy in enumerate(tests[repeat])
        },
    )
    for repeat, there in enumerate(lessons_there):
        tau = np.array([result["tau"] for result, _ in there])
        theta = np.array([arrays["theta"] for _, arrays in there])
        for count in plan.samples:
            chosen = choose(
                tau,
                count,
                plan.choice,
                np.random.default_rng([plan.seed, _CHOICE, repeat, count]),
            )
            for name in plan.schemes:
                scheme = fit_scheme(
                    name,
                    skills[repeat],
                    tau[chosen],
                    theta[chosen],
                    plan.scenario,
                )
                if repeat == 0 and count == max(plan.samples):
                    shown[name] = scheme
                    shown_lessons = [there[i] for i in chosen]
                for place, xy in enumerate(tests[repeat]):
                    row: dict[str, Any] = {
                        "scheme": name,
                        "samples": count,
                        "repeat": repeat,
                        "place": place,
                    }
                    rows.append(row)
                    view, _ = views[repeat, place]
                    if view["found"]:
                        specs[name, count, repeat, place] = strike(
                            plan.scenario,
                            xy,
                            trial_seed(plan.seed, _STRIKES, repeat, place),
                            scheme.predict([view["tau"]])[0],
                            prototypes[repeat],
                        )
    outcomes = executor.run(f"Drumming, {title}", specs)
    # A drum that was not found is not struck.
    missed: Result = ({"reward": 0.0, "success": False}, {})
    for row in rows:
        key = (row["scheme"], row["samples"], row["repeat"], row["place"])
        outcome, _ = outcomes.get(key, missed)
        row.update(reward=outcome["reward"], success=outcome["success"])
    return MirrorOutcome(
        results=_gather(plan, rows, _map(plan, shown, shown_lessons)),
        skill=skills[0],
        schemes=shown,
        prototypes=prototypes[0],
        tests=tests[0],
    )


def _gather(
    plan: MirrorPlan,
    rows: Sequence[dict[str, Any]],
    example: dict[str, Any] | None,
) -> dict[str, Any]:
    shape = (plan.repeats, plan.evaluations)

    def of(name: str, count: int, field: str) -> np.ndarray:
        values = [
            row[field]
            for row in rows
            if row["scheme"] == name and row["samples"] == count
        ]
        return np.array(values, dtype=float).reshape(shape)

    schemes: dict[str, Any] = {}
    comparisons = []
    for count in plan.samples:
        successes = {name: of(name, count, "success") for name in plan.schemes}
        for name, table in successes.items():
            schemes.setdefault(name, {})[str(count)] = {
                "success_rate": success_rate(table),
                "per_repeat": table.mean(axis=1).tolist(),
                "rewards": of(name, count, "reward").ravel().tolist(),
            }
        comparisons += compare(successes, count)
    return {
        "study": "mirror",
        "version": __version__,
        "seed": plan.seed,
        "scenario": plan.scenario,
        "samples": list(plan.samples),
        "repeats": plan.repeats,
        "evaluations": plan.evaluations,
        "demonstrations": plan.demonstrations,
        "choice": plan.choice,
        "variability": plan.variability,
        "workspace": plan.workspace,
        "schemes": schemes,
        "comparisons": comparisons,
        "map": example,
    }


def _map(
    plan: MirrorPlan,
    schemes: dict[str, Any],
    taught: Sequence[Result],
) -> dict[str, Any] | None:
    """The map h of the first repeat on a grid, with what it was taught by."""
    if "transfer_default" not in schemes:
        return None
    scheme = schemes["transfer_default"]
    scenario = load_scenario(plan.scenario)
    limits = np.array(scenario.skill.input_range)
    axes = [np.linspace(low, high, _GRID) for low, high in limits]
    grid = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 2)
    known = np.array([result["tau"] for result, _ in taught])
    centre = ["y_img", "q3* [rad]"]
    fixed = ["x_img", "y_img"]
    mode = scenario.look.mode
    return {
        "scheme": "transfer_default",
        "samples": len(taught),
        "input_names": fixed if mode == "fixed_yaw" else centre,
        "output_names": centre,
        "shape": [_GRID, _GRID],
        "input": grid.tolist(),
        "output": scheme.transform(grid).tolist(),
        "taught_input": known.tolist(),
        "taught_output": scheme.transform(known).tolist(),
    }
