"""PIDF control of antagonistic chamber pressures.

The controller asks for a pressure difference by PID on the joint angle and
opens the valves in proportion to what is missing of it (the F part):

    u = kP e + kI ∫e dt + kD ė + u_eq,   e = q_des - q,
    v⁺ = clip(kF (u - (p_a - p_b)), -1, 1),   v⁻ = -v⁺.

u_eq is an equilibrium offset: with it the joint can be held, for instance
while somebody leads it by the hand, with small gains and without integral.
"""

from collections.abc import Mapping, Sequence
import dataclasses
from pathlib import Path
from typing import Self

import numba
import numpy as np
from numpy.typing import ArrayLike, NDArray

from drake_affetto.common.errors import (
    InputError,
    require,
    require_array,
    require_range,
)

DEFAULT_FILE = "package://drake_affetto/control.yaml"


@dataclasses.dataclass
class JointGains:
    """Gains of one joint.

    Attributes:
        kP: Pa/rad.
        kI: Pa/(rad s).
        kD: Pa s/rad.
        kF: valve opening per pressure difference, 1/Pa.
    """

    kP: float = 5e5
    kI: float = 3e5
    kD: float = 2.5e4
    kF: float = 1.5e-5

    def check(self, where: str) -> None:
        """Raises InputError naming the first gain that is negative."""
        for field in ("kP", "kI", "kD", "kF"):
            require_range(f"{where}.{field}", getattr(self, field), 0.0)


@dataclasses.dataclass
class PidfGains:
    """Gains of `n` joints, arrays (n) in the units of `JointGains`.

    Attributes:
        kP: Pa/rad (n).
        kI: Pa/(rad s) (n).
        kD: Pa s/rad (n).
        kF: Valve opening per pressure difference (n), 1/Pa.
    """

    kP: NDArray[np.float64]
    kI: NDArray[np.float64]
    kD: NDArray[np.float64]
    kF: NDArray[np.float64]

    def __post_init__(self) -> None:
        """Makes float copies; raises InputError where they do not fit."""
        self.kP = require_array("kP", self.kP)
        require(
            self.kP.ndim == 1 and self.kP.size > 0,
            "kP",
            self.kP,
            "an array of one gain for each joint",
        )
        for field in ("kP", "kI", "kD", "kF"):
            value = require_array(
                field, getattr(self, field), self.kP.shape, low=0.0
            )
            setattr(self, field, value.copy())

    @classmethod
    def from_array(cls, array: ArrayLike) -> Self:
        """The gains whose rows (4, n) are kP, kI, kD and kF.

        Args:
            array: Gains (4, n).

        Raises:
            InputError: For another shape, or what is no gain.
        """
        return cls(*require_array("array", array, (4, None)))

    def to_array(self) -> NDArray[np.float64]:
        """(4, n) array with the rows kP, kI, kD and kF."""
        return np.stack([self.kP, self.kI, self.kD, self.kF])

    def scaled(self, factor: float, *, integral: float = 0.0) -> "PidfGains":
        """Gains for leading the joints by hand.

        Args:
            factor: of kP and kD, in 0 to 1 for a compliant joint.
            integral: of kI; none by default, for the hand would be fought by
                an integrator.

        Returns:
            New gains with the same kF.
        """
        require_range("factor", factor, 0.0)
        require_range("integral", integral, 0.0)
        return PidfGains(
            factor * self.kP, integral * self.kI, factor * self.kD, self.kF
        )


@dataclasses.dataclass
class ControlParameters:
    """Gains of the joints by their names, and the limits of the control.

    Attributes:
        integral_limit: greatest part of u that the integral may ask for, Pa.
        difference_limit: greatest pressure difference u asked for, Pa.
        integral_deadband: errors up to this are not integrated, rad. An
            integrator that works on a joint held by dry friction makes it
            jump to and fro for ever.
        gains: gains by joint name, or by the name of an actuator class.
    """

    integral_limit: float = 300e3
    difference_limit: float = 550e3
    integral_deadband: float = 0.005
    gains: dict[str, JointGains] = dataclasses.field(default_factory=dict)

    def check(self, where: str) -> None:
        """Raises InputError naming the first field that does not fit."""
        require_range(f"{where}.integral_limit", self.integral_limit, 0.0)
        require_range(f"{where}.difference_limit", self.difference_limit, 0.0)
        require_range(f"{where}.integral_deadband", self.integral_deadband, 0.0)
        for name, gains in self.gains.items():
            gains.check(f"{where}.gains.{name}")

    def limits(self) -> dict[str, float]:
        """The limits, named as a controller's arguments are."""
        return {
            "integral_limit": self.integral_limit,
            "difference_limit": self.difference_limit,
            "integral_deadband": self.integral_deadband,
        }

    def for_joints(
        self, names: Sequence[str], classes: Mapping[str, str] | None = None
    ) -> PidfGains:
        """The gains of the joints named, in that order.

        Args:
            names: the joints.
            classes: joint -> its actuator class, whose gains a joint has that
                `gains` does not name.

        Raises:
            InputError: for a joint that has none.
        """
        rows = []
        for name in names:
            actuator = (classes or {}).get(name)
            found = [k for k in (name, actuator) if k in self.gains]
            if not found:
                known = ", ".join(self.gains) or "none"
                either = f" or its class {actuator!r}" if actuator else ""
                raise InputError(
                    f"no gains for joint {name!r}{either}; known: {known}"
                )
            rows.append(self.gains[found[0]])
        return PidfGains(
            kP=np.array([g.kP for g in rows]),
            kI=np.array([g.kI for g in rows]),
            kD=np.array([g.kD for g in rows]),
            kF=np.array([g.kF for g in rows]),
        )


def load_control(
    source: ControlParameters | str | Path = DEFAULT_FILE,
    overlays: Sequence[str | Path] = (),
) -> ControlParameters:
    """Reads gains and limits from a YAML file of `ControlParameters`.

    Args:
        source: the file, its package:// URI, or the parameters themselves.
        overlays: further ones, each holding only what it changes.

    Raises:
        InputError: for a file or a value that does not fit, by name.
    """
    # Drake's YAML reader is behind this; the mathematics need none of it.
    from drake_affetto.common.yaml_config import load_config

    return load_config(ControlParameters, source, overlays)


@numba.njit(cache=True)
def pidf_update(
    h: float,
    gains: NDArray[np.float64],
    integral_limit: float,
    difference_limit: float,
    integral_deadband: float,
    desired_state: NDArray[np.float64],
    estimated_state: NDArray[np.float64],
    pressure: NDArray[np.float64],
    offset: NDArray[np.float64],
    integral: NDArray[np.float64],
    demand: NDArray[np.float64],
    opening: NDArray[np.float64],
) -> None:
    """One update of the controller, in place.

    The integral is frozen while it would push a limited signal (the valve or
    the demand) further into its limit, and held within its own limit.

    Args:
        h: period of the updates, s.
        gains: (4, n) rows kP, kI, kD, kF, or the same as one row (4n).
        integral_limit: limit of kI ∫e dt, Pa.
        difference_limit: limit of the demand u, Pa.
        integral_deadband: error that is not integrated, rad.
        desired_state: (2n) [q_des; q̇_des], rad and rad/s.
        estimated_state: (2n) [q; q̇].
        pressure: (2n) [p_a; p_b], Pa.
        offset: (n) u_eq, Pa.
        integral: (n) ∫e dt, rad s; advanced.
        demand: (n) u, Pa; set.
        opening: (n) v⁺ in [-1, 1]; set.
    """
    n = integral.size
    rows = gains.reshape(4, n)
    for i in range(n):
        error = desired_state[i] - estimated_state[i]
        error_rate = desired_state[n + i] - estimated_state[n + i]
        k_i = rows[1, i]
        proportional = rows[0, i] * error + rows[2, i] * error_rate
        difference = pressure[i] - pressure[n + i]

        excess = error - min(max(error, -integral_deadband), integral_deadband)
        trial = integral[i] + h * excess
        u = proportional + offset[i] + k_i * trial
        v = rows[3, i] * (
            min(max(u, -difference_limit), difference_limit) - difference
        )
        limited = abs(v) > 1.0 or abs(u) > difference_limit
        driving = u - difference if abs(v) > 1.0 else u
        if limited and driving * error > 0.0:
            trial = integral[i]
        if k_i > 0.0:
            bound = integral_limit / k_i
            trial = min(max(trial, -bound), bound)
        else:
            trial = 0.0
        integral[i] = trial

        u = proportional + offset[i] + k_i * trial
        u = min(max(u, -difference_limit), difference_limit)
        demand[i] = u
        v = rows[3, i] * (u - difference)
        opening[i] = min(max(v, -1.0), 1.0)
