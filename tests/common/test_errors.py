import math

from hypothesis import given
from hypothesis import strategies as st
import pytest

from drake_affetto.common.errors import (
    InputError,
    require,
    require_array,
    require_choice,
    require_file,
    require_interval,
    require_range,
)


def test_is_a_value_error_so_that_callers_need_not_know_it():
    assert issubclass(InputError, ValueError)


def test_require_names_field_value_and_expectation():
    require(True, "gain", 3, "anything")
    with pytest.raises(InputError) as caught:
        require(False, "control.gain", -3, "a positive number")
    assert str(caught.value) == "control.gain is -3, expected a positive number"


@given(st.floats(-1e6, 1e6), st.floats(-1e6, 1e6), st.floats(-1e6, 1e6))
def test_require_range_takes_what_lies_between(low, high, value):
    low, high = sorted((low, high))
    if low <= value <= high:
        require_range("x", value, low, high)
    else:
        with pytest.raises(InputError, match="x is"):
            require_range("x", value, low, high)


def test_require_range_includes_its_ends():
    require_range("x", 1, 1, 2)
    require_range("x", 2, 1, 2)
    require_range("x", 0.0)


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf, "1", None])
def test_require_range_refuses_what_is_no_finite_number(value):
    for bounds in ((), (0.0,), (-math.inf, 0.0), (0.0, 1.0)):
        with pytest.raises(InputError, match="x is"):
            require_range("x", value, *bounds)


@pytest.mark.parametrize(
    ("bounds", "words"),
    [((0, 1), "from 0 to 1"), ((0,), "at least 0"), ((-math.inf, 5), "most 5")],
)
def test_require_range_says_what_it_expected(bounds, words):
    with pytest.raises(InputError, match=words):
        require_range("x", math.nan, *bounds)


def test_require_file(tmp_path):
    file = tmp_path / "a.yaml"
    file.touch()
    assert require_file("scenario", str(file)) == file
    for wrong in (tmp_path / "none", tmp_path):
        with pytest.raises(InputError, match=r"scenario is .*existing file"):
            require_file("scenario", wrong)


def test_require_array_gives_floats():
    array = require_array("x", [1, 2], (2,))
    assert array.dtype == float
    assert require_array("x", [[1.0, 2.0]], (None, 2)).shape == (1, 2)
    assert require_array("x", 3).shape == ()


@pytest.mark.parametrize(
    ("value", "options", "message"),
    [
        ([0.0, math.nan, math.inf], {}, r"x\[1\] is nan, expected a finite"),
        (
            [[1.0, 2.0], [3.0, -4.0]],
            {"low": 0},
            r"x\[1, 1\] is -4.0, .*least 0",
        ),
        ([1.0, 9.0], {"low": 0, "high": 5}, r"x\[1\] is 9.0, .*from 0 to 5"),
        ([1.0, 0.0], {"positive": True}, r"x\[1\] is 0.0, .*above 0"),
        (math.nan, {}, "x is nan, expected a finite number"),
        ([1.0], {"shape": (2,)}, r"of shape \(1,\), expected the shape \(2,\)"),
        (
            [1.0],
            {"shape": (None, 3), "expected": "points"},
            r"expected points \(any, 3\)",
        ),
        (["a"], {}, "x is no array of numbers"),
        ([[1.0], [1.0, 2.0]], {}, "x is no array of numbers"),
    ],
)
def test_require_array_names_the_first_wrong_entry(value, options, message):
    with pytest.raises(InputError, match=message) as caught:
        require_array("x", value, **options)
    assert "\n" not in str(caught.value)


def test_a_large_array_is_not_printed():
    theta = [0.0] * 120
    theta[17] = math.nan
    with pytest.raises(InputError) as caught:
        require_array("theta", theta, (120,))
    assert str(caught.value) == "theta[17] is nan, expected a finite number"


def test_choices_and_intervals_are_told():
    require_choice("mode", "b", "a", "b")
    with pytest.raises(InputError, match=r"^mode is 'c', expected 'a' or 'b'$"):
        require_choice("mode", "c", "a", "b")
    require_interval("x", [1.0, 2.0])
    for pair in ([2.0, 1.0], [1.0, 1.0], [1.0], [1.0, 2.0, 3.0]):
        with pytest.raises(InputError, match="a lower and a greater upper"):
            require_interval("x", pair)
