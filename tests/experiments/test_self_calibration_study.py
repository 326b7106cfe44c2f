"""The study of self-calibration in a world of geometry, and a real one."""

import json

from experiments.test_self_calibration import PLAN
import numpy as np
import pytest

from drake_affetto.calibration.plane import CalibrationFailure
from drake_affetto.common.typed_json import from_plain, to_plain
from drake_affetto.experiments.calibration_media import (
    write_calibration_replay,
)
from drake_affetto.experiments.plans import SelfCalibrationPlan
from drake_affetto.experiments.results import MirrorResults
from drake_affetto.experiments.self_calibration_study import (
    run_self_calibration,
)
from drake_affetto.experiments.trials import run_task
from drake_affetto.runner.executor import TrialExecutor
from drake_affetto.runner.store import TrialStore
from support.fake_mirrors import FakeMirrors


def run_outcome(path, world, plan=PLAN):
    with (
        TrialStore(path) as store,
        TrialExecutor(world, store, workers=0, quiet=True) as executor,
    ):
        return run_self_calibration(executor, plan)


def run(path, world, plan=PLAN):
    return run_outcome(path, world, plan).results


@pytest.fixture(scope="module")
def path(tmp_path_factory):
    return tmp_path_factory.mktemp("s") / "t.sqlite"


@pytest.fixture(scope="module")
def results(path):
    return run(path, FakeMirrors())


def test_results_hold_what_is_promised(results):
    plain = to_plain(results)
    json.dumps(plain, allow_nan=False)
    found = plain["self_calibration"]
    assert set(found["methods"]) == {"hand", "ellipse", "ear"}
    for method in found["methods"].values():
        rate = method["success_rate"]
        assert rate["low"] <= rate["mean"] <= rate["high"]
        assert len(method["planes"]) == len(method["per_repeat"]) == 2
        for row in method["planes"]:
            assert np.shape(row["covariance"]) == (3, 3)
            assert row["angle_error"] >= 0.0
    assert found["methods"]["hand"]["looks"] <= 12
    assert found["methods"]["ear"]["strokes"] == 24
    assert np.shape(found["methods"]["ear"]["heard"]) == (2, 24)
    assert plain["schemes"]["transfer_default"]["3"]["success_rate"]
    steps = {(each["method"], each["step"]) for each in found["beliefs"]}
    assert ("ear", 0) in steps
    assert ("ear", 24) in steps
    assert np.shape(found["true_line"]) == (2, 2)
    again = from_plain(MirrorResults, plain, "results.json: ")
    again.check("results.json: ")
    assert again == results


def test_it_drums_without_a_demonstration(results):
    methods = results.self_calibration.methods
    assert methods["hand"].success_rate.mean >= 0.8
    # Of two mirrors an ellipse of some ten pixels may miss one; it then says
    # how little it knows.
    assert methods["ellipse"].success_rate.mean > 0.0
    assert all(plane.covered for plane in methods["ellipse"].planes)
    assert methods["hand"].angle_error < 2.0
    assert methods["hand"].offset_error < 15.0


def test_the_believed_line_comes_near_the_true_one(results):
    found = results.self_calibration
    truth = np.array(found.true_line)
    along = (truth[1] - truth[0]) / np.linalg.norm(truth[1] - truth[0])
    across = np.array([-along[1], along[0]])

    def off(method, step):
        lines = next(
            each.lines
            for each in found.beliefs
            if (each.method, each.step) == (method, step)
        )
        middle = np.mean(lines, axis=1)
        return np.abs((middle - truth[0]) @ across).mean()

    last = max(e.step for e in found.beliefs if e.method == "hand")
    assert off("hand", last) < 0.02
    assert off("ear", 24) < off("ear", 0)


def test_a_finished_study_runs_nothing_again(path, results):
    def never(spec):
        raise AssertionError(f"{spec['kind']} ran although it was finished")

    assert run(path, never) == results


def test_a_robot_that_finds_no_mirror_at_all_says_what_is_missing(tmp_path):
    with pytest.raises(CalibrationFailure, match="not seen in the mirror"):
        run(tmp_path / "t.sqlite", FakeMirrors(blind=True))


@pytest.mark.slow
def test_a_small_study_on_the_robot(tmp_path):
    plan = SelfCalibrationPlan(
        repeats=1,
        evaluations=2,
        demonstrations=6,
        skills=1,
        samples=(3,),
        schemes=("transfer_default",),
        turned_after=1,
        quiet=0,
    )
    outcome = run_outcome(tmp_path / "t.sqlite", run_task, plan)
    hand = outcome.results.self_calibration.methods["hand"]
    assert hand.angle_error < 2.0
    assert hand.looks <= 12
    write_calibration_replay(
        tmp_path, plan.settings, outcome.repeat, outcome.by_hand, plan.seed
    )
    page = (tmp_path / "self_calibration.html").read_text()
    # Both parts of the replay are in it.
    for part in ("looking", "drumming"):
        assert f"/drake/{part}" in page
