"""The recursively learned ELM against ridge regression written down."""

from hypothesis import given
from hypothesis import strategies as st
import numpy as np
from numpy.testing import assert_allclose
import pytest
from scipy.special import expit
from sklearn.base import clone
from sklearn.exceptions import NotFittedError
from sklearn.utils.estimator_checks import check_estimator

from drake_affetto.skill import ElmRegressor


def samples(n=40, d=2, outputs=3, seed=0):
    random = np.random.default_rng(seed)
    return random.uniform(-1, 1, (n, d)), random.normal(size=(n, outputs))


def ridge(phi, y, alpha, weights=None):
    """Least squares of rows, the ridge among them."""
    root = np.ones(len(phi)) if weights is None else np.sqrt(weights)
    rows = np.vstack(
        [root[:, None] * phi, np.sqrt(alpha) * np.eye(phi.shape[1])]
    )
    wanted = np.vstack(
        [root[:, None] * y, np.zeros((phi.shape[1], y.shape[1]))]
    )
    return np.linalg.lstsq(rows, wanted, rcond=None)[0]


@pytest.mark.filterwarnings("ignore")
def test_scikit_learn_accepts_it():
    check_estimator(ElmRegressor(random_state=0))


def test_eq_3_written_down():
    X, y = samples()
    elm = ElmRegressor(7, input_range=[[-1, 1], [-2, 4]], random_state=3)
    elm.fit(X, y)
    scaled = np.column_stack([X[:, 0], (X[:, 1] - 1.0) / 3.0])
    phi = expit(scaled @ elm.input_weights_ + elm.biases_)
    assert_allclose(elm.hidden(X), phi, atol=1e-14)
    assert_allclose(elm.predict(X), phi @ elm.coef_, atol=1e-12)
    assert elm.input_weights_.shape == (2, 7)
    assert elm.coef_.shape == (7, 3)


def test_weight_scale_is_the_deviation():
    X, y = samples(d=40)
    elm = ElmRegressor(200, weight_scale=2.5, random_state=0).fit(X, y)
    assert elm.input_weights_.std() == pytest.approx(2.5, rel=0.05)
    assert elm.biases_.std() == pytest.approx(2.5, rel=0.2)


@given(
    n=st.integers(1, 60),
    hidden=st.integers(1, 30),
    outputs=st.integers(1, 5),
    d=st.integers(1, 4),
    alpha=st.sampled_from([1e-4, 1e-2, 3.0]),
    seed=st.integers(0, 99),
)
def test_any_portions_in_any_order_give_the_ridge_solution(
    n, hidden, outputs, d, alpha, seed
):
    X, y = samples(n, d, outputs, seed)
    random = np.random.default_rng(seed)
    elm = ElmRegressor(hidden, alpha, weight_scale=2.0, random_state=0)
    order = random.permutation(n)
    for part in np.array_split(order, random.integers(1, n + 1)):
        elm.partial_fit(X[part], y[part])
    known = ridge(elm.hidden(X), y, alpha)
    batch = clone(elm).fit(X, y)
    size = np.abs(known).max()
    assert_allclose(elm.coef_, known, rtol=0, atol=1e-8 * max(1.0, size))
    assert_allclose(elm.coef_, batch.coef_, rtol=0, atol=1e-8 * max(1.0, size))


def test_a_hundred_thousand_updates_one_by_one():
    X, y = samples(100_000, 2, 1)
    y = np.sin(3 * X[:, :1]) + 0.1 * y
    elm = ElmRegressor(12, 1e-4, random_state=0).partial_fit(X[:1], y[:1])
    phi = elm.hidden(X)
    # Past the validation and the hidden layer, which take most of the time.
    for i in range(1, len(X)):
        elm._absorb(phi[i : i + 1], y[i : i + 1])
    assert_allclose(elm._solve(), ridge(phi, y, 1e-4), rtol=1e-7)


def test_what_is_known_of_the_inputs_does_not_depend_on_portions():
    X, y = samples(60)
    elm = ElmRegressor(random_state=0)
    for part in np.array_split(np.arange(60), [1, 2, 3, 40]):
        elm.partial_fit(X[part] + 7.0, y[part])
    assert elm.n_samples_seen_ == 60
    assert_allclose(elm.input_mean_, X.mean(axis=0) + 7.0)
    assert_allclose(elm.input_covariance_, np.cov(X.T, ddof=0), atol=1e-12)
    assert_allclose(elm.input_low_, X.min(axis=0) + 7.0)
    assert_allclose(elm.input_high_, X.max(axis=0) + 7.0)


@pytest.mark.parametrize("portion", [1, 7, 50])
def test_forgetting_weighs_by_age_and_keeps_the_ridge(portion):
    X, y = samples(50)
    elm = ElmRegressor(9, 1e-3, forgetting=0.9, random_state=0)
    for begin in range(0, 50, portion):
        rows = slice(begin, begin + portion)
        elm.partial_fit(X[rows], y[rows])
    weights = 0.9 ** np.arange(49, -1, -1)
    assert_allclose(
        elm.coef_, ridge(elm.hidden(X), y, 1e-3, weights), atol=1e-9
    )


def test_forgetting_follows_a_change_and_never_blows_up():
    elm = ElmRegressor(20, forgetting=0.9, random_state=0)
    X, _ = samples(300)
    elm.partial_fit(X, X[:, :1])
    elm.partial_fit(X, -X[:, :1])
    assert_allclose(elm.predict(X), -X[:, :1], atol=0.05)
    # Nothing new for long: the rest is forgotten, not amplified.
    for _ in range(500):
        elm.partial_fit(X[:1], -X[:1, :1])
    assert np.abs(elm.predict(X)).max() < 3.0
    assert np.isfinite(elm.coef_).all()


@given(
    d=st.integers(1, 4),
    hidden=st.integers(1, 20),
    outputs=st.integers(0, 4),
    seed=st.integers(0, 99),
)
def test_jacobian_by_central_differences(d, hidden, outputs, seed):
    X, y = samples(30, d, max(outputs, 1), seed)
    y = y[:, 0] if outputs == 0 else y
    limits = np.column_stack([np.full(d, -1.5), 1.0 + np.arange(d)])
    elm = ElmRegressor(hidden, input_range=limits, random_state=seed).fit(X, y)
    jacobian = elm.input_jacobian(X[:5])
    assert jacobian.shape == (*elm.predict(X[:5]).shape, d)
    for k in range(d):
        step = 1e-5 * np.eye(d)[k]
        slope = (elm.predict(X[:5] + step) - elm.predict(X[:5] - step)) / 2e-5
        assert_allclose(jacobian[..., k], slope, rtol=1e-6, atol=1e-6)


@pytest.mark.parametrize("flat", [False, True])
def test_leave_one_out_by_leaving_out(flat):
    X, y = samples(15)
    y = y[:, 0] if flat else y
    elm = ElmRegressor(10, 1e-2, random_state=0).fit(X, y)
    residuals = elm.loo_residuals(X, y)
    for i in range(15):
        rest = np.arange(15) != i
        without = clone(elm).fit(X[rest], y[rest])
        missed = y[i] - without.predict(X[i : i + 1])[0]
        assert_allclose(residuals[i], missed, rtol=1e-6)


@pytest.mark.parametrize("forgetting", [1.0, 0.9])
def test_error_covariance_is_the_likeliest(forgetting):
    """Yᵀ K⁻¹ Y / N, with K the covariance of samples under the prior."""
    X, y = samples(30)
    elm = ElmRegressor(9, 1e-2, forgetting=forgetting, random_state=0)
    for part in np.array_split(np.arange(30), [1, 4, 20]):
        elm.partial_fit(X[part], y[part])
    weights = forgetting ** np.arange(29, -1, -1)
    phi, y = (np.sqrt(weights)[:, None] * a for a in (elm.hidden(X), y))
    kernel = np.eye(30) + phi @ phi.T / 1e-2
    known = y.T @ np.linalg.solve(kernel, y) / weights.sum()
    assert_allclose(elm.error_covariance_, known, rtol=1e-9, atol=1e-12)
    gram = phi.T @ phi + 1e-2 * np.eye(9)
    at = elm.hidden(X[:5] + 0.3)
    known = np.sum(at.T * np.linalg.solve(gram, at.T), axis=0)
    assert_allclose(elm.leverage(X[:5] + 0.3), known, rtol=1e-9)


def test_error_covariance_knows_noise():
    """Half the outputs follow the task, the others do not."""
    X, noise = samples(400, outputs=2)
    y = np.column_stack([np.sin(X), 0.3 * noise])
    found = ElmRegressor(alpha=1e-2, random_state=0).fit(X, y)
    covariance = found.error_covariance_
    assert_allclose(np.diag(covariance)[2:], 0.09, rtol=0.2)
    assert np.diag(covariance)[:2].max() < 1e-3


def test_many_outputs_have_no_covariance():
    X, _ = samples(5)
    elm = ElmRegressor(3, random_state=0).fit(X, np.ones((5, 2001)))
    with pytest.raises(AttributeError, match="2000 outputs"):
        _ = elm.error_covariance_


def test_learning_leaves_the_data_alone():
    X, y = samples(8)
    kept = X.copy(), y.copy()
    elm = ElmRegressor(random_state=0).fit(X, y)
    # A column and a row are in LAPACK's order already.
    elm.partial_fit(X[:1], y[:1])
    flat = y[:, 0].copy()
    ElmRegressor(random_state=0).fit(X, flat).partial_fit(X, flat)
    assert np.array_equal(X, kept[0])
    assert np.array_equal(y, kept[1])
    assert np.array_equal(flat, kept[1][:, 0])


def test_scaling_is_that_of_the_range_whatever_comes_first():
    near, far = samples(20)[0] * 0.01, samples(20)[0]
    elms = []
    for first in (near, far):
        elm = ElmRegressor(input_range=[[-5, 5]] * 2, random_state=0)
        elms.append(elm.partial_fit(first, first))
    assert_allclose(elms[0].hidden(far), elms[1].hidden(far))


def test_one_pair_serves_all_inputs():
    X, y = samples()
    one = ElmRegressor(input_range=[-1, 3], random_state=0).fit(X, y)
    two = ElmRegressor(input_range=[[-1, 3]] * 2, random_state=0).fit(X, y)
    assert_allclose(one.predict(X), two.predict(X))


@pytest.mark.parametrize(("n", "bound"), [(8, 0.3), (15, 0.12), (25, 0.08)])
def test_few_samples_of_a_smooth_skill(n, bound):
    """What the default weights promise, median over draws."""

    def skill(tau):
        return np.column_stack(
            [30.0 * np.sin(2.0 * tau[:, 0] + tau[:, 1]), 0.5 * tau[:, 1] ** 2]
        )

    limits = np.array([[0.0, 1.0], [-0.5, 0.1]])
    errors = []
    for seed in range(9):
        random = np.random.default_rng(seed)
        X, X_new = (
            random.uniform(limits[:, 0], limits[:, 1], (k, 2)) for k in (n, 200)
        )
        elm = ElmRegressor(input_range=limits, random_state=seed)
        missed = elm.fit(X, skill(X)).predict(X_new) - skill(X_new)
        errors.append(missed.std(axis=0) / skill(X_new).std(axis=0))
    assert np.all(np.median(errors, axis=0) < bound)


def test_refitting_forgets():
    X, y = samples()
    elm = ElmRegressor(random_state=0).fit(X + 9.0, -y)
    assert_allclose(
        elm.fit(X, y).coef_, ElmRegressor(random_state=0).fit(X, y).coef_
    )
    assert elm.input_high_.max() <= 1.0


@pytest.mark.parametrize(
    ("parameters", "message"),
    [
        ({"n_hidden": 0}, "n_hidden"),
        ({"n_hidden": 2.5}, "n_hidden"),
        ({"alpha": 0.0}, "alpha"),
        ({"alpha": np.nan}, "alpha"),
        ({"forgetting": 0.0}, "forgetting"),
        ({"forgetting": 1.1}, "forgetting"),
        ({"weight_scale": -1.0}, "weight_scale"),
        ({"input_range": [[0, 1]]}, "input_range"),
        ({"input_range": [[0, 1], [2, 2]]}, "input_range"),
        ({"input_range": [[0, 1], [0, np.inf]]}, "input_range"),
    ],
)
def test_bad_parameters_are_named(parameters, message):
    X, y = samples()
    with pytest.raises(ValueError, match=message):
        ElmRegressor(**parameters).fit(X, y)


def test_bad_data_are_named():
    X, y = samples()
    elm = ElmRegressor()
    with pytest.raises(NotFittedError):
        elm.predict(X)
    with pytest.raises(NotFittedError):
        elm.input_jacobian(X)
    with pytest.raises(ValueError, match="NaN"):
        elm.fit(np.where(X[0, 0] == X, np.nan, X), y)
    with pytest.raises(ValueError, match="NaN"):
        elm.fit(X, np.where(y == y[0, 0], np.nan, y))
    with pytest.raises(ValueError, match="0 sample"):
        elm.fit(X[:0], y[:0])
    with pytest.raises(ValueError, match="inconsistent"):
        elm.fit(X, y[:-1])
    elm.fit(X, y)
    with pytest.raises(ValueError, match="3 features"):
        elm.predict(np.ones((2, 3)))
    with pytest.raises(ValueError, match="3 features"):
        elm.partial_fit(np.ones((2, 3)), y[:2])
    with pytest.raises(ValueError, match=r"y has shape .* expect"):
        elm.partial_fit(X, y[:, :2])
    with pytest.raises(ValueError, match=r"y has shape .* expect"):
        elm.partial_fit(X, y[:, 0])


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("alpha", 1.0),
        ("n_hidden", 7),
        ("weight_scale", 2.0),
        ("input_range", [[0.0, 2.0]] * 2),
        ("random_state", 5),
    ],
)
def test_a_parameter_set_too_late_is_refused(name, value):
    X = np.random.default_rng(0).uniform(size=(6, 2))
    model = ElmRegressor(n_hidden=5, random_state=0).partial_fit(X, X)
    before = model.predict(X)
    model.set_params(**{name: value})
    with pytest.raises(ValueError, match=f"{name} is .*begun with"):
        model.partial_fit(X, X)
    assert np.array_equal(model.predict(X), before)
    # `fit` begins anew, with it.
    model.fit(X, X).partial_fit(X, X)


def test_a_limit_that_is_changed_in_place_is_seen():
    X = np.random.default_rng(0).uniform(size=(6, 2))
    limits = np.array([[0.0, 1.0], [0.0, 1.0]])
    model = ElmRegressor(input_range=limits, random_state=0).partial_fit(X, X)
    model.partial_fit(X, X)
    limits[0, 1] = 5.0
    with pytest.raises(ValueError, match="input_range is"):
        model.partial_fit(X, X)


def test_forgetting_may_change_and_does_have_an_effect():
    """As the weighted ridge regression over both portions has it."""
    X = np.random.default_rng(0).uniform(size=(40, 2))
    model = ElmRegressor(n_hidden=5, random_state=0).partial_fit(X, X)
    model.set_params(forgetting=0.8).partial_fit(X, 2 * X)
    phi = np.vstack([model.hidden(X)] * 2)
    y = np.vstack([X, 2 * X])
    weight = np.append(np.full(40, 0.8**40), 0.8 ** np.arange(39, -1, -1))
    gram = phi.T @ (weight[:, None] * phi) + model.alpha * np.eye(5)
    expected = np.linalg.solve(gram, phi.T @ (weight[:, None] * y))
    np.testing.assert_allclose(model.coef_, expected, rtol=1e-6)
    with pytest.raises(ValueError, match="forgetting is 2"):
        model.set_params(forgetting=2.0).partial_fit(X, X)
