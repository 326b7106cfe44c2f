"""Valves, chambers and joint friction of the pneumatic actuators.

The system is in `actuation`, its continuous twin in `continuous`; what is
re-exported here needs no Drake.
"""

from drake_affetto.pneumatics.flow import mass_flow_rate
from drake_affetto.pneumatics.parameters import (
    ActuatorClass,
    PneumaticParameters,
    load_parameters,
)

__all__ = [
    "ActuatorClass",
    "PneumaticParameters",
    "load_parameters",
    "mass_flow_rate",
]
