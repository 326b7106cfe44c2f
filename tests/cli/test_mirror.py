"""`affetto mirror --self-calibrate`."""

import json

import pytest

from drake_affetto.cli.main import main
from drake_affetto.experiments import trials
from support.fake_mirrors import FakeMirrors

WORDS = [
    "mirror",
    "--self-calibrate",
    *("--repeats", "1", "--evaluations", "2", "--demonstrations", "5"),
    *("--samples", "3", "--workers", "0", "--no-media", "--out"),
]


@pytest.fixture
def settings(tmp_path):
    path = tmp_path / "mine.yaml"
    # A small cloud, for speed.
    path.write_text("ear: {particles: 300}\n")
    return ["--calibration", str(path)]


def test_it_drums_without_a_demonstration(
    tmp_path, settings, monkeypatch, capsys
):
    monkeypatch.setattr(trials, "run_task", FakeMirrors())
    out = tmp_path / "out"
    assert main([*WORDS, str(out), *settings]) == 0
    results = json.loads((out / "results.json").read_text())
    methods = results["self_calibration"]["methods"]
    assert set(methods) == {"hand", "ellipse", "ear"}
    assert methods["hand"]["success_rate"]["mean"] == 1.0
    told = capsys.readouterr().out
    assert "Without a demonstration" in told
    assert "ellipse" in told


def test_its_mirrors_are_drawn_as_asked(
    tmp_path, settings, monkeypatch, capsys
):
    monkeypatch.setattr(trials, "run_task", FakeMirrors())
    out = tmp_path / "out"
    asked = ["--rotation", "2", "--translation", "0.01", "--schemes", "relearn"]
    assert main([*WORDS, str(out), *settings, *asked]) == 0
    results = json.loads((out / "results.json").read_text())
    found = results["self_calibration"]
    assert (found["rotation"], found["translation"]) == (2.0, 0.01)
    # The schemes beside are those that were asked for.
    assert set(results["schemes"]) == {"relearn"}


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (["--rotation", "2"], "--rotation is 2.0, expected nothing without"),
        (["--self-calibrate", "--rotation", "99"], "--rotation is 99"),
        (["--self-calibrate", "--translation", "-1"], "--translation is -1"),
    ],
)
def test_other_mirrors_need_the_self_calibration(tmp_path, capsys, words, told):
    out = tmp_path / "out"
    assert main(["mirror", *words, "--out", str(out)]) == 2
    assert told in capsys.readouterr().err
    assert not out.exists()


def test_without_a_calibration_nothing_is_overwritten(
    tmp_path, settings, monkeypatch, capsys
):
    monkeypatch.setattr(trials, "run_task", FakeMirrors(blind=True))
    out = tmp_path / "out"
    out.mkdir()
    (out / "results.json").write_text("kept")
    assert main([*WORDS, str(out), *settings]) == 1
    error = capsys.readouterr().err
    assert "not seen in the mirror at any of 12 postures" in error
    assert error.count("\n") == 1
    assert (out / "results.json").read_text() == "kept"
