"""Transfer: the cost's derivatives, and maps that are known."""

import warnings

from hypothesis import given
from hypothesis import strategies as st
import numpy as np
from numpy.testing import assert_allclose
import pytest
from scipy.optimize import check_grad, minimize
from sklearn.base import clone
from sklearn.compose import ColumnTransformer
from sklearn.ensemble import RandomForestRegressor
from sklearn.exceptions import NotFittedError
from sklearn.frozen import FrozenEstimator
from sklearn.gaussian_process import GaussianProcessRegressor
from sklearn.gaussian_process.kernels import RBF
from sklearn.kernel_ridge import KernelRidge
from sklearn.linear_model import Ridge
from sklearn.neighbors import KNeighborsRegressor
from sklearn.neural_network import MLPRegressor
from sklearn.pipeline import make_pipeline
from sklearn.preprocessing import StandardScaler
from sklearn.utils.estimator_checks import check_estimator

from drake_affetto.skill import (
    Affine,
    Domain,
    ElmRegressor,
    Mapping,
    Similarity,
    TransferRegressor,
    loo_covariance,
)
from drake_affetto.skill.adapters import source_model
from drake_affetto.skill.search import Objective, Prior

TURN = np.array([[0.6, -0.8], [0.8, 0.6]])


def skill_of(Z, outputs=6):
    """A smooth function of two inputs with as many outputs as wanted."""
    a, b = Z.T
    columns = [np.sin(2 * a + b), a * b, np.exp(a) - b, b**2, a - 2 * b, a**3]
    return np.column_stack(columns)[:, :outputs]


def learned(outputs=6, n=80, seed=0):
    random = np.random.default_rng(seed)
    Z = random.uniform(-1, 1, (n, 2))
    y = skill_of(Z, max(outputs, 1))
    y = y[:, 0] if outputs == 0 else y
    return ElmRegressor(random_state=seed).fit(Z, y), Z, y


def seen_anew(Z):
    """The same tasks as another camera has them: 2 turned and 3 times."""
    return 3.0 * Z @ TURN.T + [5.0, -2.0]


@pytest.fixture(scope="module")
def skill():
    return learned()[0]


def few(n=5, seed=1, outputs=6):
    Z = np.random.default_rng(seed).uniform(-1, 1, (n, 2))
    return seen_anew(Z), skill_of(Z, outputs)


@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize("options", [{}, {"prior": None, "n_starts": 3}])
def test_scikit_learn_accepts_it(options):
    # Estimators with one output are what those checks are made for.
    source = learned(0)[0]
    check_estimator(TransferRegressor(source, **options))


class Quadratic(Mapping):
    """h(x) = (p0 x0 + p1 x1², p2): not affine, and not linear in p."""

    def count(self, n_in, n_out):
        return 3

    def apply(self, parameters, X):
        a, b, c = parameters
        return np.column_stack(
            [a * X[:, 0] + b**2 * X[:, 1] ** 2, c * X[:, 1] + a]
        )

    def derivative(self, parameters, X):
        _, b, _ = parameters
        result = np.zeros((len(X), 2, 3))
        result[:, 0, 0] = X[:, 0]
        result[:, 0, 1] = 2 * b * X[:, 1] ** 2
        result[:, 1, 2] = X[:, 1]
        result[:, 1, 0] = 1.0
        return result

    def starts(self, target, source, n_starts, random):
        return [
            (f"{k}", random.normal(size=3)) for k in range(min(n_starts, 8))
        ]


def objective_of(mapping, alpha, weights, seed, n=4, further=3):
    random = np.random.default_rng(seed)
    source, Z, _ = learned(seed=seed % 5)
    X = random.uniform(-1, 1, (n, 2))
    prior = None
    if weights is not None:
        inside, moments, shape = weights
        domain = Domain.of_samples(Z)
        prior = Prior(domain, inside, moments, shape, scale=0.7)
    return Objective(
        source_model(source),
        mapping,
        X,
        skill_of(random.uniform(-1, 1, (n, 2))),
        random.uniform(-1, 1, (further, 2)),
        alpha,
        prior,
    )


@given(
    kind=st.sampled_from(["affine", "similarity", "own"]),
    alpha=st.sampled_from([0.0, 0.3]),
    weights=st.sampled_from(
        [None, (1.0, 0.0, 0.0), (0.5, 2.0, 0.0), (0.5, 0.3, 4.0)]
    ),
    seed=st.integers(0, 99),
)
def test_gradient_by_differences(kind, alpha, weights, seed):
    mapping = {"affine": Affine(), "similarity": Similarity()}.get(
        kind, Quadratic()
    )
    if weights is not None and kind != "affine":
        weights = (*weights[:2], 0.0)
    objective = objective_of(mapping, alpha, weights, seed)
    size = mapping.count(2, 2)
    p = np.random.default_rng(seed).normal(size=size)
    free = np.ones(size, dtype=bool)
    if kind == "similarity":
        p[4], free[4] = 1.0, False

    def cost(values):
        full = p.copy()
        full[free] = values
        return objective(full[None])[0][0]

    def gradient(values):
        full = p.copy()
        full[free] = values
        return 2.0 * objective(full[None])[1][0][free]

    size = np.linalg.norm(gradient(p[free]))
    assert check_grad(cost, gradient, p[free], epsilon=1e-7) < 1e-5 * (1 + size)


def test_curvature_is_that_of_the_residuals():
    """At a perfect fit Gauss-Newton's Hessian is the Hessian."""
    source, Z, _ = learned()
    X = Z[:6]
    objective = Objective(
        source_model(source),
        Affine(),
        X,
        source.predict(X),
        X[:0],
        0.0,
        None,
    )
    p = np.array([1.0, 0.0, 0.0, 1.0, 0.0, 0.0])
    cost, gradient, curvature = objective(p[None])
    assert cost[0] < 1e-20
    assert_allclose(gradient, 0.0, atol=1e-12)
    for k in range(6):
        step = 1e-5 * np.eye(6)[k]
        change = objective((p + step)[None])[1] - objective((p - step)[None])[1]
        assert_allclose(curvature[0, k], change[0] / 2e-5, atol=1e-5)


def test_many_starts_are_each_their_own():
    objective = objective_of(Affine(), 0.1, (0.5, 0.3, 4.0), 3)
    many = np.random.default_rng(0).normal(size=(9, 6))
    together = objective(many)
    for k, p in enumerate(many):
        for a, b in zip(together, objective(p[None]), strict=True):
            assert_allclose(a[k], b[0], rtol=1e-10, atol=1e-12)


@pytest.mark.parametrize("solver", ["lm", "bfgs"])
@pytest.mark.parametrize("mapping", ["affine", "similarity"])
def test_finds_the_map(skill, solver, mapping):
    X, y = few(6)
    transfer = TransferRegressor(
        skill, mapping, solver=solver, n_starts=16
    ).fit(X, y)
    inverse = TURN.T / 3.0
    assert_allclose(transfer.H_, inverse, atol=0.02)
    assert_allclose(transfer.c_, -inverse @ [5.0, -2.0], atol=0.05)
    Z = np.random.default_rng(9).uniform(-1, 1, (50, 2))
    assert_allclose(transfer.transform(seen_anew(Z)), Z, atol=0.05)
    assert_allclose(transfer.predict(seen_anew(Z)), skill_of(Z), atol=0.1)


def test_eq_5_minimized_elsewhere(skill):
    """Bare Eq. 5: a general-purpose search of the same starts is no better."""
    X, y = few(4)
    transfer = TransferRegressor(
        skill, alpha=0.05, prior=None, metric=None, average=False, n_starts=12
    ).fit(X, y)

    def cost(p):
        predicted = skill.predict(X @ p[:4].reshape(2, 2).T + p[4:])
        return np.sum((predicted - y) ** 2) + 0.05 * np.sum(p**2)

    found = [minimize(cost, s.initial).fun for s in transfer.starts_]
    assert transfer.cost_ == pytest.approx(cost(transfer.parameters_))
    assert transfer.cost_ <= min(found) * (1 + 1e-6)
    assert_allclose(
        transfer.parameters_,
        np.append(transfer.H_.ravel(), transfer.c_),
    )
    assert transfer.gradient_norm_ < 1e-5


def test_starts_are_reported(skill):
    X, y = few()
    transfer = TransferRegressor(skill, n_starts=10).fit(X, y)
    starts = transfer.starts_
    assert len(starts) == 10
    assert starts[0].name == "identity"
    assert_allclose(starts[0].initial, [1, 0, 0, 1, 0, 0])
    costs = [s.cost for s in starts]
    assert transfer.winner_ == int(np.argmin(costs))
    assert transfer.cost_ == min(costs)
    assert sum(s.weight for s in starts) == pytest.approx(1.0)
    assert starts[transfer.winner_].weight > 0.0


def test_average_is_of_distinct_minima_only():
    source, _, _ = learned(1)
    Z = np.random.default_rng(4).uniform(-1, 1, (3, 2))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        transfer = TransferRegressor(source, noise=0.5, n_starts=24).fit(
            Z, skill_of(Z, 1)
        )
    counted = [s for s in transfer.starts_ if s.weight > 0.0]
    assert len(counted) > 1
    moved = [Affine().apply(s.parameters, Z) for s in counted]
    for i in range(len(moved)):
        for j in range(i):
            assert np.abs(moved[i] - moved[j]).max() > 1e-3
    by_hand = sum(
        s.weight * source.predict(Affine().apply(s.parameters, Z))
        for s in counted
    )
    assert_allclose(transfer.predict(Z), by_hand)


def test_further_inputs_without_outputs_help():
    source, _, _ = learned(1)
    random = np.random.default_rng(0)
    Z_new, Z_more = random.uniform(-1, 1, (2, 100, 2))
    errors = np.zeros((8, 2))
    for k in range(len(errors)):
        Z = random.uniform(-1, 1, (4, 2))
        X, y = seen_anew(Z), skill_of(Z, 1)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            for i, further in enumerate([None, seen_anew(Z_more)]):
                transfer = TransferRegressor(source).fit(X, y, further)
                missed = transfer.predict(seen_anew(Z_new)) - skill_of(Z_new, 1)
                errors[k, i] = np.mean(missed**2)
    assert np.median(errors[:, 1]) < 0.5 * np.median(errors[:, 0])


def test_prior_keeps_to_the_domain(skill):
    # Outputs that no task of the domain has would pull far outside.
    X, y = few()
    y = y + 3.0
    far = TransferRegressor(skill, prior=None, metric=None, alpha=1e-6)
    far.fit(X, y)
    near = TransferRegressor(
        skill, prior="domain", metric=None, noise=3.0, domain=[[-1, 1]] * 2
    ).fit(X, y)
    assert np.abs(far.transform(X)).max() > 1.5
    assert np.abs(near.transform(X)).max() < 1.2


def test_metric_weighs_the_outputs(skill):
    """An output of pure noise does harm, unless the metric knows it."""
    random = np.random.default_rng(0)
    Z = random.uniform(-1, 1, (60, 2))
    y = np.column_stack([skill_of(Z, 3), 5.0 * random.normal(size=60)])
    noisy = ElmRegressor(random_state=0, alpha=1e-2).fit(Z, y)
    covariance = loo_covariance(noisy, Z, y)
    assert covariance.shape == (4, 4)
    assert np.linalg.eigvalsh(covariance).min() > 0.0
    assert covariance[3, 3] > 100.0 * covariance[0, 0]
    missed = {"none": [], "auto": [], "metric": [], "variances": []}
    Z_new = random.uniform(-1, 1, (100, 2))
    for _ in range(5):
        Z = random.uniform(-1, 1, (5, 2))
        y = np.column_stack([skill_of(Z, 3), 5.0 * random.normal(size=5)])
        for name, metric in (
            ("none", None),
            ("auto", "auto"),
            ("metric", covariance),
            ("variances", np.diag(covariance)),
        ):
            transfer = TransferRegressor(noisy, metric=metric)
            transfer.fit(seen_anew(Z), y)
            error = transfer.predict(seen_anew(Z_new))[:, :3] - skill_of(
                Z_new, 3
            )
            missed[name].append(np.mean(error**2))
    medians = {name: np.median(values) for name, values in missed.items()}
    for name in ("auto", "metric", "variances"):
        assert medians[name] < 0.2 * medians["none"]


def test_metric_is_what_it_says():
    """With a metric the cost is that of residuals times its root."""
    source, _, _ = learned(3)
    X, y = few(5, outputs=3)
    root = np.tril(np.random.default_rng(0).normal(size=(3, 3))) + 2 * np.eye(3)
    transfer = TransferRegressor(
        source, metric=root @ root.T, prior=None, alpha=0.0, average=False
    ).fit(X, y)
    missed = transfer.predict(X) - y
    known = np.sum(np.linalg.solve(root, missed.T) ** 2)
    assert transfer.cost_ == pytest.approx(known, rel=1e-6, abs=1e-12)


@pytest.mark.parametrize("residual", ["smooth", Ridge(alpha=1e-3)])
def test_residual_learns_what_the_map_cannot(skill, residual):
    X, y = few(25)
    y = y + 0.3 * X[:, :1] - 1.0
    plain = TransferRegressor(skill).fit(X, y)
    tuned = TransferRegressor(skill, residual=residual).fit(X, y)
    X_new, y_new = few(100, seed=7)
    y_new = y_new + 0.3 * X_new[:, :1] - 1.0

    def error(transfer):
        return np.mean((transfer.predict(X_new) - y_new) ** 2)

    assert plain.residual_ is None
    assert error(tuned) < 0.5 * error(plain)


def test_own_map_of_a_sensor(skill):
    """A user's map with few parameters, from whichever of its starts."""
    known = np.array([0.5, 0.4, -0.8])
    X = np.random.default_rng(0).uniform(-1, 1, (6, 2))
    Z = Quadratic().apply(known, X)
    transfer = TransferRegressor(
        skill, Quadratic(), prior="domain", domain=[[-1.5, 1.5]] * 2
    ).fit(X, skill.predict(Z))
    assert_allclose(np.abs(transfer.parameters_), np.abs(known), atol=1e-3)
    assert_allclose(transfer.transform(X), Z, atol=1e-3)
    assert not hasattr(transfer, "H_")


@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize(
    "source",
    [
        MLPRegressor(
            hidden_layer_sizes=(40,),
            activation="tanh",
            solver="lbfgs",
            max_iter=600,
            random_state=0,
        ),
        KernelRidge(kernel="rbf", alpha=1e-4, gamma=0.5),
        KernelRidge(kernel="poly", degree=5, alpha=1e-4),
        GaussianProcessRegressor(RBF(1.0), alpha=1e-4, optimizer=None),
    ],
    ids=["mlp", "kernel ridge", "numeric", "gp"],
)
def test_any_fitted_regressor_will_do(source):
    _, Z, y = learned()
    source = FrozenEstimator(clone(source).fit(Z, y))
    X, y = few(6)
    transfer = TransferRegressor(source, domain=[[-1, 1]] * 2, n_starts=16)
    transfer.fit(X, y)
    assert_allclose(transfer.H_, TURN.T / 3.0, atol=0.05)


def test_other_numbers_of_inputs(skill):
    """Three inputs of which two tell the task; and one that tells half."""
    random = np.random.default_rng(0)
    Z = random.uniform(-1, 1, (9, 2))
    mix = random.normal(size=(3, 2))
    wide = TransferRegressor(skill).fit(Z @ mix.T, skill_of(Z))
    Z_new = random.uniform(-1, 1, (40, 2))
    assert_allclose(wide.predict(Z_new @ mix.T), skill_of(Z_new), atol=0.15)
    line = np.column_stack([Z[:, 0], 0.5 * Z[:, 0]])
    narrow = TransferRegressor(skill).fit(Z[:, :1], skill_of(line))
    assert_allclose(narrow.H_[:, 0], [1.0, 0.5], atol=0.05)


def test_clones_keep_the_skill_but_not_the_map(skill):
    X, y = few()
    transfer = TransferRegressor(skill, noise=0.1).fit(X, y)
    copy = clone(transfer)
    assert copy.estimator is skill
    assert copy.noise == 0.1
    with pytest.raises(NotFittedError):
        copy.predict(X)
    assert_allclose(copy.fit(X, y).predict(X), transfer.predict(X))


def test_the_skill_is_not_changed(skill):
    before = skill.coef_.copy()
    TransferRegressor(skill).fit(*few())
    assert_allclose(skill.coef_, before)


def test_same_seed_same_map(skill):
    X, y = few(3)
    maps = [TransferRegressor(skill).fit(X, y).parameters_ for _ in range(2)]
    assert np.array_equal(*maps)


def test_too_few_samples_for_the_map_warn(skill):
    X, y = few(2)
    with pytest.warns(UserWarning, match="2 samples determine at most 4 of"):
        TransferRegressor(skill).fit(X, y)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        TransferRegressor(skill, "similarity").fit(X, y)
        TransferRegressor(skill).fit(*few(3))


def test_a_search_that_is_cut_short_warns(skill):
    with pytest.warns(UserWarning, match="max_iter=1 "):
        TransferRegressor(skill, max_iter=1).fit(*few())


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"mapping": "projective"}, "mapping is 'projective'"),
        ({"prior": "magic"}, "prior is 'magic'"),
        ({"solver": "adam"}, "solver is 'adam'"),
        ({"n_starts": 0}, "n_starts is 0"),
        ({"max_iter": 2.5}, "max_iter is 2.5"),
        ({"alpha": -1.0}, "alpha is -1.0"),
        ({"noise": 0.0}, "noise is 0.0"),
        ({"tol": np.nan}, "tol is nan"),
        ({"metric": np.eye(3)}, "metric has shape"),
        ({"metric": "magic"}, "metric is 'magic'"),
        ({"metric": -np.eye(6)}, "not positive definite"),
        ({"domain": [[0, 1]]}, "domain is"),
        ({"domain": [[0, 1], [1, 1]]}, "domain is"),
        ({"domain": Domain.of_range([[0, 1]])}, "domain has 1 inputs"),
        ({"residual": "rough"}, "residual is 'rough'"),
    ],
)
def test_bad_parameters_are_named(skill, options, message):
    with pytest.raises(ValueError, match=message):
        TransferRegressor(skill, **options).fit(*few())


def test_bad_data_are_named(skill):
    X, y = few()
    transfer = TransferRegressor(skill)
    with pytest.raises(NotFittedError):
        transfer.predict(X)
    with pytest.raises(NotFittedError):
        TransferRegressor(ElmRegressor()).fit(X, y)
    with pytest.raises(ValueError, match="NaN"):
        transfer.fit(X * np.nan, y)
    with pytest.warns(UserWarning, match="1 samples determine at most 2"):
        transfer.fit(X[:1], y[:1])
    assert np.isfinite(transfer.predict(X)).all()
    with pytest.raises(ValueError, match=r"y has 2 outputs.* predicts 6"):
        transfer.fit(X, y[:, :2])
    with pytest.raises(ValueError, match="X is constant"):
        transfer.fit(np.ones((5, 2)), y)
    with pytest.raises(ValueError, match="X_unlabeled has 3 features"):
        transfer.fit(X, y, np.ones((5, 3)))
    with pytest.raises(ValueError, match="X_unlabeled"):
        transfer.fit(X, y, np.full((5, 2), np.nan))
    transfer.fit(X, y)
    with pytest.raises(ValueError, match="3 features"):
        transfer.predict(np.ones((2, 3)))
    linear = Ridge().fit(X, y)
    with pytest.raises(ValueError, match=r"prior='domain' needs .* Ridge"):
        TransferRegressor(linear, prior="domain").fit(X, y)
    with pytest.raises(ValueError, match="shrinkage is 2"):
        loo_covariance(skill, X, y, shrinkage=2)


@pytest.mark.parametrize(
    "source",
    [
        RandomForestRegressor(60, random_state=0),
        KNeighborsRegressor(3),
        FrozenEstimator(KNeighborsRegressor(3)),
    ],
    ids=["forest", "neighbors", "frozen"],
)
def test_a_source_without_derivatives_is_searched_without(source):
    """Nearly as good as the source itself, were the true map known."""
    Z = np.random.default_rng(2).uniform(-1, 1, (1500, 2))
    inner = source.estimator if isinstance(source, FrozenEstimator) else source
    inner.fit(Z, skill_of(Z))
    Z_new = 0.9 * Z[:200]
    transfer = TransferRegressor(source, domain=[[-1, 1]] * 2).fit(*few(8))
    assert transfer.solver_ == "evolution"
    assert np.isfinite(transfer.cost_)

    def rms(y):
        return np.sqrt(np.mean((y - skill_of(Z_new)) ** 2))

    assert rms(transfer.predict(seen_anew(Z_new))) < 0.2
    assert rms(source.predict(seen_anew(Z_new))) > 1.0


def test_smooth_sources_are_searched_by_their_derivatives(skill):
    assert TransferRegressor(skill).fit(*few()).solver_ == "lm"
    _, Z, y = learned()
    poly = KernelRidge(kernel="poly", degree=5, alpha=1e-4).fit(Z, y)
    transfer = TransferRegressor(poly, domain=[[-1, 1]] * 2, n_starts=4)
    assert transfer.fit(*few(6)).solver_ == "lm"


def test_evolution_finds_what_derivatives_find(skill):
    X, y = few(6)
    quick = TransferRegressor(skill).fit(X, y)
    slow = TransferRegressor(skill, solver="evolution").fit(X, y)
    assert slow.solver_ == "evolution"
    assert_allclose(slow.H_, quick.H_, atol=0.01)
    assert len(slow.starts_) == len(quick.starts_)


def test_samples_on_a_line_are_told(skill):
    along = np.linspace(-1, 1, 6)[:, None]
    Z = along * [0.6, 0.8]
    for shift in (0.0, 0.01):
        bent = Z + shift * np.array([[-0.8, 0.6]]) * np.sin(40 * along)
        with pytest.warns(UserWarning, match="6 samples lie on a line .* 2 of"):
            TransferRegressor(skill).fit(seen_anew(bent), skill_of(bent))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        # Two different points determine a similarity.
        TransferRegressor(skill, "similarity").fit(seen_anew(Z), skill_of(Z))
        TransferRegressor(skill).fit(*few(6))


@pytest.mark.filterwarnings("error")
def test_a_source_that_knows_its_columns_is_given_them():
    """One that takes them by name, and one that would warn."""
    pd = pytest.importorskip("pandas")
    _, Z, y = learned()
    table = pd.DataFrame(Z, columns=["a", "b"])
    by_name = make_pipeline(
        ColumnTransformer([("scale", StandardScaler(), ["b", "a"])]),
        GaussianProcessRegressor(RBF(1.0), alpha=1e-4, optimizer=None),
    )
    scaled = make_pipeline(
        StandardScaler(),
        KernelRidge(kernel="rbf", alpha=1e-4, gamma=0.5),
    )
    for source in (by_name, scaled, Ridge(), KNeighborsRegressor(3)):
        source.fit(table, y)
        options = {"domain": [[-1, 1]] * 2, "n_starts": 8}
        transfer = TransferRegressor(source, **options).fit(*few(8))
        assert transfer.predict(few(8)[0]).shape == (8, 6)
        if source in (by_name, scaled):
            assert_allclose(transfer.H_, TURN.T / 3.0, atol=0.05)
