"""What zlib packs best still fits its packed size."""

import zlib

import pytest

from drake_affetto.common.stored_size import greatest_size


@pytest.mark.parametrize("size", [0, 1, 1000, 10**5, 10**7])
def test_what_packs_best_fits(size):
    packed = len(zlib.compress(bytes(size), 9))
    assert size <= greatest_size(packed) < 2 * size + 40_000
