"""The toy experiment: its data, its resumption, its results."""

import math

import numpy as np
from numpy.testing import assert_allclose
import pytest

from drake_affetto.common.typed_json import to_plain
from drake_affetto.experiments import toy
from drake_affetto.experiments.plans import ToyPlan


def test_function():
    assert_allclose(
        toy.toy_function(np.array([[0.0, 0.0], [1.0, 1.0], [0.5, -1.0]])),
        [2.0, 6.0 + 2.0 * math.e, 0.25 - 4.0 + 2.0 * math.exp(-0.5)],
    )


@pytest.mark.parametrize("name", toy.DOMAINS)
def test_problem(name):
    domain = toy.DOMAINS[name]
    problem = toy.make_problem(domain, seed=3)
    for X in (problem.X, problem.X_test, problem.Z):
        assert domain.low <= X.min()
        assert X.max() <= domain.high
    # Half a turn and back.
    assert_allclose(problem.X_target @ toy.TURN, problem.Z)
    assert_allclose(problem.y_target, toy.toy_function(problem.Z))
    assert problem.source.n_samples_seen_ == domain.n_source
    again = toy.make_problem(domain, seed=3)
    assert np.array_equal(again.source.coef_, problem.source.coef_)
    other = toy.make_problem(domain, seed=4)
    assert not np.array_equal(other.X, problem.X)


def test_subsets():
    domain = toy.DOMAINS["unit"]
    chosen = [toy.subset(domain, 0, k) for k in range(20)]
    assert all(c.sum() == domain.n_labelled for c in chosen)
    assert len({tuple(c) for c in chosen}) == 20


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
    assert error["default"] < 0.5 * error["several_starts"]
    assert error["several_starts"] < error["paper_single_start"]
    assert error["unlabelled"] < 0.1
    assert error["true_map"] < error["default"] < error["affine_regression"]
    assert error["unchanged"] > 10.0
    spread = figures["transfer"]["default"]["per_seed"]["other_mse_mean"]
    assert len(spread) == 3
    assert error["default"] == np.median(spread)
