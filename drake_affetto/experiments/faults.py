"""What faults do to the drumming robot, and whether it notices.

A skill is learned from sound demonstrations. Then the whole chain, look and
strike, is run with a fault of each kind and size, and once more without it,
with the same place and noise. What counts as a false success is judged by the
contact in the recording, of which neither skill, reward nor supervisor know.
"""

from collections import Counter
from collections.abc import Mapping, Sequence
import dataclasses

import numpy as np

from drake_affetto.experiments.fault_catalog import FaultCatalog, load_catalog
from drake_affetto.experiments.plans import FaultsPlan
from drake_affetto.experiments.results.faults import (
    FaultRow,
    FaultsResults,
    SoundTrials,
)
from drake_affetto.experiments.results.trial import WatchedResult
from drake_affetto.experiments.skills import (
    learn_skill,
    stack_prototypes,
    teach_positions,
)
from drake_affetto.experiments.statistics import success_rate
from drake_affetto.experiments.trials import (
    draw_positions,
    run_trials,
    trial_seed,
    watched,
)
from drake_affetto.faults.config import KINDS
from drake_affetto.faults.supervision import Check
from drake_affetto.runner.executor import Spec, TrialExecutor
from drake_affetto.skill.policy import Regressor
from drake_affetto.sound.config import load_sound_config
from drake_affetto.station.scenario import load_scenario

# What a seed of the study is for.
_TESTS, _SOURCE, _HIDDEN, _TRIALS, _FAULTS = range(5)

FORCE_LIMIT = 40.0
"""What the robot must not exceed by its own action, N."""


@dataclasses.dataclass(frozen=True)
class _Test:
    """One trial of the study.

    Attributes:
        repeat: Number of the trial of its fault and size.
        cell: Number of the fault and size.
        faulted: Whether the fault is there.
    """

    repeat: int
    cell: int
    faulted: bool


def run_faults(executor: TrialExecutor, plan: FaultsPlan) -> FaultsResults:
    """Runs the study and returns its results; see the module.

    Args:
        executor: Executor of the study.
        plan: How much is done.

    Raises:
        InputError: If the plan or the catalog does not fit, or too few
            demonstrations succeed.
    """
    plan.check()
    catalog = load_catalog(plan.catalog)
    demonstrations = teach_positions(
        executor,
        "Kinesthetic teaching",
        plan.scenario,
        plan.demonstrations,
        (plan.seed, _SOURCE, 0),
    )
    scenario = load_scenario(plan.scenario)
    skill = learn_skill(
        scenario.skill, demonstrations, trial_seed(plan.seed, _HIDDEN)
    )
    tests = _plan_tests(plan, catalog, skill, stack_prototypes(demonstrations))
    outcomes = run_trials(executor, "Drumming with faults", tests)
    hit = load_sound_config(scenario.sound).hit_impulse
    return make_results(plan, catalog, outcomes, hit)


def _plan_tests(
    plan: FaultsPlan,
    catalog: FaultCatalog,
    skill: Regressor,
    prototypes: np.ndarray,
) -> dict[_Test, Spec]:
    """All trials, the first of each fault first."""
    scenario = load_scenario(plan.scenario)
    cells = catalog.cells
    positions = draw_positions(
        scenario,
        plan.repeats * len(cells),
        np.random.default_rng([plan.seed, _TESTS]),
    )
    tests: dict[_Test, Spec] = {}
    for repeat in range(plan.repeats):
        for cell, (kind, size) in enumerate(cells):
            rng = np.random.default_rng([plan.seed, _FAULTS, repeat, cell])
            fault = catalog.faults[kind].draw(size, catalog.joints, rng)
            for faulted in (True, False):
                tests[_Test(repeat, cell, faulted)] = watched(
                    plan.scenario,
                    positions[repeat * len(cells) + cell],
                    trial_seed(plan.seed, _TRIALS, repeat, cell),
                    skill,
                    prototypes,
                    [fault] if faulted else [],
                )
    return tests


def make_results(
    plan: FaultsPlan,
    catalog: FaultCatalog,
    outcomes: Mapping[_Test, WatchedResult],
    hit_impulse: float,
) -> FaultsResults:
    """What the trials come to.

    Args:
        plan: Plan of the study.
        catalog: Faults of the study.
        outcomes: Results of its trials.
        hit_impulse: Impulse above which the head was hit, N s.
    """
    pairs: dict[int, list[tuple[WatchedResult, WatchedResult]]] = {}
    for test, result in outcomes.items():
        if test.faulted:
            twin = outcomes[dataclasses.replace(test, faulted=False)]
            pairs.setdefault(test.cell, []).append((result, twin))
    rows = [
        _row(catalog, cell, pairs[cell], hit_impulse) for cell in sorted(pairs)
    ]
    sound = _sound(
        [result for test, result in outcomes.items() if not test.faulted],
        hit_impulse,
    )
    return FaultsResults.of(
        plan,
        force_limit=FORCE_LIMIT,
        rows=rows,
        sound=sound,
        faulted=sum(row.trials for row in rows),
        false_success=sum(row.false_success for row in rows),
        missed=sum(row.missed for row in rows),
        false_alarms=sound.false_alarms + sum(row.early for row in rows),
        beyond_limit=sum(
            result.max_force > FORCE_LIMIT for result in outcomes.values()
        ),
    )


def _began(result: WatchedResult) -> bool:
    """Whether a trial was ended, and its fault had begun by then."""
    if result.detected_at is None or result.onset is None:
        return False
    # The supervisor looks at the tick at which a fault begins.
    return result.detected_at >= result.onset - 1e-6


def _row(
    catalog: FaultCatalog,
    cell: int,
    pairs: Sequence[tuple[WatchedResult, WatchedResult]],
    hit_impulse: float,
) -> FaultRow:
    number, size = catalog.cells[cell]
    kind = catalog.faults[number].kind
    results = [result for result, _ in pairs]
    valid = [(r, twin) for r, twin in pairs if not r.invalid]
    detected = [r for r in results if r.invalid and _began(r)]
    times = [
        r.detected_at - r.onset
        for r in detected
        if r.detected_at is not None and r.onset is not None
    ]
    hits = [r.impulse > hit_impulse for r, _ in valid]
    return FaultRow(
        kind=kind,
        size=size if KINDS[kind].has_size else None,
        unit=KINDS[kind].unit,
        trials=len(results),
        success=sum(
            r.heard and hit for (r, _), hit in zip(valid, hits, strict=True)
        ),
        false_success=sum(
            r.heard and not hit for (r, _), hit in zip(valid, hits, strict=True)
        ),
        detected=len(detected),
        early=sum(bool(r.invalid) for r in results) - len(detected),
        harmed=sum(r.heard != twin.heard for r, twin in pairs),
        missed=sum(r.heard != twin.heard for r, twin in valid),
        detection_time=max(0.0, float(np.median(times))) if times else None,
        max_force=max(r.max_force for r in results),
        max_speed=max(r.max_speed for r in results),
        reasons=_reasons(results),
    )


def _sound(results: Sequence[WatchedResult], hit_impulse: float) -> SoundTrials:
    valid = [r for r in results if not r.invalid]
    scores = np.max([r.scores for r in results], axis=0)
    return SoundTrials(
        trials=len(results),
        success=success_rate([[r.heard for r in valid]]) if valid else None,
        false_success=sum(r.heard and r.impulse <= hit_impulse for r in valid),
        false_alarms=len(results) - len(valid),
        reasons=_reasons(results),
        max_force=max(r.max_force for r in results),
        max_speed=max(r.max_speed for r in results),
        highest_scores={
            check.name.lower(): float(scores[check]) for check in Check
        },
    )


def _reasons(results: Sequence[WatchedResult]) -> dict[str, int]:
    """How often each reason was given, without the joint it is of."""
    found = Counter(r.invalid.split(" (")[0] for r in results if r.invalid)
    return dict(found.most_common())
