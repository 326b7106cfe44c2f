"""The one Diagram that wires all systems, and the scenario it is built from."""

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from drake_affetto.station.station import AffettoStation

__all__ = ["AffettoStation"]


def __getattr__(name: str) -> Any:
    if name == "AffettoStation":
        from drake_affetto.station.station import AffettoStation

        return AffettoStation
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
