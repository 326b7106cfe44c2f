"""The robots of a study: one throughout, or a body of its own for each repeat.

A body is written as a scenario that extends that of the study, so its trials
can be run again, looked at and changed like those of any other scenario.
"""

from collections.abc import Sequence
import dataclasses
from pathlib import Path

import numpy as np
import yaml

from drake_affetto.common.errors import InputError
from drake_affetto.common.output import write_text_atomic
from drake_affetto.common.yaml_config import load_config
from drake_affetto.station.body import DEFAULT_FILE, Body, BodyRanges
from drake_affetto.station.content import scenario_source
from drake_affetto.station.scenario import load_scenario

# The folder of a study's bodies, beside its results.
_FOLDER = "bodies"


@dataclasses.dataclass(frozen=True)
class Robots:
    """The robots of a study's repeats.

    Attributes:
        bodies: Body of each repeat; none where all have the model's.
        folder: Where the scenarios of the bodies are.
    """

    bodies: Sequence[Body] = ()
    folder: Path | None = None

    def scenario(self, repeat: int, name: str) -> str:
        """The scenario `name` with the robot of a repeat.

        Args:
            repeat: Number of the repeat.
            name: Scenario, by name or path.
        """
        if not self.bodies:
            return name
        assert self.folder is not None
        path = self.folder / f"{Path(name).stem}_{repeat:02d}.yaml"
        text = yaml.safe_dump(
            {
                "extends": scenario_source(name),
                "body": dataclasses.asdict(self.bodies[repeat]),
            },
            sort_keys=False,
        )
        if not path.is_file() or path.read_text(encoding="utf-8") != text:
            write_text_atomic(path, text)
        return str(path)

    def numbers(self) -> list[dict[str, float]]:
        """How each body departs from the model, each number by its name."""
        return [body.numbers() for body in self.bodies]


def draw_robots(
    count: int, scenario: str, seed: Sequence[int], folder: Path | None
) -> Robots:
    """Draws the bodies of a study.

    Args:
        count: Number of bodies; 0 for the model's throughout.
        scenario: Scenario of the study, by name or path.
        seed: Seed of the bodies, as several numbers. More bodies leave the
            others as they are.
        folder: Folder of the study's results.

    Raises:
        InputError: If there is no folder for bodies.
    """
    if count == 0:
        return Robots()
    if folder is None:
        raise InputError("bodies need a folder for their scenarios")
    place = folder / _FOLDER
    place.mkdir(exist_ok=True)
    joints = load_scenario(scenario).active_joints
    ranges = load_config(BodyRanges, DEFAULT_FILE)
    return Robots(
        [
            ranges.draw(joints, np.random.default_rng([*seed, number]))
            for number in range(count)
        ],
        place,
    )
