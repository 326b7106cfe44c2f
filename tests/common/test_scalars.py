"""Choices in each of Drake's scalar types."""

import numpy as np
from pydrake.autodiffutils import AutoDiffXd
from pydrake.symbolic import Expression, Variable
import pytest

from drake_affetto.common.scalars import clip, select


@pytest.mark.parametrize("value", [-2.0, 0.3, 5.0])
def test_all_scalar_types_are_clipped_alike(value):
    expected = np.clip(value, -1.0, 1.0)
    assert clip(value, -1.0, 1.0) == expected
    smooth = clip(AutoDiffXd(value, [1.0, 2.0]), -1.0, 1.0)
    assert smooth.value() == expected
    inside = expected == value
    np.testing.assert_array_equal(
        smooth.derivatives(), [1.0, 2.0] if inside else [0.0, 0.0]
    )
    x = Variable("x")
    symbolic = clip(Expression(x), -1.0, 1.0)
    assert symbolic.Evaluate({x: value}) == expected


def test_only_the_choice_is_calculated():
    def never():
        raise AssertionError

    assert select(True, lambda: 1, never) == 1
    assert select(False, never, lambda: 2) == 2


def test_an_expression_keeps_both_choices():
    x = Variable("x")
    chosen = select(Expression(x) > 0.0, lambda: 1.0, lambda: Expression(x))
    assert chosen.Evaluate({x: 3.0}) == 1.0
    assert chosen.Evaluate({x: -3.0}) == -3.0
