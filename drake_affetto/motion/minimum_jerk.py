"""The blend by which hands and references move from one place to another."""

import numpy as np

from drake_affetto.common.typing import Array


def minimum_jerk(s: Array | float) -> Array:
    """The blend with the least jerk from rest to rest (Flash and Hogan 1985).

    Args:
        s: Part of the time (...), from 0 to 1.

    Returns:
        Part of the way (...), from 0 to 1; constant outside of [0, 1].
    """
    s = np.clip(s, 0.0, 1.0)
    return s**3 * (10.0 - 15.0 * s + 6.0 * s**2)
