"""Checks of the configurations that a scenario hands on to Drake.

Some values Drake refuses by an exception that does not name the field, and
some by ending the process.
"""

import dataclasses
from typing import Any

from pydrake.multibody.plant import AddMultibodyPlant, MultibodyPlantConfig
from pydrake.systems.analysis import (
    ApplySimulatorConfig,
    Simulator,
    SimulatorConfig,
)
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.primitives import ConstantVectorSource

from drake_affetto.common.errors import (
    InputError,
    one_line,
    require,
    require_range,
)

LONGEST_STEP = 5e-3
"""The longest step of the plant, s. Up to it outcomes are those of a step of
0.25 ms, within the limits of docs/step_convergence.md."""


@dataclasses.dataclass(frozen=True)
class _Range:
    """Least and greatest value of a number that Drake is handed."""

    low: float
    high: float


_PLANT_RANGES = {
    "time_step": _Range(1e-5, LONGEST_STEP),
    "penetration_allowance": _Range(1e-9, 1.0),
    "stiction_tolerance": _Range(1e-9, 10.0),
    "sap_near_rigid_threshold": _Range(0.0, 1e6),
}
_SIMULATOR_RANGES = {
    "max_step_size": _Range(1e-6, 10.0),
    "accuracy": _Range(1e-12, 1.0),
    "target_realtime_rate": _Range(0.0, 1e3),
}


def check_plant_config(config: MultibodyPlantConfig, where: str) -> None:
    """Raises InputError for the first field that Drake would refuse."""
    _check_ranges(config, _PLANT_RANGES, where)
    default = MultibodyPlantConfig(time_step=config.time_step)

    def ask(config: MultibodyPlantConfig) -> None:
        AddMultibodyPlant(config, DiagramBuilder())

    _ask_drake(ask, config, default, where)


def check_simulator_config(config: SimulatorConfig, where: str) -> None:
    """Raises InputError for the first field that Drake would refuse."""
    _check_ranges(config, _SIMULATOR_RANGES, where)
    require(
        config.start_time == 0.0,
        f"{where}.start_time",
        config.start_time,
        "0: a trial begins then",
    )

    def ask(config: SimulatorConfig) -> None:
        ApplySimulatorConfig(config, Simulator(ConstantVectorSource([0.0])))

    _ask_drake(ask, config, SimulatorConfig(), where)


def _check_ranges(config: Any, ranges: dict[str, _Range], where: str) -> None:
    for name, limits in ranges.items():
        value = getattr(config, name)
        require_range(f"{where}.{name}", value, limits.low, limits.high)


def _ask_drake(ask: Any, config: Any, default: Any, where: str) -> None:
    """Raises InputError with Drake's complaint, and the field it is about.

    Args:
        ask: Function that has Drake take a configuration.
        config: What is checked.
        default: A configuration that Drake takes; each field of `config` is
            tried in it to find the one that is refused.
        where: Name of `config` in errors.
    """
    try:
        ask(config)
        return
    except RuntimeError as error:
        # It may repeat a long value.
        reason = one_line(error)[:200]
    for field in type(config).__fields__:
        usual, value = getattr(default, field.name), getattr(config, field.name)
        setattr(default, field.name, value)
        try:
            ask(default)
        except RuntimeError:
            require(
                False,
                f"{where}.{field.name}",
                value,
                f"what Drake takes ({reason})",
            )
        setattr(default, field.name, usual)
    raise InputError(f"{where}: {reason}")
