"""Actions of a learner as movements of the arm: a box about what was taught."""

import numpy as np
from numpy.typing import ArrayLike

from drake_affetto.common.errors import require_array, require_range
from drake_affetto.common.typing import Array

# An action of 1 goes this much further than the farthest lesson.
_MARGIN = 1.25


class MovementSpace:
    """θ = mean + a @ directions for actions a in [-1, 1]^k.

    The mean is the lessons' mean. The directions are the lessons' principal
    ones, or each parameter by itself; their lengths are such that the box
    holds all lessons, and a quarter more.

    Attributes:
        mean: Mean of the lessons (F,).
        directions: What an action of 1 adds (k, F).
        share: Share of the lessons' variance that lies in the directions.
    """

    def __init__(self, theta: ArrayLike, directions: int | None = 3):
        """Spans the space.

        Args:
            theta: Movements of the lessons (N, F).
            directions: k, number of principal directions; None for all F
                parameters, one by one.

        Raises:
            InputError: If the lessons are no such array, or too few for so
                many directions.
        """
        theta = require_array("theta", theta, (None, None))
        require_range("lessons", len(theta), 2)
        self.mean: Array = theta.mean(axis=0)
        away = theta - self.mean
        if directions is None:
            self.directions = np.diag(_MARGIN * np.abs(away).max(axis=0))
            self.share = 1.0
            return
        most = min(len(theta) - 1, theta.shape[1])
        require_range("directions", directions, 1, most)
        _, sizes, axes = np.linalg.svd(away, full_matrices=False)
        axes = axes[:directions]
        # The sign of a principal direction is open: its largest entry is
        # positive here, wherever it is computed.
        rows = np.arange(directions)
        axes *= np.sign(axes[rows, np.abs(axes).argmax(axis=1)])[:, None]
        reach = _MARGIN * np.abs(away @ axes.T).max(axis=0)
        self.directions = reach[:, None] * axes
        self.share = float(np.sum(sizes[:directions] ** 2) / np.sum(sizes**2))

    @property
    def size(self) -> int:
        """k, the size of an action."""
        return len(self.directions)

    def theta(self, action: ArrayLike) -> Array:
        """The movement θ (F,) of an action (k,).

        Args:
            action: Entries in [-1, 1] (k,).

        Raises:
            InputError: If the action has another shape, or an entry is no
                number in [-1, 1].
        """
        action = require_array(
            "action", action, (self.size,), low=-1.0, high=1.0
        )
        return self.mean + action @ self.directions
