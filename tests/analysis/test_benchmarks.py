"""The benchmarks, run as a reader would."""

import re

import pytest

from support.scripts import run


def test_benchmarks_are_listed_and_told_apart():
    names = run("benchmarks/benchmark.py", "--list").stdout.split()
    assert {"dmp", "elm", "transfer", "start"} <= set(names)
    wrong = run("benchmarks/benchmark.py", "--only", "magic")
    assert wrong.returncode == 2
    assert "magic" in wrong.stderr


@pytest.mark.slow
def test_benchmarks_of_learning_run():
    done = run("benchmarks/benchmark.py", "--only", "dmp", "elm", "transfer")
    assert (done.returncode, done.stderr) == (0, "")
    assert "partial_fit of one sample" in done.stdout
    # A ratio within one run, far below what is measured on a free machine.
    (ratio,) = re.findall(r"32 starts, Eq. 5.* (\d+) × faster", done.stdout)
    assert int(ratio) > 20


@pytest.mark.slow
def test_benchmark_of_the_start_measures_helps_faces_and_the_first_trial():
    done = run("benchmarks/benchmark.py", "--only", "start")
    assert (done.returncode, done.stderr) == (0, "")
    ratios = dict(
        re.findall(
            r"^(.+?)  +[\d.]+ s  \( *([\d.]+) × import", done.stdout, re.M
        )
    )
    station = float(ratios["AffettoStation"])
    assert station > 1.0
    for name in ("affetto --help", "affetto drum --help", "import skill"):
        # That these import no numpy other tests ask; beside it they take 0.1 to
        # 0.5 of its time on a free machine, and the station 13 times.
        assert float(ratios[name]) < 0.5 * station
    assert "first trial of a study" in done.stdout
