"""Maps h from a new input space to the one in which a skill was learned.

A map is a small object: how many parameters it has, h, its derivative by those
parameters, and where a search for them may begin. `Affine` is the paper's; a
user who knows more of a sensor writes an own one:

    class Polar(Mapping):
        def count(self, n_in, n_out): ...
        def apply(self, parameters, X): ...
        def derivative(self, parameters, X): ...
        def starts(self, target, source, n_starts, random): ...
"""

import abc
import dataclasses
import functools
import itertools
import math
from typing import Self

import numpy as np
from numpy.typing import ArrayLike

from drake_affetto.common.errors import require, require_array
from drake_affetto.common.typing import Array


@dataclasses.dataclass(frozen=True)
class Domain:
    """Where the inputs of a skill lie.

    Attributes:
        mean: (d,).
        covariance: (d, d).
        low: (d,), the least value of each input.
        high: (d,), the greatest.
    """

    mean: Array
    covariance: Array
    low: Array
    high: Array

    @classmethod
    def of_samples(cls, X: ArrayLike) -> Self:
        """The domain of the samples X (N, d).

        Raises:
            InputError: For what is no such array of at least one sample.
        """
        X = require_array("X", X, (None, None))
        require(len(X) > 0, "X", "no samples", "at least one")
        centered = X - X.mean(axis=0)
        return cls(
            X.mean(axis=0),
            centered.T @ centered / len(X),
            X.min(axis=0),
            X.max(axis=0),
        )

    @classmethod
    def of_range(cls, limits: ArrayLike) -> Self:
        """The domain of inputs that fill the box limits (d, 2) evenly.

        Args:
            limits: Lowest and highest value of each input (d, 2).

        Raises:
            InputError: For what is no such box.
        """
        low, high = require_array("limits", limits, (None, 2)).T
        require(bool(np.all(low < high)), "limits", limits, "low below high")
        return cls(
            (low + high) / 2.0, np.diag((high - low) ** 2 / 12.0), low, high
        )

    @functools.cached_property
    def deviation(self) -> Array:
        """(d,), standard deviation of each input; 1 where it is 0."""
        deviation = np.sqrt(np.diag(self.covariance))
        return np.where(deviation > 1e-12, deviation, 1.0)


class Mapping(abc.ABC):
    """h(x; p): a family of maps with parameters p (P,)."""

    def expectation(self, parameters: Array) -> tuple[Array, Array] | None:
        """What is known of the parameters before any sample, if anything.

        Args:
            parameters: (S, P).

        Returns:
            Residuals (S, R), each of unit standard deviation, and their
            derivatives (S, R, P); or None.
        """
        return None

    @abc.abstractmethod
    def count(self, n_in: int, n_out: int) -> int:
        """P, for maps from n_in to n_out inputs."""

    def freedom(self, n_in: int, n_out: int) -> int:
        """How many of the parameters the samples have to determine."""
        return self.count(n_in, n_out)

    @abc.abstractmethod
    def apply(self, parameters: Array, X: Array) -> Array:
        """h(X): parameters (P,), X (N, n_in) to (N, n_out).

        Args:
            parameters: Parameters p of the map (P,).
        """

    @abc.abstractmethod
    def derivative(self, parameters: Array, X: Array) -> Array:
        """∂h/∂p at X: parameters (P,), X (N, n_in) to (N, n_out, P).

        Args:
            parameters: Parameters p of the map (P,).
        """

    @abc.abstractmethod
    def starts(
        self,
        target: Domain,
        source: Domain,
        n_starts: int,
        random: np.random.RandomState,
    ) -> list[tuple[str, Array]]:
        """At most n_starts named parameters (P,) to begin a search from.

        Args:
            target: of the inputs to be mapped.
            source: of the inputs that the skill knows.
            n_starts: how many are wanted.
            random: for those that are drawn.
        """

    def apply_many(self, parameters: Array, X: Array) -> Array:
        """`apply` for parameters (S, P): (S, N, n_out).

        Args:
            parameters: Parameters of S maps (S, P).
        """
        return np.array([self.apply(row, X) for row in parameters])

    def derivative_many(self, parameters: Array, X: Array) -> Array:
        """`derivative` for parameters (S, P): (S, N, n_out, P).

        Args:
            parameters: Parameters of S maps (S, P).
        """
        return np.array([self.derivative(row, X) for row in parameters])


class Affine(Mapping):
    """h(x) = H x + c, with p the rows of H, then c (Eq. 5)."""

    def count(self, n_in: int, n_out: int) -> int:
        """See base class."""
        return n_out * (n_in + 1)

    def apply(self, parameters: Array, X: Array) -> Array:
        """See base class."""
        return self.apply_many(parameters[None], X)[0]

    def derivative(self, parameters: Array, X: Array) -> Array:
        """See base class."""
        return self.derivative_many(parameters[None], X)[0]

    def apply_many(self, parameters: Array, X: Array) -> Array:
        """See base class."""
        linear, offset = self.split(parameters, X.shape[1])
        return X @ np.swapaxes(linear, 1, 2) + offset[:, None]

    def derivative_many(self, parameters: Array, X: Array) -> Array:
        """See base class."""
        n, n_in = X.shape
        n_out = parameters.shape[1] // (n_in + 1)
        one = np.zeros((n, n_out, n_out * (n_in + 1)))
        for i in range(n_out):
            one[:, i, i * n_in : (i + 1) * n_in] = X
            one[:, i, n_out * n_in + i] = 1.0
        # h is linear in p: the same for all of them.
        return np.broadcast_to(one, (len(parameters), *one.shape))

    def split(self, parameters: Array, n_in: int) -> tuple[Array, Array]:
        """p (..., P) to H (..., n_out, n_in) and c (..., n_out).

        Args:
            parameters: Parameters p (..., P).
        """
        n_out = parameters.shape[-1] // (n_in + 1)
        linear = parameters[..., : n_out * n_in]
        return (
            linear.reshape(*parameters.shape[:-1], n_out, n_in),
            parameters[..., n_out * n_in :],
        )

    def starts(
        self,
        target: Domain,
        source: Domain,
        n_starts: int,
        random: np.random.RandomState,
    ) -> list[tuple[str, Array]]:
        """The identity; then maps that take one domain onto the other.

        Those map mean to mean and deviation to deviation, with axes that are
        kept, reflected, rotated in steps, and rotated at random.

        Args:
            target: Where inputs of the new view lie.
            source: Where the skill has learned.
            n_starts: Number of starts.
            random: Source of random numbers.
        """
        n_in, n_out = target.mean.size, source.mean.size
        identity = np.eye(n_out, n_in)
        named = [("identity", np.append(identity.ravel(), np.zeros(n_out)))]
        for name, turn in _turns(n_in, n_out, n_starts - 1, random):
            linear = source.deviation[:, None] * turn / target.deviation
            offset = source.mean - linear @ target.mean
            named.append((name, np.append(linear.ravel(), offset)))
        return named[:n_starts]


class Similarity(Mapping):
    """A rotation, scaling, shift and perhaps reflection of the plane.

    p = (a, b, c_1, c_2, e): H = [[a, -b e], [b, a e]]. The last, ±1, says
    whether the map reflects; it is set by the start and never changes.
    """

    def count(self, n_in: int, n_out: int) -> int:
        """See base class."""
        if (n_in, n_out) != (2, 2):
            raise ValueError(
                f"the similarity maps 2 inputs to 2, not {n_in} to {n_out}"
            )
        return 5

    def freedom(self, n_in: int, n_out: int) -> int:
        """See base class."""
        return 4

    def apply(self, parameters: Array, X: Array) -> Array:
        """See base class."""
        return X @ self.linear(parameters).T + parameters[2:4]

    def linear(self, parameters: Array) -> Array:
        """H (2, 2).

        Args:
            parameters: Parameters p of the map (P,).
        """
        a, b, _, _, side = parameters
        return np.array([[a, -b * side], [b, a * side]])

    def derivative(self, parameters: Array, X: Array) -> Array:
        """See base class."""
        side = parameters[4]
        result = np.zeros((len(X), 2, 5))
        result[:, 0, 0] = X[:, 0]
        result[:, 0, 1] = -side * X[:, 1]
        result[:, 1, 0] = side * X[:, 1]
        result[:, 1, 1] = X[:, 0]
        result[:, 0, 2] = 1.0
        result[:, 1, 3] = 1.0
        return result

    def starts(
        self,
        target: Domain,
        source: Domain,
        n_starts: int,
        random: np.random.RandomState,
    ) -> list[tuple[str, Array]]:
        """The identity; then turns in even steps, with and without mirror.

        Args:
            target: Where inputs of the new view lie.
            source: Where the skill has learned.
            n_starts: Number of starts.
            random: Source of random numbers.
        """
        named = [("identity", np.array([1.0, 0.0, 0.0, 0.0, 1.0]))]
        scale = math.sqrt(
            np.trace(source.covariance)
            / max(np.trace(target.covariance), 1e-12)
        )
        for side in (1.0, -1.0):
            steps = max(1, (n_starts - (side > 0)) // 2)
            for k in range(steps):
                angle = 2.0 * math.pi * k / steps
                parameters = np.array(
                    [
                        scale * math.cos(angle),
                        scale * math.sin(angle),
                        0.0,
                        0.0,
                        side,
                    ]
                )
                center = self.linear(parameters) @ target.mean
                parameters[2:4] = source.mean - center
                kind = "rotation" if side > 0 else "reflection"
                degrees = round(math.degrees(angle))
                named.append((f"{kind} {degrees}", parameters))
        return named[:n_starts]


def make_mapping(mapping: str | Mapping) -> Mapping:
    """The map of that name ("affine", "similarity"), or the object itself.

    Raises:
        ValueError: if there is no such map, or the object lacks a method.
    """
    known = {"affine": Affine, "similarity": Similarity}
    if isinstance(mapping, str):
        if mapping not in known:
            raise ValueError(
                f"mapping is {mapping!r}, expected one of {sorted(known)} or "
                "a Mapping"
            )
        return known[mapping]()
    if not isinstance(mapping, Mapping):
        raise ValueError(
            f"mapping is a {type(mapping).__name__}, expected one of "
            f"{sorted(known)} or a Mapping"
        )
    return mapping


def _turns(
    n_in: int, n_out: int, count: int, random: np.random.RandomState
) -> list[tuple[str, Array]]:
    """At most `count` named matrices (n_out, n_in) with orthonormal rows."""
    eye = np.eye(n_out, n_in)
    turns = [("centered", eye)]
    signs = itertools.product((1.0, -1.0), repeat=min(n_in, n_out))
    for sign in itertools.islice(signs, 1, count + 1):
        flips = [f"{i}" for i, s in enumerate(sign) if s < 0]
        scale = np.ones(n_out)
        scale[: len(sign)] = sign
        turns.append((f"reflection {'+'.join(flips)}", scale[:, None] * eye))
    if n_in == n_out == 2:
        # Half turns are among the reflections of both axes already.
        for k in (1, 3, 5, 7, 2, 6):
            angle = k * math.pi / 4.0
            c, s = math.cos(angle), math.sin(angle)
            turn = np.array([[c, -s], [s, c]])
            turns.append((f"rotation {45 * k}", turn))
            turns.append(
                (f"rotation {45 * k} reflection 1", turn * [1.0, -1.0])
            )
    missing = max(0, count - len(turns))
    larger = max(n_in, n_out)
    drawn = random.normal(size=(missing, larger, larger))
    basis, triangle = np.linalg.qr(drawn)
    # With these signs the matrices are evenly distributed.
    basis *= np.sign(np.diagonal(triangle, axis1=1, axis2=2))[:, None, :]
    basis *= np.exp(0.3 * random.normal(size=(missing, 1, 1)))
    turns += [("random", turn[:n_out, :n_in]) for turn in basis]
    return turns[:count]


# Samples that spread less than this across their longest extent are a line.
_THIN = 0.03


def lost_parameters(mapping: Mapping, parameters: Array, X: Array) -> int:
    """How many parameters of a map samples leave open because of their place.

    Samples on a line do not tell an affine map of a plane, however many.

    Args:
        mapping: The map.
        parameters: Parameters (P,) at which it is linearized.
        X: Samples (N, n).

    Returns:
        The number of parameters that samples all around would determine, but
        these do not; those that differ hardly from a line count as on it.
    """
    unit = Domain.of_samples(X).deviation
    mean = X.mean(axis=0)
    left, size, right = np.linalg.svd((X - mean) / unit, full_matrices=False)
    size = np.where(size > _THIN * size[0], size, 0.0)
    flattened = mean + ((left * size) @ right) * unit
    cloud = np.random.default_rng(0).standard_normal(
        (2 * len(parameters), X.shape[1])
    )
    return max(
        _rank(mapping.derivative(parameters, mean + cloud * unit))
        - _rank(mapping.derivative(parameters, flattened)),
        0,
    )


def _rank(derivative: Array) -> int:
    """The rank of ∂h/∂p (N, d, P) over all samples."""
    stacked = derivative.reshape(-1, derivative.shape[-1])
    if not np.isfinite(stacked).all():
        return 0
    length = np.linalg.norm(stacked, axis=0)
    return int(
        np.linalg.matrix_rank(stacked / np.where(length > 0.0, length, 1.0))
    )
