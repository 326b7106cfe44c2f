"""`affetto teach`: what it tells."""

import io

import numpy as np
import pytest
from rich.console import Console

from drake_affetto.cli import main as cli
from drake_affetto.cli.teach import print_outcomes
from drake_affetto.common.folder_lock import lock_file
from drake_affetto.experiments import trials
from drake_affetto.experiments.results import DemonstrationResult


def test_a_drum_that_is_not_seen_is_reported():
    buffer = io.StringIO()
    nothing = np.zeros(0)
    unseen = DemonstrationResult(
        *([0.2, 0.0], False, [0.0, 0.0], 0, False, 0.0, 0.0),
        *(nothing, nothing, nothing),
    )
    print_outcomes([unseen], Console(file=buffer, width=100))
    assert "drum not seen" in buffer.getvalue()
    print_outcomes([], Console(file=buffer, width=100))


def teach(path, *more):
    return cli.main(
        ["teach", "--demonstrations", "2", "--workers", "0", "--out", str(path)]
        + list(more)
    )


@pytest.fixture
def silent(monkeypatch):
    """A drum that is never seen."""
    unseen = {
        "xy": [0.0, 0.0],
        "found": False,
        "tau": [0.0, 0.0],
        "attempts": 0,
        "success": False,
        "reward": 0.0,
        "max_pull": 0.0,
    }
    nothing = {
        "theta": np.zeros(0),
        "q": np.zeros((0, 0)),
        "prototype": np.zeros((0, 0)),
    }
    monkeypatch.setattr(trials, "run_task", lambda spec: (unseen, nothing))


def test_where_nothing_was_taught_no_file_is_named(tmp_path, silent, capsys):
    path = tmp_path / "taught.h5"
    assert teach(path) == 1
    out = capsys.readouterr().out
    assert "Nothing was taught" in out
    assert "taught.h5" not in out
    assert not path.exists()


def test_the_second_of_two_is_told_at_the_start(tmp_path, silent, capsys):
    path = tmp_path / "taught.h5"
    with lock_file(path, "affetto teach"):
        assert teach(path) == 2
    done = capsys.readouterr()
    assert done.out == ""
    assert done.err.count("\n") == 1
    assert f"another `affetto teach` is at work on {path}" in done.err


@pytest.mark.parametrize(
    ("name", "message"),
    [("", "--out is ''"), (".", "a file, not a folder")],
)
def test_what_is_no_file_is_refused(
    tmp_path, monkeypatch, capsys, name, message
):
    monkeypatch.chdir(tmp_path)
    assert teach(name) == 2
    assert message in capsys.readouterr().err


def test_a_scenario_that_does_not_fit_leaves_no_folder(tmp_path, capsys):
    bad = tmp_path / "bad.yaml"
    bad.write_text("extends: drumming\nsettling_duration: -1\n")
    path = tmp_path / "new" / "taught.h5"
    words = ["teach", "--out", str(path), "--scenario", str(bad)]
    assert cli.main(words) == 2
    assert "bad.settling_duration is -1" in capsys.readouterr().err
    assert [each.name for each in tmp_path.iterdir()] == ["bad.yaml"]
