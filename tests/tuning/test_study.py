"""The tuning study, small and short but real: on the whole robot."""

import json
import os
from pathlib import Path
import re
import signal
import sqlite3
import subprocess
import sys
import time

import numpy as np
import optuna
from optuna.trial import TrialState
from plotly.offline import get_plotlyjs
import pytest

from drake_affetto.cli.main import main
from drake_affetto.common.errors import InputError
from drake_affetto.common.fingerprint import text_digest
from drake_affetto.common.folder_lock import lock_folder
from drake_affetto.common.typed_json import from_plain, to_plain
from drake_affetto.control.pidf import (
    ControlParameters,
    PidfGains,
    load_control,
)
from drake_affetto.pneumatics.parameters import (
    ActuatorClass,
    JointActuator,
    PneumaticParameters,
)
from drake_affetto.report import write_report
from drake_affetto.station.scenario import load_scenario
from drake_affetto.tuning.config import HELD_OUT, REST, TRAINING, TuningConfig
from drake_affetto.tuning.environment import environment
from drake_affetto.tuning.gains_file import contralateral
from drake_affetto.tuning.plan import GAINS, load_plan
from drake_affetto.tuning.results import TuningResults
from drake_affetto.tuning.study import run_tune
from support.short_tuning import SHORT

JOINTS = ("right_elbow_rotation", "right_elbow_flexion")
TRIALS = 8


def study_of(out):
    optuna.logging.set_verbosity(optuna.logging.ERROR)
    return optuna.load_study(
        study_name="tune", storage=f"sqlite:///{out}/study.sqlite"
    )


def by_candidate(out):
    """Factors and costs of the finished trials of a study."""
    trials = study_of(out).get_trials(
        states=(TrialState.COMPLETE, TrialState.PRUNED)
    )
    return {
        t.user_attrs["candidate"]: (t.params, t.user_attrs["joint_costs"])
        for t in trials
    }


@pytest.fixture(scope="module")
def short(tmp_path_factory):
    path = tmp_path_factory.mktemp("tuning") / "short.yaml"
    path.write_text(SHORT)
    return path


@pytest.fixture(scope="module")
def plan(short):
    return load_plan(JOINTS, seed=3, tuning=str(short))


@pytest.fixture(scope="module")
def finished(tmp_path_factory, plan):
    """A study that two workers did together."""
    out = tmp_path_factory.mktemp("tune")
    results = run_tune(out, plan, trials=TRIALS, workers=2)
    return out, to_plain(results)


@pytest.mark.slow
def test_the_results_have_the_agreed_form(finished):
    out, results = finished
    stored = json.loads((out / "results.json").read_text())
    assert stored == results
    # They are read back as they were written.
    assert to_plain(from_plain(TuningResults, stored)) == results
    assert results["study"] == "tune"
    assert results["seed"] == 3
    assert results["joints"] == list(JOINTS)
    assert results["trials"]["finished"] == TRIALS
    names = load_scenario("drumming").active_joints
    for side in ("hand_tuned", "best"):
        part = results[side]
        assert set(part["trajectories"]) == {TRAINING, *HELD_OUT}
        for trajectory in part["trajectories"].values():
            assert list(trajectory["tracking_error_deg"]) == names
        assert list(part["rest_oscillation_percent"]) == names
    best, hand = results["best"]["cost"], results["hand_tuned"]["cost"]
    assert results["improvement"] == pytest.approx(1.0 - best / hand)
    assert set(results["held_out_improvement"]) == set(HELD_OUT)


@pytest.mark.slow
def test_degrees_and_percent_of_range_agree(finished, plan):
    _, results = finished
    part = results["best"]["trajectories"]["chirp"]
    robot = environment(plan)
    for joint, span in zip(robot.names, robot.span, strict=True):
        assert part["tracking_error_deg"][joint] == pytest.approx(
            part["tracking_percent"][joint] / 100.0 * np.degrees(span)
        )


@pytest.mark.slow
def test_the_hand_tuned_start_is_trial_0(finished):
    out, results = finished
    first = study_of(out).get_trials()[0]
    assert first.number == 0
    assert first.state == TrialState.COMPLETE
    assert set(first.params.values()) == {1.0}
    # What the results say of it is what the trial has found.
    assert results["hand_tuned"]["cost"] == pytest.approx(first.value)


@pytest.mark.slow
def test_two_workers_lose_and_repeat_no_trial(finished):
    out, _ = finished
    trials = study_of(out).get_trials()
    assert len(trials) == TRIALS
    assert {t.state for t in trials} <= {
        TrialState.COMPLETE,
        TrialState.PRUNED,
    }
    candidates = [t.user_attrs["candidate"] for t in trials]
    assert sorted(candidates) == list(range(TRIALS))
    params = {tuple(t.params.values()) for t in trials}
    assert len(params) == TRIALS


@pytest.mark.slow
def test_the_best_is_what_was_found_and_is_not_worse(finished):
    out, results = finished
    study = study_of(out)
    assert results["trials"]["best"] == study.best_trial.number
    # The gains are written with four digits, so nearly the same.
    assert results["best"]["cost"] == pytest.approx(study.best_value, rel=0.05)
    assert results["best"]["cost"] <= 1.01 * results["hand_tuned"]["cost"]


@pytest.mark.slow
def test_gains_are_an_overlay_that_a_scenario_takes(finished, tmp_path):
    out, results = finished
    path = tmp_path / "mine.yaml"
    path.write_text(
        "extends: drumming\n"
        f"control:\n  overlays: ['{(out / 'gains.yaml').as_posix()}']\n"
    )
    control = load_scenario(path).control
    loaded = load_control(control.parameters, tuple(control.overlays))
    plain = load_control()
    for joint in JOINTS:
        for side in (joint, contralateral(joint)):
            for gain in GAINS:
                assert getattr(loaded.gains[side], gain) == pytest.approx(
                    results["best"]["gains"][joint][gain]
                )
    # What was not searched stays.
    assert loaded.gains["waist_yaw"] == plain.gains["waist_yaw"]
    assert loaded.integral_limit == plain.integral_limit


@pytest.mark.slow
def test_the_page_needs_nothing_else(finished, tmp_path):
    out, results = finished
    page = write_report([out], tmp_path / "study.html").read_text(
        encoding="utf-8"
    )
    assert page.startswith("<!DOCTYPE html>")
    # One Plotly, in the page itself; its addresses are never asked for.
    plotly = get_plotlyjs().replace("</script", "<\\/script")
    assert page.count(plotly) == 1
    ours = page.replace(plotly, "")
    # Every picture and link is data, or a place on the page.
    addresses = re.findall(r'\b(?:src|href)="([^"]*)"', ours)
    assert all(each.startswith(("data:", "#")) for each in addresses)
    ours = re.sub(r'"data:[^"]*"', '""', ours)
    for pattern in (r"@import", r"url\(", "https?:"):
        assert not re.search(pattern, ours), pattern
    assert "prefers-color-scheme: dark" in ours
    assert 'name="viewport"' in ours
    figures = json.loads(
        re.search(
            r'<script type="application/json" id="figures">(.*?)</script>',
            ours,
            flags=re.S,
        ).group(1)
    )
    names = [name.replace("_", "-") for name in (TRAINING, *HELD_OUT, REST)]
    # Importances need more trials than these.
    assert set(figures) == {
        "tuning-history",
        *(f"tuning-{name}" for name in names),
    }
    traces = json.loads(figures[f"tuning-{names[0]}"])["data"]
    assert len(traces) == 3 * 8
    for joint in results["best"]["gains"]:
        assert joint.replace("_", " ") in ours


@pytest.mark.slow
def test_a_finished_study_is_not_run_again(finished, plan, monkeypatch):
    out, results = finished

    def refuse(*_):
        raise AssertionError("all trials had been finished")

    monkeypatch.setattr("drake_affetto.tuning.trial.run_trial", refuse)
    again = run_tune(out, plan, trials=TRIALS, workers=0)
    assert to_plain(again) == results


@pytest.mark.slow
def test_killed_in_the_middle_it_goes_on(finished, short, tmp_path):
    reference, _ = finished
    command = [
        *(sys.executable, "-m", "drake_affetto.cli", "tune"),
        *("--joints", *JOINTS, "--seed", "3", "--tuning", str(short)),
        *("--trials", str(TRIALS), "--workers", "1"),
        *("--out", str(tmp_path)),
    ]
    process = subprocess.Popen(
        command,
        cwd=Path(__file__).parents[2],
        stdout=subprocess.DEVNULL,
        env={**os.environ, "OMP_NUM_THREADS": "1"},
    )
    file = tmp_path / "study.sqlite"

    def states():
        try:
            with sqlite3.connect(f"file:{file}?mode=ro", uri=True) as db:
                return [
                    row[0] for row in db.execute("SELECT state FROM trials")
                ]
        except sqlite3.Error:
            return []

    limit = time.monotonic() + 120.0
    while True:
        now = states()
        if len([s for s in now if s != "RUNNING"]) >= 3 and "RUNNING" in now:
            break
        assert process.poll() is None, "it ended by itself"
        assert time.monotonic() < limit
        time.sleep(0.02)
    process.send_signal(signal.SIGKILL)
    process.wait()
    # Its worker has ended with it: nothing writes any more.
    time.sleep(1.0)
    kept = by_candidate(tmp_path)
    assert 3 <= len(kept) < TRIALS
    assert states().count("RUNNING") <= 1
    time.sleep(0.5)
    assert by_candidate(tmp_path) == kept
    assert not (tmp_path / "results.json").exists()

    # The rest is done in this process: workers make no difference either.
    options = [*command[3:], "--workers", "0"]
    assert main(options) == 0
    after = by_candidate(tmp_path)
    assert {k: after[k] for k in kept} == kept
    assert sorted(after) == list(range(TRIALS))
    assert "RUNNING" not in states()
    # As if nothing had happened, whoever did the work.
    assert after == by_candidate(reference)
    ours = json.loads((tmp_path / "results.json").read_text())
    theirs = json.loads((reference / "results.json").read_text())
    assert ours["best"] == theirs["best"]


@pytest.mark.slow
def test_another_study_is_not_mixed_in(finished, short, capsys):
    out, _ = finished
    status = main(
        [
            *("tune", "--joints", JOINTS[0], "--tuning", str(short)),
            *("--trials", "2", "--workers", "0", "--out", str(out)),
        ]
    )
    assert status == 2
    assert "--restart" in capsys.readouterr().err
    assert len(by_candidate(out)) == TRIALS


def test_a_folder_with_something_else_in_it_is_told(tmp_path, short, capsys):
    (tmp_path / "study.sqlite").write_text("this is no database at all" * 99)
    status = main(
        [
            *("tune", "--joints", JOINTS[0], "--tuning", str(short)),
            *("--trials", "1", "--workers", "0", "--out", str(tmp_path)),
        ]
    )
    assert status == 2
    assert "study.sqlite" in capsys.readouterr().err


def test_the_text_of_the_fingerprint_stays():
    """Stored studies would not continue if names of classes changed."""
    parts = (
        TuningConfig(),
        PidfGains([1.0], [2.0], [3.0], [4.0]),
        ControlParameters(),
        PneumaticParameters(
            supply_pressure=659.3e3,
            classes={"elbow": ActuatorClass()},
            joints={"joint": JointActuator(actuator="elbow")},
        ),
    )
    assert [text_digest(repr(part)) for part in parts] == [
        "b8722c8c7cf2de6a",
        "986d15f3684b9261",
        "88fdc912f428f29a",
        "62965bb81f52bb92",
    ]


@pytest.mark.slow
def test_two_processes_do_not_write_into_one_study(plan, tmp_path):
    with (
        lock_folder(tmp_path, "affetto tune"),
        pytest.raises(InputError, match="another `affetto tune`"),
    ):
        run_tune(tmp_path, plan, trials=1, workers=0)
    assert not (tmp_path / "study.sqlite").exists()
