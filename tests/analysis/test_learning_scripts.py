"""The scripts on learning, run as a reader would."""

from pathlib import Path
import re
import subprocess
import sys

import pytest

ANALYSIS = Path(__file__).parents[2] / "analysis"


def run(script, *words):
    return subprocess.run(
        [sys.executable, str(ANALYSIS / script), *words],
        capture_output=True,
        text=True,
        timeout=300,
        cwd=ANALYSIS.parent,
    )


def test_benchmarks_are_listed_and_told_apart():
    names = run("benchmark.py", "--list").stdout.split()
    assert {"dmp", "elm", "transfer"} <= set(names)
    wrong = run("benchmark.py", "--only", "magic")
    assert wrong.returncode == 2
    assert "magic" in wrong.stderr


@pytest.mark.slow
def test_benchmarks_of_learning_run():
    done = run("benchmark.py", "--only", "dmp", "elm", "transfer")
    assert (done.returncode, done.stderr) == (0, "")
    assert "partial_fit of one sample" in done.stdout
    # A ratio within one run, far below what is measured on a free machine.
    (ratio,) = re.findall(r"32 starts, Eq. 5.* (\d+) × faster", done.stdout)
    assert int(ratio) > 20


@pytest.mark.slow
def test_tutorial_runs_and_says_what_it_promises(tmp_path):
    done = run("tutorial_transfer.py", "--out", str(tmp_path))
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
def test_fig_2_is_drawn(tmp_path):
    done = run("fig2_toy.py", "--out", str(tmp_path))
    assert (done.returncode, done.stderr) == (0, "")
    assert (tmp_path / "fig2_toy.png").stat().st_size > 10_000
    wrong = run(
        "fig2_toy.py", "--out", str(tmp_path), "--results", str(tmp_path)
    )
    assert wrong.returncode == 2
    assert "results.json" in wrong.stderr
