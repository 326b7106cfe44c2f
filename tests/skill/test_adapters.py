"""Input Jacobians of other people's estimators, by central differences."""

import numpy as np
from numpy.testing import assert_allclose
import pytest
from sklearn.exceptions import NotFittedError
from sklearn.frozen import FrozenEstimator
from sklearn.gaussian_process import GaussianProcessRegressor
from sklearn.gaussian_process.kernels import (
    RBF,
    ConstantKernel,
    DotProduct,
    Matern,
    RationalQuadratic,
    WhiteKernel,
)
from sklearn.kernel_ridge import KernelRidge
from sklearn.linear_model import PoissonRegressor, Ridge
from sklearn.neighbors import KNeighborsRegressor
from sklearn.neural_network import MLPRegressor
from sklearn.pipeline import make_pipeline
from sklearn.preprocessing import (
    MinMaxScaler,
    PolynomialFeatures,
    StandardScaler,
)

from drake_affetto.skill import ElmRegressor, input_jacobian
from drake_affetto.skill.adapters import source_domain, source_model

RANDOM = np.random.default_rng(0)
X = RANDOM.uniform(-1.0, 2.0, (40, 3))
Y = np.column_stack([np.sin(X[:, 0]) * X[:, 1], X[:, 2] ** 2 + 1.0])
AT = RANDOM.uniform(-1.2, 2.2, (7, 3))


def mlp(activation):
    return MLPRegressor(
        hidden_layer_sizes=(9, 5),
        activation=activation,
        max_iter=30,
        random_state=0,
    )


EXACT = {
    "elm": ElmRegressor(input_range=[-1, 2], random_state=0),
    "mlp logistic": mlp("logistic"),
    "mlp tanh": mlp("tanh"),
    "mlp relu": mlp("relu"),
    "mlp identity": mlp("identity"),
    "kernel ridge": KernelRidge(kernel="rbf", alpha=0.1),
    "kernel ridge gamma": KernelRidge(kernel="rbf", gamma=0.7, alpha=0.1),
    "kernel ridge linear": KernelRidge(kernel="linear"),
    "gp": GaussianProcessRegressor(
        ConstantKernel(2.0) * RBF([1.0, 2.0, 0.5]) + WhiteKernel(0.1),
        normalize_y=True,
        optimizer=None,
    ),
    "gp matern 5/2": GaussianProcessRegressor(
        Matern([1.0, 2.0, 3.0], nu=2.5) + DotProduct(),
        alpha=0.1,
        optimizer=None,
    ),
    "gp matern 3/2": GaussianProcessRegressor(
        Matern(nu=1.5) * RBF(3.0), alpha=0.1, optimizer=None
    ),
    "linear": Ridge(),
    "pipeline": make_pipeline(
        StandardScaler(), MinMaxScaler(), KernelRidge(kernel="rbf", alpha=0.1)
    ),
    "frozen": FrozenEstimator(Ridge()),
}
NUMERIC = {
    "gp of another kernel": GaussianProcessRegressor(
        RationalQuadratic(), alpha=0.1, optimizer=None
    ),
    "kernel ridge of another kernel": KernelRidge(kernel="poly", alpha=0.1),
    "pipeline with features": make_pipeline(PolynomialFeatures(), Ridge()),
    "pipeline with a clip": make_pipeline(MinMaxScaler(clip=True), Ridge()),
}


def fitted(estimator, y):
    inner = getattr(estimator, "estimator", estimator)
    inner.fit(X, y)
    return estimator


def central_differences(estimator, at, step=1e-5):
    slopes = []
    for k in range(at.shape[1]):
        shift = step * np.eye(at.shape[1])[k]
        change = estimator.predict(at + shift) - estimator.predict(at - shift)
        slopes.append(change.reshape(len(at), -1) / (2 * step))
    return np.stack(slopes, axis=2)


@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize("flat", [False, True])
@pytest.mark.parametrize("name", [*EXACT, *NUMERIC])
def test_jacobian_by_central_differences(name, flat):
    estimator = fitted({**EXACT, **NUMERIC}[name], Y[:, 0] if flat else Y)
    model = source_model(estimator)
    assert model.exact == (name in EXACT)
    assert model.flat == (np.ndim(estimator.predict(AT)) == 1)
    assert (model.n_in, model.n_out) == (3, 1 if flat else 2)
    value, jacobian = model.evaluate(AT)
    assert_allclose(value, estimator.predict(AT).reshape(7, -1), atol=1e-9)
    known = central_differences(estimator, AT)
    assert_allclose(jacobian, known, rtol=1e-6, atol=1e-6)
    assert_allclose(input_jacobian(estimator, AT), jacobian, rtol=1e-9)


def test_a_link_function_is_not_taken_for_a_linear_model():
    model = source_model(PoissonRegressor().fit(X, Y[:, 1]))
    assert not model.exact


@pytest.mark.parametrize("name", ["elm", "linear"])
def test_projection_of_the_outputs(name):
    model = source_model(fitted(EXACT[name], Y))
    matrix = RANDOM.normal(size=(2, 4))
    value, jacobian = model.evaluate(AT)
    projected, slope = model.project(matrix).evaluate(AT)
    assert_allclose(projected, value @ matrix, atol=1e-12)
    assert_allclose(
        slope, np.einsum("nfd,fr->nrd", jacobian, matrix), atol=1e-12
    )


def test_outputs_of_an_elm_span_no_more_than_its_hidden_layer():
    many = RANDOM.normal(size=(40, 30))
    elm = ElmRegressor(8, random_state=0).fit(X, many)
    basis = source_model(elm).output_basis()
    assert basis.shape == (30, 8)
    predicted = elm.predict(AT)
    assert_allclose(predicted @ basis @ basis.T, predicted, atol=1e-9)


def test_domains_that_estimators_remember():
    elm = ElmRegressor(random_state=0).fit(X[:10], Y[:10])
    elm.partial_fit(X[10:], Y[10:])
    for estimator in (
        elm,
        KernelRidge().fit(X, Y),
        GaussianProcessRegressor().fit(X, Y),
        FrozenEstimator(elm),
    ):
        domain = source_domain(estimator)
        assert_allclose(domain.mean, X.mean(axis=0))
        assert_allclose(domain.covariance, np.cov(X.T, ddof=0))
        assert_allclose(domain.low, X.min(axis=0))
        assert_allclose(domain.high, X.max(axis=0))
    assert source_domain(Ridge().fit(X, Y)) is None


def test_what_has_not_been_fitted_is_told():
    for estimator in (ElmRegressor(), Ridge(), KNeighborsRegressor()):
        with pytest.raises(NotFittedError):
            source_model(estimator)
