"""Learning to drum from demonstrations (paper Figs. 3b, 3c).

Demonstrations are learned one by one, in random order and, on request, in the
order in which the skill itself would ask for them. After each, the skill drums
at test positions that it has not seen; every trial is simulated in full and
judged by its sound.
"""

from collections.abc import Iterable, Sequence
import copy
import dataclasses
from pathlib import Path
from typing import Any

import numpy as np

from drake_affetto.experiments.bodies import draw_robots
from drake_affetto.experiments.plans import DrumPlan
from drake_affetto.experiments.results import (
    CurvePoint,
    DemonstrationResult,
    DrumResults,
    EvaluatedPosition,
    FinalTest,
    GazeResult,
    LearningCurve,
    RewardEvaluation,
    RewardRow,
    SimilarityTraces,
    StrikeResult,
    TaughtPosition,
)
from drake_affetto.experiments.skills import (
    best_constant,
    look_at_positions,
    make_skill,
    run_strikes,
    skills_by_count,
    stack_prototypes,
    strike_if_seen,
    task_parameters,
    teach_positions,
)
from drake_affetto.experiments.statistics import (
    invalid_count,
    is_valid,
    success_rate,
)
from drake_affetto.experiments.trials import (
    Movement,
    draw_positions,
    trial_seed,
)
from drake_affetto.runner.executor import Spec, TrialExecutor
from drake_affetto.sound.config import load_sound_config
from drake_affetto.sound.separation import separation
from drake_affetto.station.scenario import Scenario, SkillConfig, load_scenario

# What a seed of the study is for. Other studies that learn the same skill use
# those of the demonstrations and the skill too.
_TESTS, SOURCE, _ORDER, HIDDEN, _TRIALS, _BODIES = range(6)

# In place of an order: no skill at all, one and the same stroke everywhere.
_BLIND = "blind"

# A curve has reached its plateau at this rate or above.
_PLATEAU = 0.9


@dataclasses.dataclass(frozen=True)
class _Test:
    """One trial of the study.

    Attributes:
        order: Order of the demonstrations, "random" or "active"; "blind" for
            the best constant stroke.
        repeat: Number of the repeat.
        n: Number of demonstrations that the skill knows.
        position: Number of the test position.
    """

    order: str
    repeat: int
    n: int
    position: int


@dataclasses.dataclass(frozen=True)
class _Outcome:
    """One trial and what it gave.

    Attributes:
        test: The trial.
        xy: Position of the drum, m.
        tau: Task parameter τ (2,).
        strike: Result; None where the drum was not found, so not struck.
    """

    test: _Test
    xy: tuple[float, float]
    tau: list[float]
    strike: StrikeResult | None

    @property
    def reward(self) -> float:
        """Reward; 0 without a movement."""
        return self.strike.reward if self.strike else 0.0

    @property
    def success(self) -> bool:
        """Whether the drum was heard."""
        return self.strike.success if self.strike else False

    @property
    def impulse(self) -> float:
        """Impulse on the drum's head, N s."""
        return self.strike.impulse if self.strike else 0.0


def run_drum(
    executor: TrialExecutor, plan: DrumPlan, folder: Path | None = None
) -> DrumResults:
    """Runs the study and returns its results; see the module.

    Args:
        executor: Executor of the study.
        plan: How much is done.
        folder: Folder of the results; only bodies need it.

    Raises:
        InputError: If the plan does not fit, or too few demonstrations
            succeed.
    """
    plan.check()
    scenario = load_scenario(plan.scenario)
    robots = draw_robots(
        plan.bodies, plan.scenario, (plan.seed, _BODIES), folder
    )
    scenarios = [
        robots.scenario(repeat, plan.scenario) for repeat in range(plan.repeats)
    ]
    positions = draw_positions(
        scenario, plan.evaluations, np.random.default_rng([plan.seed, _TESTS])
    )
    demonstrations = [
        teach_positions(
            executor,
            f"Kinesthetic teaching, {repeat + 1} of {plan.repeats}",
            scenarios[repeat],
            plan.demonstrations,
            (plan.seed, SOURCE, repeat),
        )
        for repeat in range(plan.repeats)
    ]
    # What the gaze finds does not depend on what was learned: one look tells
    # it for all tests with that place and seed, each of which looks again.
    seen = look_at_positions(
        executor,
        "Looking at test positions",
        scenarios,
        [positions] * plan.repeats,
        (plan.seed, _TRIALS),
    )
    tests = _plan_tests(
        plan, scenarios, scenario, demonstrations, positions, seen
    )
    strikes = run_strikes(
        executor, "Drumming at test positions", tests, plan.repeat_invalid
    )
    outcomes = [
        _Outcome(
            test,
            tuple(positions[test.position].tolist()),
            seen[test.repeat, test.position].tau,
            strikes[test],
        )
        for test in tests
        # Neither judged nor learned from.
        if is_valid(strikes[test])
    ]
    skilled = [each for each in outcomes if each.test.order != _BLIND]
    results = _make_results(plan, scenario, demonstrations, skilled)
    (blind,) = _curve(plan, (o for o in outcomes if o.test.order == _BLIND))
    return dataclasses.replace(
        results,
        chance=blind.success_rate,
        bodies=robots.numbers(),
        invalid=invalid_count(strikes.values()),
    )


def _plan_tests(
    plan: DrumPlan,
    scenarios: Sequence[str],
    scenario: Scenario,
    demonstrations: Sequence[Sequence[DemonstrationResult]],
    positions: np.ndarray,
    seen: dict[tuple[int, int], GazeResult],
) -> dict[_Test, Spec | None]:
    """The trials of all orders, repeats and numbers of demonstrations.

    With them those of each repeat's best constant stroke, played blind.

    Returns:
        For each trial its spec; None where the drum was not found.
    """
    tests: dict[_Test, Spec | None] = {}
    for repeat, known in enumerate(demonstrations):
        prototypes = stack_prototypes(known)
        movers = _movers(plan, scenario, known, repeat)
        # Place by place: trials of one place and seed share the search.
        for position, xy in enumerate(positions):
            for (order, n), mover in movers.items():
                tests[_Test(order, repeat, n, position)] = strike_if_seen(
                    scenarios[repeat],
                    xy,
                    trial_seed(plan.seed, _TRIALS, repeat, position),
                    seen[repeat, position],
                    mover,
                    prototypes,
                )
    return tests


def _movers(
    plan: DrumPlan,
    scenario: Scenario,
    known: Sequence[DemonstrationResult],
    repeat: int,
) -> dict[tuple[str, int], Any]:
    """What one repeat tests, by order and number of demonstrations."""
    movers: dict[tuple[str, int], Any] = {}
    for order, sequence in _orders(plan, scenario, known, repeat).items():
        skills = skills_by_count(
            scenario.skill,
            [known[i] for i in sequence],
            trial_seed(plan.seed, HIDDEN, repeat),
        )
        for n in plan.tested_after:
            # First and last, both orders know the same.
            if order == "random" or n not in (1, plan.demonstrations):
                movers[order, n] = skills[n - 1]
    movers[_BLIND, 0] = Movement(best_constant(known, scenario))
    return movers


def _orders(
    plan: DrumPlan,
    scenario: Scenario,
    demonstrations: Sequence[DemonstrationResult],
    repeat: int,
) -> dict[str, list[int]]:
    """The orders in which the demonstrations are learned."""
    rng = np.random.default_rng([plan.seed, _ORDER, repeat])
    orders = {"random": rng.permutation(len(demonstrations)).tolist()}
    if plan.active:
        orders["active"] = active_order(
            scenario.skill,
            task_parameters(demonstrations),
            orders["random"][0],
            trial_seed(plan.seed, HIDDEN, repeat),
        )
    return orders


def active_order(
    config: SkillConfig, tau: np.ndarray, first: int, seed: int
) -> list[int]:
    """The order in which a skill would ask for demonstrations.

    Greedy design: each time the position is chosen that most reduces the sum
    of the leverages (predictive variances) of all positions. For that the
    robot need only have looked at them.

    Args:
        config: Configuration of the skill.
        tau: Task parameters of the positions (N, 2).
        first: Position that is taught first.
        seed: Seed of the skill's hidden layer.

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
        uncertainty = []
        for i in rest:
            extended = copy.deepcopy(skill).partial_fit(tau[[i]], nothing)
            uncertainty.append(extended.leverage(tau).sum())
        order.append(rest[int(np.argmin(uncertainty))])
        skill.partial_fit(tau[[order[-1]]], nothing)
    return order


def _curve(plan: DrumPlan, outcomes: Iterable[_Outcome]) -> list[CurvePoint]:
    """Success after each number of demonstrations."""
    by_count: dict[int, list[list[bool]]] = {}
    for each in outcomes:
        table = by_count.setdefault(
            each.test.n, [[] for _ in range(plan.repeats)]
        )
        table[each.test.repeat].append(each.success)
    return [
        CurvePoint(
            n,
            success_rate(_padded(by_count[n])),
            [float(np.mean(row)) for row in by_count[n] if row],
        )
        for n in sorted(by_count)
    ]


def _padded(rows: Sequence[Sequence[bool]]) -> np.ndarray:
    """A table of rows, NaN where trials of a repeat are not valid."""
    table = np.full((len(rows), max(map(len, rows))), np.nan)
    for line, row in zip(table, rows, strict=True):
        line[: len(row)] = row
    return table


def demonstrations_needed(curve: Sequence[CurvePoint]) -> int | None:
    """Number from which success stays at 90 % or more; None if it does not."""
    needed = None
    for point in reversed(curve):
        if point.success_rate.mean < _PLATEAU:
            break
        needed = point.n
    return needed


def _make_results(
    plan: DrumPlan,
    scenario: Scenario,
    demonstrations: Sequence[Sequence[DemonstrationResult]],
    outcomes: Sequence[_Outcome],
) -> DrumResults:
    sound = load_sound_config(scenario.sound)
    curve = _curve(plan, (o for o in outcomes if o.test.order == "random"))
    active = None
    if plan.active:
        both = (1, plan.demonstrations)
        own = _curve(
            plan,
            (
                o
                for o in outcomes
                if o.test.order == "active" or o.test.n in both
            ),
        )
        active = LearningCurve(own, demonstrations_needed(own))
    last = [o for o in outcomes if o.test.n == plan.demonstrations]
    attempts = [each.attempts for some in demonstrations for each in some]
    return DrumResults.of(
        plan,
        taught=[
            TaughtPosition(
                repeat,
                (each.xy[0], each.xy[1]),
                each.tau,
                each.attempts,
                each.reward,
                each.max_pull,
            )
            for repeat, some in enumerate(demonstrations)
            for each in some
        ],
        first_try=float(np.mean([count == 1 for count in attempts])),
        by_demonstrations=curve,
        n_to_90=demonstrations_needed(curve),
        active=active,
        final=FinalTest(
            float(np.mean([o.success for o in last])),
            [
                EvaluatedPosition(
                    o.test.repeat,
                    o.xy,
                    o.tau,
                    o.reward,
                    o.success,
                    o.impulse,
                    o.strike.landing if o.strike else None,
                )
                for o in last
            ],
        ),
        separation=_evaluate_reward(
            outcomes, sound.hit_impulse, sound.reward.threshold
        ),
        rewards=[
            RewardRow(
                o.test.order, o.test.repeat, o.test.n, o.xy, o.reward, o.impulse
            )
            for o in outcomes
        ],
        similarity=_similarity(outcomes, sound.reward.hop),
    )


def _evaluate_reward(
    outcomes: Sequence[_Outcome], impulse: float, threshold: float
) -> RewardEvaluation:
    """The reward as a classifier of hits, which the impulse tells."""
    evaluation = separation(
        [o.reward for o in outcomes],
        np.array([o.impulse > impulse for o in outcomes]),
        threshold,
    )
    both = 0 < evaluation.hits < len(outcomes)
    return RewardEvaluation(
        # Without both hits and misses there is nothing to separate.
        auc=evaluation.auc if both else None,
        threshold=evaluation.threshold,
        false_hits=evaluation.false_hits,
        missed_hits=evaluation.missed_hits,
        impulse_threshold=impulse,
        trials=len(outcomes),
        hits=evaluation.hits,
    )


def _similarity(
    outcomes: Sequence[_Outcome], hop: float
) -> SimilarityTraces | None:
    """The similarity over time in a median hit and a median miss (Fig. 3b)."""
    heard = sorted(
        (o.strike for o in outcomes if o.strike is not None),
        key=lambda strike: strike.reward,
    )
    hits = [each for each in heard if each.success]
    misses = [each for each in heard if each.impulse == 0.0]
    if not hits or not misses:
        return None
    hit, miss = (
        each[len(each) // 2].reward_over_time.astype(float).tolist()
        for each in (hits, misses)
    )
    return SimilarityTraces((hop * np.arange(len(hit))).tolist(), hit, miss)
