import json
import math
from pathlib import Path
import stat

from hypothesis import given
from hypothesis import strategies as st
import numpy as np
import pytest

from drake_affetto.common import output
from drake_affetto.common.errors import InputError
from drake_affetto.common.output import (
    atomic_path,
    output_folder,
    prepare_output,
    write_bytes_atomic,
    write_json,
    write_text_atomic,
)


def names(folder: Path) -> set[str]:
    return {path.name for path in folder.iterdir()}


def write_half(path: Path, error: BaseException) -> None:
    with atomic_path(path) as fresh:
        fresh.write_text("half")
        raise error


class TestPrepareOutput:
    def test_makes_the_folder_and_leaves_it_empty(self, tmp_path):
        folder = prepare_output(tmp_path / "a/b")
        assert folder == tmp_path / "a/b"
        assert names(folder) == set()

    def test_keeps_what_stands_in_the_folder(self, tmp_path):
        (tmp_path / "results.json").write_text("old")
        assert prepare_output(str(tmp_path)) == tmp_path
        assert names(tmp_path) == {"results.json"}
        assert (tmp_path / "results.json").read_text() == "old"

    def test_home_is_expanded(self, tmp_path, monkeypatch):
        monkeypatch.setenv("HOME", str(tmp_path))
        assert prepare_output("~/out") == tmp_path / "out"

    def test_refuses_a_file(self, tmp_path):
        file = tmp_path / "file"
        file.write_text("kept")
        for path in (file, file / "below", file / "further/below"):
            with pytest.raises(InputError) as caught:
                prepare_output(path)
            assert str(path) in str(caught.value)
        assert file.read_text() == "kept"

    @pytest.mark.parametrize("path", ["", "nul\0byte"])
    def test_refuses_what_is_no_path(self, path):
        with pytest.raises(InputError, match="output folder"):
            prepare_output(path)

    def test_leaves_no_folder_behind_where_it_fails(self, tmp_path):
        with pytest.raises(InputError, match="too long"):
            prepare_output(tmp_path / "made/on/the/way" / ("x" * 300))
        assert names(tmp_path) == set()

    def test_finds_out_that_files_are_refused(self, tmp_path, monkeypatch):
        """Also where permission bits would allow them, as they do to root."""

        def refuse(*args, **kwargs):
            raise OSError(30, "Read-only file system")

        monkeypatch.setattr(output.os, "open", refuse)
        with pytest.raises(InputError, match="Read-only file system"):
            prepare_output(tmp_path / "a/b")
        assert names(tmp_path) == set()


class TestAtomicPath:
    def test_file_appears_whole_at_the_end(self, tmp_path):
        path = tmp_path / "figure.png"
        with atomic_path(path) as fresh:
            assert fresh.parent == tmp_path
            assert fresh.suffix == ".png"
            fresh.write_bytes(b"half")
            assert not path.exists()
            fresh.write_bytes(b"whole")
        assert path.read_bytes() == b"whole"
        assert names(tmp_path) == {"figure.png"}

    @pytest.mark.parametrize(
        "error", [RuntimeError("boom"), KeyboardInterrupt()]
    )
    def test_failure_leaves_the_old_file_and_nothing_else(
        self, tmp_path, error
    ):
        path = tmp_path / "results.json"
        path.write_text("old")
        with pytest.raises(type(error)):
            write_half(path, error)
        assert path.read_text() == "old"
        assert names(tmp_path) == {"results.json"}

    def test_full_disk_is_one_line(self, tmp_path):
        path = tmp_path / "x.bin"
        with pytest.raises(InputError, match=r"x\.bin: No space left"):
            write_half(path, OSError(28, "No space left on device"))
        assert names(tmp_path) == set()

    def test_missing_folder_is_one_line(self, tmp_path):
        with pytest.raises(InputError, match="No such file or directory"):
            write_bytes_atomic(tmp_path / "none/x", b"")

    def test_a_link_stays_and_its_target_is_written(self, tmp_path):
        (tmp_path / "far").mkdir()
        for name in ("there.json", "not_yet.json"):
            (tmp_path / name).symlink_to(Path("far") / name)
        (tmp_path / "far/there.json").write_text("old")
        for name in ("there.json", "not_yet.json"):
            write_json(tmp_path / name, [1])
            assert (tmp_path / name).is_symlink()
            assert json.loads((tmp_path / "far" / name).read_text()) == [1]
        assert names(tmp_path / "far") == {"there.json", "not_yet.json"}


def test_bytes_and_text_are_written_as_given(tmp_path):
    write_bytes_atomic(tmp_path / "b", bytes(range(256)))
    assert (tmp_path / "b").read_bytes() == bytes(range(256))
    write_text_atomic(tmp_path / "t", "τ → θ\n")
    assert (tmp_path / "t").read_bytes().decode("utf-8") == "τ → θ\n"


def test_files_are_as_readable_as_any_other(tmp_path):
    (tmp_path / "plain").touch()
    write_text_atomic(tmp_path / "atomic", "")
    modes = {
        stat.S_IMODE((tmp_path / name).stat().st_mode)
        for name in ("plain", "atomic")
    }
    assert len(modes) == 1


def test_directory_in_the_way_is_kept(tmp_path):
    (tmp_path / "x").mkdir()
    with pytest.raises(InputError, match="cannot write"):
        write_text_atomic(tmp_path / "x", "text")
    assert names(tmp_path) == {"x"}


JSON = st.recursive(
    st.none()
    | st.booleans()
    | st.integers(-(2**60), 2**60)
    | st.floats(allow_nan=False, allow_infinity=False)
    | st.text(st.characters(exclude_categories=["Cs"])),
    lambda inner: (
        st.lists(inner, max_size=4)
        | st.dictionaries(
            st.text(st.characters(exclude_categories=["Cs"])),
            inner,
            max_size=4,
        )
    ),
    max_leaves=15,
)


class TestWriteJson:
    @given(obj=JSON)
    def test_reads_back_the_same(self, tmp_path_factory, obj):
        path = tmp_path_factory.getbasetemp() / "round_trip.json"
        write_json(path, obj)
        assert json.loads(path.read_text("utf-8")) == obj

    def test_numpy_becomes_plain(self, tmp_path):
        path = tmp_path / "x.json"
        write_json(
            path,
            {
                "b": np.arange(4.0).reshape(2, 2),
                "a": (np.float64(0.1), np.int64(3), np.bool_(True)),
                "scalar": np.array(2.5),
                "path": Path("some/file"),
            },
        )
        assert json.loads(path.read_text()) == {
            "b": [[0.0, 1.0], [2.0, 3.0]],
            "a": [0.1, 3, True],
            "scalar": 2.5,
            "path": "some/file",
        }
        assert list(json.loads(path.read_text())) == [
            "b",
            "a",
            "scalar",
            "path",
        ]

    @pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf])
    def test_number_that_is_not_finite_is_refused_by_place(
        self, tmp_path, value
    ):
        path = tmp_path / "x.json"
        path.write_text("old")
        trials = [{"tau": np.array([0.0, value])}]
        with pytest.raises(ValueError, match=r"drumming\[0\]\.tau\[1\] is"):
            write_json(path, {"drumming": trials})
        assert path.read_text() == "old"
        assert names(tmp_path) == {"x.json"}

    def test_what_has_no_form_in_json_is_refused(self, tmp_path):
        with pytest.raises(TypeError):
            write_json(tmp_path / "x.json", {"a": object()})
        assert names(tmp_path) == set()


def test_a_folder_made_for_input_that_does_not_fit_goes_again(tmp_path):
    (tmp_path / "there").mkdir()
    for name, kept in (("new/deep", False), ("there", True)):
        with pytest.raises(InputError, match="it is bad"):
            refuse_in(tmp_path / name)
        assert (tmp_path / name).is_dir() == kept
    assert names(tmp_path) == {"there"}
    with output_folder(tmp_path / "new/deep") as folder:
        assert folder.is_dir()
    assert folder.is_dir()


def refuse_in(folder):
    with output_folder(folder) as made:
        assert made.is_dir()
        raise InputError("it is bad")
