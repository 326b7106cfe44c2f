"""What the actuators are made of: typed configuration to parameter arrays."""

from collections.abc import Sequence
import dataclasses
import math
from pathlib import Path
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from drake_affetto.common.errors import (
    InputError,
    require,
    require_array,
    require_range,
)
from drake_affetto.common.fields import check_ranges, number
from drake_affetto.pneumatics.chamber import (
    ROWS,
    Row,
    chamber_flows,
    opening_fraction,
)

DEFAULT_FILE = "package://drake_affetto/pneumatics.yaml"


@dataclasses.dataclass
class ActuatorClass:
    """One size of cylinder or vane, its two valves, lines and seals.

    Attributes:
        torque_constant: K_a, torque per pressure in chamber a and volume per
            angle, N m/Pa = m³/rad.
        area_ratio: K_b/K_a; below 1 for the rod side of a cylinder.
        dead_volume: of each chamber at the end of its stroke, with line, m³.
        fill_conductance: sonic conductance supply to chamber, m³/(s Pa).
        exhaust_conductance: chamber to atmosphere, m³/(s Pa).
        leak_conductance: chamber to atmosphere past the seals, always open.
        critical_ratio: critical pressure ratio b of all three.
        underlap: opening of both edges of a valve at rest, as a fraction of
            its full stroke. Negative: a dead band of that size.
        valve_lag: time constant of the valve's spool, s.
        dead_time: from command to spool: electronics and line, s.
        regulator_gain: opening per pressure error in regulator mode, 1/Pa.
        coulomb_torque: sliding friction, N m.
        breakaway_torque: greatest friction at rest, N m.
        stribeck_velocity: width of the fall from one to the other, rad/s.
        bristle_deflection: angle by which the joint gives before it breaks
            away, rad.
        bristle_relaxation: damping of the bristles over their stiffness, s.
        dwell_torque: friction that is added after a long rest, N m.
        dwell_travel: angle of travel over which that falls to 1/e, rad.
        dwell_recovery: time in which it returns, s; 0: it does not.
    """

    torque_constant: float = number(5e-6, 0.0, math.inf)
    area_ratio: float = number(0.95, 0.0, math.inf)
    dead_volume: float = number(12e-6, 0.0, math.inf)
    fill_conductance: float = number(0.077e-8, 0.0, math.inf)
    exhaust_conductance: float = number(0.028e-8, 0.0, math.inf)
    leak_conductance: float = number(0.0, 0.0, math.inf)
    critical_ratio: float = number(0.3, 0.0, 0.99)
    underlap: float = number(0.02, -0.9, 0.9)
    valve_lag: float = number(0.016, 0.0, 1.0)
    dead_time: float = number(0.015, 0.0, 1.0)
    regulator_gain: float = number(9.6e-6, 0.0, math.inf)
    coulomb_torque: float = number(0.075, 0.0, math.inf)
    breakaway_torque: float = 0.15
    stribeck_velocity: float = number(0.05, 1e-4, math.inf)
    bristle_deflection: float = number(2e-3, 1e-6, 0.1)
    bristle_relaxation: float = number(2e-3, 0.0, math.inf)
    dwell_torque: float = number(0.0, 0.0, math.inf)
    dwell_travel: float = number(4.0, 1e-3, math.inf)
    dwell_recovery: float = number(0.0, 0.0, math.inf)

    def check(self, where: str) -> None:
        """Raises InputError naming the first field that cannot be."""
        check_ranges(self, where)
        for field in ("torque_constant", "area_ratio", "dead_volume"):
            value = getattr(self, field)
            require(value > 0.0, f"{where}.{field}", value, "a number above 0")
        require_range(
            f"{where}.breakaway_torque",
            self.breakaway_torque,
            self.coulomb_torque,
        )


_CLASS_FIELDS = tuple(f.name for f in dataclasses.fields(ActuatorClass))


@dataclasses.dataclass
class JointActuator:
    """Which actuator class drives a joint, and where the joint differs.

    Attributes:
        actuator: name of the class.
        override: values of `ActuatorClass` fields that hold for this joint
            alone.
    """

    actuator: str = ""
    override: dict[str, float] = dataclasses.field(default_factory=dict)


@dataclasses.dataclass
class PneumaticParameters:
    """The air supply, the actuator classes and the joints they drive.

    Attributes:
        supply_pressure: Pa absolute.
        atmospheric_pressure: Pa absolute.
        temperature: of supply and surroundings, K.
        polytropic_exponent: of the air in the chambers, 1 (isothermal) to 1.4
            (adiabatic).
        classes: actuator classes by name.
        joints: the actuator of each joint by the joint's name.
    """

    supply_pressure: float = 701.3e3
    atmospheric_pressure: float = 101.3e3
    temperature: float = 293.15
    polytropic_exponent: float = 1.2
    classes: dict[str, ActuatorClass] = dataclasses.field(default_factory=dict)
    joints: dict[str, JointActuator] = dataclasses.field(default_factory=dict)

    def check(self, where: str) -> None:
        """Raises InputError naming the first field that cannot be."""
        require_range(
            f"{where}.atmospheric_pressure", self.atmospheric_pressure, 1e4, 2e5
        )
        require_range(
            f"{where}.supply_pressure",
            self.supply_pressure,
            self.atmospheric_pressure,
            2e6,
        )
        require_range(f"{where}.temperature", self.temperature, 200.0, 400.0)
        require_range(
            f"{where}.polytropic_exponent", self.polytropic_exponent, 1.0, 1.4
        )
        for name, actuator in self.classes.items():
            actuator.check(f"{where}.classes.{name}")
        for name, joint in self.joints.items():
            self._resolved(name, joint, f"{where}.joints.{name}")

    def actuator_of(self, name: str) -> ActuatorClass:
        """The actuator of the joint `name`, its overrides applied.

        Raises:
            InputError: for a joint or a class that is not there, or an
                override that does not fit.
        """
        if name not in self.joints:
            known = ", ".join(self.joints) or "none"
            raise InputError(f"no actuator for joint {name!r}; known: {known}")
        return self._resolved(name, self.joints[name], f"joints.{name}")

    def _resolved(
        self, name: str, joint: JointActuator, where: str
    ) -> ActuatorClass:
        require(
            joint.actuator in self.classes,
            f"{where}.actuator",
            joint.actuator,
            f"one of {', '.join(self.classes)}",
        )
        for field in joint.override:
            require(
                field in _CLASS_FIELDS,
                f"{where}.override",
                field,
                f"one of {', '.join(_CLASS_FIELDS)}",
            )
        resolved = dataclasses.replace(
            self.classes[joint.actuator], **joint.override
        )
        resolved.check(where)
        return resolved

    def for_joints(
        self,
        names: Sequence[str],
        q_lower: ArrayLike,
        q_upper: ArrayLike,
    ) -> NDArray[np.float64]:
        """The parameter array of the compiled kernel.

        Args:
            names: joint names (n).
            q_lower: lower limits (n), rad.
            q_upper: upper limits (n), rad.

        Returns:
            (ROWS, n) array, its rows as in `chamber.Row`.

        Raises:
            InputError: for an unknown joint or limits that do not fit.
        """
        n = len(names)
        low, high = np.asarray(q_lower, float), np.asarray(q_upper, float)
        require(
            low.shape == high.shape == (n,),
            "shapes of q_lower and q_upper",
            (low.shape, high.shape),
            f"({n},), a limit for each joint",
        )
        for name, least, greatest in zip(names, low, high, strict=True):
            require(
                -np.inf < least < greatest < np.inf,
                f"range of joint {name}",
                [float(least), float(greatest)],
                "a finite lower and a greater upper limit: the volumes of "
                "the chambers follow from them",
            )
        array = np.empty((ROWS, n))
        for i, name in enumerate(names):
            actuator = self.actuator_of(name)
            array[:, i] = self._column(actuator, low[i], high[i])
        return array

    def _column(
        self, actuator: ActuatorClass, q_lower: float, q_upper: float
    ) -> NDArray[np.float64]:
        stiffness = actuator.breakaway_torque / actuator.bristle_deflection
        values = {
            Row.Q_LOWER: q_lower,
            Row.Q_UPPER: q_upper,
            Row.K_A: actuator.torque_constant,
            Row.K_B: actuator.torque_constant * actuator.area_ratio,
            Row.V_A: actuator.dead_volume,
            Row.V_B: actuator.dead_volume,
            Row.C_FILL: actuator.fill_conductance,
            Row.C_EXHAUST: actuator.exhaust_conductance,
            Row.C_LEAK: actuator.leak_conductance,
            Row.CRITICAL_RATIO: actuator.critical_ratio,
            Row.UNDERLAP: actuator.underlap,
            Row.VALVE_LAG: actuator.valve_lag,
            Row.DEAD_TIME: actuator.dead_time,
            Row.REGULATOR_GAIN: actuator.regulator_gain,
            Row.COULOMB: actuator.coulomb_torque,
            Row.BREAKAWAY: actuator.breakaway_torque,
            Row.STRIBECK_VELOCITY: actuator.stribeck_velocity,
            Row.STIFFNESS: stiffness,
            Row.DAMPING: stiffness * actuator.bristle_relaxation,
            Row.DWELL_TORQUE: actuator.dwell_torque,
            Row.DWELL_TRAVEL: actuator.dwell_travel,
            Row.DWELL_RECOVERY: actuator.dwell_recovery,
            Row.SUPPLY: self.supply_pressure,
            Row.ATMOSPHERE: self.atmospheric_pressure,
            Row.TEMPERATURE: self.temperature,
            Row.EXPONENT: self.polytropic_exponent,
        }
        return np.array([values[row] for row in Row])


def load_parameters(
    source: PneumaticParameters | str | Path = DEFAULT_FILE,
    overlays: Sequence[str | Path] = (),
) -> PneumaticParameters:
    """Reads the actuators' parameters.

    Args:
        source: a YAML file of `PneumaticParameters`, its package:// URI, or
            the parameters themselves.
        overlays: further such files, each holding only what it changes (for
            instance a fit to a robot's logs).

    Raises:
        InputError: for a file or a value that does not fit, by name.
    """
    # Drake's YAML reader is behind this; the mathematics need none of it.
    from drake_affetto.common.yaml_config import load_config

    return load_config(PneumaticParameters, source, overlays)


class Joints(Protocol):
    """Joints by their names, with their limits, for instance a selection of a
    plant's (`scene.JointSelection`)."""

    @property
    def names(self) -> Sequence[str]: ...
    @property
    def lower(self) -> NDArray[np.float64]: ...
    @property
    def upper(self) -> NDArray[np.float64]: ...


def parameter_array(
    parameters: PneumaticParameters | ArrayLike, joints: Joints | None = None
) -> NDArray[np.float64]:
    """The (ROWS, n) array of the kernel, see `chamber.Row`.

    Args:
        parameters: of the actuators of `joints`; or the array itself.
        joints: whose limits the chambers have; not needed for an array.

    Raises:
        InputError: if they do not fit.
    """
    if isinstance(parameters, PneumaticParameters):
        if joints is None:
            raise InputError("joints is None, expected those of the parameters")
        return parameters.for_joints(joints.names, joints.lower, joints.upper)
    array = np.array(parameters, dtype=float)
    require(
        array.ndim == 2 and array.shape[0] == ROWS and array.shape[1] > 0,
        "parameters",
        array.shape,
        f"an array of shape ({ROWS}, n)",
    )
    require(
        not np.isnan(array).any(), "parameters", "an array with NaN", "numbers"
    )
    return array


def resting_pressure(
    parameters: NDArray[np.float64], opening: ArrayLike = 0.0
) -> NDArray[np.float64]:
    """The pressure at which a chamber stays with its valve at rest.

    It is the one at which the underlapped edges and the leak pass as much air
    out as in, the mean pressure of the joint in flow mode.

    Args:
        parameters: (ROWS, n), see `chamber.Row`.
        opening: where the valve is held instead, (n) or for all, in [-1, 1].

    Returns:
        (n) Pa absolute. With the valve closed at rest and no leak any pressure
        stays: half of the supply's gauge pressure is returned then.
    """
    result = np.empty(parameters.shape[1])
    strokes = np.broadcast_to(np.asarray(opening, dtype=float), result.shape)
    for i, column in enumerate(parameters.T):
        supply = column[Row.SUPPLY]
        atmosphere = column[Row.ATMOSPHERE]
        temperature = column[Row.TEMPERATURE]
        under = column[Row.UNDERLAP]
        fill = column[Row.C_FILL] * opening_fraction(strokes[i], under)
        vent = opening_fraction(-strokes[i], under)
        out = column[Row.C_EXHAUST] * vent + column[Row.C_LEAK]
        low, high = atmosphere, supply
        if fill == 0.0 and out == 0.0:
            result[i] = 0.5 * (low + high)
            continue
        for _ in range(60):
            middle = 0.5 * (low + high)
            mdot_in, mdot_out, _, _ = chamber_flows(
                middle,
                temperature,
                supply,
                atmosphere,
                temperature,
                fill,
                out,
                column[Row.CRITICAL_RATIO],
            )
            if mdot_in > mdot_out:
                low = middle
            else:
                high = middle
        result[i] = 0.5 * (low + high)
    return result


def pressure_differences(
    parameters: NDArray[np.float64],
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Slope and offset, (n) each, of p_a - p_b over the torque it gives.

    At the mean gauge pressure p_m of the valves' rest the torque is
    τ = (K_a + K_b) Δp/2 + (K_a - K_b) p_m, friction apart, so that
    Δp = slope τ + offset.

    Args:
        parameters: (ROWS, n), see `chamber.Row`.

    Returns:
        1/m³ and Pa.
    """
    K_a, K_b = parameters[Row.K_A], parameters[Row.K_B]
    mean = resting_pressure(parameters) - parameters[Row.ATMOSPHERE]
    slope = 2.0 / (K_a + K_b)
    return slope, -slope * (K_a - K_b) * mean


def chamber_volumes(
    parameters: NDArray[np.float64], q: ArrayLike
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Volumes (n) of the chambers a and b [m³] at the joint angles q, rad.

    Raises:
        InputError: For angles that are not finite, or do not broadcast
            against (n).
    """
    q = require_array("q", q)
    n = parameters.shape[1]
    require(
        q.ndim == 0 or n == 1 or q.shape in ((1,), (n,)),
        "q",
        f"an array of shape {q.shape}",
        f"one angle for each of {n} joints",
    )
    volume_a = parameters[Row.V_A] + parameters[Row.K_A] * (
        q - parameters[Row.Q_LOWER]
    )
    volume_b = parameters[Row.V_B] + parameters[Row.K_B] * (
        parameters[Row.Q_UPPER] - q
    )
    return volume_a, volume_b


def closed_stiffness(
    parameters: NDArray[np.float64], q: ArrayLike, pressure: ArrayLike
) -> NDArray[np.float64]:
    """Rotational stiffness of joints whose valves are shut, N m/rad.

    Σ n p K²/V over both chambers, the rotational form of n p A²/V.

    Args:
        parameters: (ROWS, n), see `chamber.Row`.
        q: joint angles (n), rad.
        pressure: (2n) [p_a; p_b], Pa absolute.

    Raises:
        InputError: For what is not finite, or of another shape.
    """
    n = parameters.shape[1]
    p = require_array("pressure", pressure, (2 * n,))
    volume_a, volume_b = chamber_volumes(parameters, q)
    return parameters[Row.EXPONENT] * (
        p[:n] * parameters[Row.K_A] ** 2 / volume_a
        + p[n:] * parameters[Row.K_B] ** 2 / volume_b
    )


def largest_dead_time(parameters: NDArray[np.float64]) -> float:
    """The longest dead time [s] among the joints of a parameter array."""
    longest = float(np.max(parameters[Row.DEAD_TIME], initial=0.0))
    return longest if math.isfinite(longest) else 0.0
