"""The PIDF valve controller."""

from typing import TYPE_CHECKING

from drake_affetto.common.lazy import attach

if TYPE_CHECKING:
    from drake_affetto.control.continuous_pidf import (
        ContinuousPidfController,
        ContinuousPidfController_,
    )
    from drake_affetto.control.pidf import (
        ControlParameters,
        JointGains,
        PidfGains,
        load_control,
        pidf_update,
    )
    from drake_affetto.control.pidf_controller import PidfConfig, PidfController

__getattr__, __dir__, __all__ = attach(
    __name__,
    {
        "ContinuousPidfController": "continuous_pidf",
        "ContinuousPidfController_": "continuous_pidf",
        "ControlParameters": "pidf",
        "JointGains": "pidf",
        "PidfConfig": "pidf_controller",
        "PidfController": "pidf_controller",
        "PidfGains": "pidf",
        "load_control": "pidf",
        "pidf_update": "pidf",
    },
)
