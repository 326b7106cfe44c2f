"""Demonstrations at many positions, kept in one file.

The file is the record: a session that is opened again with the same file goes
on after the demonstrations that it holds.
"""

from pathlib import Path

import numpy as np

from drake_affetto import __version__
from drake_affetto.common.errors import InputError, require
from drake_affetto.common.output import prepare_output
from drake_affetto.experiments.plans import TeachPlan
from drake_affetto.experiments.results import DemonstrationResult
from drake_affetto.experiments.trials import draw_positions
from drake_affetto.station.scenario import load_scenario
from drake_affetto.teaching.demonstrations import (
    Demonstration,
    append_demonstration,
    read_demonstrations,
)

# Seeds of the positions of one session: from seed * _SEEDS on.
_SEEDS = 100_000


class TeachingSession:
    """The positions to be taught, and the file of demonstrations.

    Attributes:
        scenario_name: Name or file of the scenario.
        scenario: Scenario as loaded.
        positions: Positions of the drum (N, 2), m.
        path: File of demonstrations.
        taught: Demonstrations in the file, by number of the position.
    """

    def __init__(self, plan: TeachPlan, path: str | Path) -> None:
        """Draws the positions and reads the file, if there is one.

        Args:
            plan: Scenario, number of positions and seed. The first positions
                are the same for any number.
            path: File of demonstrations.

        Raises:
            InputError: If the scenario or the file does not fit.
        """
        self.path = Path(path).expanduser()
        require(bool(str(path)), "--out", path, "the name of a file")
        require(not self.path.is_dir(), "--out", path, "a file, not a folder")
        self.scenario_name = plan.scenario
        self.scenario = load_scenario(plan.scenario)
        for field, value in (
            ("motion_source", "skill"),
            ("valve_source", "pidf"),
        ):
            require(
                getattr(self.scenario, field) == value,
                f"{plan.scenario}.{field}",
                getattr(self.scenario, field),
                f"{value!r} for the robot to be taught",
            )
        prepare_output(self.path.parent)
        self._seed = plan.seed
        self.taught: dict[int, Demonstration] = {}
        there = read_demonstrations(self.path) if self.path.exists() else []
        numbers = [self._number(each) for each in there]
        drawn = draw_positions(
            self.scenario,
            max(plan.demonstrations, 1 + max(numbers, default=0)),
            np.random.default_rng([plan.seed, 0x7EAC]),
        )
        for i, each in zip(numbers, there, strict=True):
            if each.drum_xy is None or np.any(each.drum_xy != drawn[i]):
                raise InputError(
                    f"{self.path} holds demonstrations at other positions than "
                    "this scenario has; name another file"
                )
            self.taught[i] = each
        self.positions = drawn[: plan.demonstrations]

    def seed(self, i: int) -> int:
        """Seed of all that is random at the position number `i`."""
        return self._seed * _SEEDS + i

    def _number(self, demonstration: Demonstration) -> int:
        """Number of the position of a demonstration in the file."""
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
        """Numbers of the positions without a demonstration in the file."""
        return [i for i in range(len(self.positions)) if i not in self.taught]

    def keep(self, i: int, result: DemonstrationResult, teacher: str) -> None:
        """Adds a successful demonstration at position `i` to the file.

        Args:
            i: Number of the position.
            result: The demonstration.
            teacher: Who taught, "simulated" or "by mouse".

        Raises:
            InputError: If it cannot be written, or something else has been
                added to the file meanwhile.
        """
        teaching = self.scenario.teaching
        # The last sample is that at the end of the demonstration.
        age = np.arange(len(result.q))[::-1] / teaching.recording_rate
        demonstration = Demonstration(
            t=teaching.duration - age,
            q=result.q,
            joint_names=tuple(self.scenario.active_joints),
            drum_xy=self.positions[i],
            seed=self.seed(i),
            attempt=result.attempts - 1,
            theta=result.theta,
            task_parameter=np.array(result.tau),
            reward=result.reward,
            prototype=result.prototype,
            max_pull=result.max_pull,
            teacher=teacher,
            scenario=self.scenario_name,
        )
        count = append_demonstration(self.path, demonstration)
        self.taught[i] = demonstration
        if count != len(self.taught):
            raise InputError(f"another process, too, adds to {self.path}")

    def result(self, i: int) -> DemonstrationResult:
        """The demonstration at position `i` that the file holds."""
        each = self.taught[i]
        return DemonstrationResult(
            xy=self.positions[i].tolist(),
            found=True,
            tau=np.array(each.task_parameter).tolist(),
            attempts=each.attempt + 1,
            success=True,
            reward=each.reward or 0.0,
            max_pull=each.max_pull or 0.0,
            theta=np.array(each.theta),
            q=each.q,
            prototype=np.array(each.prototype),
        )
