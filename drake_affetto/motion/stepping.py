"""One step of all joints of a movement primitive, compiled."""

from typing import NamedTuple

import numba
import numpy as np

from drake_affetto.common.typing import Array

NO_FORCING = np.zeros((2, 0))
NO_WEIGHTS = np.zeros((0, 0))


class StepTable(NamedTuple):
    """All that a step of fixed length needs, for every phase on its grid.

    Attributes:
        transition: (2, 2), carries [q - g; q̇] over one step.
        forcing: (N, 2, K), what the forcing adds in the step that begins at
            phase 1 - i · phase_step.
        phase_step: by how much the phase falls in one step.
        dt: s, length of a step.
        duration: s, T.
    """

    transition: Array
    forcing: Array
    phase_step: float
    dt: float
    duration: float


@numba.njit(cache=True)
def advance_joints(state, goal, transition, forcing, weights):
    """One step of all joints, in place; two hundred of them a second.

    Args:
        state: [q; q̇] (2, n).
        goal: Goal (n,).
        transition: Step without forcing (2, 2).
        forcing: What the basis functions add (2, K).
        weights: θ (n, K); with no K there is no forcing.
    """
    for i in range(state.shape[1]):
        away = state[0, i] - goal[i]
        rate = state[1, i]
        for row in range(2):
            moved = transition[row, 0] * away + transition[row, 1] * rate
            for k in range(forcing.shape[1]):
                moved += forcing[row, k] * weights[i, k]
            state[row, i] = moved
        state[0, i] += goal[i]
