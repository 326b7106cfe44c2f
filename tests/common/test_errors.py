import math

from hypothesis import given
from hypothesis import strategies as st
import pytest

from drake_affetto.common.errors import (
    InputError,
    require,
    require_file,
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
