"""Faults of the robot and its surroundings, and who notices them."""

from typing import TYPE_CHECKING

from drake_affetto.common.lazy import attach

if TYPE_CHECKING:
    from drake_affetto.faults.camera_faults import CameraFaults
    from drake_affetto.faults.command_link import CommandLink
    from drake_affetto.faults.config import KINDS, Fault
    from drake_affetto.faults.fault_source import FaultSource
    from drake_affetto.faults.schedule import FaultSchedule
    from drake_affetto.faults.supervision import SupervisorParameters
    from drake_affetto.faults.supervisor import Supervisor, Verdict

__getattr__, __dir__, __all__ = attach(
    __name__,
    {
        "KINDS": "config",
        "CameraFaults": "camera_faults",
        "CommandLink": "command_link",
        "Fault": "config",
        "FaultSchedule": "schedule",
        "FaultSource": "fault_source",
        "Supervisor": "supervisor",
        "SupervisorParameters": "supervision",
        "Verdict": "supervisor",
    },
)
