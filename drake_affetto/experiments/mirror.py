"""A learned skill in a changed view (paper Fig. 5).

The skill has been learned with the drum in direct view. Now the drum is seen
in the mirror, or with a camera that was moved. A few demonstrations are given
there, each scheme learns from them in its own way, and drums at test
positions. Every trial is simulated in full and judged by its sound.
"""

from collections.abc import Mapping, Sequence
import dataclasses
from pathlib import Path
from typing import Any

import numpy as np

from drake_affetto.experiments.bodies import Robots, draw_robots
from drake_affetto.experiments.drumming import HIDDEN, SOURCE
from drake_affetto.experiments.plans import MirrorPlan
from drake_affetto.experiments.results import (
    DemonstrationResult,
    GazeResult,
    MirrorResults,
    SchemeCell,
    SchemeComparisonRow,
    StrikeResult,
    TransferMap,
)
from drake_affetto.experiments.skills import (
    best_constant,
    fit_scheme,
    learn_skill,
    look_at_positions,
    run_strikes,
    stack_prototypes,
    strike_if_seen,
    task_parameters,
    teach_positions,
)
from drake_affetto.experiments.statistics import (
    compare,
    compare_landing,
    correct_primary,
    invalid_count,
    is_valid,
    scheme_cell,
    success_table,
)
from drake_affetto.experiments.trials import (
    Movement,
    draw_positions,
    trial_seed,
)
from drake_affetto.runner.executor import Spec, TrialExecutor
from drake_affetto.station.scenario import load_scenario

# What the seeds of this study are for; the skill's are those of the drum study.
_TARGET, _TESTS, _CHOICE, _TRIALS, _KNOWLEDGE, _BODIES = range(100, 106)

# In place of a scheme: no skill at all, one and the same stroke everywhere.
_BLIND = "blind"

# What the study was made to decide, named before it was run: each transfer
# against learning from scratch, with few samples, by success and by landing.
PRIMARY_PAIRS = (("transfer_default", "relearn"), ("transfer", "relearn"))
PRIMARY_SAMPLES = (2, 3)

# Points along each side of the map's grid in the results.
_GRID = 11


@dataclasses.dataclass
class MirrorOutcome:
    """What the study found, and what of its first repeat can be shown.

    Attributes:
        results: Content of results.json.
        skill: Source skill of the first repeat.
        schemes: Schemes of the first repeat by name, fitted with the most
            samples.
        prototypes: Prototypes of the reward (N, bands, frames).
        demonstrations: Demonstrations that these schemes were given.
        positions: Test positions of the first repeat (evaluations, 2), m.
        seen: What the gaze found at these positions.
        scenarios: Scenarios of the first repeat's robot, by name or path: in
            direct view, and in the changed one.
    """

    results: MirrorResults
    skill: Any
    schemes: dict[str, Any]
    prototypes: np.ndarray
    demonstrations: list[DemonstrationResult]
    positions: np.ndarray
    seen: list[GazeResult]
    scenarios: tuple[str, str]


@dataclasses.dataclass
class _Repeat:
    """What one repeat of the study starts from.

    Attributes:
        skill: Skill, learned in direct view.
        prototypes: Prototypes of the reward (N, bands, frames).
        constant: Movement (F,) of the best constant stroke.
        pool: Demonstrations in the changed view.
        positions: Test positions (evaluations, 2), m.
        scenario: Scenario of the changed view with this repeat's robot.
    """

    skill: Any
    prototypes: np.ndarray
    constant: np.ndarray
    pool: list[DemonstrationResult]
    positions: np.ndarray
    scenario: str


@dataclasses.dataclass(frozen=True)
class _Test:
    """One trial of the study.

    Attributes:
        scheme: Scheme of transfer.
        samples: Number of samples that it was given.
        repeat: Number of the repeat.
        position: Number of the test position.
    """

    scheme: str
    samples: int
    repeat: int
    position: int


def changed_views() -> list[str]:
    """The scenarios of changed views that come with the package."""
    from drake_affetto.experiments.view_maps import CHANGED_VIEWS

    return list(CHANGED_VIEWS)


def choose(
    tau: np.ndarray, count: int, how: str, rng: np.random.Generator
) -> np.ndarray:
    """Chooses the samples that a scheme is given.

    Args:
        tau: Task parameters of the samples (N, d).
        count: Number of samples that are chosen.
        how: "random"; or "spread", where each sample is the one farthest from
            those before it and the first is random.
        rng: Source of randomness.

    Returns:
        Numbers of the chosen samples (count,).
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


def run_mirror(
    executor: TrialExecutor, plan: MirrorPlan, folder: Path | None = None
) -> MirrorOutcome:
    """Runs the study of one scenario; see the module.

    Args:
        executor: Executor of the study.
        plan: What is compared.
        folder: Folder of the results; only bodies need it.

    Raises:
        InputError: If the plan does not fit, or too few demonstrations
            succeed.
    """
    plan.check()
    # The name distinguishes the phases of several plans in one store.
    among = f", {plan.name}" if plan.name else ""
    title = Path(plan.scenario).stem + among
    robots = draw_robots(
        plan.bodies, plan.scenario, (plan.seed, _BODIES), folder
    )
    repeats = [
        _teach(executor, plan, robots, repeat, among, title)
        for repeat in range(plan.repeats)
    ]
    seen = look_at_positions(
        executor,
        f"Looking, {title}",
        [each.scenario for each in repeats],
        [each.positions for each in repeats],
        (plan.seed, _TRIALS),
    )
    # Each scheme with each number of samples strikes at all test positions.
    tests: dict[_Test, Spec | None] = {}
    shown: dict[str, Any] = {}
    shown_samples: list[DemonstrationResult] = []
    for number, repeat in enumerate(repeats):
        movers: dict[tuple[str, int], Any] = {
            (_BLIND, 0): Movement(repeat.constant)
        }
        for count in plan.samples:
            chosen = choose(
                task_parameters(repeat.pool),
                count,
                plan.choice,
                np.random.default_rng([plan.seed, _CHOICE, number, count]),
            )
            samples = [repeat.pool[i] for i in chosen]
            schemes = _fit_schemes(
                plan,
                repeat.skill,
                samples,
                trial_seed(plan.seed, _KNOWLEDGE, number),
            )
            movers |= {(name, count): each for name, each in schemes.items()}
            if number == 0 and count == max(plan.samples):
                shown, shown_samples = schemes, samples
        # Place by place: trials of one place and seed share the search.
        for position, xy in enumerate(repeat.positions):
            for (name, count), mover in movers.items():
                tests[_Test(name, count, number, position)] = strike_if_seen(
                    repeat.scenario,
                    xy,
                    trial_seed(plan.seed, _TRIALS, number, position),
                    seen[number, position],
                    mover,
                    repeat.prototypes,
                )
    outcomes = run_strikes(
        executor, f"Drumming, {title}", tests, plan.repeat_invalid
    )
    first = repeats[0]
    return MirrorOutcome(
        results=_make_results(
            plan, robots, outcomes, _map(plan, shown, shown_samples)
        ),
        skill=first.skill,
        schemes=shown,
        prototypes=first.prototypes,
        demonstrations=shown_samples,
        positions=first.positions,
        seen=[seen[0, i] for i in range(plan.evaluations)],
        scenarios=(robots.scenario(0, plan.direct), first.scenario),
    )


def _teach(
    executor: TrialExecutor,
    plan: MirrorPlan,
    robots: Robots,
    repeat: int,
    among: str,
    title: str,
) -> _Repeat:
    """Teaches one repeat: in direct view, then in the changed one."""
    demonstrations, pool = (
        teach_positions(
            executor,
            f"Kinesthetic teaching{view}, {repeat + 1} of {plan.repeats}",
            robots.scenario(repeat, scenario),
            count,
            (plan.seed, use, repeat),
            variability=plan.variability,
            workspace=plan.workspace,
        )
        for view, scenario, count, use in (
            (among, plan.direct, plan.demonstrations, SOURCE),
            (f", {title}", plan.scenario, plan.pool_size, _TARGET),
        )
    )
    return _Repeat(
        skill=learn_skill(
            load_scenario(plan.direct).skill,
            demonstrations,
            trial_seed(plan.seed, HIDDEN, repeat),
        ),
        prototypes=stack_prototypes(demonstrations),
        constant=best_constant(demonstrations, load_scenario(plan.direct)),
        pool=pool,
        positions=draw_positions(
            load_scenario(plan.scenario),
            plan.evaluations,
            np.random.default_rng([plan.seed, _TESTS, repeat]),
            plan.workspace,
        ),
        scenario=robots.scenario(repeat, plan.scenario),
    )


def _fit_schemes(
    plan: MirrorPlan,
    skill: Any,
    samples: Sequence[DemonstrationResult],
    knowledge: int,
) -> dict[str, Any]:
    """All schemes of the plan, fitted to the same samples.

    `knowledge` is the seed of how wrongly the robot knows its camera, the
    same for all numbers of samples.
    """
    tau = task_parameters(samples)
    theta = np.array([each.theta for each in samples])
    loaded = load_scenario(plan.scenario)
    return {
        name: fit_scheme(
            name,
            skill,
            tau,
            theta,
            plan.scenario,
            plan.direct,
            knowledge,
            loaded,
        )
        for name in plan.schemes
    }


def _make_results(
    plan: MirrorPlan,
    robots: Robots,
    outcomes: Mapping[_Test, StrikeResult | None],
    example: TransferMap | None,
) -> MirrorResults:
    schemes: dict[str, dict[int, SchemeCell]] = {}
    comparisons: list[SchemeComparisonRow] = []
    for count in plan.samples:
        # Tables (repeats, test positions).
        successes: dict[str, np.ndarray] = {}
        landings: dict[str, np.ndarray] = {}
        for name in plan.schemes:
            strikes = _table(plan, outcomes, name, count)
            successes[name] = success_table(strikes)
            landings[name] = np.array(
                [
                    [s.landing if s and is_valid(s) else np.nan for s in row]
                    for row in strikes
                ]
            )
            schemes.setdefault(name, {})[count] = scheme_cell(strikes)
        comparisons += compare(successes, count)
        comparisons += [
            compare_landing(landings, pair, count)
            for pair in PRIMARY_PAIRS
            if set(pair) <= set(landings)
        ]
    return MirrorResults.of(
        plan,
        schemes=schemes,
        comparisons=correct_primary(
            comparisons, PRIMARY_PAIRS, PRIMARY_SAMPLES
        ),
        map=example,
        chance=scheme_cell(_table(plan, outcomes, _BLIND, 0)).success_rate,
        bodies=robots.numbers(),
        knowledge=_knowledge(plan),
        invalid=invalid_count(outcomes.values()),
    )


def _knowledge(plan: MirrorPlan) -> dict[str, float]:
    """How wrongly the default's map knows the camera, if it knows one."""
    transfer = load_scenario(plan.scenario).transfer
    if transfer.mapping != "optical":
        return {}
    return dataclasses.asdict(transfer.errors)


def _table(
    plan: MirrorPlan,
    outcomes: Mapping[_Test, StrikeResult | None],
    name: str,
    count: int,
) -> list[list[StrikeResult | None]]:
    """The strikes of a scheme: a row a repeat, a column a test position."""
    return [
        [
            outcomes[_Test(name, count, repeat, position)]
            for position in range(plan.evaluations)
        ]
        for repeat in range(plan.repeats)
    ]


def _map(
    plan: MirrorPlan,
    schemes: Mapping[str, Any],
    samples: Sequence[DemonstrationResult],
) -> TransferMap | None:
    """The map h of the first repeat on a grid, with its samples."""
    if "transfer_default" not in schemes:
        return None
    scheme = schemes["transfer_default"]
    scenario = load_scenario(plan.scenario)
    limits = np.array(scenario.skill.input_range)
    axes = [np.linspace(low, high, _GRID) for low, high in limits]
    grid = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 2)
    known = task_parameters(samples)
    centered = ["y_img", "q3* [rad]"]
    fixed = ["x_img", "y_img"]
    return TransferMap(
        scheme="transfer_default",
        samples=len(samples),
        input_names=fixed if scenario.look.mode == "fixed_yaw" else centered,
        output_names=centered,
        shape=[_GRID, _GRID],
        input=_pairs(grid),
        output=_pairs(scheme.transform(grid)),
        taught_input=_pairs(known),
        taught_output=_pairs(scheme.transform(known)),
    )


def _pairs(points: np.ndarray) -> list[tuple[float, float]]:
    return [(float(x), float(y)) for x, y in points]
