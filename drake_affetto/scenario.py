"""The typed YAML that a station is built from: its public face."""

from drake_affetto.station.scenario import (
    DrumRegion,
    LookConfig,
    Scenario,
    SkillConfig,
    TransferConfig,
    load_scenario,
    scenario_names,
)

__all__ = [
    "DrumRegion",
    "LookConfig",
    "Scenario",
    "SkillConfig",
    "TransferConfig",
    "load_scenario",
    "scenario_names",
]
