"""The tutorial on the station, run as a reader would."""

from pathlib import Path
import re
import subprocess
import sys

import pytest

SCRIPT = Path(__file__).parents[2] / "analysis" / "tutorial_station.py"


def run(*words):
    return subprocess.run(
        [sys.executable, str(SCRIPT), *words],
        capture_output=True,
        text=True,
        timeout=300,
        cwd=SCRIPT.parents[1],
    )


@pytest.mark.slow
def test_tutorial_runs_and_the_drum_agrees_with_what_it_says():
    done = run()
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
    helped = run("--help")
    assert helped.returncode == 0
    assert "controller" in helped.stdout
    assert run("--magic").returncode == 2
