"""The toy experiment: its protocol, its data, the order of its methods."""

import numpy as np
from numpy.testing import assert_allclose
import pytest

from drake_affetto.common.typed_json import to_plain
from drake_affetto.experiments import toy
from drake_affetto.experiments.plans import ToyPlan


def eq_6(x1, x2):
    """Written anew, not to repeat a mistake of the module."""
    return (x1 + 1) * (x1 + 1) * (x1 + 1) + 0.2 * (x2 + 1) * (x2 + 1) * (x2 + 1)


def seed_rows(repeats=2, seed=50, domain="unit"):
    """Trial of one seed: figures of the source, errors by method."""
    plan = ToyPlan(repeats=repeats, seeds=1, seed=seed)
    return toy.run_seed(toy.plan_seeds(domain, plan)[seed])


def test_function():
    # (1 + 0.2), (8 + 1.6), (1.5³ + 0), (1 + 0.2 · 8), (0 + 0.2): by hand.
    assert_allclose(
        toy.toy_function(
            np.array([[0, 0], [1, 1], [0.5, -1], [0, 1], [-1, 0]])
        ),
        [1.2, 9.6, 3.375, 2.6, 0.2],
    )
    assert "(x1 + 1)^3 + 2 (x2 + 1)^3 / 10" in toy.FUNCTION


@pytest.mark.parametrize("name", toy.DOMAINS)
def test_problem(name):
    domain = toy.DOMAINS[name]
    problem = toy.make_problem(domain, seed=3)
    for X in (problem.X, problem.X_test, problem.Z):
        assert domain.low <= X.min()
        assert X.max() <= domain.high
    again = toy.make_problem(domain, seed=3)
    assert np.array_equal(again.source.coef_, problem.source.coef_)
    other = toy.make_problem(domain, seed=4)
    assert not np.array_equal(other.X, problem.X)
    assert not np.array_equal(
        other.source.input_weights_, problem.source.input_weights_
    )


def test_the_paper_s_square_is_the_first():
    assert toy.DOMAINS["unit"] == toy.ToyDomain(0.0, 1.0)


def test_points_are_the_paper_s_and_each_is_used_once():
    problem = toy.make_problem(toy.DOMAINS["unit"], seed=3)
    sizes = [
        len(X) for X in (problem.X, problem.X_test, problem.Z, problem.X_target)
    ]
    assert sizes == [14, 6, 20, 20]
    # No point is both learned and tested, or both learned and transferred.
    together = np.concatenate([problem.X, problem.X_test, problem.Z])
    assert len(np.unique(together, axis=0)) == 40
    # The ELM has learned the 14 alone.
    assert problem.source.n_samples_seen_ == 14
    assert_allclose(problem.source.input_mean_, problem.X.mean(axis=0))


def test_targets_are_turned_by_half_a_turn_and_keep_their_values():
    problem = toy.make_problem(toy.DOMAINS["unit"], seed=3)
    angle = np.pi
    turn = [
        [np.cos(angle), -np.sin(angle)],
        [np.sin(angle), np.cos(angle)],
    ]
    assert_allclose(problem.X_target, problem.Z @ np.transpose(turn))
    assert_allclose(problem.y, eq_6(*problem.X.T))
    assert_allclose(problem.y_test, eq_6(*problem.X_test.T))
    assert_allclose(problem.y_target, eq_6(*problem.Z.T))


def test_subsets():
    chosen = [toy.subset(0, k) for k in range(100)]
    assert all(c.shape == (20,) and c.sum() == 5 for c in chosen)
    assert len({tuple(c) for c in chosen}) > 95
    # Every point is given now and then: a quarter of the times.
    share = np.mean(chosen, axis=0)
    assert share.min() > 0.08
    assert share.max() < 0.45


class Spy:
    """Notes what each method is fitted with, and predicts zero."""

    def __init__(self, name, log):
        self.name, self.log = name, log

    def fit(self, X, y, *further):
        self.log.append((self.name, X, y, further))
        return self

    def predict(self, X):
        return np.zeros(len(X))


@pytest.fixture
def fitted(monkeypatch):
    """What a run of two repeats of seed 50 gives each method; its result."""
    log = []
    monkeypatch.setattr(
        toy, "make_transfer", lambda name, source, repeat: Spy(name, log)
    )
    monkeypatch.setattr(
        "drake_affetto.skill.make_scheme", lambda name, source: Spy(name, log)
    )
    return log, seed_rows(repeats=2)


def test_all_methods_get_the_same_five_points(fitted):
    log, _ = fitted
    problem = toy.make_problem(toy.DOMAINS["unit"], seed=50)
    methods = {*toy.TRANSFERS, *toy.BASELINES} - {"true_map"}
    half = len(log) // 2
    for part in (log[:half], log[half:]):
        assert {name for name, *_ in part} == methods
        assert len(part) == len(methods)
        first = part[0][1]
        assert first.shape == (5, 2)
        for name, X, y, further in part:
            assert np.array_equal(X, first)
            assert_allclose(y, eq_6(*-X.T))
            if name == "unlabelled":
                # The inputs of the others, and of no other points.
                (others,) = further
                assert others.shape == (15, 2)
                both = np.concatenate([X, others])
                assert_allclose(
                    both[np.lexsort(both.T)],
                    problem.X_target[np.lexsort(problem.X_target.T)],
                )
            else:
                assert further == ()
    assert not np.array_equal(log[0][1], log[half][1])


def test_methods_are_judged_on_the_points_not_given(fitted):
    log, (_, rows) = fitted
    problem = toy.make_problem(toy.DOMAINS["unit"], seed=50)
    half = len(log) // 2
    for name in {*toy.TRANSFERS, *toy.BASELINES} - {"true_map"}:
        for k, errors in enumerate(rows[name]):
            given = log[k * half][1]
            known = (problem.X_target[:, None] == given).all(-1).any(-1)
            assert known.sum() == 5
            # The spies say zero, so that the errors are the values squared.
            squared = problem.y_target**2
            assert_allclose(
                errors, [squared[known].mean(), squared[~known].mean()]
            )


def test_the_skill_is_tested_on_the_other_six():
    result, _ = seed_rows(repeats=1)
    problem = toy.make_problem(toy.DOMAINS["unit"], seed=50)
    for key, X, Z in (
        ("train_mse", problem.X, problem.X),
        ("test_mse", problem.X_test, problem.X_test),
        ("rotated_mse", -problem.Z, problem.Z),
    ):
        error = problem.source.predict(X) - eq_6(*Z.T)
        assert_allclose(result[key], np.mean(error**2))


def test_the_paper_s_way():
    """Eq. 5 alone: BFGS from random starts, others in another repeat."""
    source = toy.make_problem(toy.DOMAINS["unit"], seed=50).source
    transfer = toy.make_transfer("paper", source, 3)
    assert (transfer.prior, transfer.metric) == (None, None)
    assert (transfer.solver, transfer.average) == ("bfgs", False)
    X = np.random.default_rng(0).uniform(-1.0, 0.0, (6, 2))
    starts = [
        [
            start.initial
            for start in toy.make_transfer("paper", source, repeat)
            .fit(X, eq_6(*-X.T))
            .starts_
        ]
        for repeat in (3, 3, 4)
    ]
    assert np.array_equal(starts[0], starts[1])
    assert not np.array_equal(starts[0], starts[2])
    assert len(starts[0]) == toy.PAPER_STARTS


def test_transfers_beat_what_they_should():
    """In small: the order of the methods, not the figures."""
    plan = ToyPlan(repeats=6, seeds=3, seed=50)
    specs = toy.plan_seeds("unit", plan)
    figures = to_plain(
        toy.gather([toy.run_seed(spec) for spec in specs.values()])
    )
    assert figures["source"]["train_mse"] < 0.01
    assert figures["source"]["test_mse"] < 0.2
    assert 10.0 < figures["source"]["rotated_mse"] < 200.0
    error = {
        name: row["other_mse_mean"]
        for group in ("transfer", "baselines")
        for name, row in figures[group].items()
    }
    assert error["default"] < 0.5 * error["paper"]
    assert error["several_starts"] < error["paper_single_start"]
    assert error["unlabelled"] < 0.1
    assert error["true_map"] < error["default"] < error["affine_regression"]
    assert error["unchanged"] > 10.0
    spread = figures["transfer"]["default"]["per_seed"]["other_mse_mean"]
    assert len(spread) == 3
    assert error["default"] == np.median(spread)
