"""What environments know from a teacher: movements and how they sounded.

The lessons are taught when they are first needed, once on a machine for each
scenario: they stand in a store of trials, keyed by all that determines them, so
that another scenario, model or version is taught anew.
"""

import dataclasses
import os
from pathlib import Path
from typing import Any

import numpy as np

from drake_affetto.common.errors import (
    InputError,
    require,
    require_array,
    require_range,
)
from drake_affetto.common.folder_lock import lock_folder
from drake_affetto.common.output import STORE, prepare_output
from drake_affetto.common.typing import Array
from drake_affetto.experiments.skills import teach_positions
from drake_affetto.experiments.worker import run_task
from drake_affetto.runner.executor import TrialExecutor
from drake_affetto.runner.store import TrialStore
from drake_affetto.station.scenario import Scenario, load_scenario
from drake_affetto.teaching.demonstrations import (
    Demonstration,
    read_demonstrations,
)

# Of the lessons' places and teacher.
_SEED = (0x1E550,)


@dataclasses.dataclass(frozen=True)
class Lessons:
    """Demonstrated movements whose replays made the drum sound.

    Attributes:
        tau: Task parameters (N, 2).
        theta: Movements (N, F).
        q: Joint angles over time (N, T, n), rad, evenly spaced in time.
        prototypes: Sounds of the replays (N, bands, frames).
    """

    tau: Array
    theta: Array
    q: Array
    prototypes: Array


def cache_folder() -> Path:
    """Where lessons are kept: $AFFETTO_CACHE, or the user's cache folder."""
    own = os.environ.get("AFFETTO_CACHE")
    if own:
        return Path(own)
    base = os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache"
    return Path(base) / "drake_affetto"


def load_lessons(scenario: str, lessons: int | str | Path = 16) -> Lessons:
    """The lessons of a scenario.

    Args:
        scenario: Scenario in which is taught, by name or path.
        lessons: How many to take from the cache, taught if they are not there
            yet (a second each); or a file of `affetto teach`.

    Raises:
        InputError: If the file does not serve, or the cache cannot be written.
    """
    if not isinstance(lessons, int):
        return _from_file(lessons, load_scenario(scenario))
    require_range("lessons", lessons, 2, 1000)
    folder = prepare_output(cache_folder())
    # Environments in several processes: one teaches, the others wait.
    with (
        lock_folder(folder, "drake_affetto.envs", wait=True),
        TrialStore(folder / STORE) as store,
        TrialExecutor(run_task, store, workers=0, quiet=True) as executor,
    ):
        taught = teach_positions(executor, "Lessons", scenario, lessons, _SEED)
    return Lessons(
        tau=np.array([each.tau for each in taught]),
        theta=np.array([each.theta for each in taught]),
        q=np.array([each.q for each in taught]),
        prototypes=np.array([each.prototype for each in taught]),
    )


def _from_file(path: str | Path, scenario: Scenario) -> Lessons:
    taught = _once(read_demonstrations(path))
    joints = list(scenario.active_joints)
    size = scenario.dmp.n_basis * len(joints)
    for i, each in enumerate(taught):
        require(
            list(each.joint_names) == joints,
            f"{path}: demonstration {i}: joint_names",
            list(each.joint_names),
            f"the scenario's {', '.join(joints)}",
        )
        for name in ("theta", "task_parameter", "prototype"):
            if getattr(each, name) is None:
                raise InputError(f"{path}: demonstration {i} has no {name}")
        require_array(f"{path}: demonstration {i}: theta", each.theta, (size,))
    require(len(taught) >= 2, str(path), len(taught), "2 lessons or more")
    try:
        return Lessons(
            tau=np.array([each.task_parameter for each in taught], float),
            theta=np.array([each.theta for each in taught], float),
            q=np.array([each.q for each in taught], float),
            prototypes=np.array([each.prototype for each in taught], float),
        )
    except ValueError as error:
        raise InputError(f"{path}: lessons of different sizes") from error


def _once(taught: list[Demonstration]) -> list[Demonstration]:
    """Without what an earlier version may have put into the file twice."""
    found: dict[Any, Demonstration] = {}
    for i, each in enumerate(taught):
        # A log of a robot has no seed.
        same = i if each.seed is None else f"{each.seed} {each.content}"
        found.setdefault(same, each)
    return list(found.values())
