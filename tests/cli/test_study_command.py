"""What the commands of studies share, in a world where trials take no time."""

import argparse
import dataclasses
import sqlite3

import pytest

from drake_affetto import __version__
from drake_affetto.cli.demo import DemoCommand
from drake_affetto.cli.drum import DrumCommand
from drake_affetto.cli.main import main
from drake_affetto.cli.mirror import MirrorCommand
from drake_affetto.cli.study_command import rate_text
from drake_affetto.cli.teach import TeachCommand
from drake_affetto.cli.toy import ToyCommand
from drake_affetto.experiments import trials
from drake_affetto.experiments.results import SuccessRate
from support import fake_world

COMMANDS = [DemoCommand, DrumCommand, MirrorCommand, TeachCommand, ToyCommand]


@pytest.fixture
def world(monkeypatch):
    """Replaces the robot; the specs that ran are in the list."""
    ran = []

    def run(spec):
        ran.append(spec)
        return fake_world.run(spec)

    monkeypatch.setattr(trials, "run_task", run)
    return ran


@pytest.mark.parametrize("kind", COMMANDS)
def test_each_runs_anywhere_and_takes_trials_over(kind):
    parser = argparse.ArgumentParser()
    kind().add_arguments(parser)
    words = ["--dask", "tcp://there:1", "--reuse", "a", "--reuse", "b"]
    args = parser.parse_args(["--out", "x", *words])
    assert (args.dask, args.reuse) == ("tcp://there:1", ["a", "b"])


@pytest.mark.parametrize("kind", COMMANDS)
def test_options_not_given_make_the_default_plan(kind):
    parser = argparse.ArgumentParser()
    command = kind()
    command.add_arguments(parser)
    plan = command.make_plan(parser.parse_args(["--out", "x"]))
    assert plan == command.plan()
    assert dataclasses.is_dataclass(plan)


@pytest.mark.parametrize(
    "words",
    [
        "drum --demonstrations 4 --evaluations 2",
        "mirror --demonstrations 4 --evaluations 2 --samples 3 --repeats 1 "
        "--no-media",
        "toy --repeats 1 --seeds 2",
    ],
)
def test_trials_of_another_folder_are_not_run_again(
    words, tmp_path, world, capsys
):
    first, second = tmp_path / "first", tmp_path / "second"
    words = [*words.split(), "--workers", "0", "--out"]
    assert main([*words, str(first)]) == 0
    count = len(world)
    capsys.readouterr()
    assert main([*words, str(second), "--reuse", str(first)]) == 0
    assert len(world) == count
    told = " ".join(capsys.readouterr().out.split())
    assert "finished trials taken over from" in told
    assert "were finished already" in told
    results = [(d / "results.json").read_bytes() for d in (first, second)]
    assert results[0] == results[1]


def test_interrupted_it_tells_that_the_command_goes_on(
    tmp_path, monkeypatch, capsys
):
    def stop(spec):
        raise KeyboardInterrupt

    monkeypatch.setattr(trials, "run_task", stop)
    words = ["drum", "--workers", "0", "--out", str(tmp_path / "out")]
    assert main(words) == 130
    told = " ".join(capsys.readouterr().out.split())
    assert "the same command goes on from there" in told
    assert not (tmp_path / "out" / "results.json").exists()


def test_a_rate_is_shown_with_its_interval():
    assert rate_text(SuccessRate(0.5, 0.25, 0.75)) == " 50%  [25%, 75%]"


def test_what_a_new_version_runs_again_is_told(
    tmp_path, world, capsys, monkeypatch
):
    mine = tmp_path / "mine.yaml"
    mine.write_text("extends: drumming\n")
    out = tmp_path / "out"
    words = "drum --demonstrations 4 --evaluations 2 --after 4 --workers 0"
    words = [*words.split(), "--scenario", str(mine), "--out", str(out)]
    assert main(words) == 0
    first = len(world)
    assert main(words) == 0
    told = capsys.readouterr().out
    assert len(world) == first
    assert "do not fit" not in told

    mine.write_text("extends: drumming\nsettling_duration: 1.5\n")
    assert main(words) == 0
    told = " ".join(capsys.readouterr().out.split())
    assert len(world) == 2 * first
    assert "finished here do not fit any more (the scenario's values" in told

    real = trials.scenario_content
    monkeypatch.setattr(
        trials,
        "scenario_content",
        lambda name: dataclasses.replace(real(name), version="9.9.9"),
    )
    assert main(words) == 0
    told = " ".join(capsys.readouterr().out.split())
    assert f"do not fit any more (version {__version__}, now 9.9.9)" in told


def test_a_damaged_store_is_told_before_work_starts(tmp_path, world, capsys):
    out = tmp_path / "out"
    words = "drum --demonstrations 4 --evaluations 2 --workers 0 --out"
    assert main([*words.split(), str(out)]) == 0
    first = len(world)
    database = sqlite3.connect(out / "trials.sqlite")
    database.execute(
        "UPDATE trials SET result = '{}' WHERE rowid = "
        "(SELECT max(rowid) FROM trials)"
    )
    database.execute("DELETE FROM trials WHERE rowid = 1")
    database.commit()
    database.close()
    capsys.readouterr()
    assert main([*words.split(), str(out)]) == 2
    err = capsys.readouterr().err
    assert err.count("\n") == 1
    assert "trials.sqlite: trial" in err
    assert "is damaged" in err
    assert len(world) == first
