"""Teaching many places into a file: order, resuming, refusals."""

import contextlib
import dataclasses
import io
import os
from pathlib import Path
import shutil
import signal
import subprocess
import sys
import textwrap
import time

import numpy as np
import pytest
from rich.console import Console

from drake_affetto.cli import main as cli
from drake_affetto.cli.teach import print_outcomes
from drake_affetto.common.errors import InputError
from drake_affetto.common.resources import models_dir
from drake_affetto.experiments import trials as tasks
from drake_affetto.experiments.plans import TeachPlan
from drake_affetto.experiments.teaching import teach
from drake_affetto.experiments.teaching_session import TeachingSession
from drake_affetto.runner.executor import TrialExecutor
from drake_affetto.runner.store import TrialStore
from drake_affetto.teaching.demonstrations import (
    append_demonstration,
    read_demonstrations,
    write_demonstrations,
)


def fake_trial(spec):
    """What a trial gives, without the robot; every fourth never sounds."""
    rng = np.random.default_rng(spec["seed"])
    success = spec["seed"] % 4 != 3
    result = {
        "xy": spec["xy"],
        "found": True,
        "tau": rng.normal(size=2).tolist(),
        "attempts": 1 + spec["seed"] % 2 if success else 4,
        "success": success,
        "reward": rng.uniform(0.3, 0.8) if success else 0.05,
        "max_pull": rng.uniform(15, 25),
    }
    arrays = {
        "theta": rng.normal(size=120),
        "q": rng.normal(size=(300, 8)),
        "prototype": rng.uniform(size=(20, 25)),
    }
    return result, arrays


@pytest.fixture
def trials(monkeypatch):
    """Replaces the robot; the seeds that were taught with are in the list."""
    ran = []

    def run(spec):
        ran.append(spec["seed"])
        return fake_trial(spec)

    monkeypatch.setattr(tasks, "run_task", run)
    return ran


def session(path, count=6, *, scenario="drumming", seed=0):
    return TeachingSession(TeachPlan(count, scenario, seed), path)


def taught_here(session):
    """Teaches in this process, with what stands for the robot."""

    @contextlib.contextmanager
    def executor(path):
        with (
            TrialStore(path) as store,
            TrialExecutor(tasks.run_task, store, workers=0, quiet=True) as made,
        ):
            yield made

    return teach(session, executor)


def test_what_sounded_is_in_the_file_and_the_rest_is_told(tmp_path, trials):
    path = tmp_path / "deep" / "taught.h5"
    taught = taught_here(session(path))
    assert [each.success for each in taught] == [True] * 3 + [False] + [
        True
    ] * 2
    assert [each.attempts for each in taught] == [1, 2, 1, 4, 1, 2]
    found = read_demonstrations(path)
    assert [each.seed for each in found] == [0, 1, 2, 4, 5]
    positions = session(path).positions
    for each in found:
        np.testing.assert_array_equal(each.drum_xy, positions[each.seed])
        assert each.attempt == each.seed % 2
        assert (each.scenario, each.teacher) == ("drumming", "simulated")
        assert each.t[-1] == 3.0
        np.testing.assert_allclose(np.diff(each.t), 0.01)
        assert each.theta.shape == (120,)
        assert each.task_parameter.shape == (2,)
    buffer = io.StringIO()
    print_outcomes(taught, Console(file=buffer, width=100))
    told = buffer.getvalue()
    assert "5 of 6 positions taught, 3 (50%) at first try" in told
    assert told.count("no sound") == 1


def test_going_on_repeats_nothing_and_ends_in_the_same_file(tmp_path, trials):
    whole, parts = tmp_path / "whole.h5", tmp_path / "parts.h5"
    expected = taught_here(session(whole, 10))
    trials.clear()
    taught_here(session(parts, 3))
    # All of it is in the file: nothing else is left.
    assert set(os.listdir(tmp_path)) == {
        "whole.h5",
        "whole.h5.trials.sqlite",
        "parts.h5",
    }
    taught_here(session(parts, 7))
    taught = taught_here(session(parts, 10))
    assert trials == list(range(10))
    assert parts.read_bytes() == whole.read_bytes()
    for a, b in zip(taught, expected, strict=True):
        np.testing.assert_array_equal(a.xy, b.xy)
        assert (a.attempts, a.success, a.reward, a.max_pull) == (
            b.attempts,
            b.success,
            b.reward,
            b.max_pull,
        )
    # Fewer than there are: the file stays as it is.
    assert len(taught_here(session(parts, 2))) == 2
    assert parts.read_bytes() == whole.read_bytes()


def test_order_is_the_plans_whoever_finishes_first(tmp_path, trials):
    path = tmp_path / "taught.h5"
    # A run that was killed while the first position took long.
    positions = session(path).positions
    with TrialStore(f"{path}.trials.sqlite") as store:
        for i in (2, 1, 3):
            spec = tasks.demonstration("drumming", positions[i].tolist(), i)
            store.put(spec, *fake_trial(spec))
    taught_here(session(path))
    assert trials == [0, 4, 5]
    assert [d.seed for d in read_demonstrations(path)] == [0, 1, 2, 4, 5]


def test_ctrl_c_says_how_to_go_on(tmp_path, monkeypatch, capsys):
    def run(spec):
        if spec["seed"] == 2:
            raise KeyboardInterrupt
        return fake_trial(spec)

    monkeypatch.setattr(tasks, "run_task", run)
    path = tmp_path / "t.h5"
    words = ["teach", "--out", str(path), "--demonstrations", "5"]
    assert cli.main([*words, "--workers", "0"]) == 130
    told = " ".join(capsys.readouterr().out.split())
    assert "2 of 5 positions are in" in told
    assert "the same command goes on from there" in told
    assert [d.seed for d in read_demonstrations(path)] == [0, 1]


_SLOW_COMMAND = """
import sys, time
sys.path.insert(0, sys.argv[1])
import test_teaching
from drake_affetto.cli import main as cli
from drake_affetto.experiments import trials as tasks

def run(spec):
    time.sleep(0.1)
    return test_teaching.fake_trial(spec)

tasks.run_task = run
sys.exit(cli.main(["teach", "--workers", "0", "--demonstrations", "40",
                   "--out", sys.argv[2]]))
"""


@pytest.mark.slow
def test_a_kill_loses_at_most_the_one_in_progress(tmp_path, trials):
    path = tmp_path / "taught.h5"
    process = subprocess.Popen(
        [
            sys.executable,
            "-c",
            textwrap.dedent(_SLOW_COMMAND),
            str(Path(__file__).parent),
            str(path),
        ],
        stdout=subprocess.DEVNULL,
    )
    try:
        end = time.monotonic() + 60
        while not path.exists() or len(read_demonstrations(path)) < 3:
            assert time.monotonic() < end
            assert process.poll() is None
            time.sleep(0.02)
    finally:
        process.send_signal(signal.SIGKILL)
        process.wait()
    there = len(read_demonstrations(path))
    assert 3 <= there < 30
    taught = taught_here(session(path, 40))
    # The killed run may have finished one that had not come into the file;
    # the fourth one never sounds and is in the store.
    assert 40 - len(trials) - there in (0, 1, 2)
    assert len(trials) == len(set(trials))
    assert [each.success for each in taught] == [i % 4 != 3 for i in range(40)]
    undisturbed = tmp_path / "undisturbed.h5"
    taught_here(session(undisturbed, 40))
    assert path.read_bytes() == undisturbed.read_bytes()


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"scenario": "mirror"}, "another scenario than mirror is now"),
        ({"seed": 1}, "seed 0, not 1"),
    ],
)
def test_a_file_of_another_session_is_refused(
    tmp_path, trials, changes, message
):
    path = tmp_path / "taught.h5"
    taught_here(session(path, 2))
    before = path.read_bytes()
    with pytest.raises(InputError, match=message):
        session(path, 2, **changes)
    assert path.read_bytes() == before


def test_two_at_one_file_are_noticed(tmp_path, trials):
    path = tmp_path / "taught.h5"
    one, other = session(path, 2), session(path, 2)
    taught_here(one)
    before = path.read_bytes()
    with pytest.raises(InputError, match="another process"):
        taught_here(other)
    assert path.read_bytes() == before


@pytest.mark.parametrize(
    "edit",
    [
        "dmp: {n_basis: 10}",
        "dmp: {smoothing: 0.04}",
        "teaching: {duration: 2.5}",
        "sound: large_drum_sound.yaml",
    ],
)
def test_a_file_whose_scenario_changed_since_is_refused(tmp_path, trials, edit):
    mine = tmp_path / "mine.yaml"
    mine.write_text("extends: drumming\n")
    shutil.copy(models_dir() / "large_drum_sound.yaml", tmp_path)
    path = tmp_path / "taught.h5"
    taught_here(session(path, 2, scenario=str(mine)))
    before = path.read_bytes()
    mine.write_text(f"extends: drumming\n{edit}\n")
    with pytest.raises(InputError, match=r"is now: other (values|files); name"):
        session(path, 3, scenario=str(mine))
    assert path.read_bytes() == before


def test_a_file_goes_on_by_whatever_way_its_scenario_is_named(
    tmp_path, trials, monkeypatch
):
    (tmp_path / "mine.yaml").write_text("extends: drumming\n")
    monkeypatch.chdir(tmp_path)
    path = tmp_path / "taught.h5"
    taught_here(session(path, 1, scenario="mine.yaml"))
    for count, name in ((2, "./mine.yaml"), (3, str(tmp_path / "mine.yaml"))):
        assert len(session(path, count, scenario=name).taught) == count - 1
        taught_here(session(path, count, scenario=name))
    assert trials == [0, 1, 2]


def test_a_file_of_the_first_version_goes_on_where_it_fits(tmp_path, trials):
    path = tmp_path / "taught.h5"
    taught_here(session(path, 2))
    old = [
        dataclasses.replace(each, content={})
        for each in read_demonstrations(path)
    ]
    write_demonstrations(path, old)
    assert len(session(path, 2).taught) == 2
    with pytest.raises(InputError, match="scenario drumming, not mirror"):
        session(path, 2, scenario="mirror")
    old[1].theta = old[1].theta[:80]
    write_demonstrations(path, old)
    with pytest.raises(InputError, match="length 80, not 120"):
        session(path, 2)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"joint_names": tuple("abcdefgh")}, "of joints a, b, c, d, e, f, g"),
        ({"theta": np.zeros(80)}, r"theta of .* seed 1 is an array of shape"),
        ({"task_parameter": None}, r"task_parameter of .* seed 1 is an array"),
        ({"prototype": None}, r"prototype of .* seed 1 is an array"),
    ],
)
def test_what_does_not_fit_the_robot_does_not_count_as_taught(
    tmp_path, trials, change, message
):
    path = tmp_path / "taught.h5"
    taught_here(session(path, 2))
    first, second = read_demonstrations(path)
    write_demonstrations(path, [first, dataclasses.replace(second, **change)])
    with pytest.raises(InputError, match=message):
        session(path, 3)


def test_what_a_file_holds_twice_counts_once(tmp_path, trials):
    """As a file that two commands of version 0.1.0 have written."""
    path = tmp_path / "taught.h5"
    taught_here(session(path, 2))
    append_demonstration(path, read_demonstrations(path)[1])
    again = session(path, 3)
    assert len(again.taught) == 2
    taught_here(again)
    assert len(again.taught) == 3
    assert trials == [0, 1, 2]


def test_a_scenario_that_changes_at_the_start_is_told(tmp_path, trials):
    mine = tmp_path / "mine.yaml"
    mine.write_text("extends: drumming\n")
    started = session(tmp_path / "taught.h5", 2, scenario=str(mine))
    mine.write_text("extends: drumming\ndmp: {n_basis: 10}\n")
    with pytest.raises(InputError, match="changed at this moment"):
        taught_here(started)
    assert trials == []


@pytest.mark.slow
def test_the_robot_is_taught(tmp_path):
    mine = tmp_path / "mine.yaml"
    mine.write_text("extends: drumming\ncamera: {renderer: analytic}\n")
    path = tmp_path / "taught.h5"
    done = cli.main(
        ["teach", "--scenario", str(mine), "--demonstrations", "2"]
        + ["--workers", "0", "--seed", "3", "--out", str(path)]
    )
    assert done == 0
    found = read_demonstrations(path)
    assert len(found) == 2
    trials = tasks.runner(str(mine))
    threshold = trials.reward_config.threshold
    for each in found:
        assert each.reward > threshold
        assert 1.0 < each.max_pull <= trials.scenario.teaching.max_force + 1e-9
        assert each.joint_names == tuple(trials.scenario.active_joints)
        # Times and angles are those from which the movement was encoded.
        np.testing.assert_allclose(
            trials.dmp.encode(each.t, each.q), each.theta, atol=1e-8
        )
        # And the movement strikes the drum where it stood.
        recording = trials.strike(each.drum_xy, each.theta, 0)
        assert trials.reward(recording, trials.tap_prototypes()) > threshold
