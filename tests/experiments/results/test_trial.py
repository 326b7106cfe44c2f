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
    "scenario": {"name": "drumming"},
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
