"""The time series of a stored trial, by running it again.

The store keeps what determines a trial and its result, not its signals: these
come back exactly from the same trial in the same scenario.
"""

import dataclasses
from pathlib import Path
from typing import Any

import numpy as np

from drake_affetto.common.errors import InputError
from drake_affetto.common.output import atomic_path
from drake_affetto.common.typing import Array
from drake_affetto.experiments.episode import TrialRunner
from drake_affetto.experiments.recordings import Recording
from drake_affetto.experiments.results.trial import TrialResult
from drake_affetto.experiments.tables import open_store
from drake_affetto.experiments.trials import (
    Movement,
    check_entry,
    replay_seed,
    run_trial,
    runner_of,
)
from drake_affetto.experiments.watched import record_watched
from drake_affetto.runner.executor import Spec


@dataclasses.dataclass(frozen=True)
class Signals:
    """The time series of one trial; arrays and their units.

    Attributes:
        key: Key of the trial.
        joint_names: Names of the n joints.
        t: Times of the joints' signals since the movement's start (S,), s.
        q: Joint angles (S, n), rad.
        v: Joint speeds q̇ (S, n), rad/s.
        q_desired: Desired angles (S, n), rad.
        v_desired: Desired speeds (S, n), rad/s.
        chamber_pressure: Absolute pressures (S, 2n), Pa: [p_a; p_b].
        valve_opening: Commands to the valves (S, n), -1 to 1.
        t_contact: Times of the contact's signals (T,), s.
        force: Force on the drum's head (T,), N.
        radius: Distance of the contact from the head's center (T,), m.
        knock_force: Forces on shell and table (T, 2), N.
        sound: Sound pressure at the microphone (samples,), Pa, from time 0 on.
        sound_rate: Sampling rate of the sound, 1/s.
    """

    key: str
    joint_names: tuple[str, ...]
    t: Array
    q: Array
    v: Array
    q_desired: Array
    v_desired: Array
    chamber_pressure: Array
    valve_opening: Array
    t_contact: Array
    force: Array
    radius: Array
    knock_force: Array
    sound: Array
    sound_rate: float

    def save(self, path: str | Path) -> None:
        """Writes the fields to a .mat file (MATLAB, Octave) or to an .npz.

        Raises:
            InputError: If the name ends otherwise, or it cannot be written.
        """
        path = check_suffix(path)
        fields = vars(self)
        with atomic_path(path) as fresh:
            if path.suffix == ".npz":
                np.savez_compressed(fresh, **fields)
                return
            from scipy.io import savemat

            names = np.array(self.joint_names, dtype=object)
            savemat(
                fresh,
                {**fields, "joint_names": names},
                do_compression=True,
                oned_as="column",
            )


def check_suffix(path: str | Path) -> Path:
    """Returns a path for signals; raises InputError for another kind."""
    path = Path(path)
    if path.suffix not in (".mat", ".npz"):
        raise InputError(
            f"signals is {str(path)!r}, expected a file that ends in .mat or "
            ".npz"
        )
    return path


def read_spec(folder: str | Path, key: str) -> tuple[str, Spec]:
    """The whole key of a stored trial, and what determines it.

    Args:
        folder: Folder of a study.
        key: The trial's key in the table of `read_trials`, or its beginning.

    Raises:
        InputError: If there is no such trial, an input of it is not kept, or
            its scenario is another one by now.
    """
    with open_store(folder) as store:
        whole, spec = store.spec(key)
    if not isinstance(spec.get("scenario"), dict):
        raise InputError(f"trial {key} is no trial on the station")
    check_entry(spec["scenario"])
    return whole, spec


def run_again(folder: str | Path, key: str) -> TrialResult:
    """Runs a stored trial again; gives the same result on the same machine.

    Args:
        folder: Folder of the study.
        key: Key of the trial, or how it begins.

    Raises:
        InputError: As `read_spec`.
    """
    return run_trial(read_spec(folder, key)[1])


def read_signals(folder: str | Path, key: str) -> Signals:
    """The time series of a stored trial, by running it again.

    Those of a demonstration are its replay's, which was heard.

    Args:
        folder: Folder of a study.
        key: The trial's key in the table of `read_trials`, or its beginning.

    Raises:
        InputError: As `read_spec`, or if nothing was moved in that trial.
    """
    whole, spec = read_spec(folder, key)
    trials = runner_of(spec["scenario"])
    recording = _record(trials, spec)
    if recording is None:
        raise InputError(
            f"trial {key} ({spec['kind']}) has no signals: no movement in it"
        )
    n = trials.station.num_joints
    return Signals(
        key=whole,
        joint_names=trials.station.joints.names,
        t=recording.joint_t,
        q=recording.joint_state[:, :n],
        v=recording.joint_state[:, n:],
        q_desired=recording.desired_state[:, :n],
        v_desired=recording.desired_state[:, n:],
        chamber_pressure=recording.chamber_pressure,
        valve_opening=recording.valve_opening,
        t_contact=recording.t,
        force=recording.contact_force[:, 0],
        radius=recording.contact_force[:, 1],
        knock_force=recording.knock_force,
        sound=recording.sound,
        sound_rate=recording.sound_rate,
    )


def _record(trials: TrialRunner, spec: Spec) -> Recording | None:
    kind, seed = spec["kind"], spec["seed"]
    xy = np.array(spec["xy"])
    if kind == "strike":
        return trials.drum(xy, Movement(spec["theta"]), seed)[1]
    if kind == "watched":
        return record_watched(trials, spec)[1]
    if kind == "demonstration":
        done: Any = run_trial(spec)
        if done.success:
            # The last replay is the one that was heard.
            last = replay_seed(seed, done.attempts - 1)
            return trials.strike(xy, done.theta, last)
    return None
