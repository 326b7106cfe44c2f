"""Full and read-only disks, two commands at once, clocks set back, copies.

What a disturbed machine does to a command that runs. It must end well or in
one line that names the file, keep what was finished, and come to the same
results when the disturbance is over:

    cd tests && python -m support.fault_trials --commands toy drum teach

Disks need root; `unshare --mount` keeps them from everybody else. The clock
needs libfaketime. What cannot be had is told and left out.
"""

import argparse
from collections.abc import Callable, Iterator
import contextlib
import os
from pathlib import Path
import random
import shutil
import subprocess
import sys
import tempfile
import time

from drake_affetto.common.errors import InputError
from drake_affetto.runner.store import TrialStore
from support.crash_trials import (
    JOBS,
    Course,
    Job,
    LostError,
    Running,
    environment,
    make_inputs,
    query,
    require_end,
    require_kept,
    undisturbed,
    working_folder,
)

FAKETIME = "/usr/lib/*/faketime/libfaketimeMT.so.1"


class UnavailableError(Exception):
    """This machine has not what the disturbance needs."""


def require_told(running: Running, *words: str) -> None:
    """Raises LostError unless a command ended in one line with these words."""
    code, told = running.process.wait(), running.told()
    lines = [each for each in told.splitlines() if "affetto:" in each]
    if code not in (1, 2) or len(lines) != 1 or "Traceback" in told:
        raise LostError(f"exit code {code}: {told[-1500:]}")
    if not all(word in lines[0] for word in words):
        raise LostError(f"it does not say {words}: {lines[0]}")


def go_on(
    job: Job, out: Path, course: Course, logs: Path, workers: int = 1
) -> None:
    """Lets the command come to its end, undisturbed; checks the results."""
    before = job.rows(out)
    running = Running(job, out, workers, logs=logs)
    running.finish()
    require_end(running, before, course)


def half_finished(
    job: Job, out: Path, course: Course, share: float = 0.5, workers: int = 1
) -> None:
    """Runs the command and kills it when so much of it is stored."""
    out.mkdir()
    running = Running(job, out, workers)
    wanted = max(1, int(share * course.total))
    running.wait_until(lambda: job.stored(out) >= wanted, 0.01)
    running.kill()


def _mount(*words: str) -> None:
    done = subprocess.run(
        ["mount", *words], capture_output=True, text=True, check=False
    )
    if done.returncode:
        raise UnavailableError(f"mount {' '.join(words)}: {done.stderr}")


@contextlib.contextmanager
def mounted(*words: str) -> Iterator[None]:
    """A mount that is taken away at the end; the last word is its place."""
    _mount(*words)
    try:
        yield
    finally:
        subprocess.run(["umount", "--lazy", words[-1]], check=True)


def size_of(folder: Path) -> int:
    """Bytes of the files in a folder."""
    return sum(path.stat().st_size for path in folder.rglob("*"))


def full_disk(job: Job, folder: Path, course: Course) -> str:
    """Disks that are full after a few trials, after most, at the results."""
    whole = size_of(folder / f"{job.name}_whole")
    full = 0
    for share in (0.1, 0.4, 0.7, 0.9, 1.1):
        disk = folder / f"disk_{share}"
        disk.mkdir()
        # What SQLite needs beside a file: a log of writes as large again.
        size = 40_000 + int(share * whole)
        with mounted("-t", "tmpfs", "-o", f"size={size}", "tmpfs", str(disk)):
            make_inputs(disk)
            out = disk / "out"
            out.mkdir()
            running = Running(job, out, logs=folder)
            if running.finish() != 0:
                full += 1
                require_told(running, str(disk))
            kept = job.rows(out)
            _mount("-o", "remount,size=200m", str(disk))
            require_kept(kept, job.rows(out), "with room again")
            go_on(job, out, course, folder)
    return f"{full} of 5 disks were full"


def read_only(job: Job, folder: Path, course: Course) -> str:
    """A disk that lets nothing be written any more."""
    out = folder / "half"
    half_finished(job, out, course)
    before = {path: path.read_bytes() for path in out.iterdir()}
    kept = job.rows(out)
    with mounted("--bind", str(out), str(out)):
        _mount("-o", "remount,bind,ro", str(out))
        running = Running(job, out)
        running.finish()
        require_told(running, str(out))
        if job.store == "trials.sqlite":
            status(out)
    if {path: path.read_bytes() for path in out.iterdir()} != before:
        raise LostError("something was written")
    require_kept(kept, job.rows(out), "on a read-only disk")
    go_on(job, out, course, folder)
    return "refused"


def status(out: Path, *more: str) -> str:
    """What `affetto status` says.

    Raises:
        LostError: If it fails.
    """
    done = subprocess.run(
        [*(sys.executable, "-m", "drake_affetto.cli"), "status", str(out)],
        env={**environment(), **dict(each.split("=", 1) for each in more)},
        capture_output=True,
        text=True,
        check=False,
    )
    if done.returncode or "trials are finished" not in done.stdout:
        raise LostError(f"status: {done.stderr[-500:]}")
    return done.stdout


def two_at_once(job: Job, folder: Path, course: Course) -> str:
    """The same command twice on one folder, at the same time."""
    told = []
    for pause in (0.0, course.first + 0.3 * (course.last - course.first)):
        out = folder / f"both_{pause:.0f}"
        out.mkdir()
        first = Running(job, out)
        first.wait(pause)
        second = Running(job, out, logs=_made(folder / "second"))
        codes = {each: each.finish() for each in (first, second)}
        if set(codes.values()) not in ({0}, {0, 2}):
            raise LostError(f"they end with {list(codes.values())}")
        for each, code in codes.items():
            if code:
                require_told(each, "at work")
            else:
                require_end(each, {}, course)
        told.append("one refused" if 2 in codes.values() else "both ended well")
        go_on(job, out, course, folder)
    return ", ".join(told)


def _made(folder: Path) -> Path:
    folder.mkdir(exist_ok=True)
    return folder


def clock(job: Job, folder: Path, course: Course) -> str:
    """A clock that is set back by a day, before and while it runs."""
    found = sorted(Path("/").glob(FAKETIME.lstrip("/")))
    if not found:
        raise UnavailableError("libfaketime is not installed")
    setting = folder / "clock"
    fake = {
        "LD_PRELOAD": str(found[0]),
        "FAKETIME_TIMESTAMP_FILE": str(setting),
        "FAKETIME_NO_CACHE": "1",
        # As on a machine whose clock is set: what has passed has passed.
        "FAKETIME_DONT_FAKE_MONOTONIC": "1",
    }
    out = folder / "clock_out"
    half_finished(job, out, course, 0.3)
    before = job.rows(out)
    setting.write_text("-1d")
    running = Running(job, out, more=fake)
    wanted = int(0.6 * course.total)
    running.wait_until(lambda: job.stored(out) >= wanted, 0.01)
    setting.write_text("-3d")
    running.finish()
    require_end(running, before, course)
    if job.store == "trials.sqlite":
        if "-" in status(out).splitlines()[-1]:
            raise LostError("status tells a negative time")
        days = query(
            out / job.store,
            "SELECT count(DISTINCT substr(finished_at, 1, 10)) FROM trials",
        )
        if days[0][0] < 3:
            raise LostError(f"the clock was not set back: {days}")
    return "set back by a day, then by two more"


def copies(job: Job, folder: Path, course: Course) -> str:
    """Copies of the store while it is written, of the file alone or of all."""
    if job.store == "study.sqlite":
        raise UnavailableError("the store is Optuna's own")
    rng = random.Random(job.name)
    out = folder / "copied"
    out.mkdir()
    running = Running(job, out)
    places = []
    store = out / job.store
    while running.wait(rng.uniform(0.0, (course.last - course.first) / 8)):
        if not store.exists():
            continue
        place = folder / f"copy_{len(places)}"
        place.mkdir()
        names = [store.name, f"{store.name}-wal"]
        rng.shuffle(names)
        # Some copy what they know of, and that is one file.
        for name in names if len(places) % 3 else names[:1]:
            with contextlib.suppress(FileNotFoundError):
                shutil.copyfile(store.with_name(name), place / name)
            time.sleep(rng.uniform(0.0, 0.05))
        places.append(place)
    require_end(running, {}, course)
    read = refused = 0
    for number, place in enumerate(places):
        path = place / store.name
        if not path.exists():
            continue
        try:
            with TrialStore(path) as opened:
                opened.verify()
                read += 1
        except InputError as error:
            if str(path) not in str(error) or "\n" in str(error):
                raise LostError(f"a copy: {error}") from error
            refused += 1
            continue
        # Each takes its time; the file alone, and a whole copy.
        if job.name != "teach" and number in (3, len(places) - 2):
            go_on(job, place, course, folder)
    return f"{read} copies read, {refused} refused"


FAULTS: dict[str, Callable[[Job, Path, Course], str]] = {
    each.__name__: each
    for each in (full_disk, read_only, two_at_once, clock, copies)
}


def disturb(
    name: str, job: Job, course: Course, whole: Path
) -> tuple[bool, str]:
    """Whether a command stands a disturbance, and what is said of it."""
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place)
        make_inputs(folder)
        shutil.copytree(whole, folder / whole.name)
        try:
            return True, FAULTS[name](job, folder, course)
        except UnavailableError as reason:
            return True, f"left out: {reason}"
        except (LostError, InputError) as error:
            return False, f"FAULT: {error}"


def main() -> int:
    """Prints what became of the commands; 1 if anything went wrong."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--commands", nargs="+", default=JOBS, choices=JOBS)
    parser.add_argument("--faults", nargs="+", default=FAULTS, choices=FAULTS)
    args = parser.parse_args()
    if os.geteuid() == 0 and "AFFETTO_MOUNTS" not in os.environ:
        # A place of its own for its disks.
        os.environ["AFFETTO_MOUNTS"] = "own"
        words = [sys.executable, "-m", "support.fault_trials", *sys.argv[1:]]
        os.execvp("unshare", ["unshare", "--mount", *words])
    failed = 0
    with working_folder(None) as folder:
        for command in args.commands:
            job = JOBS[command]
            course = undisturbed(job, folder)
            for name in args.faults:
                start = time.monotonic()
                fits, told = disturb(
                    name, job, course, folder / f"{command}_whole"
                )
                failed += not fits
                seconds = time.monotonic() - start
                print(
                    f"{command}, {name}: {told} ({seconds:.0f} s)", flush=True
                )
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
