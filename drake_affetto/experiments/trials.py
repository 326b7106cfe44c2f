"""The kinds of trial that studies plan, and how a worker runs them.

A spec is a plain mapping. `kind` and `scenario` say what to run where; the
rest determines the trial, including seeds. The scenario is known by its
content, and a process that runs a spec verifies that it has read the same. The
kinds are

    look           the gaze searches for the drum
    demonstration  the gaze, then a teacher who repeats the movement until the
                   robot's own replay makes the drum sound
    strike         the whole chain with what a skill says given: gaze,
                   movement, sound
    drumming       the whole chain: gaze, skill, movement, sound
    hand_look      the arm goes to a posture, at which the hand's marker is
                   looked for in the mirror
    ellipse_look   the gaze, then the shape of the drum's marker
    watched        the whole chain with faults, as far as the supervisor lets it

and `drake_affetto.experiments.results` has the result of each.

Long: all kinds of trial stand side by side.
"""

from collections.abc import Callable, Container, Mapping, Sequence
import dataclasses
from typing import Any

import numpy as np

from drake_affetto import __version__
from drake_affetto.common.errors import InputError
from drake_affetto.common.fingerprint import files_digest
from drake_affetto.common.resources import models_dir
from drake_affetto.experiments.episode import GuidedMovement, TrialRunner
from drake_affetto.experiments.mirror_looks import (
    look_at_ellipse,
    look_at_hand,
)
from drake_affetto.experiments.recordings import Recording
from drake_affetto.experiments.results.trial import (
    DemonstrationResult,
    DrummingResult,
    EllipseLookResult,
    GazeResult,
    HandLookResult,
    StrikeResult,
    TrialResult,
    pack,
    unpack,
)
from drake_affetto.experiments.watched import run_watched
from drake_affetto.faults.config import Fault
from drake_affetto.geometry.region import spread_inside
from drake_affetto.perception.blob import BlobCalibration, BlobConfig
from drake_affetto.runner.executor import Key, Result, Spec, TrialExecutor
from drake_affetto.scene.world import FramePose
from drake_affetto.skill.policy import Regressor
from drake_affetto.sound.reward import reward_over_time
from drake_affetto.station.content import (
    Content,
    scenario_content,
    scenario_source,
)
from drake_affetto.station.scenario import Scenario, load_scenario

# One runner, so one Diagram, for each content of a scenario and process; beside
# it, what led to the scenario.
_RUNNERS: dict[Content, tuple[str, TrialRunner]] = {}

# Each keeps a Diagram with its renderers, some 50 MiB, after trials twice that.
# A study of many bodies goes from one to the next and does not come back;
# others have two scenarios.
MOST_RUNNERS = 4

NAME = "@name"
"""Entry of a spec's scenario that says what leads to it."""

# Every replay has noise of its own: its seed is this far from the last one's.
_REPLAY_SEED_STEP = 7919


def runner(scenario: str) -> TrialRunner:
    """This process's runner of a scenario as its files are now.

    It is built when first asked for, and again when a file has changed.

    Args:
        scenario: Scenario, by name or path.

    Raises:
        InputError: If the scenario does not fit.
    """
    return runner_of(scenario_entry(scenario))


def runner_of(entry: Mapping[str, Any]) -> TrialRunner:
    """This process's runner of the scenario that a spec was made for.

    Args:
        entry: Entry "scenario" of the spec.

    Raises:
        InputError: If this process finds another scenario there: its files
            are not those of the spec.
    """
    content = check_entry(entry, loaded=_RUNNERS)
    if content not in _RUNNERS:
        name = entry[NAME]
        loaded = load_scenario(name)
        for old, (source, _) in list(_RUNNERS.items()):
            # What its files held before is not asked for again.
            if source == name:
                del _RUNNERS[old]
        # The least recently built of too many goes, before there is one more.
        while len(_RUNNERS) >= MOST_RUNNERS:
            del _RUNNERS[next(iter(_RUNNERS))]
        built = TrialRunner(loaded)
        # It may have been edited while it was read.
        check_entry(entry)
        _RUNNERS[content] = name, built
    return _RUNNERS[content][1]


def models_digest() -> str:
    """Distinguishes the models of this installation from any others."""
    root = models_dir()
    # The other YAML files count where a scenario names them.
    suffixes = (".sdf", ".obj", ".xml", ".dmd.yaml")
    return files_digest(
        path
        for path in sorted(root.rglob("*"))
        if path.is_file() and path.name.endswith(suffixes)
    )


def software() -> dict[str, str]:
    """What must be the same wherever trials of one study run."""
    return {"version": __version__, "models": models_digest()}


def scenario_entry(scenario: str) -> dict[str, str]:
    """A spec's entry for a scenario: its content, and what leads to it.

    Args:
        scenario: Scenario, by name or path.

    Raises:
        InputError: If the scenario does not fit.
    """
    return {
        # It does not determine the trial, see `trial_key`.
        NAME: scenario_source(scenario),
        **dataclasses.asdict(scenario_content(scenario)),
    }


def check_entry(
    entry: Mapping[str, Any], loaded: Container[Content] = ()
) -> Content:
    """The content in a spec's entry for a scenario, compared with the files'.

    Args:
        entry: Entry "scenario" of the spec.
        loaded: Contents for which the files are not asked.

    Raises:
        InputError: If the scenario is another one by now, or here: the trial
            would give something else.
    """
    # Version 0.1.0 kept the name as a part of the trial.
    name = entry.get(NAME, entry.get("name"))
    fields = dataclasses.fields(Content)
    if not isinstance(name, str):
        raise InputError("the trial does not say which scenario it is of")
    if all(isinstance(entry.get(f.name), str) for f in fields):
        content = Content(**{f.name: entry[f.name] for f in fields})
        if content in loaded:
            return content
    now = scenario_content(name)
    changed = now.changed(entry)
    if changed:
        raise InputError(
            f"the scenario {name!r} is not the one of the trial: other "
            f"{', '.join(changed)}"
        )
    return now


def at_mirror(spec: Spec, pose: FramePose | None) -> Spec:
    """The spec of the same trial with the mirror elsewhere.

    Args:
        spec: Spec of any kind.
        pose: Pose of the frame `mirror_pose`; None for the scenario's.
    """
    if pose is None:
        return spec
    return {**spec, "mirror": dataclasses.asdict(pose)}


def _spec(kind: str, scenario: str, **rest: Any) -> Spec:
    return {"kind": kind, "scenario": scenario_entry(scenario), **rest}


def demonstration(
    scenario: str, xy: Sequence[float], seed: int, variability: float = 1.0
) -> Spec:
    """The spec of a demonstration with the drum at xy.

    Args:
        scenario: Scenario, by name or path.
        xy: Position of the drum (2,), m.
        seed: Seed of the noise and the teacher.
        variability: Factor of how much the teacher's strokes differ.
    """
    return _spec(
        "demonstration",
        scenario,
        xy=list(xy),
        seed=seed,
        variability=variability,
    )


def look(scenario: str, xy: Sequence[float], seed: int) -> Spec:
    """The spec of a search for the drum at xy with the gaze."""
    return _spec("look", scenario, xy=list(xy), seed=seed)


def strike(
    scenario: str,
    xy: Sequence[float],
    seed: int,
    theta: np.ndarray,
    prototypes: np.ndarray,
) -> Spec:
    """The spec of the chain with the drum at xy and a given movement.

    It is `drumming` with a skill that has been asked already: for what a
    `look` there, with this seed, finds. Movements that are tried one after
    another with the same place and seed share the search, see
    `TrialRunner.look`.

    Args:
        scenario: Scenario, by name or path.
        xy: Position of the drum (2,), m.
        seed: Seed of the trial; that of the look.
        theta: Parameters of the movement (F,).
        prototypes: Prototypes of the reward (N, bands, frames).
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
) -> Spec:
    """The spec of the whole chain with the drum at xy, judged by its sound.

    Args:
        scenario: Scenario, by name or path.
        xy: Position of the drum (2,), m.
        seed: Seed of the noise.
        regressor: Skill, from task parameters to parameters of a movement.
        prototypes: Prototypes of the reward (bands, frames) each.
    """
    return _spec(
        "drumming",
        scenario,
        xy=list(xy),
        seed=seed,
        regressor=regressor,
        prototypes=list(prototypes),
    )


def hand_look(
    scenario: str,
    xy: Sequence[float],
    seed: int,
    posture: np.ndarray,
    blob: BlobConfig,
) -> Spec:
    """The spec of a look at the robot's own hand in the mirror.

    Args:
        scenario: Scenario, by name or path.
        xy: Position of the drum meanwhile (2,), m.
        seed: Seed of the noise.
        posture: Angles of the joints (n,) at which it looks, rad.
        blob: How the hand's marker looks.
    """
    return _spec(
        "hand_look",
        scenario,
        xy=list(xy),
        seed=seed,
        posture=np.asarray(posture, float).tolist(),
        blob=dataclasses.asdict(blob),
    )


def watched(
    scenario: str,
    xy: Sequence[float],
    seed: int,
    regressor: Regressor,
    prototypes: np.ndarray,
    faults: Sequence[Fault] = (),
) -> Spec:
    """The spec of the whole chain with faults, watched by the supervisor.

    Args:
        scenario: Scenario with a supervisor, by name or path.
        xy: Position of the drum (2,), m.
        seed: Seed of the noise and of what is random in the faults.
        regressor: Skill, from task parameters to parameters of a movement.
        prototypes: Prototypes of the reward (N, bands, frames).
        faults: Faults of the trial, in place of the scenario's.
    """
    return _spec(
        "watched",
        scenario,
        xy=list(xy),
        seed=seed,
        regressor=regressor,
        prototypes=np.asarray(prototypes, float),
        faults=[dataclasses.asdict(each) for each in faults],
    )


def ellipse_look(scenario: str, xy: Sequence[float], seed: int) -> Spec:
    """The spec of a look at the shape of the drum's marker at xy."""
    return _spec("ellipse_look", scenario, xy=list(xy), seed=seed)


@dataclasses.dataclass(frozen=True)
class Movement:
    """What a skill says where it has been asked already.

    Attributes:
        theta: Parameters of the movement (F,).
    """

    theta: np.ndarray

    def predict(self, tau: np.ndarray) -> np.ndarray:
        """θ (N, F) for τ (N, d), the same for all."""
        return np.tile(np.asarray(self.theta, dtype=float), (len(tau), 1))


def run_trial(
    spec: Spec, runners: Mapping[str, TrialRunner] | None = None
) -> TrialResult:
    """Runs one spec in this process.

    Args:
        spec: What to run.
        runners: Runners to use instead of this process's own, by scenario,
            e.g. ones that show the trials in Meshcat.

    Raises:
        InputError: If there is no such kind of trial.
    """
    kinds: dict[str, Callable[[TrialRunner, Spec], TrialResult]] = {
        "demonstration": _run_demonstration,
        "drumming": _run_drumming,
        "look": _run_look,
        "strike": _run_strike,
        "hand_look": _run_hand_look,
        "ellipse_look": _run_ellipse_look,
        "watched": run_watched,
    }
    kind = spec["kind"]
    if kind not in kinds:
        raise InputError(f"no kind of trial is called {kind!r}")
    entry = spec["scenario"]
    given = {scenario_source(k): v for k, v in (runners or {}).items()}
    trials = given.get(entry[NAME]) or runner_of(entry)
    mirror = spec.get("mirror")
    trials.place_mirror(None if mirror is None else FramePose(**mirror))
    return kinds[kind](trials, spec)


def run_task(
    spec: Spec, runners: Mapping[str, TrialRunner] | None = None
) -> Result:
    """Runs one spec; gives its result as the store keeps it."""
    return pack(run_trial(spec, runners))


def run_trials(
    executor: TrialExecutor,
    label: str,
    specs: Mapping[Key, Spec],
    on_result: Callable[[Key, Any], None] | None = None,
) -> dict[Key, Any]:
    """Runs specs on the executor's workers; gives typed results by key.

    Args:
        executor: Executor of the study.
        label: Name of this phase of the study.
        specs: What to run.
        on_result: Called with each result as soon as it is there.
    """

    def typed(key: Key, result: Result) -> Any:
        spec = specs[key]
        return unpack(spec["kind"], *result, executor.where(spec))

    def report(key: Key, result: Result) -> None:
        if on_result is not None:
            on_result(key, typed(key, result))

    found = executor.run(label, specs, report)
    return {key: typed(key, result) for key, result in found.items()}


def replay_seed(seed: int, attempt: int) -> int:
    """Seed of the noise of a demonstration's replay number 0, 1, ..."""
    return seed + _REPLAY_SEED_STEP * (attempt + 1)


def demonstrate(
    trials: TrialRunner,
    xy: np.ndarray,
    seed: int,
    guide: Callable[[int], GuidedMovement],
    try_again: Callable[[int, float], bool],
) -> DemonstrationResult:
    """One demonstration: gaze, then a teacher, until the replay sounds.

    Args:
        trials: Runner of the scenario.
        xy: Position of the drum (2,), m.
        seed: Seed of the noise.
        guide: The teacher: gives the movement of attempt 0, 1, ...
        try_again: Whether to repeat the movement after so many attempts, the
            last with that reward.
    """
    gaze = trials.gaze(xy, seed)
    empty = np.zeros((0, 0))
    result = DemonstrationResult(
        xy=np.asarray(xy).tolist(),
        found=gaze.found,
        tau=gaze.task_parameter.tolist(),
        attempts=0,
        success=False,
        reward=0.0,
        max_pull=0.0,
        theta=np.zeros(0),
        q=empty,
        prototype=empty,
    )
    # What is not valid teaches nothing.
    if not gaze.found or not trials.verdict.valid:
        return result
    prototypes = trials.tap_prototypes()
    while not result.success:
        attempt = result.attempts
        movement = guide(attempt)
        # The robot's own replay decides.
        recording = trials.strike(
            xy, movement.theta, replay_seed(seed, attempt)
        )
        value = trials.reward(recording, prototypes)
        result = dataclasses.replace(
            result,
            attempts=attempt + 1,
            success=bool(value > trials.reward_config.threshold)
            and trials.verdict.valid,
            max_pull=max(result.max_pull, movement.max_pull),
        )
        if value > result.reward or attempt == 0:
            result = dataclasses.replace(
                result,
                reward=value,
                theta=movement.theta,
                q=movement.q,
                prototype=trials.prototype(recording),
            )
        if not result.success and not try_again(attempt + 1, value):
            break
    return result


def _run_demonstration(trials: TrialRunner, spec: Spec) -> DemonstrationResult:
    xy, seed = np.array(spec["xy"]), spec["seed"]
    limit = trials.scenario.teaching.max_attempts
    return demonstrate(
        trials,
        xy,
        seed,
        lambda attempt: trials.teach(xy, seed, attempt, spec["variability"]),
        lambda attempts, reward: attempts < limit,
    )


def _run_drumming(trials: TrialRunner, spec: Spec) -> DrummingResult:
    gaze, recording = trials.drum(
        np.array(spec["xy"]), spec["regressor"], spec["seed"]
    )
    contact = {"max_force": 0.0, "impulse": 0.0}
    value = 0.0
    verdict = trials.verdict
    if recording is not None:
        contact = _contact(recording)
        value = trials.reward(recording, spec["prototypes"])
        heard = bool(value > trials.reward_config.threshold)
        verdict = trials.check_stroke(gaze, recording, heard)
    return DrummingResult(
        found=gaze.found,
        tau=gaze.task_parameter.tolist(),
        reward=value,
        success=bool(value > trials.reward_config.threshold) and verdict.valid,
        **contact,
        invalid=verdict.reason,
    )


def _run_look(trials: TrialRunner, spec: Spec) -> GazeResult:
    gaze = trials.look(np.array(spec["xy"]), spec["seed"])
    return GazeResult(gaze.found, gaze.task_parameter.tolist(), gaze.duration)


def _run_strike(trials: TrialRunner, spec: Spec) -> StrikeResult:
    xy = np.array(spec["xy"])
    gaze, recording = trials.drum(xy, Movement(spec["theta"]), spec["seed"])
    if recording is None and not trials.verdict.valid:
        nothing = np.zeros(0, dtype=np.float32)
        reason = trials.verdict.reason
        return StrikeResult(0.0, False, 0.0, 0.0, 0.0, False, nothing, reason)
    if recording is None:
        raise InputError(
            f"the drum at {xy.round(3).tolist()} is not found, so there is no "
            "strike at it"
        )
    trace = reward_over_time(trials.spectrogram(recording), spec["prototypes"])
    value = trials.reward(recording, spec["prototypes"])
    landing = trials.landing(recording)
    heard = bool(value > trials.reward_config.threshold)
    verdict = trials.check_stroke(gaze, recording, heard)
    return StrikeResult(
        reward=value,
        success=heard and verdict.valid,
        **_contact(recording),
        landing=landing.distance,
        graze=landing.graze,
        reward_over_time=trace.astype(np.float32),
        invalid=verdict.reason,
    )


def _run_hand_look(trials: TrialRunner, spec: Spec) -> HandLookResult:
    blob = dict(spec["blob"])
    blob["calibration"] = BlobCalibration(**blob["calibration"])
    return look_at_hand(
        trials,
        np.array(spec["xy"]),
        spec["seed"],
        np.array(spec["posture"]),
        BlobConfig(**blob),
    )


def _run_ellipse_look(trials: TrialRunner, spec: Spec) -> EllipseLookResult:
    return look_at_ellipse(trials, np.array(spec["xy"]), spec["seed"])


def _contact(recording: Recording) -> dict[str, float]:
    """What happened, to compare the reward with: it does not know of it."""
    return {
        "max_force": float(recording.contact_force[:, 0].max()),
        "impulse": recording.impulse,
    }


def trial_seed(*numbers: int) -> int:
    """A seed that belongs to the given numbers alone.

    More repeats or positions leave the seeds of the others as they are.
    """
    return int(np.random.SeedSequence(numbers).generate_state(1)[0] >> 1)


def draw_positions(
    scenario: Scenario,
    count: int,
    rng: np.random.Generator,
    workspace: float = 1.0,
) -> np.ndarray:
    """Positions of the drum (count, 2), spread over the scenario's region, m.

    A scrambled Sobol sequence: random, but without gaps or clusters.

    Args:
        scenario: Scenario with the region.
        count: Number of positions.
        rng: Source of randomness.
        workspace: Share of the region's length and width, about its center,
            that is used.
    """
    region = scenario.drum_region
    corners = region.middle + workspace * (region.corners - region.middle)
    return spread_inside(corners, count, rng)
