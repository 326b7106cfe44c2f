"""Demonstrations at many positions, kept in one file.

The file is the record: a session that is opened again with the same file goes
on after the demonstrations that it holds.
"""

import dataclasses
from pathlib import Path

import numpy as np

from drake_affetto.common.errors import (
    InputError,
    require,
    require_array,
)
from drake_affetto.common.output import prepare_output
from drake_affetto.experiments.plans import TeachPlan
from drake_affetto.experiments.results import DemonstrationResult
from drake_affetto.experiments.trials import draw_positions
from drake_affetto.station.content import scenario_content
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
        content: What determines its demonstrations.
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
        self.content = scenario_content(plan.scenario)
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
        # An earlier version could put a demonstration in twice.
        self._count = len(there)
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
        expected = {
            "joints": ", ".join(self.scenario.active_joints),
            "seed": self._seed,
            "version": self.content.version,
        }
        found = {
            "joints": ", ".join(demonstration.joint_names),
            "seed": None
            if demonstration.seed is None
            else demonstration.seed // _SEEDS,
            "version": demonstration.version,
        }
        if not demonstration.content:
            # Of version 0.1.0: these tell a little of what made it.
            expected["scenario"] = self.scenario_name
            found["scenario"] = demonstration.scenario
            expected["length"] = self._theta_size
            theta = demonstration.theta
            found["length"] = 0 if theta is None else theta.size
        for what in expected:
            if found[what] != expected[what]:
                raise InputError(
                    f"{self.path} holds demonstrations of {what} "
                    f"{found[what]}, not {expected[what]}; name another file"
                )
        if demonstration.content:
            changed = self.content.changed(demonstration.content)
            if changed:
                raise InputError(
                    f"{self.path} holds demonstrations of another scenario "
                    f"than {self.scenario_name} is now: other "
                    f"{', '.join(changed)}; name another file"
                )
        for field, shape in (
            ("theta", (self._theta_size,)),
            ("task_parameter", (2,)),
            ("prototype", (None, None)),
        ):
            require_array(
                f"{self.path}: {field} of the demonstration with seed "
                f"{demonstration.seed}",
                getattr(demonstration, field),
                shape,
            )
        assert demonstration.seed is not None
        return demonstration.seed % _SEEDS

    @property
    def _theta_size(self) -> int:
        return self.scenario.dmp.n_basis * len(self.scenario.active_joints)

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
                added to the file meanwhile. Then it is not added.
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
            content=dataclasses.asdict(self.content),
        )
        self._count = append_demonstration(
            self.path, demonstration, self._count
        )
        self.taught[i] = demonstration

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
