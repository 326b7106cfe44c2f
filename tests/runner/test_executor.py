"""The executor of trials: order, reuse, and workers that die."""

import os
from pathlib import Path

import numpy as np
import pytest

from drake_affetto.common.errors import InputError
from drake_affetto.runner.executor import TrialExecutor
from drake_affetto.runner.store import TrialStore


def square(spec):
    marks = Path(spec["marks"])
    with (marks / f"{spec['i']}").open("a") as file:
        file.write("ran\n")
    return {"square": spec["i"] ** 2}, {"i": np.full(3, spec["i"])}


def square_or_die_once(spec):
    mark = Path(spec["marks"]) / "died"
    if spec["i"] == 2 and not mark.exists():
        mark.touch()
        os._exit(9)
    return square(spec)


def die(spec):
    os._exit(9)


def refuse(spec):
    raise InputError("the drum is not on the table")


def specs(tmp_path, count=5):
    return {
        f"number {i}": {"kind": "square", "i": i, "marks": str(tmp_path)}
        for i in range(count)
    }


@pytest.mark.parametrize("workers", [0, 2])
def test_results_come_in_the_order_of_the_plan(tmp_path, workers):
    with (
        TrialStore(tmp_path / "s.sqlite") as store,
        TrialExecutor(square, store, workers=workers, quiet=True) as executor,
    ):
        results = executor.run("squares", specs(tmp_path))
    assert [r["square"] for r, _ in results.values()] == [0, 1, 4, 9, 16]
    np.testing.assert_array_equal(results["number 3"][1]["i"], [3, 3, 3])


def test_what_is_finished_is_not_run_again(tmp_path):
    for count in (3, 5):
        with (
            TrialStore(tmp_path / "s.sqlite") as store,
            TrialExecutor(square, store, workers=0, quiet=True) as executor,
        ):
            executor.run("squares", specs(tmp_path, count))
            reused = executor.reused
    assert reused == 3
    for i in range(5):
        assert (tmp_path / str(i)).read_text() == "ran\n"


def test_a_worker_that_dies_is_replaced(tmp_path):
    with (
        TrialStore(tmp_path / "s.sqlite") as store,
        TrialExecutor(
            square_or_die_once, store, workers=2, quiet=True
        ) as executor,
    ):
        results = executor.run("squares", specs(tmp_path))
        assert len(store) == 5
    assert [r["square"] for r, _ in results.values()] == [0, 1, 4, 9, 16]


def test_workers_that_always_die_end_the_study(tmp_path):
    with (
        TrialStore(tmp_path / "s.sqlite") as store,
        TrialExecutor(die, store, workers=1, quiet=True) as executor,
        pytest.raises(InputError, match="squares: worker processes die"),
    ):
        executor.run("squares", specs(tmp_path, 1))


@pytest.mark.parametrize("workers", [0, 1])
def test_an_error_in_a_trial_reaches_the_user(tmp_path, workers):
    with (
        TrialStore(tmp_path / "s.sqlite") as store,
        TrialExecutor(refuse, store, workers=workers, quiet=True) as executor,
        pytest.raises(InputError, match="not on the table"),
    ):
        executor.run("squares", specs(tmp_path, 1))


def test_each_trial_is_kept_as_it_finishes(tmp_path):
    """Also where the workers are this very process."""
    kept = []
    with TrialStore(tmp_path / "s.sqlite") as store:

        def run(spec):
            kept.append(len(store))
            return square(spec)

        with TrialExecutor(run, store, workers=0, quiet=True) as executor:
            executor.run("squares", specs(tmp_path))
    assert kept == [0, 1, 2, 3, 4]


def test_every_result_is_handed_over_once_under_its_key(tmp_path):
    twice = specs(tmp_path, 3) | {"again": specs(tmp_path, 1)["number 0"]}
    for stored in (False, True):
        handed = []
        with (
            TrialStore(tmp_path / "s.sqlite") as store,
            TrialExecutor(square, store, workers=0, quiet=True) as executor,
        ):
            results = executor.run(
                "squares", twice, lambda *each, to=handed: to.append(each)
            )
            assert executor.reused == (3 if stored else 0)
        assert sorted(key for key, _ in handed) == sorted(twice)
        for key, (result, _) in handed:
            assert result == results[key][0]
    assert list(results) == list(twice)
    assert (tmp_path / "0").read_text() == "ran\n"
