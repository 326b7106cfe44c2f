"""The whole chain with faults, watched by the supervisor.

The robot looks, strikes, listens and looks again, as far as its supervisor lets
it. What really happened is recorded beside, for judging only.
"""

import math
from typing import Any

import numpy as np

from drake_affetto.common.errors import require
from drake_affetto.common.typing import Array
from drake_affetto.experiments.episode import TrialRunner
from drake_affetto.experiments.fault_injection import FaultInjection
from drake_affetto.experiments.recordings import Recording
from drake_affetto.experiments.results.trial import WatchedResult
from drake_affetto.faults.config import Fault

# So long is recorded after a trial has been ended, s: what the arm then does.
_AFTERWARDS = 0.5


def run_watched(trials: TrialRunner, spec: Any) -> WatchedResult:
    """Runs a trial of the kind "watched".

    Raises:
        InputError: If the scenario has no supervisor, or a fault does not fit.
    """
    injection = trials.injection
    require(
        injection is not None and trials.scenario.supervisor.enabled,
        "supervisor.enabled",
        trials.scenario.supervisor.enabled,
        "true, for trials with faults",
    )
    return record_watched(trials, spec)[0]


def record_watched(
    trials: TrialRunner, spec: Any
) -> tuple[WatchedResult, Recording | None]:
    """The same with the recording; None where nothing was struck."""
    injection = trials.injection
    assert injection is not None
    faults = [Fault(**each) for each in spec["faults"]]
    for i, fault in enumerate(faults):
        fault.check(f"faults[{i}]", trials.scenario.active_joints)
    usual, injection.faults = injection.faults, faults
    try:
        return _run(trials, injection, spec)
    finally:
        injection.faults = usual


def _run(
    trials: TrialRunner, injection: FaultInjection, spec: Any
) -> tuple[WatchedResult, Recording | None]:
    xy, seed = np.array(spec["xy"]), spec["seed"]
    gaze = trials.gaze(xy, seed)
    begin = trials.context.get_time() - gaze.duration
    recording = None
    value = 0.0
    start = math.inf
    force, speed = 0.0, 0.0
    if gaze.found and trials.verdict.valid:
        start = trials.await_movement(spec["regressor"])
    if gaze.found and trials.verdict.valid:
        # What was before the movement is forgotten as it begins.
        trials.advance(start)
        force, speed = _greatest(trials)
        recording = trials.record(start, seed)
        value = trials.reward(recording, spec["prototypes"])
    heard = bool(value > trials.reward_config.threshold)
    if recording is not None and trials.verdict.valid:
        injection.afterwards(gaze, recording, heard)
    else:
        trials.advance(trials.context.get_time() + _AFTERWARDS)
    after = _greatest(trials)
    verdict = trials.verdict
    onset = min(
        (fault.span(begin, start)[0] for fault in injection.faults),
        default=math.inf,
    )
    result = WatchedResult(
        found=gaze.found,
        tau=gaze.task_parameter.tolist(),
        reward=value,
        heard=heard,
        invalid=verdict.reason,
        detected_at=verdict.time - begin if not verdict.valid else None,
        onset=onset - begin if math.isfinite(onset) else None,
        movement_at=start - begin if math.isfinite(start) else None,
        max_force=max(force, after[0]),
        impulse=0.0 if recording is None else recording.impulse,
        max_speed=max(speed, after[1]),
        scores=injection.scores.astype(np.float32),
    )
    return result, recording


def _greatest(trials: TrialRunner) -> tuple[float, float]:
    """Greatest force on anything [N] and joint speed [rad/s] of the logs."""

    def most(values: Array) -> float:
        return float(np.abs(values).max(initial=0.0))

    n = trials.station.num_joints
    return (
        max(
            most(trials.log("drum.contact_force")[1][:, 0]),
            most(trials.log("drum.knock_force")[1]),
        ),
        most(trials.log("affetto.joint_state")[1][:, n:]),
    )
