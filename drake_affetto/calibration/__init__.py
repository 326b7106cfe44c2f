"""What the robot works out of a mirror by itself: arrays alone, no Drake.

All that is taken in are readings of joints, pixels, and whether a stroke was
heard: there is no place for where the mirror truly is.
"""

from typing import TYPE_CHECKING

from drake_affetto.common.lazy import attach

if TYPE_CHECKING:
    from drake_affetto.calibration.belief import PlaneBelief
    from drake_affetto.calibration.config import load_self_calibration
    from drake_affetto.calibration.ellipse import (
        EllipseLook,
        estimate_from_ellipses,
    )
    from drake_affetto.calibration.hand import HandLook, estimate_from_hand
    from drake_affetto.calibration.knowledge import (
        KnowledgeErrors,
        RobotKnowledge,
    )
    from drake_affetto.calibration.plane import (
        CalibrationFailure,
        PlaneEstimate,
        PlanePrior,
    )
    from drake_affetto.calibration.postures import HandCalibration
    from drake_affetto.calibration.recheck import HandRecheck
    from drake_affetto.calibration.watch import StrokeWatch

__getattr__, __dir__, __all__ = attach(
    __name__,
    {
        "CalibrationFailure": "plane",
        "EllipseLook": "ellipse",
        "HandCalibration": "postures",
        "HandLook": "hand",
        "HandRecheck": "recheck",
        "KnowledgeErrors": "knowledge",
        "PlaneBelief": "belief",
        "PlaneEstimate": "plane",
        "PlanePrior": "plane",
        "RobotKnowledge": "knowledge",
        "StrokeWatch": "watch",
        "estimate_from_ellipses": "ellipse",
        "estimate_from_hand": "hand",
        "load_self_calibration": "config",
    },
)
