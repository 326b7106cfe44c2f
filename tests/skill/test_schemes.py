"""The schemes of the comparison."""

import numpy as np
from numpy.testing import assert_allclose
import pytest
from sklearn.base import clone

from drake_affetto.skill import SCHEMES, ElmRegressor, make_scheme

RANDOM = np.random.default_rng(0)
Z = RANDOM.uniform(-1, 1, (60, 2))


def skill_of(Z):
    return np.column_stack([np.sin(2 * Z[:, 0]), Z[:, 0] * Z[:, 1], Z[:, 1]])


SKILL = ElmRegressor(input_range=[-1, 1], random_state=0).fit(Z, skill_of(Z))
X = -Z[:5]
Y = skill_of(Z[:5])


@pytest.mark.parametrize("name", SCHEMES)
def test_all_have_one_interface_and_leave_the_skill(name):
    before = SKILL.predict(Z)
    scheme = make_scheme(name, SKILL)
    predicted = scheme.fit(X, Y).predict(-Z)
    assert predicted.shape == (60, 3)
    assert np.isfinite(predicted).all()
    assert_allclose(SKILL.predict(Z), before)
    again = clone(scheme).fit(X, Y)
    assert_allclose(again.predict(-Z), predicted)


def test_what_each_does():
    fitted = {name: make_scheme(name, SKILL).fit(X, Y) for name in SCHEMES}
    assert_allclose(fitted["unchanged"].predict(Z), SKILL.predict(Z))
    scratch = ElmRegressor(input_range=[-1, 1], random_state=0).fit(X, Y)
    assert_allclose(fitted["relearn"].predict(Z), scratch.predict(Z))
    both = ElmRegressor(input_range=[-1, 1], random_state=0)
    both.fit(np.vstack([Z, X]), np.vstack([skill_of(Z), Y]))
    assert_allclose(fitted["continue"].predict(Z), both.predict(Z), atol=1e-8)
    assert_allclose(fitted["transfer_default"].H_, -np.eye(2), atol=0.1)
    linear = np.column_stack([X, np.ones(5)])
    slope = np.linalg.lstsq(linear, Y, rcond=None)[0]
    assert_allclose(
        fitted["affine_regression"].predict(Z),
        np.column_stack([Z, np.ones(60)]) @ slope,
        atol=1e-9,
    )
    assert_allclose(fitted["gaussian_process"].predict(X), Y, atol=0.3)


def test_the_papers_transfer_is_its_own():
    paper = make_scheme("transfer", SKILL).fit(X, Y)
    assert paper.solver == "bfgs"
    assert [s.name for s in paper.starts_] == ["identity"]
    assert paper.prior is None


def test_relearn_with_other_ranges():
    scheme = make_scheme("relearn", SKILL, input_range=[[-5, 5]] * 2)
    assert scheme.input_range == [[-5, 5]] * 2
    assert SKILL.input_range == [-1, 1]


def test_unknown_scheme_is_told():
    with pytest.raises(ValueError, match="'magic'"):
        make_scheme("magic", SKILL)
