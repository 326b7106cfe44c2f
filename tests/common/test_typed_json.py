"""Results as dataclasses: written to JSON, read back, checked."""

import dataclasses
from dataclasses import field
import json
from typing import Literal

import hypothesis
from hypothesis import strategies as st
import numpy as np
import pytest

from drake_affetto.common.errors import InputError
from drake_affetto.common.typed_json import from_plain, to_plain


@dataclasses.dataclass(frozen=True)
class Cell:
    rate: float = field(metadata={"range": (0.0, 1.0)})
    hits: int
    note: str | None = None


@dataclasses.dataclass(frozen=True)
class Table:
    name: Literal["drum", "mirror"]
    cells: dict[str, dict[int, Cell]] = field(metadata={"not_empty": True})
    corner: tuple[float, float] = (0.0, 0.0)
    done: bool = False
    rows: list[list[int]] = field(default_factory=list)


GOOD = {
    "name": "drum",
    "cells": {"a": {"3": {"rate": 0.5, "hits": 2}}},
    "corner": [1, 2.5],
    "done": True,
    "rows": [[1], [2, 3]],
}


def read(**changes):
    return from_plain(Table, {**GOOD, **changes}, "results.json: ")


@hypothesis.given(
    st.builds(
        Table,
        name=st.sampled_from(["drum", "mirror"]),
        cells=st.dictionaries(
            st.text(min_size=1),
            st.dictionaries(
                st.integers(0, 99),
                st.builds(
                    Cell,
                    st.floats(0.0, 1.0),
                    st.integers(),
                    st.none() | st.text(),
                ),
            ),
            min_size=1,
        ),
        corner=st.tuples(*2 * (st.floats(-1e100, 1e100),)),
        done=st.booleans(),
        rows=st.lists(st.lists(st.integers())),
    )
)
def test_what_is_written_is_read_back(table):
    text = json.dumps(to_plain(table), allow_nan=False)
    assert from_plain(Table, json.loads(text)) == table


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"name": "toy"}, "results.json: name is 'toy', expected 'drum' or"),
        ({"done": 1}, "results.json: done is 1, expected true or false"),
        ({"corner": [1.0]}, "results.json: corner is .*, expected 2 values"),
        ({"corner": [1.0, "x"]}, r"corner\[1\] is 'x', expected a number"),
        ({"rows": [[1], [True]]}, r"rows\[1\]\[0\] is True, expected a whole"),
        ({"rows": {}}, "rows is {}, expected a list"),
        ({"cells": {}}, "cells is empty"),
        ({"cells": {"a": []}}, r"cells\.a is \[\], expected an object"),
        ({"cells": {"a": {"x": {}}}}, r"cells\.a is 'x', expected whole"),
        ({"cells": {"a": {"3": {"rate": 0.5}}}}, r"a\.3\.hits is missing"),
        (
            {"cells": {"a": {"3": {"rate": 1.5, "hits": 1}}}},
            r"cells\.a\.3\.rate is 1\.5, expected a number from 0 to 1",
        ),
        (
            {"cells": {"a": {"3": {"rate": 0.5, "hits": 1, "note": 7}}}},
            r"note is 7, expected a text",
        ),
    ],
)
def test_errors_name_the_place_the_value_and_what_was_expected(
    changes, message
):
    with pytest.raises(InputError, match=message) as caught:
        read(**changes)
    assert "\n" not in str(caught.value)


def test_numbers_are_finite():
    with pytest.raises(InputError, match=r"corner\[0\] is nan"):
        read(corner=[float("nan"), 0.0])


def test_fields_may_be_missing_if_they_have_a_default_and_others_are_ignored():
    read_back = read(later_field=3)
    assert read_back == read()
    few = {name: GOOD[name] for name in ("name", "cells")}
    assert from_plain(Table, few).corner == (0.0, 0.0)


def test_numpy_and_paths_become_plain(tmp_path):
    plain = to_plain(
        {"a": np.arange(3), 4: np.float64(0.5), "p": tmp_path, "t": (1, None)}
    )
    assert plain == {
        "a": [0, 1, 2],
        "4": 0.5,
        "p": str(tmp_path),
        "t": [1, None],
    }
