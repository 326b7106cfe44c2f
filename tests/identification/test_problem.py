"""The parameters of a fit and their scales."""

from hypothesis import given
from hypothesis import strategies as st
import pytest

from support.robot_bench import make_problem


@given(fraction=st.floats(0.0, 1.0), index=st.integers(0, 21))
def test_scales_of_the_parameters_are_invertible(fraction, index):
    parameter = make_problem().parameters()[index]
    value = parameter.decode(fraction)
    assert parameter.lower * (1 - 1e-12) <= value or parameter.lower < 0
    assert parameter.encode(value) == pytest.approx(fraction, abs=1e-9)
    inside = min(max(fraction, 1e-4), 1 - 1e-4)
    numerical = (
        parameter.decode(inside + 1e-6) - parameter.decode(inside - 1e-6)
    ) / 2e-6
    assert parameter.slope(inside) == pytest.approx(numerical, rel=1e-4)


def test_start_lies_within_the_bounds(problem):
    for parameter in problem.parameters():
        assert parameter.lower < parameter.start < parameter.upper
