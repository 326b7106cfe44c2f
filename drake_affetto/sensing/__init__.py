"""What the robot's own sensors make of its angles and pressures."""

from typing import TYPE_CHECKING

from drake_affetto.common.lazy import attach

if TYPE_CHECKING:
    from drake_affetto.sensing.joint_sensors import JointSensors
    from drake_affetto.sensing.readings import SensorParameters

__getattr__, __dir__, __all__ = attach(
    __name__,
    {
        "JointSensors": "joint_sensors",
        "SensorParameters": "readings",
    },
)
