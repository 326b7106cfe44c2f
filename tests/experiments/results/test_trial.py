"""Results of trials as the store keeps them."""

import numpy as np
import pytest

from drake_affetto.common.errors import InputError
from drake_affetto.experiments.results.trial import (
    TRIAL_RESULTS,
    pack,
    unpack,
)
from support import fake_world

SPEC = {
    "scenario": {"@name": "drumming"},
    "xy": [0.235, -0.09],
    "seed": 1,
    "variability": 1.0,
    "theta": np.array([0.235, -0.09]),
}


@pytest.mark.parametrize("kind", ["look", "demonstration", "strike"])
def test_results_go_to_the_store_and_back(kind):
    plain, arrays = fake_world.run({"kind": kind, **SPEC})
    typed = unpack(kind, plain, arrays)
    assert isinstance(typed, TRIAL_RESULTS[kind])
    again, more = pack(typed)
    assert again == plain
    assert set(more) == set(arrays)
    for name, array in arrays.items():
        np.testing.assert_array_equal(more[name], array)


def test_a_kind_that_is_not_known_is_named():
    with pytest.raises(InputError, match="'dance'"):
        unpack("dance", {}, {})


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"plain": ("reward", ...)}, "row 3: reward is missing"),
        ({"plain": ("reward", "much")}, "row 3: reward is 'much', expected a"),
        ({"plain": ("reward", 1e308)}, "row 3: reward is 1e\\+308, expected a"),
        ({"plain": ("attempts", -1)}, "row 3: attempts is -1, expected a"),
        ({"plain": ("max_pull", -2.0)}, "row 3: max_pull is -2.0, expected a"),
        ({"plain": ("tau", [0.1])}, r"row 3: tau is \[0.1\], expected 2"),
        ({"plain": ("xy", "here")}, "row 3: xy is 'here', expected a list"),
        ({"plain": ("success", 1)}, "row 3: success is 1, expected true or"),
        ({"plain": ("mood", 1)}, "row 3: a demonstration has no field 'mood'"),
        ({"arrays": ("theta", ...)}, "row 3: theta is missing"),
        ({"arrays": ("theta", np.zeros((2, 2)))}, "row 3: theta is an array"),
        ({"arrays": ("q", np.array([["a"]]))}, "row 3: q is no array of num"),
        (
            {"arrays": ("q", np.full((2, 2), np.nan))},
            r"3: q\[0, 0\] is nan",
        ),
        ({"arrays": ("spare", np.ones(2))}, "has no field 'spare'"),
    ],
)
def test_a_result_of_other_fields_is_told(change, message):
    plain, arrays = fake_world.run({"kind": "demonstration", **SPEC})
    for which, (name, value) in change.items():
        part = {"plain": plain, "arrays": arrays}[which]
        if value is ...:
            del part[name]
        else:
            part[name] = value
    with pytest.raises(InputError, match=message):
        unpack("demonstration", plain, arrays, "row 3: ")


def test_a_reason_is_stored_only_where_a_trial_is_not_valid():
    plain, arrays = fake_world.run({"kind": "strike", **SPEC})
    assert unpack("strike", plain, arrays).invalid == ""
    told = plain | {"invalid": "commands come late"}
    again, _ = pack(unpack("strike", told, arrays))
    assert again == told
