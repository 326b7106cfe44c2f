"""The plan of a tuning study."""

from collections.abc import Sequence
import dataclasses
from pathlib import Path

from pydrake.multibody.plant import MultibodyPlant

from drake_affetto.common.errors import naming, require
from drake_affetto.control.pidf import (
    load_control,
)
from drake_affetto.scene import world
from drake_affetto.station.scenario import Scenario, load_scenario
from drake_affetto.tuning.config import (
    DEFAULT_FILE,
    START_FILE,
    TuningConfig,
    load_tuning,
)
from drake_affetto.tuning.references import joint_range

GAINS = ("kP", "kI", "kD", "kF")


@dataclasses.dataclass(frozen=True)
class TunePlan:
    """All that determines a tuning study, except its number of trials.

    Attributes:
        joints: Joints whose gains are searched; the others keep those of
            `start`.
        seed: Seed of the search.
        scenario: Name or file of the scenario; that of a robot which repeats
            itself, unless another is asked for.
        start: YAML file of the gains that the search starts from.
        tuning: YAML file of `TuningConfig`.
    """

    joints: tuple[str, ...]
    seed: int = 0
    scenario: str = "easy_drumming"
    start: str = START_FILE
    tuning: str = DEFAULT_FILE


def parameter_names(joints: Sequence[str]) -> list[str]:
    """Names of the search's parameters, joint by joint: the gains' factors."""
    return [f"{joint}.{gain}" for joint in joints for gain in GAINS]


def load_plan(
    joints: Sequence[str] | None,
    *,
    seed: int = 0,
    scenario: str = "easy_drumming",
    start: str = START_FILE,
    tuning: str = DEFAULT_FILE,
) -> TunePlan:
    """Makes a plan and checks it before anything runs.

    Args:
        joints: Active joints of the scenario; None for all of them.
        seed: Seed of the search.
        scenario: Name or file of the scenario; that of a robot which repeats
            itself, unless another is asked for.
        start: YAML file of the gains that the search starts from.
        tuning: YAML file of `TuningConfig`.

    Raises:
        InputError: If joints, files or their values do not fit.
    """
    loaded = load_scenario(scenario)
    require(
        loaded.valve_source == "pidf",
        "scenario.valve_source",
        loaded.valve_source,
        "'pidf', for its gains are tuned",
    )
    active = loaded.active_joints
    chosen = list(active) if joints is None else list(joints)
    require(len(chosen) > 0, "--joints", chosen, "at least one joint")
    for joint in chosen:
        require(
            joint in active,
            "--joints",
            joint,
            f"active joints of {scenario!r}: {', '.join(active)}",
        )
    require(
        len(set(chosen)) == len(chosen), "--joints", chosen, "no joint twice"
    )
    load_control(start).for_joints(active)
    with naming(Path(tuning).name):
        _check_excursions(load_tuning(tuning), loaded)
    return TunePlan(
        joints=tuple(joint for joint in active if joint in chosen),
        seed=seed,
        scenario=scenario,
        start=start,
        tuning=tuning,
    )


def _check_excursions(tuning: TuningConfig, scenario: Scenario) -> None:
    """Raises InputError for excursions that the scenario's joints have not."""
    active = scenario.active_joints
    for name, pair in tuning.excursions.items():
        expected = f"one of the active joints {', '.join(active)}"
        require(name in active, f"excursions.{name}", pair, expected)
    plant = MultibodyPlant(scenario.plant_config.time_step)
    world.add_world(plant, scenario.world)
    start = [world.get_joint(plant, n).get_default_angle() for n in active]
    joint_range(tuning, active, start, *world.joint_limits(plant, active))
