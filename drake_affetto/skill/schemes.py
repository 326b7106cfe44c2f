"""What to do with a few samples in a new view: the schemes that are compared.

All have the same interface, so that a study can run through them:

    for name in SCHEMES:
        theta = make_scheme(name, skill).fit(X, y).predict(X_new)
"""

from collections.abc import Callable
import copy
from typing import Any, Self
import warnings

from numpy.typing import ArrayLike, NDArray
from sklearn.base import BaseEstimator, RegressorMixin, clone
from sklearn.exceptions import ConvergenceWarning
from sklearn.gaussian_process import GaussianProcessRegressor
from sklearn.gaussian_process.kernels import (
    RBF,
    ConstantKernel,
    DotProduct,
    WhiteKernel,
)
from sklearn.linear_model import LinearRegression
from sklearn.pipeline import make_pipeline
from sklearn.preprocessing import StandardScaler

from drake_affetto.skill.scheme_names import SCHEMES
from drake_affetto.skill.transfer import TransferRegressor


class NoTransfer(RegressorMixin, BaseEstimator):
    """The skill as it is, whatever samples there are.

    Args:
        estimator: the fitted skill.
    """

    def __init__(self, estimator: Any) -> None:
        self.estimator = estimator

    def fit(self, X: ArrayLike, y: ArrayLike) -> Self:
        """Does nothing."""
        return self

    def predict(self, X: ArrayLike) -> NDArray:
        """What the skill predicts for X (N, d)."""
        return self.estimator.predict(X)

    def __sklearn_is_fitted__(self) -> bool:
        return True

    def __sklearn_clone__(self) -> Self:
        return type(self)(self.estimator)


class FineTuned(RegressorMixin, BaseEstimator):
    """A copy of the skill that goes on learning, with what it already knows.

    Args:
        estimator: the fitted skill, with `partial_fit`; it is not changed.

    Attributes:
        estimator_: the copy, once `fit` has been called.
    """

    def __init__(self, estimator: Any) -> None:
        self.estimator = estimator

    def fit(self, X: ArrayLike, y: ArrayLike) -> Self:
        """Adds the samples X (N, d), y (N, F) to those of the skill."""
        self.estimator_ = copy.deepcopy(self.estimator)
        self.estimator_.partial_fit(X, y)
        return self

    def predict(self, X: ArrayLike) -> NDArray:
        """What the copy predicts for X (N, d)."""
        return self.estimator_.predict(X)

    def __sklearn_clone__(self) -> Self:
        return type(self)(self.estimator)


class _GaussianProcess(GaussianProcessRegressor):
    """scikit-learn's, which does not warn of length scales at their limits.

    A handful of samples often tells no more than that.
    """

    def fit(self, X: ArrayLike, y: ArrayLike) -> Self:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", ConvergenceWarning)
            return super().fit(X, y)


def _relearn(source: Any, input_range: ArrayLike | None) -> Any:
    scratch = clone(source)
    if input_range is not None:
        scratch.set_params(input_range=input_range)
    return scratch


def _paper(source: Any) -> TransferRegressor:
    return TransferRegressor(
        source,
        prior=None,
        metric=None,
        average=False,
        solver="bfgs",
        n_starts=1,
    )


def _gaussian_process(source: Any) -> Any:
    # A plane and a smooth departure from it; inputs and outputs have unit
    # deviation. Better on few samples than the departure alone.
    kernel = (
        DotProduct(1.0, (1e-2, 1e2))
        + ConstantKernel(0.1, (1e-3, 1e1)) * RBF(1.5, (0.5, 10.0))
        + WhiteKernel(1e-3, (1e-5, 1e-1))
    )
    return make_pipeline(
        StandardScaler(),
        _GaussianProcess(kernel, normalize_y=True, random_state=0),
    )


_MAKERS: dict[str, Callable[..., Any]] = {
    "unchanged": NoTransfer,
    "relearn": _relearn,
    "continue": FineTuned,
    "transfer": _paper,
    "transfer_default": TransferRegressor,
    "transfer_affine": TransferRegressor,
    "gaussian_process": _gaussian_process,
    "affine_regression": lambda source: LinearRegression(),
}


def make_scheme(
    name: str, source: Any, *, input_range: ArrayLike | None = None
) -> Any:
    """The scheme of that name for a skill: something with fit and predict.

    - unchanged: the skill as it is.
    - relearn: the same kind of regressor, from scratch.
    - continue: a copy of the skill, trained further.
    - transfer: Eq. 5 as in the paper: affine, BFGS from the identity.
    - transfer_default, transfer_affine: `TransferRegressor` with its defaults,
      whose map is affine. A study gives the first whatever map its scenario
      names.
    - gaussian_process, affine_regression: fitted to the new samples alone.

    Args:
        name: one of `SCHEMES`.
        source: the fitted skill; it is never changed.
        input_range: for "relearn", (d, 2), the ranges of the new inputs, if
            they are not those of the skill's.

    Raises:
        ValueError: if there is no such scheme.
    """
    if name not in _MAKERS:
        raise ValueError(f"scheme is {name!r}, expected one of {SCHEMES}")
    if name == "relearn":
        return _relearn(source, input_range)
    return _MAKERS[name](source)
