"""YAML is read as a person reads it, or refused by file, field and line."""

import json

from hypothesis import given
from hypothesis import strategies as st
import pytest
import yaml

from drake_affetto.common.errors import InputError
from drake_affetto.common.strict_yaml import check_yaml, parse_yaml, read_text

TEXTS = st.text(st.characters(codec="utf-8", categories=["L", "N", "P"]))
SCALARS = (
    st.none()
    | st.booleans()
    | st.integers(-(10**12), 10**12)
    | st.floats(allow_nan=False, allow_infinity=False)
    | TEXTS
)
NESTS = st.recursive(
    SCALARS,
    lambda inside: (
        st.lists(inside, max_size=4)
        | st.dictionaries(TEXTS, inside, max_size=4)
    ),
    max_leaves=12,
)


@given(NESTS)
def test_what_a_writer_wrote_is_read_back(nest):
    """Two writers that do not know of this reader: JSON's and PyYAML's."""
    assert parse_yaml(json.dumps(nest, ensure_ascii=False), "f") == nest
    assert parse_yaml(yaml.safe_dump(nest, allow_unicode=True), "f") == nest


@given(st.text())
def test_any_text_is_read_or_refused_in_one_line(text):
    told = "f.yaml"
    try:
        parse_yaml(text, "f.yaml")
    except InputError as error:
        told = str(error)
    assert told.startswith("f.yaml")


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("1e-3", 1e-3),
        ("-2E5", -2e5),
        (".5", 0.5),
        ("5.", 5.0),
        ("007.5", 7.5),
        ("-7", -7),
        ("on", "on"),
        ("No", "No"),
        ("2020-01-01", "2020-01-01"),
        ("TRUE", True),
        ("~", None),
        ("10-20", "10-20"),
        ("'010'", "010"),
        ('"1:30"', "1:30"),
    ],
)
def test_plain_words_are_what_they_look_like(text, value):
    read = parse_yaml(f"a: {text}", "f")["a"]
    assert read == value
    assert type(read) is type(value)


@pytest.mark.parametrize(
    "number",
    [
        "010",
        "-010",
        "08",
        "0x1F",
        "0o17",
        "0b11",
        "1_0",
        "1_0.5",
        "1:30",
        "1:2:3",
    ],
)
def test_numbers_that_readers_take_differently_are_refused(number):
    with pytest.raises(InputError) as caught:
        parse_yaml(f"a:\n  b: [1, {number}]", "f.yaml")
    assert str(caught.value).startswith(f"f.yaml: a.b[1] is {number} in line 2")


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("a: 1\nb: 2\na: 3", "f: a is given twice, in lines 1 and 3"),
        ("x:\n- {a: 1, a: 1}", r"f: x\[0\]\.a is given twice, in lines 2"),
        ("a: &a [1, *a]", r"f: a\[1\] contains itself"),
        ("a: " + "9" * 5000, "a in line 1 is a number of 5000 digits"),
        ("? [a]\n: 1", "f: a key in line 1 is no single word"),
        ("a: 1\n---\nb: 1", "f is not YAML.*another document.*line 2"),
        ("a: !!int b", "f is not YAML"),
        ("a: !!timestamp 5", "f is not YAML"),
        ("a: !!python/tuple [1]", "f is not YAML: .*tag.*line 1"),
        ("a: \0", "f is not YAML"),
    ],
)
def test_what_cannot_be_meant_is_refused(text, told):
    with pytest.raises(InputError, match=told):
        parse_yaml(text, "f")


def test_aliases_do_not_grow_without_end():
    lines = ["a: &a [1, 2, 3, 4, 5, 6, 7, 8, 9, 0]"]
    for last, name in zip("abcdefgh", "bcdefghi", strict=True):
        lines.append(f"{name}: &{name} [{', '.join(['*' + last] * 10)}]")
    with pytest.raises(InputError, match="more than 200000 values"):
        parse_yaml("\n".join(lines), "f")
    assert parse_yaml("a: &a [1]\nb: *a", "f") == {"a": [1], "b": [1]}


def test_tags_of_other_readers_are_left_to_them(tmp_path):
    path = tmp_path / "f.yaml"
    path.write_text("a: !Rpy {deg: [1, 2, 3]}")
    check_yaml(path)
    path.write_text("a: !Rpy {deg: [1], deg: [2]}")
    with pytest.raises(InputError, match=r"f\.yaml: a\.deg is given twice"):
        check_yaml(path)


def test_a_byte_order_mark_is_no_part_of_the_text(tmp_path):
    path = tmp_path / "f.yaml"
    path.write_bytes(b"\xef\xbb\xbfa: 1")
    assert read_text(path) == "a: 1"
    path.write_bytes(b"\xff\xfea")
    with pytest.raises(InputError, match="is not UTF-8 text"):
        read_text(path)
    with pytest.raises(InputError, match=r"cannot read .*directory"):
        read_text(tmp_path)
