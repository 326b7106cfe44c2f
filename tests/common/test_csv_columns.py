"""Columns of numbers from CSV files, and what is said of other files."""

import numpy as np
import pytest

from drake_affetto.common.csv_columns import read_columns
from drake_affetto.common.errors import InputError


def write(path, text):
    path.write_text(text, encoding="utf-8")
    return path


def test_columns_are_found_by_name_in_the_order_asked(tmp_path):
    path = write(tmp_path / "a.csv", "t , b,a\n0,1,2\n\n0.5,nan,-4e-1\n")
    found = read_columns(path, ["a", "t"], ["c", "b"])
    assert list(found) == ["a", "t", "b"]
    np.testing.assert_array_equal(found["a"], [2.0, -0.4])
    np.testing.assert_array_equal(found["t"], [0.0, 0.5])
    np.testing.assert_array_equal(found["b"], [1.0, np.nan])


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "no column t, a; it has 0 columns"),
        ("t,b\n1,2\n3,4\n", "no column a;"),
        ("t,a\n1,2\n", "fewer than two rows"),
        ("t,a\n1,2\n\n3,x\n", "line 4, column a is 'x', expected a number"),
        ("t,a\n1,2\n3\n", "line 3, column a is missing"),
        ("t,a\n1,2\n3,1_0\n", "line 3, column a is '1_0', expected a number"),
        ("t,a\n1,2\n3,٣\n", "line 3, column a is '٣'"),
        ("t,a\n1,2\n3,\n", "line 3, column a is ''"),
        ("t,a,a\n1,2,3\n3,4,5\n", "two columns a"),
        ('t,a\n1,"2\n3,4\n', "line 3|fewer"),
    ],
)
def test_what_is_wrong_is_told_with_the_file(tmp_path, text, message):
    path = write(tmp_path / "a.csv", text)
    with pytest.raises(InputError, match=message) as caught:
        read_columns(path, ["t", "a"])
    assert "a.csv" in str(caught.value)


def test_files_that_cannot_be_read(tmp_path):
    with pytest.raises(InputError, match="cannot read"):
        read_columns(tmp_path / "none.csv", ["t"])
    with pytest.raises(InputError, match="cannot read"):
        read_columns(tmp_path, ["t"])
    path = tmp_path / "a.csv"
    path.write_bytes(b"\xff\xfe\x00t")
    with pytest.raises(InputError, match="UTF-8"):
        read_columns(path, ["t"])
    path.write_text("t\n" + "1" * 200_000 + "\n2\n")
    with pytest.raises(InputError, match="no CSV"):
        read_columns(path, ["t"])
