"""The drumming child robot Affetto as a Drake systems-framework model."""

from typing import TYPE_CHECKING

from drake_affetto.common.lazy import attach

if TYPE_CHECKING:
    from drake_affetto.station.scenario import Scenario, load_scenario
    from drake_affetto.station.station import AffettoStation

__version__ = "0.2.0"

__getattr__, __dir__, __all__ = attach(
    __name__,
    {
        "AffettoStation": "station.station",
        "Scenario": "station.scenario",
        "load_scenario": "station.scenario",
    },
)
