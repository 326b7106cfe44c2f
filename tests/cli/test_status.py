"""What `affetto status` tells of a study, running or done."""

from datetime import UTC, datetime, timedelta
import os
from pathlib import Path
import sqlite3
import subprocess
import sys

import pytest

from drake_affetto.cli.main import main
from drake_affetto.cli.status import rate
from drake_affetto.common.errors import InputError
from drake_affetto.runner.store import Phase, TrialStore


def spec(i):
    return {"kind": "k", "i": i}


def test_phases_are_counted_by_what_is_finished(tmp_path, capsys):
    with TrialStore(tmp_path / "trials.sqlite") as store:
        store.plan("teaching", [spec(i) for i in range(3)])
        for i in range(4):
            store.put(spec(i), {}, {})
        # A trial may belong to two phases, and twice to one.
        store.plan("drumming", [spec(i) for i in (2, 3, 4, 5, 5)])
        assert store.phases() == [
            Phase("teaching", 3, 3),
            Phase("drumming", 4, 2),
        ]
        # While it is written to.
        assert main(["status", str(tmp_path)]) == 0
    said = " ".join(capsys.readouterr().out.split())
    assert "4 trials are finished" in said
    assert "2 are planned and not finished" in said
    assert "the results are written" not in said
    (tmp_path / "results.json").write_text("{}")
    assert main(["status", str(tmp_path)]) == 0
    said = " ".join(capsys.readouterr().out.split())
    assert "the results are written" in said


def test_a_folder_without_a_study_is_told(tmp_path, capsys):
    assert main(["status", str(tmp_path)]) == 2
    assert "no trials.sqlite" in capsys.readouterr().err
    assert not (tmp_path / "trials.sqlite").exists()
    (tmp_path / "trials.sqlite").write_text("not a data base at all")
    assert main(["status", str(tmp_path)]) == 2
    assert "cannot read trials" in capsys.readouterr().err


def test_the_rate_is_that_of_the_last_trials():
    begin = datetime(2026, 1, 1, tzinfo=UTC)
    slow = [begin + timedelta(seconds=60 * i) for i in range(40)]
    fast = [slow[-1] + timedelta(seconds=0.5 * i) for i in range(1, 40)]
    times = [time.isoformat() for time in slow + fast]
    assert rate(times) == pytest.approx(2.0)
    assert rate(times[:1]) is None
    assert rate([times[0]] * 3) is None


def test_a_full_disk_ends_clearly_and_keeps_what_is_finished(tmp_path):
    path = tmp_path / "trials.sqlite"
    with TrialStore(path) as store:
        store.put(spec(0), {"reward": 1.0}, {})
        pages = store._db.execute("PRAGMA page_count").fetchone()[0]
        # SQLite's own answer to a disk without room.
        store._db.execute(f"PRAGMA max_page_count = {pages}")
        long = {"text": "x" * 100_000}
        with pytest.raises(InputError, match=r"full.*1 finished trials"):
            store.put(spec(1), long, {})
    with TrialStore(path) as store:
        assert store.get(spec(0)) == ({"reward": 1.0}, {})


def test_only_files_of_trials_are_absorbed(tmp_path):
    other = tmp_path / "other.sqlite"
    with sqlite3.connect(other) as db:
        db.execute("CREATE TABLE letters (a TEXT)")
    with TrialStore(tmp_path / "trials.sqlite") as store:
        with pytest.raises(InputError, match="another program's file"):
            store.merge(other)
        with pytest.raises(InputError, match="no file of trials"):
            store.merge(tmp_path / "nowhere.sqlite")
        # It goes on working.
        store.put(spec(0), {}, {})
        assert len(store) == 1


INTERRUPTED = r"""
import os, pathlib, signal, sys, threading, time
sys.path.insert(0, sys.argv[1])
from support import fake_world
from drake_affetto.experiments import trials
trials.run_task = fake_world.run
marks = pathlib.Path(os.environ["FAKE_WORLD_MARKS"])

def ctrl_c():
    while not marks.exists() or marks.read_text().count("\n") < 6:
        time.sleep(0.05)
    os.killpg(0, signal.SIGINT)

if __name__ == "__main__":
    from drake_affetto.cli.main import main
    os.setpgrp()
    threading.Thread(target=ctrl_c, daemon=True).start()
    sys.exit(main(["drum", "--workers", "1", "--out", sys.argv[2]]))
"""


@pytest.mark.slow
def test_ctrl_c_tells_how_to_go_on(tmp_path):
    script = tmp_path / "study.py"
    script.write_text(INTERRUPTED)
    out = tmp_path / "out"
    done = subprocess.run(
        [sys.executable, script, Path(__file__).parents[1], out],
        capture_output=True,
        text=True,
        timeout=60,
        env={
            **os.environ,
            "FAKE_WORLD_MARKS": str(tmp_path / "marks"),
            "FAKE_WORLD_SECONDS": "0.2",
        },
    )
    assert done.returncode == 130, done.stderr
    said = " ".join(done.stdout.split())
    assert "the same command goes on from there" in said
    assert "Traceback" not in done.stderr
    assert not (out / "results.json").exists()
    with TrialStore(out / "trials.sqlite") as store:
        assert len(store) > 0
