"""Joints at rest: what pressures and valves hold a torque.

All arrays of parameters are (ROWS, n), their rows as in `chamber.Row`.
"""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from drake_affetto.common.errors import require, require_array
from drake_affetto.pneumatics.chamber import Row
from drake_affetto.pneumatics.parameters import resting_pressure


def chamber_torque(
    parameters: NDArray[np.float64], pressure: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Torque of both chambers (n), N m, without friction.

    Args:
        parameters: of n joints.
        pressure: (2n) [p_a; p_b], Pa absolute.
    """
    n = parameters.shape[1]
    gauge_a = pressure[:n] - parameters[Row.ATMOSPHERE]
    gauge_b = pressure[n:] - parameters[Row.ATMOSPHERE]
    return parameters[Row.K_A] * gauge_a - parameters[Row.K_B] * gauge_b


def pressures_for_torque(
    parameters: NDArray[np.float64],
    torque: ArrayLike,
    mean: ArrayLike | None = None,
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Chamber pressures that give `torque` at about a mean pressure.

    Args:
        parameters: of n joints.
        torque: (n) N m, for instance what holds the arm against gravity.
        mean: mean pressure, Pa absolute, scalar or (n); by default the
            pressure of the valves' rest.

    Returns:
        p_a and p_b (n each), Pa absolute, within atmosphere and supply.

    Raises:
        InputError: For a torque or pressure of another shape, or not finite.
    """
    if mean is None:
        mean = resting_pressure(parameters)
    wanted = _of_joints("torque", torque, parameters)
    mean = _of_joints("mean", mean, parameters)
    K_a, K_b = parameters[Row.K_A], parameters[Row.K_B]
    low, high = parameters[Row.ATMOSPHERE], parameters[Row.SUPPLY]
    gauge = mean - low
    shift = (wanted - (K_a - K_b) * gauge) / (K_a + K_b)
    # Where one chamber meets a limit the other makes up for it.
    p_a = np.clip(mean + shift, low, high)
    p_b = np.clip(low + (K_a * (p_a - low) - wanted) / K_b, low, high)
    p_a = np.clip(low + (K_b * (p_b - low) + wanted) / K_a, low, high)
    return p_a, p_b


def opening_for_torque(
    parameters: NDArray[np.float64], torque: ArrayLike
) -> NDArray[np.float64]:
    """Valve openings v⁺ (n) under which joints at rest hold `torque`.

    At these openings, v⁻ = -v⁺, each chamber takes in what it lets out at the
    pressure that it has then (`resting_pressure`), and the pressures give the
    torque: an operating point of the open loop. A torque beyond the actuator's
    gives an opening at which the valves are saturated, in [-1, 1].

    Args:
        parameters: of n joints, their valves underlapped.
        torque: (n) N m.

    Raises:
        InputError: For a torque of another shape, or not finite.
    """
    wanted = _of_joints("torque", torque, parameters)
    low = np.full(wanted.shape, -1.0)
    high = -low
    # The torque only grows with the opening.
    for _ in range(60):
        middle = 0.5 * (low + high)
        pressure = np.concatenate(
            [
                resting_pressure(parameters, middle),
                resting_pressure(parameters, -middle),
            ]
        )
        below = chamber_torque(parameters, pressure) < wanted
        low = np.where(below, middle, low)
        high = np.where(below, high, middle)
    return 0.5 * (low + high)


def _of_joints(
    field: str, value: ArrayLike, parameters: NDArray[np.float64]
) -> NDArray[np.float64]:
    """A finite number for each of the n joints (n); one number is for all."""
    array = require_array(field, value)
    n = parameters.shape[1]
    require(
        array.shape in ((), (1,), (n,)),
        field,
        f"an array of shape {array.shape}",
        f"one number, or ({n},): one for each joint",
    )
    return np.broadcast_to(array, (n,))
