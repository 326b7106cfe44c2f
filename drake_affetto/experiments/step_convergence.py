"""Do outcomes depend on the plant's step? The same strikes at several steps.

Skills of 1, 2, 3, 5 and 12 demonstrations strike at unseen positions, so that
there are safe hits, narrow ones and misses. Movements and positions are made
once, at the reference step; every step then plays just these.
"""

from collections.abc import Mapping, Sequence
import dataclasses
import functools
from typing import Any

import numpy as np

from drake_affetto.common.typed_json import from_plain, to_plain
from drake_affetto.common.typing import Array
from drake_affetto.experiments.episode import TrialRunner
from drake_affetto.experiments.recordings import Recording
from drake_affetto.experiments.trials import (
    NAME,
    check_entry,
    draw_positions,
    scenario_entry,
    trial_seed,
)
from drake_affetto.runner.executor import Result, Spec, TrialExecutor
from drake_affetto.station.content import Content
from drake_affetto.station.scenario import load_scenario

SKILLS = (1, 2, 3, 5, 12)
"""Numbers of demonstrations of the skills that strike."""

# Force from which on the hand counts as arrived, N: above grazing, below any
# peak of interest.
_ARRIVED = 0.2

# The end of a recording over which pressures are held, s.
_HELD = 0.2


@dataclasses.dataclass
class Arrival:
    """When and where the hand arrives at the head.

    Attributes:
        time: Time since the movement's start, s.
        place: Position of the palm then (2,), m.
    """

    time: float
    place: list[float]


@dataclasses.dataclass
class StepOutcome:
    """What one strike at one step gave.

    Attributes:
        reward: R of paper Eq. 10.
        success: Whether R is above the threshold.
        arrival: Arrival at the head; None if there is none.
        peak_force: Greatest force on the head, N.
        pressure: Chamber pressures (2n,) at the end, Pa.
        tracking: Rms error of the joints from the desired angles, rad.
    """

    reward: float
    success: bool
    arrival: Arrival | None
    peak_force: float
    pressure: list[float]
    tracking: float


@dataclasses.dataclass
class Difference:
    """How far outcomes at one step are from those at the reference.

    Attributes:
        time_step: Step of the plant, s.
        trials: Number of strikes.
        hits: Number of hits by the sound.
        agreement: Share of trials in which both are hits or both are misses.
        time: Median and 95th percentile of the difference of arrival, s.
        place: The same of the palm's distance at arrival, m.
        peak_force: The same of the relative difference of the peak force.
        pressure: The same of the held pressures, Pa.
        tracking: The same of the tracking error, rad.
        reward: The same of R.
    """

    time_step: float
    trials: int
    hits: int
    agreement: float
    time: tuple[float, float]
    place: tuple[float, float]
    peak_force: tuple[float, float]
    pressure: tuple[float, float]
    tracking: tuple[float, float]
    reward: tuple[float, float]


@functools.cache
def _runner(content: Content, name: str, time_step: float) -> TrialRunner:
    loaded = load_scenario(name)
    loaded.plant_config.time_step = time_step
    return TrialRunner(loaded)


def run_step_trial(spec: Spec) -> Result:
    """Runs one spec of this study, a demonstration or a strike."""
    entry = spec["scenario"]
    trials = _runner(check_entry(entry), entry[NAME], spec["time_step"])
    xy, seed = np.array(spec["xy"]), spec["seed"]
    if spec["kind"] == "movement":
        return {}, {"theta": trials.teach(xy, seed).theta}
    recording = trials.strike(xy, np.asarray(spec["theta"]), seed)
    reward = trials.reward(recording, trials.tap_prototypes())
    outcome = _outcome(trials, recording, reward)
    return to_plain(outcome), {}


def _outcome(
    trials: TrialRunner, recording: Recording, reward: float
) -> StepOutcome:
    n = trials.station.num_joints
    error = (recording.true_state - recording.desired_state)[:, :n]
    held = recording.joint_t > recording.joint_t[-1] - _HELD
    return StepOutcome(
        reward=reward,
        success=bool(reward > trials.reward_config.threshold),
        arrival=_arrival(trials, recording),
        peak_force=float(recording.contact_force[:, 0].max()),
        pressure=recording.chamber_pressure[held].mean(axis=0).tolist(),
        tracking=float(np.sqrt(np.mean(error**2))),
    )


def _arrival(trials: TrialRunner, recording: Recording) -> Arrival | None:
    force = recording.contact_force[:, 0]
    late = np.flatnonzero(force > _ARRIVED)
    if not late.size:
        return None
    around = slice(max(int(late[0]) - 1, 0), int(late[0]) + 1)
    time = float(np.interp(_ARRIVED, force[around], recording.t[around]))
    state = [
        np.interp(time, recording.joint_t, each)
        for each in recording.true_state.T
    ]
    (palm,) = trials.palm_path(np.array([state]))
    return Arrival(time, palm[:2].tolist())


def run_step_convergence(
    executor: TrialExecutor,
    steps: Sequence[float],
    *,
    trials: int = 200,
    scenario: str = "drumming",
    seed: int = 0,
) -> list[Difference]:
    """Compares strikes at `steps` with the same ones at the first of them.

    Args:
        executor: Executor of `run_step_trial`.
        steps: Steps of the plant, s; the first is the reference.
        trials: Number of strikes at each step, at least one for each skill.
        scenario: Scenario, by name or path.
        seed: Seed of positions, teacher and noise.

    Returns:
        The differences of each step but the first, in their order.
    """
    movements = _movements(executor, steps[0], trials, scenario, seed)
    outcomes: dict[float, list[StepOutcome]] = {}
    for step in steps:
        found = executor.run(
            f"Strikes at {1e3 * step:g} ms",
            {
                k: _spec("strike", scenario, step, xy, seed, k, theta=theta)
                for k, (xy, theta) in enumerate(movements)
            },
        )
        outcomes[step] = [
            from_plain(StepOutcome, result) for result, _ in found.values()
        ]
    reference = outcomes[steps[0]]
    return [difference(step, outcomes[step], reference) for step in steps[1:]]


def _spec(
    kind: str,
    scenario: str,
    step: float,
    xy: Array,
    seed: int,
    number: int,
    **rest: Any,
) -> Mapping[str, Any]:
    return {
        "kind": kind,
        "scenario": scenario_entry(scenario),
        "time_step": step,
        "xy": np.asarray(xy).tolist(),
        "seed": trial_seed(seed, number),
        **rest,
    }


def _movements(
    executor: TrialExecutor,
    step: float,
    trials: int,
    scenario: str,
    seed: int,
) -> list[tuple[Array, Array]]:
    """Position and θ of each strike, from skills of few to many lessons."""
    from drake_affetto.experiments.skills import make_skill

    loaded = load_scenario(scenario)
    rng = np.random.default_rng([seed, 0x57E9])
    taught = draw_positions(loaded, max(SKILLS), rng)
    unseen = draw_positions(loaded, trials, rng)
    found = executor.run(
        "Demonstrations",
        {
            k: _spec("movement", scenario, step, xy, seed, 1_000_000 + k)
            for k, xy in enumerate(taught)
        },
    )
    theta = np.array([arrays["theta"] for _, arrays in found.values()])
    # The drum's place itself is the task parameter: no image is needed.
    corners = loaded.drum_region.corners
    box = np.stack([corners.min(axis=0), corners.max(axis=0)], axis=1)
    config = dataclasses.replace(loaded.skill, input_range=box.tolist())
    skills = [
        make_skill(config, seed).fit(taught[:count], theta[:count])
        for count in SKILLS
    ]
    return [
        (xy, skills[k % len(skills)].predict(xy[None])[0])
        for k, xy in enumerate(unseen)
    ]


def difference(
    step: float,
    outcomes: Sequence[StepOutcome],
    reference: Sequence[StepOutcome],
) -> Difference:
    """Differences of outcomes to the reference's, trial by trial."""
    pairs = list(zip(outcomes, reference, strict=True))
    both = [
        (a.arrival, b.arrival)
        for a, b in pairs
        if a.arrival is not None and b.arrival is not None
    ]
    # Of strikes that arrive: what grazes has no force to speak of.
    forces = [
        a.peak_force / b.peak_force
        for a, b in pairs
        if a.arrival is not None and b.arrival is not None
    ]

    def spread(values: Any) -> tuple[float, float]:
        sizes = np.abs(np.asarray(values, dtype=float))
        if not sizes.size:
            return float("nan"), float("nan")
        return float(np.median(sizes)), float(np.quantile(sizes, 0.95))

    return Difference(
        time_step=step,
        trials=len(pairs),
        hits=sum(a.success for a, _ in pairs),
        agreement=float(np.mean([a.success == b.success for a, b in pairs])),
        time=spread([a.time - b.time for a, b in both]),
        place=spread(
            [np.linalg.norm(np.subtract(a.place, b.place)) for a, b in both]
        ),
        peak_force=spread(np.subtract(forces, 1.0)),
        pressure=spread(
            [np.subtract(a.pressure, b.pressure) for a, b in pairs]
        ),
        tracking=spread([a.tracking - b.tracking for a, b in pairs]),
        reward=spread([a.reward - b.reward for a, b in pairs]),
    )
