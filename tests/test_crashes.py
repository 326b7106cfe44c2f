"""A small share of what kills, full disks and copies do to long commands.

More of them on demand:

    cd tests && python -m support.crash_trials --kills 50
    cd tests && python -m support.fault_trials
"""

import dataclasses
import os
import random
import shutil
import signal

import pytest

from support.crash_trials import (
    Job,
    LostError,
    Running,
    Tally,
    kill_again_and_again,
    one_life,
    require_kept,
    undisturbed,
)
from support.fault_trials import go_on, half_finished, require_told

KILLS = 4

# The smallest of the commands; its trials need no robot.
TOY = Job("toy", "toy --repeats 1 --seeds 6 --out {out}")

# The same where no file may become larger, as on a disk without room.
PROGRAM = """
import resource, signal, sys
from drake_affetto.cli.main import main
signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
resource.setrlimit(resource.RLIMIT_FSIZE, 2 * (LARGEST,))
sys.exit(main(sys.argv[1:]))
"""


@pytest.fixture(scope="module")
def world(tmp_path_factory):
    """A folder, and how the command goes when nobody disturbs it."""
    folder = tmp_path_factory.mktemp("crashes")
    return folder, undisturbed(TOY, folder, workers=0)


@pytest.mark.slow
def test_kills_lose_nothing_that_was_finished(world):
    folder, course = world
    tally = kill_again_and_again(TOY, folder, course, KILLS, 1, workers=0)
    assert tally.faults == []
    assert tally.kills == KILLS
    assert tally.ended >= 1


@pytest.mark.slow
def test_a_worker_is_killed_and_the_command_goes_on(world):
    folder, course = world
    out = folder / "worker"
    out.mkdir()
    running = Running(TOY, out)
    assert running.wait_until(lambda: bool(running.workers()), 0.01)
    os.kill(running.workers()[0], signal.SIGKILL)
    assert running.finish() == 0
    # Nor does it matter which process did the work.
    assert TOY.final(out) == course.final


@pytest.mark.slow
def test_workers_do_not_outlive_the_command(world):
    out = world[0] / "orphans"
    out.mkdir()
    running = Running(TOY, out)
    assert running.wait_until(lambda: bool(running.workers()), 0.01)
    running.process.kill()
    running.process.wait()
    assert running.wait_for_group(30.0)


@pytest.mark.slow
def test_a_disk_that_takes_no_more_is_told_and_nothing_is_lost(world):
    folder, course = world
    out = folder / "full"
    out.mkdir()
    # The log of writes grows beyond it.
    program = PROGRAM.replace("LARGEST", "120_000")
    small = dataclasses.replace(TOY, program=("-c", program))
    running = Running(small, out, workers=0)
    assert running.finish() == 2
    require_told(running, str(out))
    kept = TOY.rows(out)
    assert 0 < len(kept) < course.total
    go_on(TOY, out, course, folder, workers=0)
    require_kept(kept, TOY.rows(out), "with room again")


@pytest.mark.slow
def test_a_copy_that_was_made_meanwhile_is_gone_on_from(world):
    folder, course = world
    out = folder / "source"
    half_finished(TOY, out, course, 0.5, workers=0)
    copy = folder / "copy"
    copy.mkdir()
    for path in out.glob("trials.sqlite*"):
        shutil.copyfile(path, copy / path.name)
    assert TOY.rows(copy) == TOY.rows(out) != {}
    go_on(TOY, copy, course, folder, workers=0)


@pytest.mark.slow
def test_two_at_once_come_to_the_same(world):
    folder, course = world
    out = folder / "both"
    out.mkdir()
    logs = folder / "second"
    logs.mkdir()
    both = [
        Running(TOY, out, workers=0),
        Running(TOY, out, workers=0, logs=logs),
    ]
    assert [each.finish() for each in both] == [0, 0]
    assert TOY.final(out) == course.final
    assert len(TOY.rows(out)) == course.total


def test_what_is_lost_is_noticed():
    """Else kills would be survived whatever they do."""
    rows = {"a": b"1", "b": b"2"}
    for after, told in (
        ({"a": b"1"}, "trial b is gone"),
        ({"a": b"1", "b": b"3"}, "trial b is another one"),
    ):
        with pytest.raises(LostError, match=told):
            require_kept(rows, after, "after")
    require_kept(rows, rows | {"c": b"3"}, "after")


FORGETFUL = """
import pathlib, sqlite3, sys, time
out = pathlib.Path(sys.argv[sys.argv.index("--out") + 1])
with sqlite3.connect(out / "trials.sqlite") as db:
    db.execute("DROP TABLE IF EXISTS trials")
    db.execute("CREATE TABLE trials (key TEXT)")
for i in range(50):
    with sqlite3.connect(out / "trials.sqlite") as db:
        db.execute("INSERT INTO trials VALUES (?)", (f"{time.time()}",))
    time.sleep(0.01)
(out / "results.json").write_text("{}")
"""


def test_a_command_that_forgets_is_found_out(tmp_path):
    job = Job("forgets", "x --out {out}", program=("-c", FORGETFUL))
    course = undisturbed(job, tmp_path)
    assert course.total == 50
    out = tmp_path / "out"
    out.mkdir()
    rng, tally = random.Random(1), Tally()
    while tally.kills == 0:
        # One that finds nothing of an earlier life.
        one_life(job, out, course, rng, tally)
    with pytest.raises(LostError, match="is gone"):
        one_life(job, out, course, rng, tally)
