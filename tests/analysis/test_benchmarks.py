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
    for name in ("affetto --help", "affetto drum --help", "import skill"):
        # These import no numpy: within one run, less than that alone.
        assert float(ratios[name]) < 1.0
    assert float(ratios["AffettoStation"]) > 1.0
    assert "first trial of a study" in done.stdout
