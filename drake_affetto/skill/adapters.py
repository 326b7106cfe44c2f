"""The input Jacobian of any fitted regressor.

`TransferRegressor` moves inputs until a skill's predictions fit: it needs
their derivative. An estimator may offer it as `input_jacobian(X)`, as the
`ElmRegressor` does. For scikit-learn's neural network, kernel ridge, Gaussian
process and linear models it is computed here in closed form, also behind
scalers in a pipeline. Everything else is differentiated numerically, at 2 d
predictions for each Jacobian.
"""

from collections.abc import Callable
import dataclasses
from typing import Any
import warnings

import numpy as np
from numpy.typing import ArrayLike
from sklearn.frozen import FrozenEstimator
from sklearn.gaussian_process import GaussianProcessRegressor, kernels
from sklearn.kernel_ridge import KernelRidge
from sklearn.neural_network import MLPRegressor
from sklearn.pipeline import Pipeline
from sklearn.preprocessing import MinMaxScaler, StandardScaler
from sklearn.utils.validation import check_is_fitted

from drake_affetto.common.typing import Array
from drake_affetto.skill.elm import ElmRegressor
from drake_affetto.skill.mappings import Domain

# Predictions (M, F) and their input Jacobian (M, F, d) at Z (M, d).
Evaluate = Callable[[Array], tuple[Array, Array]]

# Places at which it is asked whether derivatives are of use.
_PROBES = 64


@dataclasses.dataclass(eq=False)
class SourceModel:
    """A fitted regressor as the pair of its predictions and their Jacobian.

    Attributes:
        evaluate: Z (M, d) to ŷ (M, F) and ∂ŷ/∂z (M, F, d).
        n_in: d.
        n_out: F.
        exact: whether the Jacobian is in closed form.
        flat: whether the regressor predicts (M,) rather than (M, 1).
        values: Z to ŷ alone, where the Jacobian is not in closed form.
    """

    evaluate: Evaluate
    n_in: int
    n_out: int
    exact: bool = True
    flat: bool = False
    values: Callable[[Array], Array] | None = None

    def project(self, matrix: Array) -> "SourceModel":
        """The model of ŷ · matrix, for a matrix (F, r)."""

        def evaluate(Z: Array) -> tuple[Array, Array]:
            value, jacobian = self.evaluate(Z)
            return value @ matrix, np.swapaxes(
                np.swapaxes(jacobian, 1, 2) @ matrix, 1, 2
            )

        values = self.values
        return SourceModel(
            evaluate,
            self.n_in,
            matrix.shape[1],
            self.exact,
            values=None if values is None else lambda Z: values(Z) @ matrix,
        )

    def output_basis(self) -> Array | None:
        """(F, r), orthonormal columns that span ŷ; None if not known."""
        return None


class ElmSource(SourceModel):
    """An ELM, whose outputs are all within the span of its read-out."""

    def __init__(self, weights: Any, biases: Any, coef: Any) -> None:
        self._weights = weights
        self._biases = biases
        self._coef = np.ascontiguousarray(coef)
        super().__init__(self._evaluate, weights.shape[0], coef.shape[1])

    def _evaluate(self, Z: Array) -> tuple[Array, Array]:
        phi = Z @ self._weights
        phi += self._biases
        # tanh is several times faster than expit.
        np.tanh(0.5 * phi, out=phi)
        phi *= 0.5
        phi += 0.5
        stacked = np.empty((self.n_in + 1, *phi.shape))
        stacked[0] = phi
        np.multiply(
            phi * (1.0 - phi), self._weights[:, None, :], out=stacked[1:]
        )
        product = stacked @ self._coef
        return product[0], np.moveaxis(product[1:], 0, 2)

    def project(self, matrix: Array) -> "SourceModel":
        """See base class."""
        return ElmSource(self._weights, self._biases, self._coef @ matrix)

    def output_basis(self) -> Array | None:
        """See base class."""
        if self._coef.shape[1] <= 2:
            return None
        _, size, basis = np.linalg.svd(self._coef, full_matrices=False)
        rank = int(np.sum(size > 1e-12 * size[0])) if size[0] > 0.0 else 1
        return basis[: max(rank, 1)].T


def source_model(estimator: Any) -> SourceModel:
    """The fitted `estimator` with the input Jacobian of its predictions.

    Raises:
        NotFittedError: if it has not been fitted.
    """
    estimator = unwrap_frozen(estimator)
    check_is_fitted(estimator)
    if isinstance(estimator, ElmRegressor):
        weights = estimator.input_gain_[:, None] * estimator.input_weights_
        source: SourceModel = ElmSource(
            weights,
            estimator.biases_ - estimator.input_center_ @ weights,
            estimator.coef_.reshape(len(estimator.biases_), -1),
        )
        source.flat = estimator.coef_.ndim == 1
        return source
    n_in = int(estimator.n_features_in_)
    sample = np.asarray(predict_unnamed(estimator, np.zeros((1, n_in))))
    evaluate = _evaluate_exactly(estimator, n_in, sample.size)
    flat = sample.ndim == 1
    if evaluate is not None:
        return SourceModel(evaluate, n_in, sample.size, flat=flat)

    def values(Z: Array) -> Array:
        return _rows(predict_unnamed(estimator, Z))

    return SourceModel(
        _evaluate_numerically(values),
        n_in,
        sample.size,
        exact=False,
        flat=flat,
        values=values,
    )


def predict_unnamed(estimator: Any, Z: Array, method: str = "predict") -> Any:
    """Predictions at Z (M, d) of an estimator that may know its columns' names.

    One that was fitted to named columns is given them by the same names: it
    may choose among them, and would warn at each call.

    Args:
        estimator: Fitted estimator.
        Z: Inputs (M, d), in the order of the columns it was fitted to.
        method: Its method that is called.
    """
    call = getattr(estimator, method)
    names = getattr(unwrap_frozen(estimator), "feature_names_in_", None)
    if names is None:
        return call(Z)
    try:
        import pandas as pd
    except ImportError:
        with warnings.catch_warnings():
            warnings.filterwarnings("ignore", "X does not have valid feature")
            return call(Z)
    return call(pd.DataFrame(Z, columns=names))


def without_derivatives(source: SourceModel) -> SourceModel:
    """The model with a Jacobian of zeros, at one prediction each."""
    values = source.values
    assert values is not None

    def evaluate(Z: Array) -> tuple[Array, Array]:
        value = values(Z)
        return value, np.zeros((*value.shape, Z.shape[1]))

    return dataclasses.replace(source, evaluate=evaluate)


def has_useful_derivatives(source: SourceModel, domain: Domain) -> bool:
    """Whether a search may follow the model's derivatives.

    Not those of a forest or of nearest neighbors, whose predictions are
    constant but for jumps: their derivative is zero at most places.

    Args:
        source: The model.
        domain: Where it is asked.
    """
    if source.exact:
        return True
    width = np.maximum(domain.high - domain.low, 1e-12)
    random = np.random.default_rng(0)
    Z = domain.low + width * random.random((_PROBES, source.n_in))
    value, jacobian = source.evaluate(Z)
    change = np.abs(jacobian * width).max(axis=(1, 2))
    flat = change <= 1e-6 * max(float(np.ptp(value, axis=0).max()), 1e-300)
    return bool(np.mean(flat) < 0.5)


def _evaluate_exactly(estimator: Any, n_in: int, n_out: int) -> Evaluate | None:
    """The closed form of whatever it is, or None."""
    if callable(getattr(estimator, "input_jacobian", None)):
        return _evaluate_own(estimator)
    for kind, make in (
        (MLPRegressor, _evaluate_mlp),
        (KernelRidge, _evaluate_kernel_ridge),
        (GaussianProcessRegressor, _evaluate_gaussian_process),
        (Pipeline, _evaluate_pipeline),
    ):
        if isinstance(estimator, kind):
            return make(estimator)
    if hasattr(estimator, "coef_") and hasattr(estimator, "intercept_"):
        coef = np.atleast_2d(np.asarray(estimator.coef_, dtype=float))
        if coef.shape == (n_out, n_in):
            linear = _evaluate_linear(coef, estimator.intercept_)
            # There are models with a link function behind the same names.
            Z = np.concatenate([np.zeros((1, n_in)), np.eye(n_in)])
            if np.allclose(linear(Z)[0], _rows(predict_unnamed(estimator, Z))):
                return linear
    return None


def input_jacobian(estimator: Any, X: ArrayLike) -> Array:
    """∂ŷ/∂x (N, F, d) of any fitted regressor at X (N, d).

    Args:
        estimator: A fitted regressor.

    Raises:
        NotFittedError: if it has not been fitted.
    """
    return source_model(estimator).evaluate(np.asarray(X, dtype=float))[1]


def source_domain(estimator: Any) -> Domain | None:
    """Where a fitted regressor's training inputs lay, if it remembers."""
    estimator = unwrap_frozen(estimator)
    if isinstance(estimator, ElmRegressor):
        return Domain(
            estimator.input_mean_,
            estimator.input_covariance_,
            estimator.input_low_,
            estimator.input_high_,
        )
    for name in ("X_train_", "X_fit_"):
        samples = getattr(estimator, name, None)
        if isinstance(samples, np.ndarray) and samples.ndim == 2:
            return Domain.of_samples(samples)
    return None


def unwrap_frozen(estimator: Any) -> Any:
    """What is inside scikit-learn's FrozenEstimator, or the thing itself."""
    while isinstance(estimator, FrozenEstimator):
        estimator = estimator.estimator
    return estimator


def _rows(values: Any) -> Array:
    values = np.asarray(values, dtype=float)
    return values[:, None] if values.ndim == 1 else values


def _evaluate_own(estimator: Any) -> Evaluate:
    def evaluate(Z: Array) -> tuple[Array, Array]:
        value = np.asarray(predict_unnamed(estimator, Z))
        jacobian = predict_unnamed(estimator, Z, "input_jacobian")
        jacobian = np.asarray(jacobian)
        return _rows(value), jacobian.reshape(len(Z), -1, Z.shape[1])

    return evaluate


def _evaluate_linear(coef: Array, intercept: Any) -> Evaluate:
    def evaluate(Z: Array) -> tuple[Array, Array]:
        value = Z @ coef.T + intercept
        return value, np.broadcast_to(coef, (len(Z), *coef.shape))

    return evaluate


def _evaluate_numerically(values: Callable[[Array], Array]) -> Evaluate:
    def evaluate(Z: Array) -> tuple[Array, Array]:
        n, d = Z.shape
        # A cube root of rounding balances it against the cubic error.
        step = 6e-6 * np.maximum(1.0, np.abs(Z).max(axis=0, initial=0.0))
        shifts = np.concatenate([np.diag(step), -np.diag(step)])
        moved = (Z + shifts[:, None, :]).reshape(-1, d)
        value = values(np.concatenate([Z, moved]))
        both = value[n:].reshape(2, d, n, -1)
        slope = (both[0] - both[1]) / (2.0 * step)[:, None, None]
        return value[:n], np.moveaxis(slope, 0, 2)

    return evaluate


def _evaluate_mlp(estimator: Any) -> Evaluate | None:
    slopes: dict[str, Any] = {
        "identity": np.ones_like,
        "logistic": lambda a: a * (1.0 - a),
        "tanh": lambda a: 1.0 - a**2,
        "relu": lambda a: (a > 0.0).astype(float),
    }
    activations: dict[str, Any] = {
        "identity": lambda z: z,
        "logistic": lambda z: 0.5 * (1.0 + np.tanh(0.5 * z)),
        "tanh": np.tanh,
        "relu": lambda z: np.maximum(z, 0.0),
    }
    activate = activations[estimator.activation]
    slope = slopes[estimator.activation]

    def evaluate(Z: Array) -> tuple[Array, Array]:
        layer = Z
        # ∂layer/∂z, (M, d, units)
        chain = np.broadcast_to(np.eye(Z.shape[1]), (len(Z), *[Z.shape[1]] * 2))
        last = len(estimator.coefs_) - 1
        parts = zip(estimator.coefs_, estimator.intercepts_, strict=True)
        for i, (weights, bias) in enumerate(parts):
            layer = layer @ weights + bias
            chain = chain @ weights
            if i < last:
                layer = activate(layer)
                chain = chain * slope(layer)[:, None, :]
        return layer, np.swapaxes(chain, 1, 2)

    return evaluate


def _evaluate_kernel_ridge(estimator: Any) -> Evaluate | None:
    data = np.asarray(estimator.X_fit_, dtype=float)
    dual = _rows(estimator.dual_coef_)
    gamma = estimator.gamma
    gamma = 1.0 / data.shape[1] if gamma is None else gamma
    if estimator.kernel == "rbf":
        kernel: Any = kernels.RBF(np.sqrt(0.5 / gamma))
    elif estimator.kernel == "linear":
        kernel = kernels.DotProduct(0.0)
    else:
        return None
    return _evaluate_kernel(kernel, data, dual)


def _evaluate_gaussian_process(estimator: Any) -> Evaluate | None:
    if not hasattr(estimator, "alpha_"):
        return None
    scale = np.atleast_1d(estimator._y_train_std)
    mean = np.atleast_1d(estimator._y_train_mean)
    data = np.asarray(estimator.X_train_, dtype=float)
    dual = _rows(estimator.alpha_) * scale
    evaluate = _evaluate_kernel(estimator.kernel_, data, dual)
    if evaluate is None:
        return None

    def shifted(Z: Array) -> tuple[Array, Array]:
        value, jacobian = evaluate(Z)
        return value + mean, jacobian

    return shifted


def _evaluate_kernel(kernel: Any, data: Array, dual: Array) -> Evaluate | None:
    """Σ_n k(z, x_n) α_n, if the kernel's derivative is known."""
    if _kernel_slope(kernel, data[:1], data[:1]) is None:
        return None

    def evaluate(Z: Array) -> tuple[Array, Array]:
        known = _kernel_slope(kernel, Z, data)
        assert known is not None
        value, slope = known
        return value @ dual, np.swapaxes(np.swapaxes(slope, 1, 2) @ dual, 1, 2)

    return evaluate


def _kernel_slope(
    kernel: Any, Z: Array, data: Array
) -> tuple[Array, Array] | None:
    """k(z, x) (M, N) and ∂k/∂z (M, N, d), or None if not known here."""
    if isinstance(kernel, (kernels.Sum, kernels.Product)):
        first = _kernel_slope(kernel.k1, Z, data)
        second = _kernel_slope(kernel.k2, Z, data)
        if first is None or second is None:
            return None
        (k1, s1), (k2, s2) = first, second
        if isinstance(kernel, kernels.Sum):
            return k1 + k2, s1 + s2
        return k1 * k2, s1 * k2[..., None] + s2 * k1[..., None]
    # Exactly these: a subclass may compute something else.
    value = kernel(Z, data)
    if type(kernel) in (kernels.ConstantKernel, kernels.WhiteKernel):
        return value, np.zeros((*value.shape, Z.shape[1]))
    if type(kernel) is kernels.DotProduct:
        return value, np.broadcast_to(data, (len(Z), *data.shape))
    if type(kernel) is kernels.RBF:
        apart = (Z[:, None] - data) / np.square(kernel.length_scale)
        return value, -apart * value[..., None]
    if type(kernel) is kernels.Matern and kernel.nu in (1.5, 2.5):
        scaled = (Z[:, None] - data) / kernel.length_scale
        root = np.sqrt(2.0 * kernel.nu)
        r = root * np.linalg.norm(scaled, axis=2)
        factor = np.exp(-r) * (1.0 if kernel.nu == 1.5 else (1.0 + r) / 3.0)
        slope = -(root**2) * factor[..., None] * scaled / kernel.length_scale
        return value, slope
    return None


def _evaluate_pipeline(estimator: Any) -> Evaluate | None:
    scalers = [step for _, step in estimator.steps[:-1]]
    if not all(
        isinstance(s, StandardScaler)
        or (isinstance(s, MinMaxScaler) and not s.clip)
        or s in (None, "passthrough")
        for s in scalers
    ):
        return None
    inner = source_model(estimator.steps[-1][1])
    if not inner.exact:
        return None
    before = estimator[:-1]
    n_in = int(estimator.n_features_in_)
    corners = np.concatenate([np.zeros((1, n_in)), np.eye(n_in)])
    moved = np.asarray(
        predict_unnamed(before, corners, "transform"), dtype=float
    )
    # Scalers are affine, and act on each input by itself.
    gain = np.diag(moved[1:] - moved[0])

    def evaluate(Z: Array) -> tuple[Array, Array]:
        value, jacobian = inner.evaluate(moved[0] + gain * Z)
        return value, jacobian * gain

    return evaluate
