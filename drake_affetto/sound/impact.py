"""A soft hand on a surface, in one dimension: force profiles without a robot.

Used for the experimenter's taps and for studies of the sound alone; in the
station the forces come from the simulated contact.
"""

import dataclasses

import numba
import numpy as np
from numpy.typing import ArrayLike

from drake_affetto.common.errors import (
    require,
    require_array,
    require_range,
)
from drake_affetto.common.typing import Array


@dataclasses.dataclass
class Hand:
    """A mass on a spring-damper arm, with a Hunt-Crossley surface.

    Attributes:
        mass: Mass that moves with the hand, kg.
        arm_stiffness: Spring between the hand and where it is led, N/m.
        arm_damping: Damper between the hand and where it is led, N s/m.
        stiffness: Contact stiffness, N/m.
        dissipation: Hunt-Crossley dissipation, s/m.
    """

    mass: float = 0.35
    arm_stiffness: float = 250.0
    arm_damping: float = 12.0
    stiffness: float = 600.0
    dissipation: float = 1.5


def contact_force(
    t: ArrayLike, target: ArrayLike, hand: Hand | list[Hand] | None = None
) -> Array:
    """Force of hands that are led along `target` onto a surface at height 0.

    Semi-implicit steps of the hand's height z under the arm's spring-damper
    and F = max(0, -k z (1 - d z')) while z < 0; the hand starts at rest at
    target[0]. Gravity is balanced by the arm.

    Args:
        t: evenly spaced times (T), s.
        target: heights to which the hands are led, (T,) or (T, N), m.
        hand: one hand for all, or one for each column.

    Returns:
        Force on the surface, same shape as `target` [N].

    Raises:
        InputError: for shapes that do not fit each other, numbers that are
            not finite, or times that are not evenly spaced.
    """
    times = require_array("t", t, (None,))
    path = require_array("target", target)
    require(
        path.ndim in (1, 2) and len(path) == len(times) >= 2,
        "target",
        f"an array of shape {path.shape}",
        f"{len(times)} rows, at least 2",
    )
    columns = path.reshape(len(path), -1)
    hands = hand if isinstance(hand, list) else [hand or Hand()]
    require(
        len(hands) in (1, columns.shape[1]),
        "hand",
        f"{len(hands)} hands",
        f"1 or {columns.shape[1]}",
    )
    step = float(times[-1] - times[0]) / (len(times) - 1)
    require(
        step > 0.0 and bool(np.allclose(np.diff(times), step, rtol=1e-3)),
        "t",
        f"times from {times[0]:g} to {times[-1]:g}",
        "evenly spaced times, increasing",
    )
    numbers = np.array([dataclasses.astuple(one) for one in hands])
    force = np.empty_like(columns)
    for i in range(columns.shape[1]):
        force[:, i] = _march(
            np.ascontiguousarray(columns[:, i]),
            np.gradient(columns[:, i], step),
            step,
            *numbers[min(i, len(hands) - 1)],
        )
    return force.reshape(path.shape)


@numba.njit(cache=True)
def _march(
    target, velocity, step, mass, spring, damper, stiffness, dissipation
):
    """Force (T) of one hand on the surface."""
    force = np.zeros(len(target))
    z = target[0]
    v = 0.0
    for i in range(len(target)):
        if z < 0.0:
            force[i] = max(-stiffness * z * (1.0 - dissipation * v), 0.0)
        pull = spring * (target[i] - z) + damper * (velocity[i] - v)
        v += step / mass * (pull + force[i])
        z += step * v
    return force


def stroke(
    t: ArrayLike,
    start: float,
    height: float,
    depth: float,
    fall: float,
    dwell: float,
    rise: float,
) -> Array:
    """Height of a stroke: down by a raised cosine, dwell, and up again.

    Args:
        t: times (T), s.
        start: when it starts to fall, s.
        height: height above the surface before and after, m.
        depth: how far below the surface it is led; negative: it stays above
            by as much, m.
        fall: duration of the way down, s.
        dwell: time at the bottom, s.
        rise: duration of the way up, s.

    Raises:
        InputError: for numbers that are not finite, or durations that are not
            above 0.
    """
    for name, value, low in (
        ("start", start, -1e6),
        ("height", height, -1e3),
        ("depth", depth, -1e3),
        ("fall", fall, 1e-6),
        ("dwell", dwell, 0.0),
        ("rise", rise, 1e-6),
    ):
        require_range(name, value, low, 1e6)
    times = require_array("t", t) - start
    down = np.clip(times / fall, 0.0, 1.0)
    up = np.clip((times - fall - dwell) / rise, 0.0, 1.0)
    share = 0.5 * (np.cos(np.pi * up) - np.cos(np.pi * down))
    return height - (height + depth) * share
