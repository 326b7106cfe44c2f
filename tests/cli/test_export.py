"""`affetto export`: what a user types and sees."""

import contextlib
import sqlite3

import numpy as np
import pytest

from drake_affetto.cli.main import main
from drake_affetto.common.output import STORE
from drake_affetto.common.owner import MARK, claim_folder
from drake_affetto.experiments import trials
from drake_affetto.experiments.tables import read_trials
from drake_affetto.runner.store import TrialStore
from support import fake_world


@pytest.fixture
def study(tmp_path):
    spec = trials.strike("drumming", [0.2, -0.1], 3, np.ones(6), np.ones(2))
    with TrialStore(tmp_path / STORE) as store:
        store.put(spec, *fake_world.run(spec))
    return tmp_path


def test_a_table_is_written(study, capsys):
    path = study / "new" / "trials.csv"
    assert main(["export", str(study), "--to", str(path)]) == 0
    assert capsys.readouterr().out == f"{path}\n"
    assert list(read_trials(path).kind) == ["strike"]


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--to", "a.xls"], "ends in .csv or .parquet"),
        (["--to", "a.csv", "--trial", "0"], "ends in .mat or .npz"),
        (["--to", "a.mat", "--trial", "none"], "key is 'none'"),
        ([], "--to"),
    ],
)
def test_bad_input_is_one_line(study, monkeypatch, capsys, words, said):
    monkeypatch.chdir(study)
    assert main(["export", str(study), *words]) == 2
    error = capsys.readouterr().err
    assert said in error
    assert error.count("\n") == 1


def test_a_folder_without_a_study_is_told(tmp_path, capsys):
    assert main(["export", str(tmp_path), "--to", "a.csv"]) == 2
    assert "there is no study" in capsys.readouterr().err


def test_a_damaged_study_is_refused_and_its_folder_left_as_it_was(
    study, capsys
):
    claim_folder(study, "drum")
    with contextlib.closing(sqlite3.connect(study / STORE)) as database:
        database.execute("UPDATE trials SET result = '['")
        database.commit()
    mark = (study / MARK).read_bytes()
    assert main(["export", str(study), "--to", str(study / "a.csv")]) == 2
    assert "result is damaged" in capsys.readouterr().err
    # SQLite keeps files of its own beside what it reads.
    assert not (study / "a.csv").exists()
    assert (study / MARK).read_bytes() == mark
