"""`affetto faults`: what it writes, and what it refuses."""

import json

import pytest

from drake_affetto.cli.main import main
from drake_affetto.experiments import trials
from support import fake_world
from support.report_page import Page

CATALOG = "{joints: [right_elbow_flexion], faults: [{kind: joint_stuck}]}"


@pytest.fixture
def words(tmp_path):
    file = tmp_path / "mine.yaml"
    file.write_text(CATALOG)
    return [
        *("faults", "--workers", "0", "--repeats", "2"),
        *("--demonstrations", "4", "--catalog", str(file)),
        *("--out", str(tmp_path / "out")),
    ]


def test_it_writes_a_table_that_the_report_shows(
    tmp_path, words, monkeypatch, capsys
):
    monkeypatch.setattr(trials, "run_task", fake_world.run)
    assert main(words) == 0
    told = capsys.readouterr().out
    assert "joint stuck" in told
    assert "2 trials with a fault" in " ".join(told.split())
    results = json.loads((tmp_path / "out" / "results.json").read_text())
    assert results["study"] == "faults"
    assert main(["report", str(tmp_path / "out")]) == 0
    page = Page(tmp_path / "out" / "report.html")
    assert "faults" in page.sections()
    assert "joint stuck" in page.text
    assert "2 trials with a fault" in page.text


@pytest.mark.parametrize(
    ("more", "message"),
    [
        (["--scenario", "drumming"], "--scenario is 'drumming', expected"),
        (["--repeats", "0"], "--repeats is 0"),
    ],
)
def test_what_does_not_fit_is_told(words, more, message, capsys):
    assert main([*words, *more]) == 2
    error = capsys.readouterr().err
    assert message in error
    assert error.count("\n") == 1


def test_an_unknown_joint_is_told(tmp_path, words, capsys):
    file = tmp_path / "mine.yaml"
    file.write_text(CATALOG.replace("right_elbow_flexion", "tail"))
    assert main(words) == 2
    assert "'tail'" in capsys.readouterr().err
