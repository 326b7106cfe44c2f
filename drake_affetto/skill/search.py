"""The cost of a map, and searches for its parameters.

What `TransferRegressor` minimizes, with its derivatives, for many parameters
at once; and two ways to minimize it.
"""

from collections.abc import Callable
import dataclasses
import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize

from drake_affetto.common.typing import Array
from drake_affetto.skill.adapters import SourceModel
from drake_affetto.skill.mappings import Affine, Domain, Mapping

# Parameters (S, P) to cost (S,), half its gradient (S, P), and half its
# Gauss-Newton Hessian (S, P, P).
Evaluate = Callable[[Array], tuple[Array, Array, Array]]

# Iterations that make the best minimum exact.
_POLISH = 20


@dataclasses.dataclass(frozen=True)
class Prior:
    """What is expected of h, in units of the squared error.

    Attributes:
        domain: in which the skill was learned.
        inside: weight of the squared distance of each h(x) from it.
        moments: weight of each point in a comparison of mean and covariance.
        shape: weight of an affine map's distortion.
        scale: by which H is divided before its distortion is judged.
        expected: weight of the squared residuals of what the map's family
            expects of its parameters.
    """

    domain: Domain
    inside: float
    moments: float
    shape: float
    scale: float
    expected: float = 0.0


class Objective:
    """The cost of parameters, its gradient and Gauss-Newton curvature.

    cost = Σ_i ‖f(h(x_i)) - y_i‖² + α ‖p‖² + prior
    """

    def __init__(
        self,
        source: SourceModel,
        mapping: Mapping,
        X: Array,
        y: Array,
        unlabeled: Array,
        alpha: float,
        prior: Prior | None,
    ) -> None:
        self._source = source
        self._mapping = mapping
        self._labeled = len(X)
        self._points = np.concatenate([X, unlabeled]) if prior else X
        self._y = y
        self._alpha = alpha
        self._prior = prior

    def __call__(self, parameters: Array) -> tuple[Array, Array, Array]:
        """For parameters (S, P): cost (S,), half its gradient (S, P), and
        half its Gauss-Newton Hessian (S, P, P)."""
        mapping, n = self._mapping, self._labeled
        moved = mapping.apply_many(parameters, self._points)
        slope = mapping.derivative_many(parameters, self._points)
        n_starts, _, d = moved.shape

        value, jacobian = self._source.evaluate(moved[:, :n].reshape(-1, d))
        residual = value.reshape(n_starts, n, -1) - self._y
        jacobian = jacobian.reshape(n_starts, n, -1, d)
        cost = np.einsum("sno,sno->s", residual, residual)
        # The curvature and gradient by each z, then by the parameters.
        transposed = np.swapaxes(jacobian, 2, 3)
        pull = (transposed @ residual[..., None])[..., 0]
        bend = transposed @ jacobian

        if self._prior is not None:
            extra, all_pull, all_bend = self._inside(moved)
            all_pull[:, :n] += pull
            all_bend[:, :n] += bend
            cost = cost + extra
            pull, bend = all_pull, all_bend
        gradient = np.einsum("snd,sndp->sp", pull, slope)
        bent = bend @ slope
        size = slope.shape[-1]
        flat = (n_starts, -1, size)
        curvature = np.swapaxes(slope.reshape(flat), 1, 2) @ bent.reshape(flat)

        if self._prior is not None:
            for weight, term in (
                (self._prior.moments, self._moments),
                (self._prior.shape, self._distortion),
                (self._prior.expected, self._unexpected),
            ):
                if weight > 0.0:
                    residual, change = term(parameters, moved, slope)
                    transposed = np.swapaxes(change, 1, 2)
                    cost = cost + weight * np.sum(residual**2, axis=1)
                    more = weight * transposed @ residual[..., None]
                    gradient += more[..., 0]
                    curvature += weight * transposed @ change
        if self._alpha > 0.0:
            cost = cost + self._alpha * np.sum(parameters**2, axis=1)
            gradient += self._alpha * parameters
            curvature[:, range(size), range(size)] += self._alpha
        return cost, gradient, curvature

    def _inside(self, moved: Array) -> tuple[Array, Array, Array]:
        """The squared distance of each z from the domain's box."""
        assert self._prior is not None
        domain, weight = self._prior.domain, self._prior.inside
        unit = domain.deviation
        outside = moved - np.clip(moved, domain.low, domain.high)
        outside /= unit
        cost = weight * np.einsum("snd,snd->s", outside, outside)
        pull = weight * outside / unit
        bend = np.zeros((*moved.shape, moved.shape[-1]))
        diagonal = range(moved.shape[-1])
        bend[..., diagonal, diagonal] = weight * (outside != 0.0) / unit**2
        return cost, pull, bend

    def _moments(
        self, parameters: Array, moved: Array, slope: Array
    ) -> tuple[Array, Array]:
        """How unlikely mean and covariance of the z are in the domain.

        Returns:
            Residuals (S, R) and their derivatives (S, R, P).
        """
        assert self._prior is not None
        domain = self._prior.domain
        unit = domain.deviation
        d, m = unit.size, moved.shape[1]
        z = (moved - domain.mean) / unit
        dz = slope / unit[:, None]
        mean = z.mean(axis=1)
        z = z - mean[:, None]
        goal = domain.covariance / np.outer(unit, unit)
        residuals = [mean]
        changes = [dz.mean(axis=1)]
        for a in range(d):
            for b in range(a, d):
                # A variance is twice as uncertain as a covariance.
                scale = math.sqrt(0.5) if a == b else 1.0
                product = (z[:, :, a] * z[:, :, b]).mean(axis=1)
                change = np.einsum("sm,smp->sp", z[:, :, a], dz[:, :, b])
                change += np.einsum("sm,smp->sp", z[:, :, b], dz[:, :, a])
                residuals.append(scale * (product - goal[a, b])[:, None])
                changes.append(scale * change[:, None] / m)
        # Means over m points, and as certain as that.
        root = math.sqrt(m)
        return (
            root * np.concatenate(residuals, axis=1),
            root * np.concatenate(changes, axis=1),
        )

    def _unexpected(
        self, parameters: Array, moved: Array, slope: Array
    ) -> tuple[Array, Array]:
        """How far parameters are from what their family expects.

        Returns:
            Residuals (S, R) and their derivatives (S, R, P).
        """
        known = self._mapping.expectation(parameters)
        assert known is not None
        return known

    def _distortion(
        self, parameters: Array, moved: Array, slope: Array
    ) -> tuple[Array, Array]:
        """How far an affine map is from a similarity: HᵀH from a multiple of 1.

        Returns:
            Residuals (S, R) and their derivatives (S, R, P).
        """
        assert self._prior is not None
        assert isinstance(self._mapping, Affine)
        n_in = self._points.shape[1]
        scale = self._prior.scale
        linear, _ = self._mapping.split(parameters / scale, n_in)
        n_starts, n_out, _ = linear.shape
        count = n_in * (n_in + 1) // 2 - 1
        residual = np.empty((n_starts, count))
        change = np.zeros((n_starts, count, parameters.shape[1]))
        by_linear = change[..., : n_out * n_in]
        by_linear = by_linear.reshape(n_starts, count, n_out, n_in)
        row = 0
        for a in range(1, n_in):
            own = linear[:, :, a]
            # Each column is as long as the one before it, ...
            before = linear[:, :, a - 1]
            residual[:, row] = np.sum(before**2 - own**2, axis=1)
            by_linear[:, row, :, a - 1] = 2.0 / scale * before
            by_linear[:, row, :, a] = -2.0 / scale * own
            row += 1
            # ... and at right angles to all those.
            for b in range(a):
                other = linear[:, :, b]
                residual[:, row] = 2.0 * np.sum(own * other, axis=1)
                by_linear[:, row, :, b] = 2.0 / scale * own
                by_linear[:, row, :, a] = 2.0 / scale * other
                row += 1
        change[..., : n_out * n_in] = by_linear.reshape(n_starts, count, -1)
        return residual, change


class LocalMinima(NamedTuple):
    parameters: Array  # (S, P)
    cost: Array  # (S,)
    gradient: Array  # (S, P), half of it
    curvature: Array  # (S, P, P), half of it
    converged: NDArray[np.bool_]  # (S,)
    iterations: int  # of the longest search


def levenberg_marquardt(
    objective: Evaluate,
    starts: Array,
    *,
    max_iter: int,
    tol: float,
) -> LocalMinima:
    """Minimizes from all starts (S, P) at once.

    Each start has its own damping, after Nielsen; those that have converged
    rest. A start has converged once no step is expected to lower its cost by
    more than tol times the cost. The best minimum is then made exact.
    """
    minima = _descend(objective, starts, max_iter, tol)
    best = int(np.argmin(minima.cost))
    exact = _descend(objective, minima.parameters[best, None], _POLISH, 1e-14)
    for all_values, value in zip(minima[:4], exact[:4], strict=True):
        all_values[best] = value[0]
    return minima


def _descend(
    objective: Evaluate, starts: Array, max_iter: int, tol: float
) -> LocalMinima:
    """`levenberg_marquardt` without the last step."""
    parameters = np.array(starts, dtype=float)
    cost, gradient, curvature = objective(parameters)
    n_starts, size = parameters.shape
    damping = np.full(n_starts, 1e-2)
    growth = np.full(n_starts, 2.0)
    converged = np.zeros(n_starts, dtype=bool)
    floor = 1e-12
    iterations = 0
    for iterations in range(max_iter + 1):
        index = np.flatnonzero(~converged)
        if index.size == 0 or iterations == max_iter:
            break
        here = curvature[index]
        scale = here.reshape(-1, size * size)[:, :: size + 1]
        scale = np.maximum(scale, floor * scale.max(axis=1, keepdims=True))
        scale = np.maximum(scale, 1e-300)
        damped = here.copy()
        damped.reshape(-1, size * size)[:, :: size + 1] += (
            damping[index, None] * scale
        )
        step = -np.linalg.solve(damped, gradient[index][..., None])[..., 0]
        expected = np.sum(
            step * (damping[index, None] * scale * step - gradient[index]),
            axis=1,
        )
        trial = parameters[index] + step
        new_cost, new_gradient, new_curvature = objective(trial)
        gain = cost[index] - new_cost
        better = gain > 0.0
        small = (expected <= tol * cost[index]) | (damping[index] > 1e12)
        kept = index[better]
        parameters[kept] = trial[better]
        cost[kept] = new_cost[better]
        gradient[kept] = new_gradient[better]
        curvature[kept] = new_curvature[better]
        # Of more than 2 only that it is large counts.
        ratio = np.clip(gain / np.maximum(expected, 1e-300), -1e3, 1e3)
        shrink = np.maximum(1.0 / 9.0, 1.0 - (2.0 * ratio - 1.0) ** 3)
        damping[index] *= np.where(better, shrink, growth[index])
        damping[index] = np.maximum(damping[index], 1e-12)
        growth[index] = np.where(better, 2.0, 2.0 * growth[index])
        converged[index] = small
    return LocalMinima(
        parameters, cost, gradient, curvature, converged, iterations
    )


# Differential evolution: least members of a population, weight of a
# difference, share of parameters that a trial takes over, and generations
# without a better one after which it ends.
_MEMBERS, _WEIGHT, _CROSSOVER, _PATIENCE = 24, 0.6, 0.9, 30
# Its generations are cheap beside the iterations of the others.
_GENERATIONS = 5


def evolution(
    objective: Evaluate,
    starts: Array,
    *,
    max_iter: int,
    tol: float,
) -> LocalMinima:
    """Minimizes by differential evolution, from the starts as a population.

    It uses no derivatives and tries all members at once. Each start has a
    place in the population, and ends as the best that took this place.

    Source: Storn and Price 1997, current-to-best/1/bin.
    """
    random = np.random.default_rng(0)
    count, size = starts.shape
    extra = max(_MEMBERS - count, 0)
    spread = np.maximum(starts.std(axis=0), 0.1 * np.abs(starts).max())
    drawn = starts[random.integers(count, size=extra)]
    drawn = drawn + spread * random.standard_normal((extra, size))
    members = np.concatenate([starts, drawn]).astype(float)
    n = len(members)
    cost = objective(members)[0]
    improved_at, generation, least = 0, 0, float(cost.min())
    while generation < _GENERATIONS * max_iter:
        if generation - improved_at >= _PATIENCE:
            break
        generation += 1
        best = members[np.argmin(cost)]
        one, other = random.integers(n, size=(2, n))
        trial = members + _WEIGHT * (
            (best - members) + members[one] - members[other]
        )
        kept = random.random((n, size)) > _CROSSOVER
        kept[range(n), random.integers(size, size=n)] = False
        trial = np.where(kept, members, trial)
        new = objective(trial)[0]
        better = new < cost
        members[better], cost[better] = trial[better], new[better]
        if cost.min() < least * (1.0 - tol) - 1e-300:
            improved_at = generation
            least = float(cost.min())
    # What was drawn beside the starts may have found the best.
    best = int(np.argmin(cost))
    if best >= count:
        worst = int(np.argmax(cost[:count]))
        members[worst], cost[worst] = members[best], cost[best]
    members = members[:count]
    converged = np.full(count, generation < _GENERATIONS * max_iter)
    return LocalMinima(members, *objective(members), converged, generation)


def bfgs(
    objective: Evaluate,
    starts: Array,
    *,
    max_iter: int,
    tol: float,
) -> LocalMinima:
    """Minimizes from one start after another by BFGS, as in the paper."""

    def cost_and_gradient(p: Array) -> tuple[float, Array]:
        cost, gradient, _ = objective(p[None])
        return float(cost[0]), 2.0 * gradient[0]

    ends = []
    converged = []
    iterations = 0
    for start in starts:
        found = minimize(
            cost_and_gradient,
            start,
            jac=True,
            method="BFGS",
            options={"maxiter": max_iter, "gtol": tol},
        )
        ends.append(found.x)
        converged.append(found.nit < max_iter)
        iterations = max(iterations, int(found.nit))
    parameters = np.array(ends)
    return LocalMinima(
        parameters, *objective(parameters), np.array(converged), iterations
    )


def repetitions(moved: Array, cost: Array, domain: Domain) -> NDArray[np.bool_]:
    """Which minima (S,) map the samples as a better one already does."""
    z = moved / domain.deviation
    repeated = np.zeros(len(z), dtype=bool)
    kept: list[int] = []
    for s in np.argsort(cost):
        apart = np.abs(z[kept] - z[s]).max(axis=(1, 2))
        if np.any(apart < 1e-2):
            repeated[s] = True
        else:
            kept.append(s)
    return repeated
