"""The kinds of trial that studies plan, and how a worker runs them.

A spec is a plain mapping. `kind` and `scenario` say what to run where; the
rest determines the trial, including seeds. Results are plain numbers, arrays
go beside them.
"""

from collections.abc import Iterable, Iterator, Mapping, Sequence
import dataclasses
import functools
import hashlib
from pathlib import Path
from typing import Any

import numpy as np

from drake_affetto import __version__
from drake_affetto.common.errors import InputError
from drake_affetto.common.resources import models_dir, resolve
from drake_affetto.experiments.episode import Recording, TrialRunner
from drake_affetto.skill.policy import Regressor
from drake_affetto.sound.reward import reward_over_time
from drake_affetto.station.scenario import Scenario, load_scenario

# One runner, so one Diagram, for each scenario and process.
_RUNNERS: dict[str, TrialRunner] = {}


def runner(scenario: str) -> TrialRunner:
    """This process's runner of a scenario, built when first asked for."""
    if scenario not in _RUNNERS:
        _RUNNERS[scenario] = TrialRunner(load_scenario(scenario))
    return _RUNNERS[scenario]


def set_runner(scenario: str, trial_runner: TrialRunner) -> None:
    """Makes tasks in this process use `trial_runner`, e.g. one with Meshcat."""
    _RUNNERS[scenario] = trial_runner


# What of a scenario says how a skill is learned, which no trial depends on: it
# is given the outcome.
_LEARNING = ("skill", "transfer")


@functools.cache
def models_digest() -> str:
    """Tells the bodies and scenes of this installation from any others."""
    root = models_dir()
    # The other YAML files count where a scenario names them.
    suffixes = (".sdf", ".obj", ".xml", ".dmd.yaml")
    return _digest_of_files(
        path
        for path in sorted(root.rglob("*"))
        if path.is_file() and path.name.endswith(suffixes)
    )


def software() -> dict[str, str]:
    """What must be the same wherever trials of one study run."""
    return {"version": __version__, "models": models_digest()}


def _digest_of_files(paths: Iterable[Path]) -> str:
    digest = hashlib.sha256()
    for path in paths:
        digest.update(path.name.encode())
        digest.update(path.read_bytes())
    return digest.hexdigest()[:16]


@functools.cache
def _fingerprint(scenario: str) -> dict[str, str]:
    """What, besides its own numbers, determines a trial of a scenario."""
    loaded = _plain(load_scenario(scenario))
    for name in _LEARNING:
        del loaded[name]
    return {
        "name": scenario,
        "values": hashlib.sha256(repr(loaded).encode()).hexdigest()[:16],
        "files": _digest_of_files(
            resolve(text)
            for text in _texts(loaded)
            if text.endswith((".yaml", ".yml"))
        ),
        "models": models_digest(),
        "version": __version__,
    }


def _texts(value: Any) -> Iterator[str]:
    """All texts in a nest of mappings and sequences."""
    if isinstance(value, str):
        yield value
    elif isinstance(value, Mapping):
        for each in value.values():
            yield from _texts(each)
    elif isinstance(value, (list, tuple)):
        for each in value:
            yield from _texts(each)


def _plain(value: Any) -> Any:
    """The numbers of a config, Drake's own structs included."""
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        return {
            f.name: _plain(getattr(value, f.name))
            for f in dataclasses.fields(value)
        }
    if hasattr(value, "__fields__"):
        return {
            f.name: _plain(getattr(value, f.name)) for f in value.__fields__
        }
    if isinstance(value, (list, tuple)):
        return [_plain(v) for v in value]
    if isinstance(value, Mapping):
        return {k: _plain(v) for k, v in value.items()}
    return value


def _spec(kind: str, scenario: str, **rest: Any) -> dict[str, Any]:
    return {"kind": kind, "scenario": _fingerprint(scenario), **rest}


def demonstration(
    scenario: str, xy: Sequence[float], seed: int, variability: float = 1.0
) -> dict[str, Any]:
    """Look for the drum at xy, be taught until the replay sounds.

    `variability` scales how much the teacher's strokes differ.

    Result: xy, found, tau (2), attempts, success, reward, max_pull. Arrays:
    theta (F), q (T, n), prototype (bands, frames); empty where nothing was
    found.
    """
    return _spec(
        "demonstration",
        scenario,
        xy=list(xy),
        seed=seed,
        variability=variability,
    )


def look(scenario: str, xy: Sequence[float], seed: int) -> dict[str, Any]:
    """Look for the drum at xy.

    Result: found, tau (2), duration. Arrays: none.
    """
    return _spec("look", scenario, xy=list(xy), seed=seed)


def strike(
    scenario: str,
    xy: Sequence[float],
    seed: int,
    theta: np.ndarray,
    prototypes: np.ndarray,
) -> dict[str, Any]:
    """Play θ (F) with the drum at xy, judged by its sound.

    What `drumming` does once the drum has been found; so one look serves all
    that is tried at one place. `prototypes` are (N, bands, frames).

    Result: reward, success, max_force, impulse. Arrays: reward_over_time.
    """
    return _spec(
        "strike",
        scenario,
        xy=list(xy),
        seed=seed,
        theta=np.asarray(theta, float),
        prototypes=np.asarray(prototypes, float),
    )


def drumming(
    scenario: str,
    xy: Sequence[float],
    seed: int,
    regressor: Regressor,
    prototypes: Sequence[np.ndarray],
) -> dict[str, Any]:
    """The whole chain with the drum at xy, judged by its sound.

    Result: found, tau (2), reward, success, max_force, impulse. Arrays: none.
    """
    return _spec(
        "drumming",
        scenario,
        xy=list(xy),
        seed=seed,
        regressor=regressor,
        prototypes=list(prototypes),
    )


def run_task(spec: Mapping[str, Any]) -> tuple[dict, dict[str, np.ndarray]]:
    """Runs one spec in this process."""
    tasks = {
        "demonstration": _run_demonstration,
        "drumming": _run_drumming,
        "look": _run_look,
        "strike": _run_strike,
    }
    if spec["kind"] not in tasks:
        raise InputError(f"no kind of trial is called {spec['kind']!r}")
    return tasks[spec["kind"]](spec)


def _run_demonstration(spec: Mapping[str, Any]):
    trials = runner(spec["scenario"]["name"])
    threshold = trials.reward_config.threshold
    xy, seed = np.array(spec["xy"]), spec["seed"]
    look = trials.look(xy, seed)
    result: dict[str, Any] = {
        "xy": spec["xy"],
        "found": look.found,
        "tau": look.task_parameter.tolist(),
        "attempts": 0,
        "success": False,
        "reward": 0.0,
        "max_pull": 0.0,
    }
    empty = np.zeros((0, 0))
    arrays = {"theta": np.zeros(0), "q": empty, "prototype": empty}
    if not look.found:
        return result, arrays
    taps = trials.taps()
    for attempt in range(trials.scenario.teaching.max_attempts):
        lesson = trials.teach(xy, seed, attempt, spec["variability"])
        # The robot's own replay decides; each one has its own noise.
        recording = trials.play(xy, lesson.theta, seed + 7919 * (attempt + 1))
        value = trials.reward(recording, taps)
        result["attempts"] = attempt + 1
        result["max_pull"] = max(result["max_pull"], lesson.max_pull)
        if value > result["reward"] or attempt == 0:
            result["reward"] = value
            arrays = {
                "theta": lesson.theta,
                "q": lesson.q,
                "prototype": trials.prototype(recording),
            }
        if value > threshold:
            result["success"] = True
            break
    return result, arrays


def _run_drumming(spec: Mapping[str, Any]):
    trials = runner(spec["scenario"]["name"])
    look, recording = trials.drum(
        np.array(spec["xy"]), spec["regressor"], spec["seed"]
    )
    result: dict[str, Any] = {
        "found": look.found,
        "tau": look.task_parameter.tolist(),
        "reward": 0.0,
        "success": False,
        "max_force": 0.0,
        "impulse": 0.0,
    }
    if recording is None:
        return result, {}
    result.update(_judge(trials, recording, spec["prototypes"]))
    return result, {}


def _run_look(spec: Mapping[str, Any]):
    trials = runner(spec["scenario"]["name"])
    seen = trials.look(np.array(spec["xy"]), spec["seed"])
    result = {
        "found": seen.found,
        "tau": seen.task_parameter.tolist(),
        "duration": seen.duration,
    }
    return result, {}


def _run_strike(spec: Mapping[str, Any]):
    trials = runner(spec["scenario"]["name"])
    recording = trials.play(np.array(spec["xy"]), spec["theta"], spec["seed"])
    heard = trials.spectrogram(recording)
    course = reward_over_time(heard, spec["prototypes"])
    result = _judge(trials, recording, spec["prototypes"])
    return result, {"reward_over_time": course.astype(np.float32)}


def _judge(
    trials: TrialRunner,
    recording: Recording,
    prototypes: Sequence[np.ndarray],
) -> dict[str, Any]:
    """The reward, from the sound; and what happened, to hold against it."""
    value = trials.reward(recording, prototypes)
    force = recording.contact_force[:, 0]
    step = recording.t[1] - recording.t[0]
    return {
        "reward": value,
        "success": bool(value > trials.reward_config.threshold),
        "max_force": float(force.max()),
        "impulse": float(force.sum() * step),
    }


def trial_seed(*numbers: int) -> int:
    """A seed of its own for whatever the numbers name.

    More repeats or positions leave the seeds of the others as they are.
    """
    return int(np.random.SeedSequence(numbers).generate_state(1)[0] >> 1)


def draw_positions(
    scenario: Scenario,
    count: int,
    rng: np.random.Generator,
    workspace: float = 1.0,
) -> np.ndarray:
    """(count, 2) places for the drum, spread over the scenario's region.

    A scrambled Sobol sequence: random, but without gaps or clusters.

    Args:
        workspace: the share of the region's length and width, about its
            middle, that is made use of.
    """
    from scipy.stats import qmc

    region = scenario.drum_region
    corners = np.array([region.x, region.y]).T
    middle = corners.mean(axis=0)
    low, high = middle + workspace * (corners - middle)
    sampler = qmc.Sobol(2, rng=rng)
    bits = max(1, int(np.ceil(np.log2(max(count, 2)))))
    points = sampler.random_base2(bits)[:count]
    return low + points * (high - low)
