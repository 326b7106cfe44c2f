"""A study's trials as one table, and back."""

import numpy as np
import pytest

from drake_affetto.common.errors import InputError
from drake_affetto.common.output import STORE
from drake_affetto.experiments import tables, trials
from drake_affetto.experiments.tables import read_trials, write_trials
from drake_affetto.runner.store import TrialStore
from support import fake_world

pd = pytest.importorskip("pandas")


@pytest.fixture
def folder(tmp_path):
    """A study of three trials in the fake world."""
    xy = [0.23, -0.09]
    specs = [
        trials.look("drumming", xy, 1),
        trials.demonstration("drumming", xy, 2),
        trials.strike("drumming", xy, 3, np.ones(6), np.ones((1, 4, 5))),
    ]
    with TrialStore(tmp_path / STORE) as store:
        store.plan("all of it", specs)
        for spec in specs:
            store.put(spec, *fake_world.run(spec))
    return tmp_path


def test_each_trial_is_a_row_with_typed_columns(folder):
    table = read_trials(folder)
    assert list(table.kind) == ["look", "demonstration", "strike"]
    assert [str(each) for each in table.dtypes] == [
        column.dtype for column in tables.COLUMNS
    ]
    assert table.attrs["units"]["impulse"] == "N s"
    assert set(table.phase) == {"all of it"}
    assert list(table.seed) == [1, 2, 3]
    assert list(table.x) == [0.23] * 3
    assert table.reward.isna().tolist() == [True, False, False]
    assert table.found.tolist()[:2] == [True, True]
    assert table.tau_1[0] == pytest.approx(
        fake_world.tau("drumming", [0.23, -0.09])[0], abs=0.01
    )


@pytest.mark.parametrize("suffix", tables.SUFFIXES)
def test_a_table_comes_back_from_its_file(folder, suffix):
    table = read_trials(folder)
    path = folder / f"trials{suffix}"
    write_trials(path, table)
    pd.testing.assert_frame_equal(read_trials(path), table)


@pytest.mark.parametrize(
    ("name", "content", "said"),
    [
        ("a.csv", b"key,kind\n1,2\n", "missing or unknown columns attempts"),
        ("a.csv", b"", "is no table of trials"),
        ("a.parquet", b"PAR1 but not for long", "is no table of trials"),
        ("b.csv", None, "expected an existing file"),
    ],
)
def test_a_corrupt_table_is_told_by_name(tmp_path, name, content, said):
    path = tmp_path / name
    if content is not None:
        path.write_bytes(content)
    with pytest.raises(InputError, match=said) as caught:
        read_trials(path)
    assert name in str(caught.value)


def test_a_wrong_entry_is_told_by_its_column(folder):
    path = folder / "trials.csv"
    write_trials(path, read_trials(folder))
    path.write_text(path.read_text().replace(",0.23,", ",left,", 1))
    with pytest.raises(InputError, match=r"trials\.csv: column x"):
        read_trials(path)


def test_what_is_no_study_or_no_table_is_told(tmp_path):
    with pytest.raises(InputError, match="there is no study in"):
        read_trials(tmp_path)
    with pytest.raises(InputError, match=r"ends in \.csv or \.parquet"):
        write_trials(tmp_path / "a.xlsx", pd.DataFrame())
