"""Kinematics of one chain of revolute joints, for many postures at once.

No Drake: arrays in, arrays out. A pose X_AB is a 4 × 4 homogeneous matrix.
`drake_affetto.scene.world.serial_chain` reads a chain from a plant.
"""

from collections.abc import Mapping
import dataclasses

import numpy as np

from drake_affetto.common.errors import require, require_array, require_range
from drake_affetto.common.typing import Array


@dataclasses.dataclass(frozen=True)
class SerialChain:
    """Revolute joints in series, from the world to a tip.

    Attributes:
        names: the n joints, from the world outwards.
        X_PJ: (n, 4, 4), pose of each joint's frame at angle zero in the frame
            of the joint before it (in world for the first).
        axes: (n, 3), each joint's axis, a unit vector in its own frame.
        X_JT: (4, 4), pose of the tip in the last joint's frame.
        lower: (n,) lower limits [rad].
        upper: (n,) upper limits [rad].
    """

    names: tuple[str, ...]
    X_PJ: Array
    axes: Array
    X_JT: Array
    lower: Array
    upper: Array

    def __post_init__(self) -> None:
        """Raises InputError for arrays that do not fit n joints."""
        n = len(self.names)
        require_array("X_PJ", self.X_PJ, (n, 4, 4))
        require_array("axes", self.axes, (n, 3))
        require_array("X_JT", self.X_JT, (4, 4))
        for name in ("lower", "upper"):
            limits = np.asarray(getattr(self, name), dtype=float)
            # A joint may have no limits: they are infinite then.
            require(
                limits.shape == (n,) and not np.isnan(limits).any(),
                name,
                limits.tolist(),
                f"a limit for each of {n} joints",
            )

    def indices(self, names: list[str] | tuple[str, ...]) -> Array:
        """Where `names` stand among the chain's joints."""
        return np.array([self.names.index(name) for name in names])

    def posture(self, angles: Mapping[str, float]) -> Array:
        """(n,) joint angles; those that `angles` does not name are zero."""
        return np.array([angles.get(name, 0.0) for name in self.names])

    def pose(self, q: Array) -> Array:
        """Pose of the tip in world, (..., 4, 4), at angles q (..., n).

        Args:
            q: Angles of the n joints (..., n), rad.
        """
        return self._walk(q)[0]

    def position_jacobian(self, q: Array) -> tuple[Array, Array]:
        """Pose of the tip and the Jacobian of its origin.

        Args:
            q: Angles of the n joints (..., n), rad.

        Returns:
            X_WT (..., 4, 4) and J (..., 3, n) [m/rad] with ṗ_WT = J q̇.
        """
        X, axes, origins = self._walk(q)
        lever = X[..., None, :3, 3] - origins
        return X, np.swapaxes(np.cross(axes, lever), -1, -2)

    def _walk(self, q: Array) -> tuple[Array, Array, Array]:
        q = np.asarray(q, dtype=float)
        if q.shape[-1:] != (len(self.names),):
            require_array("q", q, (*q.shape[:-1], len(self.names)))
        X = np.broadcast_to(np.eye(4), (*q.shape[:-1], 4, 4))
        axes = np.empty((*q.shape, 3))
        origins = np.empty((*q.shape, 3))
        for i in range(len(self.names)):
            X = X @ self.X_PJ[i]
            axes[..., i, :] = X[..., :3, :3] @ self.axes[i]
            origins[..., i, :] = X[..., :3, 3]
            X = X @ _rotation(self.axes[i], q[..., i])
        return X @ self.X_JT, axes, origins


def _rotation(axis: Array, angle: Array) -> Array:
    """Rodrigues' formula: poses (..., 4, 4) of turns by `angle` (...)."""
    x, y, z = axis
    K = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    X = np.zeros((*np.shape(angle), 4, 4))
    s = np.sin(angle)[..., None, None]
    c = np.cos(angle)[..., None, None]
    X[..., :3, :3] = np.eye(3) + s * K + (1 - c) * (K @ K)
    X[..., 3, 3] = 1
    return X


def solve_position(
    chain: SerialChain,
    targets: Array,
    rest: Array,
    weights: Array,
    *,
    start: Array | None = None,
    margin: float = 0.0,
    iterations: int = 120,
    damping: float = 0.01,
    comfort: float = 0.05,
) -> tuple[Array, Array]:
    """Postures that bring the tip to `targets`, near `rest`.

    Damped least squares with a pull to the rest posture in the null space of
    the task (Buss, "Introduction to inverse kinematics with Jacobian
    transpose, pseudoinverse and damped least squares methods", 2004), within
    the joints' limits, all targets at once.

    Args:
        targets: (m, 3) positions in world [m].
        rest: (n,) or (m, n) posture to stay close to [rad].
        weights: (n,) how freely each joint moves; zero holds it at `rest`.
        start: (n,) or (m, n) posture to begin at; `rest` by default.
        margin: part of each joint's range to keep off either limit.
        damping: of the least squares [m].
        comfort: step towards `rest` in each iteration, 0 to 1.
        chain: The joints and the tip.
        iterations: Number of steps.

    Returns:
        (m, n) postures and (m,) distances [m] left to the targets.

    Raises:
        InputError: For an argument that is not finite or does not fit.
    """
    targets = require_array("targets", targets, (None, 3))
    shape = (len(targets), len(chain.names))
    weights = require_array("weights", weights, shape[1:], low=0.0)
    for name, posture in (("rest", rest), ("start", start)):
        if posture is not None and np.shape(posture) not in (shape, shape[1:]):
            require_array(name, posture, shape)
        if posture is not None:
            require_array(name, posture)
    require_range("margin", margin, 0.0, 0.5)
    require_range("damping", damping, 1e-9, 1e3)
    require_range("comfort", comfort, 0.0, 1.0)
    require_range("iterations", iterations, 1, 1_000_000)
    rest = np.broadcast_to(np.asarray(rest, dtype=float), shape)
    q = np.array(np.broadcast_to(rest if start is None else start, shape))
    free = weights > 0
    gap = margin * (chain.upper - chain.lower)
    low = np.where(free, chain.lower + gap, -np.inf)
    high = np.where(free, chain.upper - gap, np.inf)
    rest = np.clip(rest, low, high)
    q = np.clip(q, low, high)
    for iteration in range(iterations):
        X, J = chain.position_jacobian(q)
        error = targets - X[:, :3, 3]
        # Short steps: the linear model holds only nearby.
        length = np.linalg.norm(error, axis=-1, keepdims=True)
        error = error * np.minimum(1.0, 0.04 / np.maximum(length, 1e-12))
        # A joint at its limit is left out where it would go further.
        moves = np.ones(shape, dtype=bool)
        for _ in range(2):
            JW = J * (weights * moves)[:, None, :]
            A = JW @ np.swapaxes(J, -1, -2) + damping**2 * np.eye(3)
            inverse = np.swapaxes(JW, -1, -2) @ np.linalg.inv(A)
            pull = np.where(moves & free, rest - q, 0.0)
            fade = comfort * (1 - iteration / iterations)
            step = _apply(inverse, error) + fade * (
                pull - _apply(inverse, _apply(J, pull))
            )
            moves = (q + step >= low) & (q + step <= high)
        q = np.clip(q + step, low, high)
    left = np.linalg.norm(targets - chain.pose(q)[:, :3, 3], axis=-1)
    return q, left


def _apply(matrix: Array, vector: Array) -> Array:
    return (matrix @ vector[..., None])[..., 0]
