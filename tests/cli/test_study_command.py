"""What the commands of studies share, in a world where trials take no time."""

import argparse
import dataclasses

import pytest

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
