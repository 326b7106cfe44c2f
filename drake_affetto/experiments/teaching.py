"""`affetto teach`: demonstrations by hand, into a file.

A simulated teacher leads the robot's hand to the drum at many places, or a
person does with the mouse. A demonstration counts if the robot's own replay
makes the drum sound. The file is the record: started again with the same
file, the command goes on after what is there.
"""

from collections.abc import Mapping
import dataclasses
from pathlib import Path
from typing import Any

import numpy as np

from drake_affetto import __version__
from drake_affetto.common.errors import InputError, require
from drake_affetto.common.output import prepare_output
from drake_affetto.runner.executor import Result
from drake_affetto.runner.store import TrialStore
from drake_affetto.teaching.demonstrations import (
    Demonstration,
    append_demonstration,
    read_demonstrations,
)

# Seeds of the positions of one run: from seed * _SEEDS on.
_SEEDS = 100_000


@dataclasses.dataclass
class Taught:
    """What came of teaching at one place.

    Attributes:
        xy: (2,) where the drum stood, m.
        found: whether the robot saw it.
        attempts: how often it was shown.
        success: whether the robot's replay sounded.
        reward: of the best replay.
        max_pull: greatest force of the teacher, N.
    """

    xy: np.ndarray
    found: bool
    attempts: int
    success: bool
    reward: float
    max_pull: float


class Course:
    """The places to be taught at, and the file of what has been taught.

    Attributes:
        scenario_name: its name, or its file.
        scenario: as loaded.
        positions: (N, 2) places of the drum, m.
        path: the file.
        taught: the demonstrations that it holds, by their position's number.
    """

    def __init__(
        self, scenario: str, count: int, seed: int, path: str | Path
    ) -> None:
        """Draws the places and reads the file, if there is one.

        Args:
            scenario: name, or file.
            count: how many places.
            seed: of the places and of all that differs between lessons. The
                first places are the same for any count.
            path: the file.

        Raises:
            InputError: if the scenario or the file does not fit.
        """
        from drake_affetto.experiments.trials import draw_positions
        from drake_affetto.station.scenario import load_scenario

        self.path = Path(path).expanduser()
        require(bool(str(path)), "--out", path, "the name of a file")
        require(not self.path.is_dir(), "--out", path, "a file, not a folder")
        self.scenario_name = scenario
        self.scenario = load_scenario(scenario)
        for field, value in (
            ("motion_source", "skill"),
            ("valve_source", "pidf"),
        ):
            require(
                getattr(self.scenario, field) == value,
                f"{scenario}.{field}",
                getattr(self.scenario, field),
                f"{value!r} for the robot to be taught",
            )
        prepare_output(self.path.parent)
        self._seed = seed
        self.taught: dict[int, Demonstration] = {}
        there = read_demonstrations(self.path) if self.path.exists() else []
        numbers = [self._number(each) for each in there]
        drawn = draw_positions(
            self.scenario,
            max(count, 1 + max(numbers, default=0)),
            np.random.default_rng([seed, 0x7EAC]),
        )
        for i, each in zip(numbers, there, strict=True):
            if each.drum_xy is None or np.any(each.drum_xy != drawn[i]):
                raise InputError(
                    f"{self.path} holds demonstrations at other places than "
                    "this scenario has; name another file"
                )
            self.taught[i] = each
        self.positions = drawn[:count]

    def seed(self, i: int) -> int:
        """Seed of all that is random at the place number `i`."""
        return self._seed * _SEEDS + i

    def _number(self, demonstration: Demonstration) -> int:
        """Which position a demonstration of the file belongs to."""
        for what, found, expected in (
            ("scenario", demonstration.scenario, self.scenario_name),
            ("version", demonstration.version, __version__),
            (
                "seed",
                None
                if demonstration.seed is None
                else demonstration.seed // _SEEDS,
                self._seed,
            ),
        ):
            if found != expected:
                raise InputError(
                    f"{self.path} holds demonstrations of {what} {found}, not "
                    f"{expected}; name another file"
                )
        assert demonstration.seed is not None
        return demonstration.seed % _SEEDS

    @property
    def missing(self) -> list[int]:
        """Numbers of the positions of which the file has nothing."""
        return [i for i in range(len(self.positions)) if i not in self.taught]

    def keep(self, i: int, demonstration: Demonstration) -> None:
        """Adds the demonstration at position `i` to the file.

        Raises:
            InputError: if it cannot be written, or something else has been
                added to the file meanwhile.
        """
        count = append_demonstration(self.path, demonstration)
        self.taught[i] = demonstration
        if count != len(self.taught):
            raise InputError(f"somebody else, too, adds to {self.path}")

    def outcome(self, i: int) -> Taught:
        """What came of position `i`, of which the file has a demonstration."""
        each = self.taught[i]
        return Taught(
            xy=self.positions[i],
            found=True,
            attempts=each.attempt + 1,
            success=True,
            reward=each.reward or 0.0,
            max_pull=each.max_pull or 0.0,
        )


def teach(
    course: Course, *, workers: int = 2, console: Any = None
) -> list[Taught]:
    """Lets a simulated teacher teach at all places that are still missing.

    Demonstrations are added to the file in the order of the places, each as
    soon as those before it are finished. What is finished but not in the file
    (because one before it is not, or because it never made a sound) waits in
    a store beside it, which goes when all is in the file.

    Args:
        workers: worker processes; 0 for this one.
        console: a rich console to show progress on; None for silence.

    Returns:
        What came of each place.
    """
    if console is not None and course.taught:
        console.print(f"{len(course.taught)} are in {course.path} already")
    outcomes = (
        _teach_missing(course, workers, console) if course.missing else {}
    )
    return [
        outcomes[i] if i in outcomes else course.outcome(i)
        for i in range(len(course.positions))
    ]


def _teach_missing(
    course: Course, workers: int, console: Any
) -> dict[int, Taught]:
    from drake_affetto.experiments.trials import demonstration, run_task
    from drake_affetto.runner.executor import TrialExecutor

    specs = {
        i: demonstration(
            course.scenario_name,
            course.positions[i].tolist(),
            course.seed(i),
        )
        for i in course.missing
    }
    path = course.path.with_name(f"{course.path.name}.trials.sqlite")
    outcomes: dict[int, Taught] = {}
    finished: dict[int, Result] = {}
    with TrialStore(path) as store:

        def keep_finished(number: int, outcome: Result) -> None:
            """Adds to the file what no earlier position holds back."""
            finished[number] = outcome
            for i in specs:
                if i in outcomes:
                    continue
                if i not in finished:
                    return
                result, arrays = finished.pop(i)
                if result["success"]:
                    course.keep(i, _demonstration(course, i, result, arrays))
                outcomes[i] = Taught(
                    course.positions[i],
                    **{
                        field.name: result[field.name]
                        for field in dataclasses.fields(Taught)
                        if field.name != "xy"
                    },
                )

        with TrialExecutor(
            run_task, store, workers=workers, quiet=console is None
        ) as executor:
            executor.run("Teaching by hand", specs, keep_finished)
    if not course.missing:
        for old in (path, *(Path(f"{path}{s}") for s in ("-wal", "-shm"))):
            old.unlink(missing_ok=True)
    return outcomes


def _demonstration(
    course: Course,
    i: int,
    result: Mapping[str, Any],
    arrays: Mapping[str, np.ndarray],
) -> Demonstration:
    teaching = course.scenario.teaching
    q = arrays["q"]
    # The last sample is that at the end of the demonstration.
    t = teaching.duration - np.arange(len(q))[::-1] / teaching.recording_rate
    return Demonstration(
        t=t,
        q=q,
        joint_names=tuple(course.scenario.active_joints),
        drum_xy=course.positions[i],
        seed=course.seed(i),
        attempt=result["attempts"] - 1,
        theta=arrays["theta"],
        task_parameter=np.array(result["tau"]),
        reward=result["reward"],
        prototype=arrays["prototype"],
        max_pull=result["max_pull"],
        teacher="simulated",
        scenario=course.scenario_name,
    )
