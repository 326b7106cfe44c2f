"""Valves, chambers and joint friction of the pneumatic actuators."""

from typing import TYPE_CHECKING

from drake_affetto.common.lazy import attach

if TYPE_CHECKING:
    from drake_affetto.pneumatics.actuation import (
        PneumaticActuation,
        PneumaticActuationConfig,
    )
    from drake_affetto.pneumatics.continuous import (
        ContinuousPneumaticActuation,
        ContinuousPneumaticActuation_,
    )
    from drake_affetto.pneumatics.driver import (
        AddPneumaticDriver,
        ApplyPneumaticDriver,
        PneumaticDriver,
        PneumaticSystems,
    )
    from drake_affetto.pneumatics.equilibrium import (
        opening_for_torque,
        pressures_for_torque,
    )
    from drake_affetto.pneumatics.flow import mass_flow_rate
    from drake_affetto.pneumatics.parameters import (
        ActuatorClass,
        JointActuator,
        PneumaticParameters,
        load_parameters,
        resting_pressure,
    )
    from drake_affetto.pneumatics.variation import ActuatorVariation

__getattr__, __dir__, __all__ = attach(
    __name__,
    {
        "ActuatorClass": "parameters",
        "ActuatorVariation": "variation",
        "AddPneumaticDriver": "driver",
        "ApplyPneumaticDriver": "driver",
        "ContinuousPneumaticActuation": "continuous",
        "ContinuousPneumaticActuation_": "continuous",
        "JointActuator": "parameters",
        "PneumaticActuation": "actuation",
        "PneumaticActuationConfig": "actuation",
        "PneumaticDriver": "driver",
        "PneumaticParameters": "parameters",
        "PneumaticSystems": "driver",
        "load_parameters": "parameters",
        "resting_pressure": "parameters",
        "mass_flow_rate": "flow",
        "opening_for_torque": "equilibrium",
        "pressures_for_torque": "equilibrium",
    },
)
