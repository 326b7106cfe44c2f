"""Transfer of a learned skill to inputs that mean something else now.

A skill f has been learned on inputs z. Now the same tasks are seen in another
way, as x, and a few of them are known with their outputs y. The skill itself
need not change if one finds the map h that says which z an x stands for (Eq. 5
of Schulz et al. 2018):

    min_p  Σ_i ‖f(h(x_i; p)) - y_i‖² + α ‖p‖²,    h(x; H, c) = H x + c.

The cost has many local minima, and with few samples many maps fit. What is
here beyond the paper: all starts of the search go at once, as a batch; the
search uses that the problem is one of least squares; an assumption on h and on
where h(x) lies narrows the choice; predictions average over the minima that
fit; and h may be any differentiable map.
"""

import math
from typing import Any, NamedTuple, Self
import warnings

import numpy as np
from numpy.typing import ArrayLike, NDArray
from sklearn.base import (
    BaseEstimator,
    MultiOutputMixin,
    RegressorMixin,
    TransformerMixin,
    clone,
)
from sklearn.exceptions import ConvergenceWarning, NotFittedError
from sklearn.gaussian_process import GaussianProcessRegressor
from sklearn.gaussian_process.kernels import RBF
from sklearn.utils import check_random_state
from sklearn.utils.validation import (
    check_array,
    check_is_fitted,
    column_or_1d,
    validate_data,
)

from drake_affetto.common.typing import Array
from drake_affetto.skill.adapters import (
    SourceModel,
    has_useful_derivatives,
    predict_unnamed,
    source_domain,
    source_model,
    without_derivatives,
)
from drake_affetto.skill.mappings import (
    Affine,
    Domain,
    Mapping,
    Similarity,
    lost_parameters,
    make_mapping,
)
from drake_affetto.skill.residuals import (
    even_tasks,
    expected_errors,
    whitening,
)
from drake_affetto.skill.search import (
    LocalMinima,
    Objective,
    Prior,
    bfgs,
    evolution,
    levenberg_marquardt,
    repetitions,
)

# Weights of the prior's terms relative to the squared error that is expected
# of one output. Chosen on seeds of the toy experiment that are not reported.
_INSIDE = 10.0
_SHAPE = 10.0
# Many inputs together weigh much, and their outermost say little.
_MANY_INSIDE = 0.3
_MANY_MOMENTS = 0.3
# λ of the bare Eq. 5, chosen there too.
_PLAIN_ALPHA = 0.03


_SOLVERS = {
    "lm": levenberg_marquardt,
    "bfgs": bfgs,
    "evolution": evolution,
}
_PRIORS = ("auto", "domain", "similar", "moments")


class Restart(NamedTuple):
    """Where a search began, and what became of it.

    Attributes:
        name: of the start.
        initial: (P,), the parameters it began from.
        parameters: (P,), those it ended with.
        cost: there.
        gradient_norm: of the cost by the parameters, there.
        weight: of this minimum in the predictions; 0 for a repetition.
    """

    name: str
    initial: Array
    parameters: Array
    cost: float
    gradient_norm: float
    weight: float


class TransferRegressor(
    MultiOutputMixin, RegressorMixin, TransformerMixin, BaseEstimator
):
    """A fitted regressor, seen through a map h that a few samples determine.

    predict(X) = estimator.predict(h(X)), with h from `fit`. Bare Eq. 5, solved
    as the paper does, is

        TransferRegressor(estimator, prior=None, metric=None, average=False,
                          solver="bfgs", n_starts=1)

    Args:
        estimator: a fitted regressor. It is used as it is, never fitted anew,
            also by clones of this object.
        mapping: the family of h: "affine", "similarity", or a Mapping.
        alpha: weight of ‖p‖² (for the affine map ‖[H c]‖²) beside the squared
            error; None for 0.03 without a prior and 0 with one.
        prior: what is expected of h beyond the samples. None: nothing.
            "domain": h(x) lies where the skill was learned. "similar": that,
            and an affine h is nearly a similarity, as between two cameras.
            "moments": all that, and the x are tasks drawn like those of the
            skill, so h(x) has their mean and covariance; for many x. "auto":
            "moments" if there are unlabeled inputs, else "similar"; None if
            it is not known where the skill was learned. With any of them,
            what the mapping itself expects of its parameters counts too.
        noise: the error to be expected of the skill itself, relative to the
            standard deviation of its outputs. It scales prior and average.
        metric: how residuals of several outputs are weighed. None: all alike.
            Covariance (F, F) or variances (F,) of the errors to be expected,
            as from `loo_covariance`: whitened by them. "auto": an ELM of
            several outputs is asked for that covariance. With a covariance
            `noise` has no effect.
        average: whether predictions are the average over all minima found,
            weighted by exp(-cost / 2σ²), or those of the best alone.
        domain: where the skill was learned: (d, 2), lowest and highest value
            of each of its inputs, or a Domain. None to ask the estimator.
        residual: None; or a regressor, fitted to what the transferred skill
            still misses; "smooth" for a Gaussian process that bends slowly.
        solver: "lm", Levenberg-Marquardt with all starts as one batch;
            "bfgs", one start after another; or "evolution", differential
            evolution, which needs no derivatives. An estimator whose
            predictions are constant but for jumps, such as a forest, always
            gets the last.
        n_starts: from how many starts to search. The first is the identity.
        max_iter: iterations of each search at most.
        tol: relative change of the cost ("lm") or the gradient's greatest
            element ("bfgs") at which a search ends.
        random_state: seed of the random starts.

    Attributes:
        estimator_: the source regressor.
        solver_: the solver that was used.
        mapping_: the Mapping.
        parameters_: (P,), of the best minimum.
        H_, c_: (d, n_features), (d,): h(x) = H x + c, for affine maps and
            similarities.
        cost_: of the best minimum.
        gradient_norm_: of the cost, there.
        starts_: list of `Restart`, in the order they were tried in.
        winner_: the index of the best among them: that of least cost.
        residual_: the fitted residual, or None.
        n_iter_: iterations of the longest search.
        n_features_in_: how many inputs x has.
    """

    def __init__(
        self,
        estimator: Any,
        mapping: str | Mapping = "affine",
        *,
        alpha: float | None = None,
        prior: str | None = "auto",
        noise: float = 0.05,
        metric: ArrayLike | str | None = "auto",
        average: bool = True,
        domain: ArrayLike | Domain | None = None,
        residual: Any = None,
        solver: str = "lm",
        n_starts: int = 32,
        max_iter: int = 100,
        tol: float = 1e-5,
        random_state: int | np.random.RandomState | None = 0,
    ) -> None:
        self.estimator = estimator
        self.mapping = mapping
        self.alpha = alpha
        self.prior = prior
        self.noise = noise
        self.metric = metric
        self.average = average
        self.domain = domain
        self.residual = residual
        self.solver = solver
        self.n_starts = n_starts
        self.max_iter = max_iter
        self.tol = tol
        self.random_state = random_state

    def fit(
        self,
        X: ArrayLike,
        y: ArrayLike,
        X_unlabeled: ArrayLike | None = None,
    ) -> Self:
        """Finds h from samples X (N, n_features) with known outputs y (N, F).

        Args:
            X: (N, n_features). A single sample leaves most of a map to what
                is expected of it.
            y: (N, F), or (N,) if the estimator predicts single numbers.
            X_unlabeled: (M, n_features), further inputs whose outputs are
                not known, of tasks like those of the skill.

        Raises:
            ValueError: if the data or a parameter do not fit.
            NotFittedError: if the estimator has not been fitted.
        """
        self._check_parameters()
        source = source_model(self.estimator)
        X, targets, unlabeled = self._validate(X, y, X_unlabeled, source)
        mapping = make_mapping(self.mapping)
        n_in = X.shape[1]
        nothing = np.zeros((1, mapping.count(n_in, source.n_in)))
        expects = mapping.expectation(nothing) is not None
        domain = self._source_domain(source)
        target = Domain.of_samples(np.concatenate([X, unlabeled]))
        reduced, wanted, rest, noise = self._whiten(source, targets, domain)
        kind = self._prior_kind(mapping, domain, n_in, source.n_in, unlabeled)
        prior = _make_prior(kind, domain, target, noise, expects)
        alpha = self.alpha
        if alpha is None:
            alpha = _PLAIN_ALPHA if prior is None else 0.0
        # Where nothing is known of the skill's inputs, assume those of now.
        assumed = domain
        if assumed is None:
            assumed = _same_or_unit(target, source.n_in)
        self.solver_ = self.solver
        if not has_useful_derivatives(reduced, assumed):
            self.solver_ = "evolution"
        if self.solver_ == "evolution" and not reduced.exact:
            reduced = without_derivatives(reduced)
        objective = Objective(
            reduced, mapping, X, wanted, unlabeled, float(alpha), prior
        )
        random = check_random_state(self.random_state)
        named = mapping.starts(target, assumed, self.n_starts, random)
        self._warn_of_freedom(mapping, source, X, named[0][1])
        minima = _SOLVERS[self.solver_](
            objective,
            np.array([parameters for _, parameters in named]),
            max_iter=self.max_iter,
            tol=self.tol,
        )
        self.estimator_ = self.estimator
        self.mapping_ = mapping
        repeated = repetitions(
            mapping.apply_many(minima.parameters, X), minima.cost, assumed
        )
        self._report(named, minima, repeated, rest, noise)
        self._fit_residual(X, targets)
        return self

    def predict(self, X: ArrayLike) -> Array:
        """f(h(X)) (N, F), or (N,) as the estimator has it, for X."""
        check_is_fitted(self)
        X = np.asarray(validate_data(self, X, reset=False, dtype=np.float64))
        moved = self.mapping_.apply_many(self._averaged, X)
        flat = moved.reshape(-1, moved.shape[-1])
        each = np.asarray(predict_unnamed(self.estimator_, flat), dtype=float)
        each = each.reshape(len(moved), len(X), *each.shape[1:])
        value = np.tensordot(self._weights, each, axes=1)
        if self.residual_ is not None:
            value += self.residual_.predict(X).reshape(value.shape)
        return value

    def transform(self, X: ArrayLike) -> Array:
        """h(X) (N, d), with the best minimum's parameters, for X."""
        check_is_fitted(self)
        X = np.asarray(validate_data(self, X, reset=False, dtype=np.float64))
        return self.mapping_.apply(self.parameters_, X)

    def _check_parameters(self) -> None:
        if self.prior is not None and self.prior not in _PRIORS:
            raise ValueError(
                f"prior is {self.prior!r}, expected None or one of {_PRIORS}"
            )
        if self.solver not in _SOLVERS:
            raise ValueError(
                f"solver is {self.solver!r}, expected one of "
                f"{', '.join(map(repr, _SOLVERS))}"
            )
        for name in ("n_starts", "max_iter"):
            value = getattr(self, name)
            if not isinstance(value, (int, np.integer)) or value < 1:
                raise ValueError(
                    f"{name} is {value!r}, expected a positive integer"
                )
        for name, low in (("alpha", 0.0), ("noise", 1e-12), ("tol", 0.0)):
            value = getattr(self, name)
            if value is None and name == "alpha":
                continue
            if not (math.isfinite(value) and value >= low):
                raise ValueError(
                    f"{name} is {value!r}, expected a number of at least "
                    f"{low:g}"
                )

    def _validate(
        self,
        X: ArrayLike,
        y: ArrayLike,
        X_unlabeled: ArrayLike | None,
        source: SourceModel,
    ) -> tuple[Array, Array, Array]:
        """Checked X (N, n), y (N, F) and X_unlabeled (M, n)."""
        checked, targets = validate_data(
            self,
            X,
            y,
            multi_output=True,
            y_numeric=True,
            dtype=np.float64,
        )
        checked = np.asarray(checked)
        targets = np.asarray(targets, dtype=np.float64)
        if source.flat:
            targets = column_or_1d(targets, warn=True)
        targets = targets.reshape(len(checked), -1)
        if targets.shape[1] != source.n_out:
            raise ValueError(
                f"y has {targets.shape[1]} outputs, but the estimator of this "
                f"{type(self).__name__} predicts {source.n_out}"
            )
        if len(checked) > 1 and np.all(checked == checked[0]):
            raise ValueError(
                "X is constant: all samples have the same input "
                f"{checked[0].tolist()}, which no map can tell apart"
            )
        unlabeled = np.empty((0, checked.shape[1]))
        if X_unlabeled is not None:
            unlabeled = np.asarray(
                check_array(
                    X_unlabeled, dtype=np.float64, input_name="X_unlabeled"
                )
            )
            if unlabeled.shape[1] != checked.shape[1]:
                raise ValueError(
                    f"X_unlabeled has {unlabeled.shape[1]} features, but X "
                    f"has {checked.shape[1]}"
                )
        return checked, targets, unlabeled

    def _warn_of_freedom(
        self, mapping: Mapping, source: SourceModel, X: Array, start: Array
    ) -> None:
        """Warns of what the samples cannot determine of the map."""
        n, n_in = X.shape
        freedom = mapping.freedom(n_in, source.n_in)
        known = n * min(source.n_out, source.n_in)
        lost = lost_parameters(mapping, start, X)
        if known >= freedom and lost:
            # There may be enough samples, but all on a line.
            warnings.warn(
                f"the {n} samples lie on a line or plane among their "
                f"{n_in} inputs and do not determine {lost} of the {freedom} "
                "parameters of the map: off it, predictions are a guess",
                UserWarning,
                stacklevel=3,
            )
        if known < freedom:
            warnings.warn(
                f"{n} samples determine at most {known} of the {freedom} "
                "parameters of the map; the rest is left to the prior and the "
                "regularisation",
                UserWarning,
                stacklevel=3,
            )

    def _source_domain(self, source: SourceModel) -> Domain | None:
        if self.domain is None:
            return source_domain(self.estimator)
        if isinstance(self.domain, Domain):
            domain = self.domain
            shape = domain.mean.shape
        else:
            limits = np.asarray(self.domain, dtype=float)
            shape = limits.shape[:1]
            if limits.shape != (source.n_in, 2) or not (
                np.isfinite(limits).all()
                and (limits[:, 1] > limits[:, 0]).all()
            ):
                raise ValueError(
                    f"domain is {limits.tolist()}, expected {source.n_in} "
                    "finite pairs whose second value is above the first"
                )
            domain = Domain.of_range(limits)
        if shape != (source.n_in,):
            raise ValueError(
                f"domain has {shape[0]} inputs, but the estimator has "
                f"{source.n_in}"
            )
        return domain

    def _whiten(
        self, source: SourceModel, y: Array, domain: Domain | None
    ) -> tuple[SourceModel, Array, float, float]:
        """The problem in outputs whose errors are alike, and as few as serve.

        Returns:
            The source with outputs (R), the y (N, R), the cost that no map can
            reduce, and the squared error to be expected of one output.
        """
        metric = self.metric
        if isinstance(metric, str):
            if metric != "auto":
                raise ValueError(
                    f"metric is {metric!r}, expected None, 'auto' or an array"
                )
            metric = expected_errors(self.estimator, source, domain)
        if metric is not None:
            matrix = whitening(metric, source.n_out)
            source, y = source.project(matrix), y @ matrix
            noise = 1.0
        else:
            noise = self.noise**2 * _spread(source, y, domain)
        basis = source.output_basis()
        rest = 0.0
        if basis is not None and basis.shape[1] < source.n_out:
            within = y @ basis
            rest = float(np.sum(y**2) - np.sum(within**2))
            source, y = source.project(basis), within
        return source, y, max(rest, 0.0), noise

    def _prior_kind(
        self,
        mapping: Mapping,
        domain: Domain | None,
        n_in: int,
        n_out: int,
        unlabeled: Array,
    ) -> frozenset[str]:
        """Which terms the prior has: "inside", "shape", "moments"."""
        prior = self.prior
        if prior is None or (prior == "auto" and domain is None):
            return frozenset()
        if domain is None:
            raise ValueError(
                f"prior={prior!r} needs to know where the skill was learned, "
                f"which a {type(self.estimator).__name__} does not tell: give "
                "domain, the lowest and highest value of each of its inputs"
            )
        terms = {"inside"}
        if prior == "moments" or (prior == "auto" and len(unlabeled)):
            terms.add("moments")
        # A map to fewer inputs must lose some: it cannot be a similarity.
        bends = isinstance(mapping, Affine) and 2 <= n_in <= n_out
        if prior != "domain" and bends:
            terms.add("shape")
        return frozenset(terms)

    def _report(
        self,
        named: list[tuple[str, Array]],
        minima: LocalMinima,
        repeated: NDArray[np.bool_],
        rest: float,
        noise: float,
    ) -> None:
        """Chooses among the minima, and keeps what there is to say of them."""
        winner = int(np.argmin(minima.cost))
        relative = (minima.cost - minima.cost[winner]) / (2.0 * noise)
        weights = np.exp(-relative) * ~repeated
        if not self.average:
            weights[:] = 0.0
            weights[winner] = 1.0
        # What is not worth a prediction.
        weights[weights < 1e-3] = 0.0
        weights /= weights.sum()
        norms = 2.0 * np.linalg.norm(minima.gradient, axis=1)
        self.starts_ = [
            Restart(name, initial, *found)
            for (name, initial), *found in zip(
                named,
                minima.parameters,
                (minima.cost + rest).tolist(),
                norms.tolist(),
                weights.tolist(),
                strict=True,
            )
        ]
        self.winner_ = winner
        # A search that was at its minimum from the start has looked once.
        self.n_iter_ = max(1, minima.iterations)
        self.parameters_ = minima.parameters[winner]
        self.cost_ = self.starts_[winner].cost
        self.gradient_norm_ = self.starts_[winner].gradient_norm
        self._averaged = minima.parameters[weights > 0.0]
        self._weights = weights[weights > 0.0]
        if isinstance(self.mapping_, Affine):
            self.H_, self.c_ = self.mapping_.split(
                self.parameters_, self.n_features_in_
            )
        elif isinstance(self.mapping_, Similarity):
            self.H_ = self.mapping_.linear(self.parameters_)
            self.c_ = self.parameters_[2:4]
        if not minima.converged[winner]:
            warnings.warn(
                f"the search for the map ended after max_iter={self.max_iter} "
                "iterations before it converged",
                ConvergenceWarning,
                stacklevel=3,
            )

    def _fit_residual(self, X: Array, y: Array) -> None:
        self.residual_ = None
        if self.residual is None:
            return
        missed = y - self.predict(X).reshape(y.shape)
        if isinstance(self.residual, str):
            if self.residual != "smooth":
                raise ValueError(
                    f"residual is {self.residual!r}, expected None, 'smooth' "
                    "or a regressor"
                )
            # As wide as the data, and with no room to follow single samples.
            width = 2.0 * Domain.of_samples(X).deviation
            residual = GaussianProcessRegressor(
                RBF(width), alpha=0.1, optimizer=None
            )
        else:
            residual = clone(self.residual)
        if missed.shape[1] == 1:
            missed = missed[:, 0]
        self.residual_ = residual.fit(X, missed)

    def __sklearn_tags__(self) -> Any:
        tags = super().__sklearn_tags__()
        try:
            single = source_model(self.estimator).flat
        except (NotFittedError, AttributeError, TypeError, ValueError):
            single = False
        tags.target_tags.multi_output = not single
        return tags

    def __sklearn_clone__(self) -> Self:
        # The estimator is what has been learned, not how to learn it.
        return type(self)(**self.get_params(deep=False))


def _make_prior(
    terms: frozenset[str],
    domain: Domain | None,
    target: Domain,
    noise: float,
    expects: bool,
) -> Prior | None:
    if not terms or domain is None:
        return None
    many = "moments" in terms
    # A single sample has no spread.
    seen = float(np.trace(target.covariance)) or 1.0
    spread = np.trace(domain.covariance) / seen
    return Prior(
        domain=domain,
        inside=noise * (_MANY_INSIDE if many else _INSIDE),
        moments=noise * _MANY_MOMENTS if many else 0.0,
        shape=noise * _SHAPE if "shape" in terms else 0.0,
        scale=math.sqrt(spread) if spread > 0.0 else 1.0,
        expected=noise if expects else 0.0,
    )


def _spread(source: SourceModel, y: Array, domain: Domain | None) -> float:
    """The variance of an output over the tasks; the mean over the outputs."""
    values = y
    if domain is not None:
        # The few y there are would tell it badly.
        tasks = even_tasks(source.n_in)
        values, _ = source.evaluate(
            domain.low + tasks * (domain.high - domain.low)
        )
    spread = float(np.mean(np.var(values, axis=0)))
    return spread if spread > 0.0 else max(float(np.mean(y**2)), 1e-12)


def _same_or_unit(target: Domain, n_out: int) -> Domain:
    if target.mean.size == n_out:
        return target
    return Domain.of_range(np.array([[-1.0, 1.0]] * n_out))
