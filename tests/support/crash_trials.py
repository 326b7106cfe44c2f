"""Kills long commands at random moments, and sees what is left of them.

Each command is run once without disturbance. Then it is started, killed after
a trial has been stored, and started again until it ends. What was finished
before a kill must be there after it, byte for byte, and the results at the end
must be those of the undisturbed run:

    cd tests && python -m support.crash_trials --kills 50 --commands drum toy

`support.fault_trials` does the same with full disks, clocks and the like.
"""

import argparse
from collections.abc import Callable, Collection, Iterator
import contextlib
import dataclasses
import json
import os
from pathlib import Path
import random
import shutil
import signal
import sqlite3
import subprocess
import sys
import tempfile
import time
from typing import Any

import h5py

from drake_affetto.common.errors import InputError
from drake_affetto.runner.store import TrialStore
from drake_affetto.teaching.demonstrations import read_demonstrations
from support.short_tuning import SHORT

ROOT = Path(__file__).parents[2]

# How long one start of a command may take, s.
LONGEST = 600.0

# How long workers may outlive the process that was killed, s.
GRACE = 15.0

FILES = {
    # Geometry instead of images: it is the studies that are killed, not VTK.
    "direct.yaml": "extends: drumming\ncamera: {renderer: analytic}\n",
    "changed.yaml": "extends: mirror\ncamera: {renderer: analytic}\n",
    "short.yaml": SHORT,
    "few.yaml": """
joints: [right_shoulder_flexion]
faults:
- {kind: joint_stuck, span: [0.0, 1.0]}
- {kind: pressure_offset, sizes: [2.0e+5], span: [0.0, 1.0]}
- {kind: supply_lost, span: [0.0, 1.0]}
""",
}


class LostError(Exception):
    """Something that was finished is not there, or is another one."""


Rows = dict[str, bytes]


def copy_database(path: Path, folder: Path) -> Path:
    """A copy of an SQLite file with what is not in the file itself yet."""
    for suffix in ("", "-wal"):
        beside = Path(f"{path}{suffix}")
        if beside.exists():
            shutil.copyfile(beside, folder / beside.name)
    return folder / path.name


def query(path: Path, text: str) -> list[tuple]:
    """The rows of a query of a file that may be written meanwhile.

    None if there is no such file or table yet.
    """
    if not path.exists():
        return []
    with contextlib.closing(
        sqlite3.connect(f"{path.absolute().as_uri()}?mode=ro", uri=True)
    ) as database:
        return database.execute(text).fetchall()


def count_rows(path: Path, text: str) -> int:
    """What a query counts; 0 if the file is about to be made or removed."""
    try:
        found = query(path, text)
    except sqlite3.OperationalError:
        return 0
    return int(found[0][0]) if found else 0


def count_taught(path: Path) -> int:
    """The demonstrations of a file, which is replaced as a whole."""
    try:
        with h5py.File(path, "r") as file:
            return len(file["demonstrations"])
    except OSError:
        return 0


def stored_trials(path: Path) -> Rows:
    """The finished trials of a study whose processes are all dead.

    Read from a copy: the file itself is left as the kill left it.
    """
    with tempfile.TemporaryDirectory() as folder:
        if not path.exists():
            return {}
        copy = copy_database(path, Path(folder))
        with contextlib.closing(sqlite3.connect(copy)) as database:
            (found,) = database.execute("PRAGMA integrity_check").fetchone()
            if found != "ok":
                raise LostError(f"{path} is damaged: {found}")
        return {
            row[0]: repr(row).encode()
            for row in query(copy, "SELECT * FROM trials")
        }


def tuned_trials(path: Path) -> Rows:
    """The finished candidates of a tuning study: factors and costs."""
    text = (
        "SELECT trial_id, key, value_json FROM trial_user_attributes "
        "JOIN trials USING (trial_id) WHERE state IN ('COMPLETE', 'PRUNED')"
    )
    values = (
        "SELECT trial_id, param_name, param_value FROM trial_params "
        "JOIN trials USING (trial_id) WHERE state IN ('COMPLETE', 'PRUNED')"
    )
    found: dict[int, dict[str, Any]] = {}
    with tempfile.TemporaryDirectory() as folder:
        if not path.exists():
            return {}
        copy = copy_database(path, Path(folder))
        for trial, name, value in query(copy, text) + query(copy, values):
            found.setdefault(trial, {})[name] = value
    return {
        str(each["candidate"]): json.dumps(each, sort_keys=True).encode()
        for each in found.values()
    }


def taught(path: Path) -> Rows:
    """The demonstrations of a file, by their seeds."""
    if not path.exists():
        return {}
    found = {}
    for each in read_demonstrations(path):
        fields = {
            name: value.tobytes() if hasattr(value, "tobytes") else value
            for name, value in dataclasses.asdict(each).items()
        }
        found[str(each.seed)] = repr(sorted(fields.items())).encode()
    return found


@dataclasses.dataclass(frozen=True)
class Job:
    """A long command, small enough to be run again and again.

    Attributes:
        name: Its name.
        words: Words of the command line; "{out}" is where it writes.
        store: File of its finished trials, from there.
        stored: How many they are, while the command runs, of the place where
            it writes.
        rows: What is finished, of the place where it writes.
        final: What must be equal at the end, of the same place.
        results: File that is written last, from there.
        program: Python's arguments before the words.
    """

    name: str
    words: str
    store: str = "trials.sqlite"
    stored: Callable[[Path], int] = lambda out: count_rows(
        out / "trials.sqlite", "SELECT count(*) FROM trials"
    )
    rows: Callable[[Path], Rows] = lambda out: stored_trials(
        out / "trials.sqlite"
    )
    final: Callable[[Path], Any] = lambda out: (
        out / "results.json"
    ).read_bytes()
    results: str = "results.json"
    program: tuple[str, ...] = ("-m", "drake_affetto.cli")

    def command(self, out: Path, workers: int) -> list[str]:
        """The command line."""
        words = [word.format(out=out) for word in self.words.split()]
        words += ["--workers", str(workers)]
        return [sys.executable, *self.program, *words]


def _taught_file(out: Path) -> Rows:
    """The movements that were taught, by their seeds.

    Each is kept beside the file until it is in the file.
    """
    beside = out / "lessons.h5.trials.sqlite"
    found = {}
    with tempfile.TemporaryDirectory() as folder:
        if beside.exists():
            copy = copy_database(beside, Path(folder))
            with TrialStore(copy) as store:
                for row in store.rows():
                    _, arrays = store.get(row.spec) or ({}, {})
                    if row.result["success"]:
                        theta = arrays["theta"].tobytes()
                        found[str(row.spec["seed"])] = theta
    path = out / "lessons.h5"
    for each in read_demonstrations(path) if path.exists() else []:
        assert each.theta is not None
        found[str(each.seed)] = each.theta.tobytes()
    return found


def _tuned_results(out: Path) -> Any:
    """Gains and costs; numbers of trials depend on how often it was killed."""
    results = json.loads((out / "results.json").read_text())
    del results["trials"]
    for part in ("best", "hand_tuned"):
        results[part].pop("trial", None)
    rows = {k: json.loads(v) for k, v in _tuned_rows(out).items()}
    return results, rows


def _tuned_rows(out: Path) -> Rows:
    return tuned_trials(out / "study.sqlite")


SMALL = "--demonstrations 4 --evaluations 2"
JOBS = {
    job.name: job
    for job in (
        Job(
            "drum",
            f"drum {SMALL} --repeats 3 --after 2 4 "
            "--scenario direct.yaml --out {out}",
        ),
        Job(
            "mirror",
            f"mirror {SMALL} --samples 3 --repeats 2 --schemes unchanged "
            "relearn transfer_default --scenario changed.yaml --out {out}",
        ),
        Job(
            "self_calibrate",
            f"mirror --self-calibrate {SMALL} --samples 3 --repeats 1 "
            "--scenario changed.yaml --out {out}",
        ),
        Job(
            "teach",
            "teach --demonstrations 10 --scenario direct.yaml "
            "--out {out}/lessons.h5",
            store="lessons.h5.trials.sqlite",
            stored=lambda out: count_taught(out / "lessons.h5"),
            rows=_taught_file,
            final=lambda out: taught(out / "lessons.h5"),
            results="lessons.h5",
        ),
        Job(
            "faults",
            "faults --demonstrations 4 --repeats 2 --catalog few.yaml "
            "--out {out}",
        ),
        Job("toy", "toy --repeats 2 --seeds 10 --out {out}"),
        Job(
            "tune",
            "tune --joints right_elbow_flexion --tuning short.yaml "
            "--trials 20 --out {out}",
            store="study.sqlite",
            stored=lambda out: count_rows(
                out / "study.sqlite",
                "SELECT count(*) FROM trials "
                "WHERE state IN ('COMPLETE', 'PRUNED')",
            ),
            rows=_tuned_rows,
            final=_tuned_results,
        ),
        Job("demo", "demo --out {out}"),
    )
}


@dataclasses.dataclass
class Course:
    """How a command went without disturbance.

    Attributes:
        total: Number of its trials.
        first: When the first was stored, s from the start.
        last: When the last was stored, s.
        end: When it ended, s.
        final: What it ended with.
    """

    total: int
    first: float
    last: float
    end: float
    final: Any


@dataclasses.dataclass
class Tally:
    """Kills of one command.

    Attributes:
        killed: Kills of each kind.
        early: Kills in which nothing new had been stored since the start.
        ended: How often the command came to its end.
        faults: What went wrong, in words.
    """

    killed: dict[str, int] = dataclasses.field(
        default_factory=lambda: dict.fromkeys(KINDS, 0)
    )
    early: int = 0
    ended: int = 0
    faults: list[str] = dataclasses.field(default_factory=list)

    @property
    def kills(self) -> int:
        """All kills."""
        return sum(self.killed.values())


KINDS = ("group", "main", "worker")
"""The whole process group; the study's own process, whose workers must end by
themselves; one worker, without which the command must go on."""

WEIGHTS = (6, 2, 1)


def environment() -> dict[str, str]:
    """This checkout's package, one thread a process."""
    paths = [str(ROOT), str(ROOT / "tests")]
    return {
        **os.environ,
        "PYTHONPATH": os.pathsep.join(paths),
        "OMP_NUM_THREADS": "1",
        "OPENBLAS_NUM_THREADS": "1",
    }


class Running:
    """A command that runs, in a process group of its own."""

    def __init__(
        self,
        job: Job,
        out: Path,
        workers: int = 1,
        more: dict[str, str] | None = None,
        logs: Path | None = None,
    ) -> None:
        """Starts it.

        Args:
            job: The command.
            out: Where it writes; it runs in the folder above.
            workers: Number of its worker processes.
            more: Variables of its environment.
            logs: Folder of what it prints; None for the folder above.
        """
        self.job, self.out = job, out
        logs = logs or out.parent
        self.log = logs / f"{out.name}.log"
        self.errors = logs / f"{out.name}.err"
        # A group of its own, without a terminal.
        with self.log.open("ab") as log, self.errors.open("wb") as errors:
            self.process = subprocess.Popen(
                job.command(out, workers),
                cwd=out.parent,
                env={**environment(), **(more or {})},
                stdin=subprocess.DEVNULL,
                stdout=log,
                stderr=errors,
                start_new_session=True,
            )
        self.start = time.monotonic()

    @property
    def age(self) -> float:
        """Time since the start, s."""
        return time.monotonic() - self.start

    def ended(self) -> bool:
        """Whether its first process has ended."""
        return self.process.poll() is not None

    def wait_until(self, there: Callable[[], bool], pause: float) -> bool:
        """Waits; False if the command ended before."""
        while not there():
            if self.ended():
                return False
            if self.age > LONGEST:
                self.kill()
                raise LostError(f"{self.job.name}: still busy, was killed")
            time.sleep(pause)
        return True

    def wait(self, seconds: float) -> bool:
        """Waits so long; False if the command ended before."""
        end = time.monotonic() + seconds
        return self.wait_until(lambda: time.monotonic() >= end, 0.002)

    def finish(self) -> int:
        """Waits for the end; the exit code."""
        self.wait_until(self.ended, 0.05)
        return self.process.wait()

    def told(self) -> str:
        """What it wrote to its standard error."""
        return self.errors.read_text(errors="replace").strip()

    def workers(self) -> list[int]:
        """Its worker processes."""
        return [pid for pid in _group(self.process.pid) if _is_worker(pid)]

    def kill(self) -> None:
        """Ends the whole group at once."""
        with contextlib.suppress(ProcessLookupError):
            os.killpg(self.process.pid, signal.SIGKILL)
        self.process.wait()
        self.wait_for_group(0.5)

    def wait_for_group(self, limit: float) -> bool:
        """Waits until no process of the group is left; False if one is."""
        end = time.monotonic() + limit
        while _group(self.process.pid):
            if time.monotonic() > end:
                return False
            time.sleep(0.01)
        return True


def _stat(pid: int) -> list[str]:
    """What Linux tells of a process after its name: state, parent, group."""
    try:
        text = Path(f"/proc/{pid}/stat").read_text()
    except OSError:
        return []
    return text.rpartition(")")[2].split()


def _group(leader: int) -> list[int]:
    """The living processes of a group."""
    found = []
    for entry in Path("/proc").iterdir():
        if entry.name.isdigit():
            stat = _stat(int(entry.name))
            if stat and stat[2] == str(leader) and stat[0] not in "ZX":
                found.append(int(entry.name))
    return found


def _is_worker(pid: int) -> bool:
    with contextlib.suppress(OSError):
        return b"spawn_main" in Path(f"/proc/{pid}/cmdline").read_bytes()
    return False


def make_inputs(folder: Path) -> None:
    """Writes the files that the commands name."""
    for name, text in FILES.items():
        (folder / name).write_text(text)


def undisturbed(job: Job, folder: Path, workers: int = 1) -> Course:
    """Runs a command to its end and notes when its trials are stored.

    Raises:
        LostError: If it fails.
    """
    out = folder / f"{job.name}_whole"
    out.mkdir()
    running = Running(job, out, workers)
    counts: list[tuple[float, int]] = []

    def look() -> bool:
        now = job.stored(out)
        if now and (not counts or counts[-1][1] != now):
            counts.append((running.age, now))
        return running.ended()

    running.wait_until(look, 0.02)
    if running.process.wait() != 0 or not counts:
        raise LostError(f"{job.name} fails: {running.told()[-500:]}")
    total = max(count for _, count in counts)
    last = next(at for at, count in counts if count == total)
    end = running.age
    return Course(total, counts[0][0], last, end, job.final(out))


def require_kept(before: Rows, after: Rows, what: str) -> None:
    """Raises LostError unless all that was there is there, unchanged."""
    for key, row in before.items():
        if key not in after:
            raise LostError(f"{what}: trial {key} is gone")
        if after[key] != row:
            raise LostError(f"{what}: trial {key} is another one")


def require_end(running: Running, before: Rows, course: Course) -> None:
    """Raises LostError unless the command ended as the undisturbed one did."""
    job, out = running.job, running.out
    code = running.process.wait()
    if code != 0:
        raise LostError(f"exit code {code}: {running.told()[-500:]}")
    require_kept(before, job.rows(out), "at the end")
    if job.final(out) != course.final:
        raise LostError(f"{out / job.results} differs from an undisturbed run")


def one_life(
    job: Job,
    out: Path,
    course: Course,
    rng: random.Random,
    tally: Tally,
    workers: int = 1,
) -> bool:
    """Starts a command and kills it; whether it came to its end before.

    Raises:
        LostError: If something finished is lost, or the results differ.
    """
    before = job.rows(out)
    kind = rng.choices(KINDS, WEIGHTS)[0]
    running = Running(job, out, workers)
    try:
        stored = job.stored(out)
        # Not in the start-up: that holds little.
        if running.wait_until(
            lambda: job.stored(out) > stored or job.stored(out) >= course.total,
            0.01,
        ):
            whole = course.last - course.first
            span = whole * max(0.1, 1.0 - stored / course.total)
            tail = course.end - course.last
            running.wait(rng.uniform(0.0, min(span, 0.4 * whole) + tail))
        if running.ended():
            require_end(running, before, course)
            return True
        tally.early += job.stored(out) == stored
        if kind == "worker":
            return _kill_worker(running, before, course, rng, tally)
        if kind == "main":
            running.process.kill()
            running.process.wait()
            if not running.wait_for_group(GRACE):
                raise LostError("workers outlive the command")
        running.kill()
        tally.killed[kind] += 1
    finally:
        running.kill()
    require_kept(before, job.rows(out), f"after a kill ({kind})")
    return False


def _kill_worker(
    running: Running,
    before: Rows,
    course: Course,
    rng: random.Random,
    tally: Tally,
) -> bool:
    """Kills one worker; the command must come to its end all the same."""
    found = running.workers()
    if found:
        with contextlib.suppress(ProcessLookupError):
            os.kill(rng.choice(found), signal.SIGKILL)
            tally.killed["worker"] += 1
    running.finish()
    require_end(running, before, course)
    return True


def kill_again_and_again(
    job: Job,
    folder: Path,
    course: Course,
    kills: int,
    seed: int,
    workers: int = 1,
) -> Tally:
    """Kills a command so many times, and lets it come to its end."""
    rng = random.Random(f"{seed} {job.name}")
    tally = Tally()
    number = 0
    while tally.kills < kills or number:
        if number == 0:
            out = Path(tempfile.mkdtemp(prefix=f"{job.name}_", dir=folder))
        number += 1
        try:
            if tally.kills < kills:
                ended = one_life(job, out, course, rng, tally, workers)
            else:
                before = job.rows(out)
                running = Running(job, out, workers)
                running.finish()
                require_end(running, before, course)
                ended = True
        except (LostError, InputError) as error:
            tally.faults.append(f"{out}: {error}")
            print(f"{job.name}: {tally.faults[-1]}", flush=True)
            number = 0
            if len(tally.faults) >= 3:
                break
            continue
        if ended:
            tally.ended += 1
            left = leftovers(out)
            if left:
                print(f"{job.name}: left behind: {', '.join(left)}", flush=True)
            shutil.rmtree(out)
            number = 0
    return tally


def leftovers(out: Path) -> list[str]:
    """Hidden files that writers left when they were killed."""
    known = {".affetto.json", ".lock"}
    return sorted(
        path.name
        for path in out.iterdir()
        if path.name.startswith(".") and path.name not in known
    )


@contextlib.contextmanager
def working_folder(keep: str | None) -> Iterator[Path]:
    """A folder with the inputs, of that name or for this run only."""
    with contextlib.ExitStack() as stack:
        if keep is None:
            folder = Path(stack.enter_context(tempfile.TemporaryDirectory()))
        else:
            folder = Path(keep).resolve()
            folder.mkdir(parents=True)
        make_inputs(folder)
        yield folder


def run_jobs(
    names: Collection[str], folder: Path, kills: int, seed: int, workers: int
) -> dict[str, Tally]:
    """Kills each of the commands so many times; prints a line for each."""
    tallies = {}
    for name in names:
        start = time.monotonic()
        job = JOBS[name]
        course = undisturbed(job, folder, workers)
        print(
            f"{name}: {course.total} trials, the first after "
            f"{course.first:.1f} s, the last after {course.last:.1f} s, "
            f"{course.end:.1f} s in all",
            flush=True,
        )
        tally = kill_again_and_again(job, folder, course, kills, seed, workers)
        tallies[name] = tally
        kinds = ", ".join(f"{n} {kind}" for kind, n in tally.killed.items())
        print(
            f"{name}: {tally.kills} kills ({kinds}; {tally.early} before a new "
            f"trial), {tally.ended} times to the end, "
            f"{len(tally.faults)} faults, {time.monotonic() - start:.0f} s",
            flush=True,
        )
    return tallies


def main() -> int:
    """Prints what became of the commands; 1 if anything was lost."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--kills", type=int, default=50)
    parser.add_argument("--commands", nargs="+", default=JOBS, choices=JOBS)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--workers", type=int, default=1)
    parser.add_argument("--keep", metavar="DIR", help="new folder for all")
    args = parser.parse_args()
    with working_folder(args.keep) as folder:
        tallies = run_jobs(
            args.commands, folder, args.kills, args.seed, args.workers
        )
    return 1 if any(tally.faults for tally in tallies.values()) else 0


if __name__ == "__main__":
    sys.exit(main())
