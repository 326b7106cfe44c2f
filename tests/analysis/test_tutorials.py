"""The tutorials, run as a reader would."""

import re

import pytest

from support.scripts import run

SCRIPT = "tutorials/own_parts.py"


@pytest.mark.slow
def test_tutorial_runs_and_the_drum_agrees_with_what_it_says():
    done = run(SCRIPT)
    assert (done.returncode, done.stderr) == (0, "")
    heard = dict(re.findall(r"   (.*?) +R = (.*)", done.stdout))
    assert len(heard) == 4
    missed = [what for what, said in heard.items() if "no sound" in said]
    assert missed == ["a stroke that turns 3 cm above the head"]
    for what, said in heard.items():
        reward = float(said.split(":")[0])
        assert reward < 0.05 if what in missed else reward > 0.3, what


@pytest.mark.slow
def test_help_is_told_and_what_is_unknown_refused():
    helped = run(SCRIPT, "--help")
    assert helped.returncode == 0
    assert "controller" in helped.stdout
    assert run(SCRIPT, "--magic").returncode == 2


@pytest.mark.slow
def test_tutorial_runs_and_says_what_it_promises(tmp_path):
    done = run("tutorials/transfer.py", "--out", str(tmp_path))
    assert (done.returncode, done.stderr) == (0, "")
    assert len(list(tmp_path.glob("*.png"))) == 4
    missed = {
        what.strip(): float(value)
        for what, value in re.findall(r"   (.*?) +([\d.]+) mm", done.stdout)
    }
    assert missed["after transfer"] < 0.2 * missed["the skill unchanged"]
    rows = {
        line.split()[0]: [float(v) for v in line.split()[1:]]
        for line in done.stdout.splitlines()
        if re.match(r"   [a-z_]+( +[\d.]+){5}$", line)
    }
    # With three demonstrations.
    assert rows["transfer_default"][0] < 0.5 * rows["relearn"][0]
    assert rows["transfer_default"][0] < rows["transfer"][0]


@pytest.mark.slow
def test_a_learner_runs_and_draws_its_curve(tmp_path, monkeypatch):
    monkeypatch.setenv("AFFETTO_CACHE", str(tmp_path / "cache"))
    words = ("--episodes", "12", "--tests", "3", "--out", str(tmp_path))
    done = run("tutorials/learn_by_reward.py", *words)
    assert (done.returncode, done.stderr) == (0, "")
    assert re.search(r"the lessons' mean +\d+% +[\d.]+", done.stdout)
    assert (tmp_path / "learning_curve.png").stat().st_size > 5000
