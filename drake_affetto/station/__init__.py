"""The one Diagram that wires all systems, and the scenario it is built from."""

from typing import TYPE_CHECKING

from drake_affetto.common.lazy import attach

if TYPE_CHECKING:
    from drake_affetto.station.diagram_drawing import (
        graphviz_source,
        write_diagram,
    )
    from drake_affetto.station.scenario import (
        DrumRegion,
        LookConfig,
        Scenario,
        SkillConfig,
        TransferConfig,
        load_scenario,
        scenario_names,
    )
    from drake_affetto.station.station import AffettoStation

__getattr__, __dir__, __all__ = attach(
    __name__,
    {
        "AffettoStation": "station",
        "DrumRegion": "scenario",
        "LookConfig": "scenario",
        "Scenario": "scenario",
        "SkillConfig": "scenario",
        "TransferConfig": "scenario",
        "graphviz_source": "diagram_drawing",
        "load_scenario": "scenario",
        "scenario_names": "scenario",
        "write_diagram": "diagram_drawing",
    },
)
