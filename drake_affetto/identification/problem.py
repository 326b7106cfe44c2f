"""The identification problem of one joint: what is known, what is fitted."""

import dataclasses
import math

from drake_affetto.common.typing import Array
from drake_affetto.pneumatics.parameters import (
    ActuatorClass,
    JointActuator,
    PneumaticParameters,
)
from drake_affetto.robot.controller import RobotController, RobotJoint


@dataclasses.dataclass(frozen=True)
class FitParameter:
    """One fitted number.

    Attributes:
        name: Name: a field of `ActuatorClass`, or one of the joint or log.
        unit: SI unit.
        lower: Lower bound.
        upper: Upper bound.
        start: Value at which the fit begins.
        logarithmic: Whether the scale is logarithmic.
    """

    name: str
    unit: str
    lower: float
    upper: float
    start: float
    logarithmic: bool = True

    def encode(self, value: float) -> float:
        """Maps `value` to [0, 1], the fraction between the bounds."""
        if self.logarithmic:
            span = math.log(self.upper / self.lower)
            return math.log(value / self.lower) / span
        return (value - self.lower) / (self.upper - self.lower)

    def decode(self, fraction: float) -> float:
        """The inverse of `encode`, limited to the bounds.

        Args:
            fraction: Place between the bounds, in [0, 1].
        """
        fraction = min(max(fraction, 0.0), 1.0)
        if self.logarithmic:
            return self.lower * (self.upper / self.lower) ** fraction
        return self.lower + fraction * (self.upper - self.lower)

    def slope(self, fraction: float) -> float:
        """The derivative of `decode`.

        Args:
            fraction: Place between the bounds, in [0, 1].
        """
        if self.logarithmic:
            return self.decode(fraction) * math.log(self.upper / self.lower)
        return self.upper - self.lower


@dataclasses.dataclass(frozen=True)
class JointProblem:
    """What is fixed while a joint is identified.

    Attributes:
        joint: The joint in the robot's own controller.
        controller: The robot's own controller.
        supply: Parameters of the air supply; its actuators are not used.
        actuator: The joint's actuator before the fit. Its torque constant is
            not fitted: pressures and angles determine volumes, flows, torques
            and the inertia only in proportion to it.
    """

    joint: RobotJoint
    controller: RobotController
    supply: PneumaticParameters
    actuator: ActuatorClass

    @property
    def angle_range(self) -> float:
        """Angle of the joint's whole range, rad."""
        return math.radians(self.joint.range_degrees)

    def parameters(self) -> list[FitParameter]:
        """The fitted parameters, with bounds in proportion to the actuator."""
        K = self.actuator.torque_constant
        V = self.actuator.dead_volume
        middle = V + 0.5 * K * self.angle_range
        # The conductance that changes a chamber's pressure at a rate of 1/s.
        flow = middle / 1.2e5
        # Torque of 1 kPa; and that of 1 kPa per %/s, or per %/s².
        kPa = 1e3 * K
        rate = 1e3 * K / (0.01 * self.angle_range)
        log, linear = True, False
        # Name; lower bound, upper bound and start as multiples of a scale; the
        # scale and its unit; whether the fit sees logarithms.
        table = (
            ("area_ratio", 0.75, 1.0, 0.95, 1.0, "1", linear),
            ("dead_volume", 0.3, 4.0, 1.0, V, "m³", log),
            ("fill_conductance", 1.5, 20.0, 5.2, flow, "m³/(s Pa)", log),
            ("exhaust_conductance", 0.6, 12.0, 1.9, flow, "m³/(s Pa)", log),
            ("leak_conductance", 0.0, 0.4, 0.1, flow, "m³/(s Pa)", linear),
            ("underlap", -0.05, 0.08, 0.01, 1.0, "1", linear),
            ("valve_lag", 2e-3, 50e-3, 16e-3, 1.0, "s", log),
            ("dead_time", 0.03, 0.17, 0.09, 1.0, "s", linear),
            ("regulator_gain", 3e-6, 60e-6, 9.6e-6, 1.0, "1/Pa", log),
            ("coulomb_torque", 2.0, 60.0, 15.0, kPa, "N m", log),
            ("dwell_torque", 1.0, 120.0, 20.0, kPa, "N m", log),
            ("dwell_travel", 0.5, 30.0, 4.0, 1.0, "rad", log),
            ("bristle_deflection", 5e-4, 2e-2, 2e-3, 1.0, "rad", log),
            ("inertia", 2e-3, 6e-2, 1e-2, rate, "kg m²", log),
            ("viscous_friction", 0.1, 3.0, 0.6, rate, "N m s/rad", log),
            ("load_constant", -80.0, 80.0, 0.0, kPa, "N m", linear),
            ("load_linear", -200.0, 200.0, 30.0, kPa, "N m", linear),
            ("load_quadratic", -200.0, 200.0, 0.0, kPa, "N m", linear),
            ("stop_angle", -10.0, 0.0, -3.0, 1.0, "%", linear),
            ("offset_a", -15.0, 15.0, 0.0, 1.0, "kPa", linear),
            ("offset_b", -15.0, 15.0, 0.0, 1.0, "kPa", linear),
            ("start_share", 0.0, 1.0, 0.3, 1.0, "1", linear),
        )
        return [
            FitParameter(
                name, unit, low * scale, high * scale, start * scale, is_log
            )
            for name, low, high, start, scale, unit, is_log in table
        ]

    def start(self) -> dict[str, float]:
        """The values with which the fit begins, by name."""
        return {p.name: p.start for p in self.parameters()}

    def fitted_actuator(self, values: dict[str, float]) -> ActuatorClass:
        """The actuator class with the fitted `values`."""
        names = {f.name for f in dataclasses.fields(ActuatorClass)}
        chosen = {k: v for k, v in values.items() if k in names}
        coulomb = chosen["coulomb_torque"]
        return dataclasses.replace(
            self.actuator, **chosen, breakaway_torque=coulomb
        )

    def kernel_parameters(self, values: dict[str, float]) -> Array:
        """The (ROWS, 1) parameter array of the compiled kernel.

        Args:
            values: Values by the parameter's name.
        """
        actuator = self.fitted_actuator(values)
        supply = dataclasses.replace(
            self.supply,
            classes={"fitted": actuator},
            joints={"joint": JointActuator(actuator="fitted")},
        )
        return supply.for_joints(["joint"], [0.0], [self.angle_range])
