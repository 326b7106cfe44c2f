"""Does the sound tell hits from all else? Strikes that are aimed elsewhere.

Movements that were taught on a drum are played while the drum stands beside the
place where the hand comes down: so far that the hand lands on the head, about
its rim, on the shell, or passes it in the air. Others come down lower, beside
the drum: on the table, or against the shell's side. The forces of each strike
are kept; its sound is made from them afterwards, so that other ways to hear
need no new strikes.

Whether the head was struck is known to the simulation and kept for judging
only: the reward has the sound alone.
"""

from collections.abc import Mapping, Sequence
import dataclasses
from typing import Any

import numpy as np

from drake_affetto.common.typed_json import to_plain
from drake_affetto.common.typing import Array
from drake_affetto.experiments.episode import Recording, TrialRunner
from drake_affetto.experiments.trials import (
    draw_positions,
    runner_of,
    scenario_entry,
    trial_seed,
)
from drake_affetto.runner.executor import Result, Spec, TrialExecutor
from drake_affetto.scene import world
from drake_affetto.sound.config import SoundConfig
from drake_affetto.sound.reward import (
    cut_prototype,
    reward,
    spectrogram,
    tap_prototypes,
)
from drake_affetto.sound.voice import DrumVoice, microphone_noise
from drake_affetto.station.scenario import load_scenario


@dataclasses.dataclass(frozen=True)
class Aim:
    """A kind of strike.

    Attributes:
        share: Share of the study's strikes.
        least: Least distance of the drum's middle from where the hand comes
            down, m.
        most: Greatest distance, m.
        low: Whether the movement goes down beside the drum, to the table.
    """

    share: float
    least: float
    most: float
    low: bool = False


# The head has a radius of 40 mm and the hand of some 25 mm: up to 65 mm apart
# they can touch from above.
AIMS = {
    "head": Aim(0.25, 0.0, 0.028),
    "rim": Aim(0.25, 0.028, 0.052),
    "shell": Aim(0.20, 0.050, 0.075),
    "near": Aim(0.10, 0.075, 0.120),
    "side": Aim(0.10, 0.050, 0.090, low=True),
    "table": Aim(0.10, 0.090, 0.160, low=True),
}

DEMONSTRATIONS = 25
"""Number of prototypes, as after a whole lesson."""

# Movements that are played, of each height.
_MOVEMENTS = {False: 24, True: 8}
# By how much the low ones go deeper than the head, m: the head is 70 mm high.
_LOWER = (0.045, 0.065)
# Where the drum stands while a low movement is taught: out of the way.
_AWAY = 0.15


@dataclasses.dataclass
class Struck:
    """What one strike touched.

    Attributes:
        impulse: Impulse on the head, N s.
        peak: Greatest force on the head, N.
        shell: Greatest force on the shell, N.
        table: Greatest force on the table, N.
    """

    impulse: float
    peak: float
    shell: float
    table: float


def run_separation_trial(spec: Spec) -> Result:
    """Runs one spec of this study, a movement or a strike."""
    trials = runner_of(spec["scenario"])
    xy, seed = np.array(spec["xy"]), spec["seed"]
    if spec["kind"] == "movement":
        return {}, {"theta": _taught(trials, xy, seed, spec["lower"])}
    recording = trials.strike(xy, np.asarray(spec["theta"]), seed)
    struck = Struck(
        impulse=recording.impulse,
        peak=float(recording.contact_force[:, 0].max()),
        shell=float(recording.knock_force[:, 0].max()),
        table=float(recording.knock_force[:, 1].max()),
    )
    return to_plain(struck), {"forces": _forces(recording)}


def _forces(recording: Recording) -> Array:
    """All that a strike's sound is made of (T, 6), in single precision.

    Time, s; force on the head, N; its radius, m; forces on shell and table, N;
    the valves' air, kg/s.
    """
    columns = np.column_stack(
        [
            recording.t,
            recording.contact_force,
            recording.knock_force,
            recording.hiss_flow,
        ]
    )
    return columns.astype(np.float32)


def _taught(trials: TrialRunner, xy: Array, seed: int, lower: float) -> Array:
    """θ of a stroke at xy; with `lower` above 0 the drum is out of the way."""
    if lower == 0.0:
        return trials.teach(xy, seed).theta
    trials.settle(xy, seed)
    station = trials.station
    context = station.GetMyContextFromRoot(trials.context)
    aim = station.touching_position(context) - [0.0, 0.0, lower]
    return trials.teach(_away(trials, xy), seed, aim=aim).theta


def _away(trials: TrialRunner, xy: Array) -> Array:
    """A place on the table away from xy, towards the table's middle."""
    way = 0.5 * np.sum(_drum_limits(trials), axis=0) - xy
    return xy + _AWAY * way / np.linalg.norm(way)


def _drum_limits(trials: TrialRunner) -> tuple[Array, Array]:
    """Least and greatest place of the drum on the table, m."""
    plant = trials.station.plant
    return world.drum_limits(plant, plant.GetMyContextFromRoot(trials.context))


def run_strikes(
    executor: TrialExecutor,
    *,
    strikes: int = 2100,
    scenario: str = "drumming",
    seed: int = 0,
) -> list[tuple[str, Result]]:
    """Teaches movements and strikes with them.

    Args:
        executor: Executor of `run_separation_trial`.
        strikes: Number of strikes in all.
        scenario: Scenario, by name or path.
        seed: Seed of movements, places and noise.

    Returns:
        Aim and result of each strike: `Struck` as plain values, and the array
        `forces`.
    """
    loaded = load_scenario(scenario)
    entry = scenario_entry(scenario)
    rng = np.random.default_rng([seed, 0x5E9A])
    thetas: dict[bool, list[tuple[Array, Array]]] = {}
    for low, count in _MOVEMENTS.items():
        places = draw_positions(loaded, count, rng)
        found = executor.run(
            "Low movements" if low else "Movements",
            {
                k: {
                    "kind": "movement",
                    "scenario": entry,
                    "xy": xy.tolist(),
                    "seed": trial_seed(seed, 1_000_000 + 1000 * low + k),
                    "lower": float(rng.uniform(*_LOWER)) if low else 0.0,
                }
                for k, xy in enumerate(places)
            },
        )
        thetas[low] = [
            (xy, arrays["theta"])
            for xy, (_, arrays) in zip(places, found.values(), strict=True)
        ]
    limits = _drum_limits(runner_of(entry))
    names = [
        name
        for name, aim in AIMS.items()
        for _ in range(round(aim.share * strikes))
    ]
    # In no order, so that a part of the study is a smaller study.
    rng.shuffle(names)
    specs: dict[int, Mapping[str, Any]] = {}
    for number, name in enumerate(names):
        aim = AIMS[name]
        xy, theta = thetas[aim.low][int(rng.integers(len(thetas[aim.low])))]
        specs[number] = {
            "kind": "strike",
            "scenario": entry,
            "aim": name,
            "xy": _beside(xy, aim, limits, rng).tolist(),
            "theta": theta.tolist(),
            "seed": trial_seed(seed, number),
        }
    found = executor.run("Strikes", specs)
    return [
        (name, result)
        for name, result in zip(names, found.values(), strict=True)
    ]


def _beside(
    xy: Array, aim: Aim, limits: tuple[Array, Array], rng: np.random.Generator
) -> Array:
    """A place (2,) of the drum for that aim, wholly on the table, m.

    Its distance from xy is evenly distributed.
    """
    while True:
        distance = rng.uniform(aim.least, aim.most)
        angle = rng.uniform(-np.pi, np.pi)
        place = xy + distance * np.array([np.cos(angle), np.sin(angle)])
        if np.all(place >= limits[0]) and np.all(place <= limits[1]):
            return place


def sound_of(voice: DrumVoice, forces: Array, seed: int) -> Array:
    """The recording of a strike, Pa, from its forces (T, 6)."""
    t, head, radius, shell, table, flow = np.asarray(forces, float).T
    # Single precision has rounded the times.
    even = np.linspace(t[0], t[-1], t.size)
    return voice.synthesize(
        even,
        head,
        radius,
        shell,
        table,
        flow,
        microphone_noise(seed),
    )


def hear(
    outcomes: Sequence[tuple[str, Result]],
    sound: SoundConfig,
    *,
    seed: int = 0,
) -> Array:
    """R of each strike, by the first hits among them as demonstrations.

    Args:
        outcomes: Outcomes of `run_strikes`.
        sound: How the drum sounds and is heard.
        seed: Seed of the microphone's and the valves' noise.

    Returns:
        (N,) in the order of `outcomes`; those of the prototypes' own strikes
        are not a number.
    """
    voice = DrumVoice(sound.voice)
    config = sound.reward
    heard = [
        spectrogram(
            sound_of(voice, arrays["forces"], trial_seed(seed, k)),
            voice.rate,
            config,
        )
        for k, (_, (_, arrays)) in enumerate(outcomes)
    ]
    # Demonstrations count if a person's taps let them: so do these.
    taps = tap_prototypes(voice, config)
    lessons: list[int] = []
    for k, (name, _) in enumerate(outcomes):
        if name == "head" and reward(heard[k], taps) > config.threshold:
            lessons.append(k)
        if len(lessons) == DEMONSTRATIONS:
            break
    prototypes = [cut_prototype(heard[k], config) for k in lessons]
    rewards = np.array([reward(each, prototypes) for each in heard])
    rewards[lessons] = np.nan
    return rewards


@dataclasses.dataclass
class Count:
    """What was heard of strikes of one aim.

    A touch too light to be called a hit is neither a hit nor no touch.

    Attributes:
        aim: Name of the aim.
        strikes: Number of strikes.
        hits: Number of those with more than the impulse of a hit on the head.
        missed: Number of hits whose R is not above the threshold.
        least: Least R of a hit; None without hits.
        untouched: Number of strikes that left the head alone.
        false: Number of these whose R is above the threshold.
        greatest: Greatest R of these; None without any.
    """

    aim: str
    strikes: int
    hits: int
    missed: int
    least: float | None
    untouched: int
    false: int
    greatest: float | None


def count(
    aim: str, rewards: Array, impulse: Array, hit: float, threshold: float
) -> Count:
    """Counts what was heard.

    Args:
        aim: Name of the aim.
        rewards: R of each strike (N,).
        impulse: Impulse on the head of each (N,), N s.
        hit: Impulse above which the head was hit, N s.
        threshold: R above which a strike counts as a hit.
    """
    struck, alone = rewards[impulse > hit], rewards[impulse <= 0.0]
    return Count(
        aim=aim,
        strikes=int(rewards.size),
        hits=int(struck.size),
        missed=int(np.sum(struck <= threshold)),
        least=float(struck.min()) if struck.size else None,
        untouched=int(alone.size),
        false=int(np.sum(alone > threshold)),
        greatest=float(alone.max()) if alone.size else None,
    )
