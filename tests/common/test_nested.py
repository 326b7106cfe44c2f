"""Nests of mappings and sequences."""

from drake_affetto.common.nested import leaves, map_leaves

NEST = {"a": [1, (2, "x")], 3: {"b": None}}


def test_leaves_are_changed_and_the_shape_stays():
    assert map_leaves(NEST, lambda leaf: [leaf]) == {
        "a": [[1], [[2], ["x"]]],
        "3": {"b": [None]},
    }


def test_leaves_come_in_their_order():
    assert list(leaves(NEST)) == [1, 2, "x", None]
    assert list(leaves("text")) == ["text"]
