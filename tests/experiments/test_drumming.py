"""The drumming study: its plan in a fake world, and a small real one."""

import dataclasses
import json
import os
from pathlib import Path
import signal
import subprocess
import sys
import time

import numpy as np
import pytest

from drake_affetto.common.errors import InputError
from drake_affetto.common.typed_json import to_plain
from drake_affetto.experiments.drumming import (
    active_order,
    demonstrations_needed,
    run_drum,
)
from drake_affetto.experiments.plans import DrumPlan
from drake_affetto.experiments.results import CurvePoint, SuccessRate
from drake_affetto.experiments.skills import make_skill
from drake_affetto.experiments.trials import run_task
from drake_affetto.runner.executor import TrialExecutor
from drake_affetto.runner.store import TrialStore
from drake_affetto.station.scenario import load_scenario
from support import fake_world

PLAN = DrumPlan(demonstrations=8, evaluations=5, repeats=3, active=True)

# A study in the fake world, in a process that can be killed.
STUDY = """
import sys
from pathlib import Path
sys.path.insert(0, sys.argv[1])
from support import fake_world
from drake_affetto.common.output import write_json
from drake_affetto.experiments.drumming import run_drum
from drake_affetto.experiments.plans import DrumPlan
from drake_affetto.runner.executor import TrialExecutor
from drake_affetto.runner.store import TrialStore

if __name__ == "__main__":
    out = Path(sys.argv[2])
    plan = DrumPlan(demonstrations=4, evaluations=3, repeats=2)
    with (
        TrialStore(out / "trials.sqlite") as store,
        TrialExecutor(fake_world.run, store, workers=2, quiet=True) as executor,
    ):
        write_json(out / "results.json", run_drum(executor, plan))
"""


def in_fake_world(path, plan=PLAN):
    with (
        TrialStore(path) as store,
        TrialExecutor(fake_world.run, store, workers=0, quiet=True) as executor,
    ):
        return to_plain(run_drum(executor, plan))


@pytest.fixture(scope="module")
def results(tmp_path_factory):
    return in_fake_world(tmp_path_factory.mktemp("drum") / "trials.sqlite")


def test_the_curve_rises_to_where_the_skill_is_good(results):
    curve = results["by_demonstrations"]
    assert [point["n"] for point in curve] == list(range(1, 9))
    means = [point["success_rate"]["mean"] for point in curve]
    assert means[0] < 0.5 < 0.9 <= means[-1]
    for point in curve:
        rate = point["success_rate"]
        assert 0.0 <= rate["low"] <= rate["mean"] <= rate["high"] <= 1.0
        assert len(point["per_repeat"]) == 3
        assert np.mean(point["per_repeat"]) == pytest.approx(rate["mean"])


def test_results_hold_what_is_promised(results):
    assert results["study"] == "drum"
    assert results["final"]["success_rate"] == pytest.approx(
        np.mean([p["success"] for p in results["final"]["positions"]])
    )
    assert len(results["final"]["positions"]) == 3 * 5
    for position in results["final"]["positions"]:
        assert set(position) >= {"xy", "reward", "success", "contact_impulse"}
        assert position["success"] == (position["reward"] > 0.15)
    # The same unseen positions in every repeat.
    places = {tuple(p["xy"]) for p in results["final"]["positions"]}
    assert len(places) == 5
    assert len(results["taught"]) == 3 * 8
    assert len({tuple(row["xy"]) for row in results["taught"]}) == 3 * 8
    told = results["separation"]
    # What both orders know at first and at last is tried once.
    assert told["trials"] == len(results["rewards"]) == 3 * 5 * (8 + 6)
    assert (told["false_hits"], told["missed_hits"]) == (0, 0)
    assert told["auc"] == 1.0
    similarity = results["similarity"]
    assert max(similarity["miss"]) < 0.15 < max(similarity["hit"])
    json.dumps(results, allow_nan=False)


def test_both_orders_begin_and_end_with_the_same(results):
    random = results["by_demonstrations"]
    active = results["active"]["by_demonstrations"]
    assert len(random) == len(active)
    for i in (0, -1):
        assert random[i] == active[i]


def test_more_repeats_leave_the_first_as_they_were(tmp_path, results):
    path = tmp_path / "trials.sqlite"
    one = DrumPlan(demonstrations=8, evaluations=5, repeats=1)
    few = in_fake_world(path, one)
    first = [p for p in results["final"]["positions"] if p["repeat"] == 0]
    assert few["final"]["positions"] == first
    with (
        TrialStore(path) as store,
        TrialExecutor(fake_world.run, store, workers=0, quiet=True) as executor,
    ):
        finished = len(store)
        assert to_plain(run_drum(executor, PLAN)) == results
        # But for demonstrations that failed, all that there was is used.
        assert executor.reused >= finished - 2


def test_a_curve_of_some_points_is_part_of_the_whole(tmp_path, results):
    plan = dataclasses.replace(PLAN, after=(2, 5))
    few = in_fake_world(tmp_path / "trials.sqlite", plan)
    for part, whole in (
        (few, results),
        (few["active"], results["active"]),
    ):
        points = whole["by_demonstrations"]
        assert part["by_demonstrations"] == [points[i] for i in (1, 4, 7)]
    assert few["final"] == results["final"]


def test_active_order_asks_for_what_leaves_it_most_certain():
    config = load_scenario("drumming").skill
    rng = np.random.default_rng(0)
    tau = rng.uniform([0.0, -0.76], [1.0, 0.76], size=(20, 2))
    order = active_order(config, tau, 7, seed=3)
    assert sorted(order) == list(range(20))
    assert order[0] == 7
    assert order == active_order(config, tau, 7, seed=3)

    def uncertain(chosen):
        skill = make_skill(config, 3)
        skill.fit(tau[chosen], np.zeros((len(chosen), 1)))
        return skill.leverage(tau).sum()

    for known in (1, 4, 9):
        others = [uncertain([*order[:known], i]) for i in order[known:]]
        assert others[0] == pytest.approx(min(others), rel=1e-6)
    by_chance = [uncertain(rng.permutation(20)[:5]) for _ in range(20)]
    assert uncertain(order[:5]) < min(by_chance)


def test_needed_demonstrations_are_those_from_which_it_stays():
    def curve(*means):
        return [
            CurvePoint(n, SuccessRate(mean, 0.0, 1.0))
            for n, mean in enumerate(means, start=1)
        ]

    assert demonstrations_needed(curve(0.2, 0.95, 0.8, 0.9, 1.0)) == 4
    assert demonstrations_needed(curve(0.9, 0.9)) == 1
    assert demonstrations_needed(curve(0.9, 0.8)) is None


def study(out: Path, marks: Path, seconds: float) -> subprocess.Popen:
    script = out / "study.py"
    script.write_text(STUDY)
    environment = {
        **os.environ,
        "FAKE_WORLD_MARKS": str(marks),
        "FAKE_WORLD_SECONDS": str(seconds),
    }
    return subprocess.Popen(
        [sys.executable, script, Path(__file__).parents[1], out],
        env=environment,
    )


@pytest.mark.slow
def test_a_killed_study_goes_on_as_if_nothing_had_been(tmp_path):
    marks = tmp_path / "marks"
    results = {}
    for name in ("undisturbed", "killed"):
        out = tmp_path / name
        out.mkdir()
        if name == "killed":
            marks.unlink()
            process = study(out, marks, 0.1)
            deadline = time.monotonic() + 60.0
            while not marks.exists() or marks.read_text().count("\n") < 14:
                assert process.poll() is None
                assert time.monotonic() < deadline
                time.sleep(0.02)
            process.send_signal(signal.SIGKILL)
            process.wait()
            assert not (out / "results.json").exists()
            with TrialStore(out / "trials.sqlite") as store:
                before = len(store)
            assert 0 < before < 30
        assert study(out, marks, 0.0).wait(timeout=120) == 0
        results[name] = (out / "results.json").read_bytes()
    assert results["killed"] == results["undisturbed"]
    # At most what was in progress ran twice: one trial for each worker, and
    # what the killed process had not yet taken from them.
    lines = marks.read_text().splitlines()
    assert len(lines) - len(set(lines)) <= 4


@pytest.mark.slow
def test_a_small_study_on_the_robot(tmp_path):
    plan = DrumPlan(demonstrations=3, evaluations=2)
    with (
        TrialStore(tmp_path / "trials.sqlite") as store,
        TrialExecutor(run_task, store, workers=2, quiet=True) as executor,
    ):
        results = to_plain(run_drum(executor, plan))
    assert all(row["max_pull"] <= 30.0 for row in results["taught"])
    rewards = [row["reward"] for row in results["rewards"]]
    assert len(rewards) == 6
    # Sound agrees with contact, which the reward does not know.
    assert results["separation"]["false_hits"] == 0
    assert results["separation"]["missed_hits"] == 0
    assert results["by_demonstrations"][-1]["success_rate"]["mean"] > 0.0


def test_a_teacher_who_always_fails_is_an_error(tmp_path):
    def fail(spec):
        result, arrays = fake_world.run(spec)
        return {**result, "success": False}, arrays

    with (
        TrialStore(tmp_path / "trials.sqlite") as store,
        TrialExecutor(fail, store, workers=0, quiet=True) as executor,
        pytest.raises(InputError, match="only 0 of 12 demonstrations"),
    ):
        run_drum(executor, DrumPlan(demonstrations=4, evaluations=1))
