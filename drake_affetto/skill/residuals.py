"""How well a skill fits: covariance of its errors, and the metric from it."""

import functools
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from scipy.stats import qmc

from drake_affetto.common.errors import require_array, require_range
from drake_affetto.common.typing import Array
from drake_affetto.skill.adapters import (
    SourceModel,
    unwrap_frozen,
)
from drake_affetto.skill.elm import ElmRegressor
from drake_affetto.skill.mappings import (
    Domain,
)

# How far the covariance of an ELM's errors is shrunk to its diagonal, and the
# least deviation of an error relative to that of its output. Chosen on draws
# of the tutorial's strokes that it does not show.
_SHRINKAGE = 0.5

_LEAST_ERROR = 0.01


def loo_covariance(
    estimator: ElmRegressor,
    X: ArrayLike,
    y: ArrayLike,
    shrinkage: float = 0.5,
) -> Array:
    """Covariance of the errors an ELM makes on samples it has not seen.

    Some outputs of a skill depend on the task, others hardly do and only vary
    with the demonstrations. Their leave-one-out errors tell them apart; as a
    `metric` they keep a transfer from fitting what cannot be predicted.

    Args:
        estimator: which has learned the samples.
        X: (N, d), those samples.
        y: (N, F).
        shrinkage: in [0, 1]: how far towards a diagonal matrix. With fewer
            samples than outputs some is needed.

    Returns:
        (F, F), positive definite.

    Raises:
        ValueError: if the data or the shrinkage do not fit.
    """
    require_range("shrinkage", shrinkage, 0.0, 1.0)
    X = require_array("X", X, (None, None))
    y = require_array("y", y)
    residuals = estimator.loo_residuals(X, y)
    residuals = residuals.reshape(len(residuals), -1)
    return _shrunk(residuals.T @ residuals / len(residuals), shrinkage)


def _shrunk(
    covariance: Array, shrinkage: float, floor: float | Array = 0.0
) -> Array:
    """On the way to its diagonal, with a floor (F,) of the variances."""
    variances = np.diag(covariance)
    # No output is known better than a thousandth of the worst.
    least = max(1e-6 * float(variances.max()), 1e-300)
    return (1.0 - shrinkage) * covariance + np.diag(
        shrinkage * variances + floor + least
    )


def expected_errors(
    estimator: Any, source: SourceModel, domain: Domain | None
) -> Array | None:
    """Covariance (F, F) of the errors of an ELM's predictions; else None.

    That of a new sample, averaged over the tasks of the domain: the noise of
    the outputs, and what the samples have left open of the function.
    """
    elm = unwrap_frozen(estimator)
    if not isinstance(elm, ElmRegressor) or source.n_out == 1:
        return None
    try:
        covariance = elm.error_covariance_
    except AttributeError:
        return None
    assert domain is not None
    tasks = domain.low + even_tasks(source.n_in) * (domain.high - domain.low)
    predicted, _ = source.evaluate(tasks)
    covariance = covariance * (1.0 + np.mean(elm.leverage(tasks)))
    # A skill that fits its samples exactly is still not exact elsewhere.
    floor = _LEAST_ERROR**2 * np.var(predicted, axis=0)
    return _shrunk(covariance, _SHRINKAGE, floor)


def whitening(metric: ArrayLike, n_out: int) -> Array:
    """L (F, F) such that errors e with that covariance have e L white."""
    covariance = require_array("metric", metric)
    if covariance.shape == (n_out,):
        covariance = np.diag(covariance)
    if covariance.shape != (n_out, n_out):
        raise ValueError(
            f"metric has shape {np.shape(metric)}, expected ({n_out},) or "
            f"({n_out}, {n_out})"
        )
    try:
        root = np.linalg.cholesky(covariance)
    except np.linalg.LinAlgError:
        raise ValueError(
            "metric is not positive definite, as a covariance of errors is"
        ) from None
    return np.linalg.inv(root).T


@functools.cache
def even_tasks(n_in: int) -> Array:
    """64 points that fill [0, 1]^n_in evenly."""
    return qmc.Halton(n_in, seed=0).random(64)
