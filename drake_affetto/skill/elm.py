"""Extreme Learning Machine: a regressor that learns one sample at a time.

A hidden layer of random, fixed logistic units and a linear read-out (Eq. 3 of
Schulz et al. 2018):

    ŷ(x) = Wᵀ φ(x),    φ(x) = σ(Vᵀ x̄ + b),

with x̄ the input scaled to its range. The read-out W minimizes the squared
error plus α ‖W‖² (Eq. 4). It is found recursively: what has been learned is
kept as a square root of the information matrix, which a new sample updates by
an orthogonal transformation. So the order of the samples does not matter, and
rounding does not add up, however many there are. What that transformation
leaves of a sample's outputs tells, beside, how well they could be predicted.
"""

import copy
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike
from scipy.linalg import solve_triangular
from scipy.linalg.blas import dsyrk
from scipy.linalg.lapack import dtpmqrt, dtpqrt, dtrtrs
from scipy.special import expit
from sklearn.base import BaseEstimator, MultiOutputMixin, RegressorMixin
from sklearn.utils import check_random_state
from sklearn.utils.validation import check_is_fitted, validate_data

from drake_affetto.common.typing import Array

# Samples that are transformed together: bounds the memory, not the result.
_CHUNK = 1024
# Columns that LAPACK transforms together; the fastest for 50 units.
_BLOCK = 16
# With more outputs their covariance would not be worth its memory.
_MOST_OUTPUTS = 2000


# What the hidden layer and the memory have been made with; `forgetting` may
# change from sample to sample.
_FIXED = ("n_hidden", "alpha", "weight_scale", "input_range")


class ElmRegressor(MultiOutputMixin, RegressorMixin, BaseEstimator):
    """A random hidden layer with a recursively learned linear read-out.

    Args:
        n_hidden: H, how many hidden units.
        alpha: weight of ‖W‖² beside the sum of squared errors.
        forgetting: λ in (0, 1]: each new sample scales the weight of all
            earlier ones by λ. The ridge is not forgotten, so that the read-out
            stays determined where no sample has come for long.
        weight_scale: standard deviation of the normal input weights and
            biases. With scaled inputs 1 gives units that are nearly linear
            across the range and so a smooth interpolation of a few samples;
            6 resolves finer structure and needs dozens of samples.
        input_range: None, to take inputs as they are; or (d, 2), the lowest
            and highest value of each input, which are mapped to -1 and 1. A
            single pair serves all inputs. Inputs may lie outside.
        random_state: seed of the hidden layer.

    Attributes:
        input_weights_: (d, H), V.
        biases_: (H,), b.
        coef_: (H, F), or (H,) if y was one-dimensional: W.
        input_center_, input_gain_: (d,), x̄ = (x - center) * gain.
        error_covariance_: (F, F), of the noise of the outputs, as far as the
            samples tell; F at most 2000.
        n_samples_seen_: how many samples have been learned.
        input_mean_, input_covariance_: (d,), (d, d), of their inputs.
        input_low_, input_high_: (d,), least and greatest of their inputs.
        n_features_in_: d.
    """

    # Of the present R and z, as soon as it is asked for.
    _coef: Array | None

    def __init__(
        self,
        n_hidden: int = 50,
        alpha: float = 1e-4,
        forgetting: float = 1.0,
        weight_scale: float = 1.0,
        input_range: ArrayLike | None = None,
        random_state: int | np.random.RandomState | None = None,
    ) -> None:
        self.n_hidden = n_hidden
        self.alpha = alpha
        self.forgetting = forgetting
        self.weight_scale = weight_scale
        self.input_range = input_range
        self.random_state = random_state

    def fit(self, X: ArrayLike, y: ArrayLike) -> Self:
        """Forgets everything, then learns the samples X (N, d), y (N, F).

        Raises:
            ValueError: if the data or a parameter do not fit.
        """
        X, y = self._validate(X, y, reset=True)
        self._begin(X.shape[1], y)
        self._learn(X, y)
        # Prediction must not change the estimator; it may after partial_fit.
        self._read_out()
        return self

    def partial_fit(self, X: ArrayLike, y: ArrayLike) -> Self:
        """Learns further samples X (N, d), y (N, F).

        With `forgetting=1` the read-out is that of `fit` on all samples so
        far, in any order. It is solved for when next needed.

        Raises:
            ValueError: if the data or a parameter do not fit, or a parameter
                other than `forgetting` is not what the learning began with.
        """
        first = not hasattr(self, "_root")
        X, y = self._validate(X, y, reset=first)
        if first:
            self._begin(X.shape[1], y)
        elif y.ndim != self._y_ndim or (
            y.ndim == 2 and y.shape[1] != self._moment.shape[1]
        ):
            expected = (
                "(n_samples,)"
                if self._y_ndim == 1
                else f"(n_samples, {self._moment.shape[1]})"
            )
            raise ValueError(
                f"y has shape {y.shape}, but the earlier samples make this "
                f"{type(self).__name__} expect {expected}"
            )
        self._check_unchanged()
        self._learn(X, y)
        return self

    def predict(self, X: ArrayLike) -> Array:
        """ŷ (N, F), or (N,) if y was one-dimensional, for X (N, d)."""
        return self.hidden(X) @ self.coef_

    def hidden(self, X: ArrayLike) -> Array:
        """φ (N, H), the activation of the hidden layer, for X (N, d)."""
        check_is_fitted(self)
        checked = validate_data(self, X, reset=False, dtype=np.float64)
        return self._activate(np.asarray(checked))

    def input_jacobian(self, X: ArrayLike) -> Array:
        """∂ŷ/∂x (N, F, d), or (N, d) if y was one-dimensional, at X (N, d)."""
        phi = self.hidden(X)
        slope = phi * (1.0 - phi)
        # The weights by raw inputs: the scaling is part of the derivative.
        weights = self.input_weights_ * self.input_gain_[:, None]
        if self._y_ndim == 1:
            return (slope * self.coef_) @ weights.T
        jacobian = np.empty((len(slope), self.coef_.shape[1], len(weights)))
        for i, row in enumerate(weights):
            jacobian[:, :, i] = (slope * row) @ self.coef_
        return jacobian

    def loo_residuals(self, X: ArrayLike, y: ArrayLike) -> Array:
        """What each learned sample would be missed by, had it been left out.

        Exact for the samples that the regressor has learned with
        `forgetting=1`: the residual over one minus the sample's leverage.

        Args:
            X: (N, d), samples that have been learned.
            y: (N, F) or (N,).

        Returns:
            y - ŷ₋ᵢ, in the shape of y.
        """
        check_is_fitted(self)
        X, y = self._validate(X, y, reset=False)
        free = 1.0 - self.leverage(X)
        residuals = y - self._activate(X) @ self.coef_
        # 1 where a sample alone determines its own prediction.
        free = np.maximum(free, 1e-12)
        return residuals / (free if y.ndim == 1 else free[:, None])

    def leverage(self, X: ArrayLike) -> Array:
        """φᵀ (ΦᵀΦ + α I)⁻¹ φ (N,) at X (N, d).

        A prediction there has an error of covariance
        (leverage + noise) · `error_covariance_`, with noise = 1 for a further
        sample and 0 for the function itself.
        """
        half = solve_triangular(self._root, self.hidden(X).T, trans="T")
        return np.einsum("hn,hn->n", half, half)

    @property
    def error_covariance_(self) -> Array:
        """(F, F); see the class.

        The read-out's prior being that of the ridge, this is the covariance
        under which the outputs learned so far are likeliest.
        """
        check_is_fitted(self)
        if self._left is None:
            raise AttributeError(
                f"with more than {_MOST_OUTPUTS} outputs there is no "
                "error_covariance_"
            )
        upper = np.triu(self._left)
        return (upper + np.triu(upper, 1).T) / self._weight_seen

    @property
    def coef_(self) -> Array:
        """The read-out W, (H, F) or (H,)."""
        check_is_fitted(self)
        return self._read_out()

    def _validate(
        self, X: ArrayLike, y: ArrayLike, *, reset: bool
    ) -> tuple[Array, Array]:
        checked, targets = validate_data(
            self,
            X,
            y,
            reset=reset,
            multi_output=True,
            y_numeric=True,
            dtype=np.float64,
        )
        return np.asarray(checked), np.asarray(targets, dtype=np.float64)

    def _begin(self, n_features: int, y: Array) -> None:
        """Draws the hidden layer and lays out an empty memory."""
        self._check_parameters()
        self.input_center_, self.input_gain_ = _scaling(
            self.input_range, n_features
        )
        random = check_random_state(self.random_state)
        scale = self.weight_scale
        self.input_weights_ = scale * random.normal(
            size=(n_features, self.n_hidden)
        )
        self.biases_ = scale * random.normal(size=self.n_hidden)
        self._begun_with = {
            name: copy.deepcopy(getattr(self, name)) for name in _FIXED
        }
        self._begun_with["random_state"] = self.random_state
        self._y_ndim = y.ndim
        n_outputs = 1 if y.ndim == 1 else y.shape[1]
        # R and z with RᵀR = ΦᵀΦ + α I and Rᵀz = ΦᵀY, by columns for LAPACK.
        self._root = np.asfortranarray(
            np.sqrt(self.alpha) * np.eye(self.n_hidden)
        )
        self._moment = np.zeros((self.n_hidden, n_outputs), order="F")
        # YᵀY - zᵀz, its upper triangle; and the weight of all samples.
        self._left = (
            np.zeros((n_outputs, n_outputs), order="F")
            if n_outputs <= _MOST_OUTPUTS
            else None
        )
        self._weight_seen = 0.0
        self.n_samples_seen_ = 0
        self.input_mean_ = np.zeros(n_features)
        self.input_covariance_ = np.zeros((n_features, n_features))
        self.input_low_ = np.full(n_features, np.inf)
        self.input_high_ = np.full(n_features, -np.inf)

    def _check_parameters(self) -> None:
        integer = isinstance(self.n_hidden, (int, np.integer))
        if not integer or self.n_hidden < 1:
            raise ValueError(
                f"n_hidden is {self.n_hidden!r}, expected a positive integer"
            )
        for name, low, high in (
            ("alpha", 0.0, np.inf),
            ("weight_scale", 0.0, np.inf),
            ("forgetting", 0.0, 1.0),
        ):
            value = getattr(self, name)
            if not low < value <= high or not np.isfinite(value):
                raise ValueError(
                    f"{name} is {value!r}, expected a number above {low:g}"
                    + (f" and at most {high:g}" if high < np.inf else "")
                )

    def _check_unchanged(self) -> None:
        """Raises ValueError for a parameter that would have no effect."""
        self._check_parameters()
        for name, then in self._begun_with.items():
            now = getattr(self, name)
            if now is then:
                continue
            if isinstance(now, np.random.RandomState) or not np.array_equal(
                np.asarray(now), np.asarray(then)
            ):
                raise ValueError(
                    f"{name} is {now!r}, but the learning has begun with "
                    f"{then!r}; only `fit` begins anew"
                )

    def _activate(self, X: Array) -> Array:
        scaled = (X - self.input_center_) * self.input_gain_
        return expit(scaled @ self.input_weights_ + self.biases_)

    def _learn(self, X: Array, y: Array) -> None:
        y = y.reshape(len(X), -1)
        for begin in range(0, len(X), _CHUNK):
            rows = slice(begin, begin + _CHUNK)
            self._absorb(self._activate(X[rows]), y[rows])
        self._note_inputs(X)
        self._coef = None

    def _note_inputs(self, X: Array) -> None:
        """Keeps the moments and limits of the inputs learned so far."""
        known, new = self.n_samples_seen_, len(X)
        total = known + new
        mean = X.mean(axis=0)
        apart = mean - self.input_mean_
        centered = X - mean
        self.input_covariance_ = (
            known * self.input_covariance_
            + centered.T @ centered
            + (known * new / total) * np.outer(apart, apart)
        ) / total
        self.input_mean_ = self.input_mean_ + (new / total) * apart
        self.input_low_ = np.minimum(self.input_low_, X.min(axis=0))
        self.input_high_ = np.maximum(self.input_high_, X.max(axis=0))
        self.n_samples_seen_ = total

    def _absorb(self, phi: Array, y: Array) -> None:
        """Updates R and z by the rows phi (N, H) and y (N, F)."""
        n = len(phi)
        kept = self.forgetting**n
        if self.forgetting < 1.0:
            age = np.arange(n - 1, -1, -1)[:, None]
            weight = np.sqrt(self.forgetting**age)
            self._root *= np.sqrt(kept)
            self._moment *= np.sqrt(kept)
            # What the ridge has lost by forgetting comes back as rows.
            ridge = np.sqrt((1.0 - kept) * self.alpha) * np.eye(self.n_hidden)
            phi = np.vstack([weight * phi, ridge])
            y = np.vstack([weight * y, np.zeros((self.n_hidden, y.shape[1]))])
        block = min(_BLOCK, self.n_hidden)
        # QR of [R; φ], and the same transformation of [z; y]. R keeps its
        # triangle, z is overwritten in place.
        self._root, reflectors, factors, _ = dtpqrt(
            0, block, self._root, np.asfortranarray(phi), overwrite_a=True
        )
        moment, left, _ = dtpmqrt(
            0,
            reflectors,
            factors,
            self._moment,
            np.asfortranarray(y),
            trans="T",
            overwrite_a=True,
        )
        if self._left is not None:
            self._left = dsyrk(
                1.0, left, beta=kept, c=self._left, trans=1, overwrite_c=True
            )
        self._weight_seen = kept * self._weight_seen + (
            n
            if self.forgetting == 1.0
            else (1.0 - kept) / (1.0 - self.forgetting)
        )
        # LAPACK gives a single column strides that a copy would not have.
        if moment.shape[1] == 1:
            moment = moment[:, 0].copy().reshape(-1, 1)
        self._moment = moment

    def _read_out(self) -> Array:
        if self._coef is None:
            self._coef = self._solve()
        return self._coef

    def _solve(self) -> Array:
        coef, _ = dtrtrs(self._root, self._moment)
        return coef[:, 0] if self._y_ndim == 1 else coef

    def __sklearn_tags__(self) -> Any:
        tags = super().__sklearn_tags__()
        tags.target_tags.single_output = True
        return tags


def _scaling(
    input_range: ArrayLike | None, n_features: int
) -> tuple[Array, Array]:
    """Center and gain (d,) that take the range to [-1, 1]."""
    if input_range is None:
        return np.zeros(n_features), np.ones(n_features)
    limits = np.asarray(input_range, dtype=np.float64)
    if limits.shape not in ((2,), (n_features, 2)):
        raise ValueError(
            f"input_range has shape {limits.shape}, expected (2,) or "
            f"({n_features}, 2): the lowest and highest value of each input"
        )
    limits = np.broadcast_to(limits, (n_features, 2))
    low, high = limits[:, 0], limits[:, 1]
    if not (np.isfinite(limits).all() and (high > low).all()):
        raise ValueError(
            f"input_range is {np.asarray(input_range).tolist()}, expected "
            "finite pairs whose second value is above the first"
        )
    return (low + high) / 2.0, 2.0 / (high - low)
