"""Thousands of damaged inputs: each ends well, or in one line.

Valid scenarios, parameter files, logs, files of demonstrations and trials,
results and packets are damaged at random, from a seed, and handed to what
reads them. Run as a program it prints the counts:

    python -m support.input_corpus --count 5000 --seed 1
"""

import argparse
from collections.abc import Callable, Collection, Iterator
import copy
import dataclasses
import functools
import json
import math
import multiprocessing
from pathlib import Path
import shutil
import signal
import sqlite3
import sys
import tempfile
import time
import traceback
from typing import Any
import warnings

import h5py
import numpy as np
import yaml

from drake_affetto.cli.main import main as affetto
from drake_affetto.common.errors import InputError
from drake_affetto.common.fingerprint import config_values
from drake_affetto.common.log_limits import load_limits
from drake_affetto.common.resources import models_dir
from drake_affetto.control.pidf import load_control
from drake_affetto.pneumatics.parameters import load_parameters
from drake_affetto.report.study_folder import read_folder
from drake_affetto.robot.controller import load_robot_controller
from drake_affetto.robot.log import read_log
from drake_affetto.robot.wire import PacketCodec, PacketError, load_wire
from drake_affetto.runner.store import TrialStore
from drake_affetto.sound.config import load_sound_config
from drake_affetto.station.scenario import load_scenario
from drake_affetto.station.variation import VariationConfig
from drake_affetto.teaching.demonstrations import (
    Demonstration,
    from_robot_csv,
    read_demonstrations,
    write_demonstrations,
)
from drake_affetto.tuning.config import load_tuning
from support import report_data
from support.robot_bench import (
    CONTROLLER,
    JOINT,
    make_log,
    make_problem,
    true_values,
    write_csv,
)

# No input may keep a reader busy for longer, s.
LONGEST = 10.0

# What a person, a script or another program may have written in a value's
# place.
WORDS = (
    *("", "~", "null", "true", "yes", "off", ".nan", "nan", ".inf", "-.inf"),
    *("-1", "0", "1", "1e308", "-1e308", "1e999", "1e-320", "0.0", "-0.0"),
    *("010", "1_0", "1:30", "0x1F", "9" * 30, "2020-01-01", "1,5", "1.2.3"),
    *("[]", "{}", "[1, 2]", "{a: 1}", "- 1", "text", "'text'", '"'),
    *("*a", "&a [*a]", "!!int x", "!!python/object:os.system x", "%", "@x"),
    *("../../x", "/dev/null", "é", "\u2028", "\x00", "x" * 5000),
)
VALUES: tuple[Any, ...] = (
    *(None, True, False, 0, 1, -1, 3, 10**30, -(10**400), 0.0, -0.5, 1e-320),
    *(1e308, -1e308, math.inf, -math.inf, math.nan, "", "text", "nan", "1e5"),
    *("../x.yaml", "\x00", "x" * 3000, [], [1], [[]], [None], ["a"] * 50),
    *({}, {"a": 1}, {"": {}}, [1.0, math.nan], [[1, 2], [3]], "010", "é"),
)


@dataclasses.dataclass(frozen=True)
class Reader:
    """One kind of input.

    Attributes:
        kind: Its name.
        whole: Content of an undamaged one, and the name of its file.
        write: Writes a damaged one into a folder, by a generator of random
            numbers; returns its path and what was damaged, if that is known.
        read: Reads it.
        command: A command of `affetto` that reads it and writes into the
            second path, for those that are refused; None if there is none.
    """

    kind: str
    whole: Callable[[], tuple[str, bytes]]
    write: Callable[[Path, np.random.Generator], tuple[Path, str]]
    read: Callable[[Path], Any]
    command: Callable[[Path, Path], list[str]] | None = None


@dataclasses.dataclass(frozen=True)
class Outcome:
    """What became of one input.

    Attributes:
        kind: Kind of input.
        seed: Seed of its damage.
        damage: The place that was damaged, if it is known.
        end: "read", "refused" or "failed".
        told: The error in words.
        seconds: Time taken, s.
    """

    kind: str
    seed: int
    damage: str
    end: str
    told: str
    seconds: float


# --- Damage ------------------------------------------------------------------


def pick(rng: np.random.Generator, values: Any) -> Any:
    return values[int(rng.integers(len(values)))]


def damage_bytes(data: bytes, rng: np.random.Generator) -> bytes:
    """Flipped, cut, doubled, inserted."""
    changed = bytearray(data)
    for _ in range(int(rng.integers(1, 12))):
        if not changed:
            break
        at = int(rng.integers(len(changed)))
        how = rng.integers(6)
        if how == 0:
            changed[at] = int(rng.integers(256))
        elif how == 1:
            changed[at] ^= 1 << int(rng.integers(8))
        elif how == 2:
            del changed[at : at + int(rng.integers(1, 60))]
        elif how == 3:
            changed[at:at] = bytes(rng.integers(0, 256, 5, dtype=np.uint8))
        elif how == 4:
            changed[at : at + 8] = b"\0" * 8
        elif rng.random() < 0.3:
            del changed[at:]
    return bytes(changed)


def damage_lines(text: str, rng: np.random.Generator) -> str:
    """What happens to a text in an editor."""
    lines = text.split("\n")
    for _ in range(int(rng.integers(1, 4))):
        at = int(rng.integers(len(lines)))
        how = rng.integers(9)
        if how == 0:
            lines.insert(at, lines[at])
        elif how == 1:
            del lines[at]
            lines = lines or [""]
        elif how == 2:
            other = int(rng.integers(len(lines)))
            lines[at], lines[other] = lines[other], lines[at]
        elif how == 3:
            lines[at] = " " * int(rng.integers(5)) + lines[at].lstrip()
        elif how == 4:
            head, colon, _ = lines[at].partition(":")
            lines[at] = head + colon + " " + pick(rng, WORDS)
        elif how == 5:
            lines[at] = lines[at] + pick(rng, WORDS)
        elif how == 6:
            lines[at] = lines[at].replace(":", "", 1)
        elif how == 7:
            lines = [*lines, *lines]
        else:
            letters = list(lines[at])
            if len(letters) > 1:
                i = int(rng.integers(len(letters) - 1))
                letters[i], letters[i + 1] = letters[i + 1], letters[i]
            lines[at] = "".join(letters)
    return "\n".join(lines)


def leaves_of(nest: Any, path: tuple[Any, ...] = ()) -> Iterator[tuple]:
    """The paths of all values in a nest, of whole sections too."""
    if path:
        yield path
    items: Any = ()
    if isinstance(nest, dict):
        items = nest.items()
    elif isinstance(nest, list):
        items = enumerate(nest)
    for key, value in items:
        yield from leaves_of(value, (*path, key))


def damage_nest(nest: Any, rng: np.random.Generator) -> tuple[Any, str]:
    """One value replaced, removed, scaled, or its key misspelled."""
    nest = copy.deepcopy(nest)
    path = pick(rng, list(leaves_of(nest)))
    inside = nest
    for key in path[:-1]:
        inside = inside[key]
    key = path[-1]
    value = inside[key]
    how = rng.random()
    number = isinstance(value, (int, float)) and not isinstance(value, bool)
    if how < 0.3 and number:
        inside[key] = value * pick(rng, (-1, 0, 1e3, 1e-3, 1e9, 0.5))
    elif how < 0.4:
        del inside[key]
    elif how < 0.5 and isinstance(inside, dict):
        inside[f"{key}x"] = inside.pop(key)
    elif how < 0.6 and isinstance(value, list):
        inside[key] = [*value, *value]
    else:
        inside[key] = pick(rng, VALUES)
    return nest, ".".join(map(str, path))


def as_yaml(nest: Any) -> str:
    """The text of a YAML file, by the faster writer if it is there."""
    dumper = getattr(yaml, "CSafeDumper", yaml.SafeDumper)
    return yaml.dump(nest, Dumper=dumper, sort_keys=False)


def write_yaml(folder: Path, rng: np.random.Generator, nest: Any) -> Any:
    """A damaged YAML file; by its values or by its text."""
    path = folder / "mine.yaml"
    if rng.random() < 0.6:
        changed, place = damage_nest(nest, rng)
        text = as_yaml(changed)
        path.write_text(text, encoding="utf-8", errors="replace")
        return path, place
    text = as_yaml(nest)
    if rng.random() < 0.8:
        text = damage_lines(text, rng)
        path.write_text(text, encoding="utf-8", errors="replace")
    else:
        path.write_bytes(damage_bytes(text.encode(), rng))
    return path, ""


# --- Inputs ------------------------------------------------------------------


# Of each kind one: direct, mirrored, and behind the wire.
SCENARIOS = ("drumming", "mirror", "robot")


@functools.cache
def full_scenario(name: str) -> dict[str, Any]:
    """Every value of a scenario, so that every field is damaged."""
    return config_values(load_scenario(name))


def damaged_scenario(folder: Path, rng: np.random.Generator) -> Any:
    name = pick(rng, SCENARIOS)
    if rng.random() < 0.6:
        return write_yaml(folder, rng, full_scenario(name))
    path = models_dir() / "scenarios" / f"{name}.yaml"
    return write_yaml(folder, rng, yaml.safe_load(path.read_text()))


@functools.cache
def parameter_nest(name: str) -> Any:
    return yaml.safe_load((models_dir() / name).read_text())


def parameter_reader(name: str, load: Callable[[Path], Any]) -> Reader:
    def write(folder: Path, rng: np.random.Generator) -> Any:
        return write_yaml(folder, rng, parameter_nest(name))

    def whole() -> tuple[str, bytes]:
        return "mine.yaml", yaml.safe_dump(parameter_nest(name)).encode()

    return Reader(name, whole, write, load)


@functools.cache
def good_log() -> str:
    with tempfile.TemporaryDirectory() as folder:
        problem = make_problem()
        log = make_log(problem, true_values(problem), seconds=3.0)
        return write_csv(Path(folder) / "log.csv", log).read_text()


def damaged_led(folder: Path, rng: np.random.Generator) -> tuple[Path, str]:
    """A log of a recording that was led by hand: columns q, not rq."""
    return damaged_csv(folder, rng, good_log().replace("rq5", "q5"))


def damaged_csv(
    folder: Path, rng: np.random.Generator, text: str | None = None
) -> tuple[Path, str]:
    path = folder / "mine.csv"
    whole = good_log() if text is None else text
    rows = [line.split(",") for line in whole.strip().split("\n")]
    columns = len(rows[0])
    at = int(rng.integers(1, len(rows)))
    column = int(rng.integers(columns))
    place = rows[0][column]
    how = rng.integers(10)
    if how == 0:
        rows[at][column] = str(pick(rng, WORDS))
    elif how == 1:
        factor = float(pick(rng, (1e3, 1e-3, -1.0, 0.0, 1e6)))
        for row in rows[1:]:
            row[column] = repr(float(row[column]) * factor)
    elif how == 2:
        for row in rows:
            del row[column]
    elif how == 3:
        rows.insert(at, list(rows[at]))
    elif how == 4:
        other = int(rng.integers(1, len(rows)))
        rows[at], rows[other] = rows[other], rows[at]
    elif how == 5:
        del rows[at : at + int(rng.integers(1, 60))]
    elif how == 6:
        rows[at][column] = repr(float(pick(rng, (-32768, 65535, 1e30))))
    elif how == 7:
        rows[at] = rows[at][:column]
    elif how == 8:
        rows[0][column] = str(pick(rng, ("t", "rq5", "", "\ufefft", "q 5")))
    text = "\n".join(map(",".join, rows))
    if how == 9:
        path.write_bytes(damage_bytes(text.encode(), rng))
        return path, ""
    path.write_text(text, encoding="utf-8", errors="replace")
    # What happens to rows happens to time.
    return path, "t" if how in (3, 4, 5, 7) else place


def taught(seed: int) -> Demonstration:
    rng = np.random.default_rng(seed)
    return Demonstration(
        t=np.arange(40) / 20.0,
        q=rng.normal(size=(40, 2)),
        joint_names=("waist_yaw", "waist_roll"),
        drum_xy=np.array([0.2, -0.1]),
        seed=seed,
        theta=rng.normal(size=30),
        task_parameter=np.array([0.3, -0.2]),
        reward=0.4,
        prototype=rng.uniform(size=(6, 9)),
        max_pull=9.0,
        scenario="drumming",
    )


@functools.cache
def good_bytes(kind: str) -> bytes:
    """A whole file of that kind."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "whole"
        if kind == "hdf5":
            write_demonstrations(path, [taught(0), taught(1)])
        else:
            with TrialStore(path) as store:
                for i in range(3):
                    spec = {"kind": "look", "xy": [0.1, 0.2], "seed": i}
                    arrays = {"theta": np.arange(4.0), "wave": np.ones((2, 3))}
                    store.plan("Looking", [spec])
                    store.put(spec, {"reward": 0.5, "success": True}, arrays)
            with sqlite3.connect(path) as db:
                db.execute("PRAGMA journal_mode=DELETE")
            db.close()
        return path.read_bytes()


def damaged_hdf5(folder: Path, rng: np.random.Generator) -> tuple[Path, str]:
    path = folder / "mine.h5"
    data = good_bytes("hdf5")
    if rng.random() < 0.5:
        path.write_bytes(damage_bytes(data, rng))
        return path, ""
    path.write_bytes(data)
    with h5py.File(path, "r+") as file:
        names: list[str] = []
        file.visit(names.append)
        name = pick(rng, [n for n in names if "/" in n])
        group = file[pick(rng, ["demonstrations/000000", "demonstrations"])]
        how = rng.integers(5)
        if how == 0:
            del file[name]
        elif how == 1:
            del file[name]
            file[name] = pick(
                rng,
                (3.0, "text", [1.0, np.nan], np.zeros((2, 2, 2)), np.zeros(0)),
            )
        elif how == 2 and len(group.attrs):
            del group.attrs[pick(rng, list(group.attrs))]
        elif how == 3 and len(group.attrs):
            attribute = pick(rng, list(group.attrs))
            group.attrs[attribute] = pick(rng, ("text", -1, np.nan, [1, 2]))
        else:
            file.attrs["format_version"] = pick(rng, (0, 99, "text", -1))
            name = ""
    return path, name.rpartition("/")[2]


def damaged_sqlite(folder: Path, rng: np.random.Generator) -> tuple[Path, str]:
    path = folder / "trials.sqlite"
    data = good_bytes("sqlite")
    if rng.random() < 0.4:
        path.write_bytes(damage_bytes(data, rng))
        return path, ""
    path.write_bytes(data)
    with sqlite3.connect(path) as db:
        tables = {
            name: [row[1] for row in db.execute(f"PRAGMA table_info({name})")]
            for (name,) in db.execute(
                "SELECT name FROM sqlite_master WHERE type = 'table'"
            )
        }
        table = pick(rng, sorted(tables))
        column = pick(rng, tables[table])
        how = rng.integers(4)
        try:
            if how == 0:
                value = pick(
                    rng, ("", "{", "[]", "3", None, b"\0\1", 1e308, "x")
                )
                db.execute(f"UPDATE {table} SET {column} = ?", (value,))
            elif how == 1:
                db.execute(f"DROP TABLE {table}")
            elif how == 2:
                db.execute(f"ALTER TABLE {table} RENAME {column} TO other")
            else:
                db.execute(f"ALTER TABLE {table} DROP COLUMN {column}")
        except sqlite3.Error:
            pass  # It does not let itself be damaged so.
    db.close()
    return path, f"{table}.{column}"


def read_sqlite(path: Path) -> None:
    with TrialStore(path, read_only=True) as store:
        store.phases()
        store.finished_at()
        for row in store.rows():
            store.spec(row.key)
            store.get(row.spec)


@functools.cache
def good_results() -> tuple[Any, ...]:
    return tuple(
        json.loads(json.dumps(make()))
        for make in (
            report_data.drum,
            report_data.mirror,
            report_data.toy,
            report_data.tune,
            report_data.demo,
        )
    )


def damaged_results(folder: Path, rng: np.random.Generator) -> Any:
    path = folder / "results.json"
    nest = pick(rng, good_results())
    if rng.random() < 0.7:
        changed, place = damage_nest(nest, rng)
        try:
            path.write_text(json.dumps(changed))
        except ValueError:
            # An int of more digits than Python writes.
            path.write_text("[]")
        return path, place
    path.write_bytes(damage_bytes(json.dumps(nest).encode(), rng))
    return path, ""


@functools.cache
def codec() -> PacketCodec:
    return PacketCodec(load_wire())


def damaged_packet(folder: Path, rng: np.random.Generator) -> Any:
    path = folder / "packet"
    n = codec().num_joints
    if rng.random() < 0.5:
        data = codec().write_sensors(np.zeros(n), np.full(2 * n, 2e5))
    else:
        data = codec().write_command(np.full(2 * n, 2e5))
    words = data.split()
    for _ in range(int(rng.integers(0, 3))):
        words[int(rng.integers(len(words)))] = pick(rng, WORDS).encode()
    data = b" ".join(words)
    path.write_bytes(damage_bytes(data, rng) if rng.random() < 0.5 else data)
    return path, ""


def read_packet(path: Path) -> None:
    data = path.read_bytes()
    for read in (codec().read_sensors, codec().read_command):
        try:
            for each in read(data):
                assert np.all(np.isfinite(each))
        except PacketError as error:
            told = error
        else:
            return
    raise InputError(f"{path.name}: {told}")


LIMITS = {"left_elbow_flexion": (0.0, 2.0)}

READERS = (
    Reader(
        "scenario",
        lambda: (
            "mine.yaml",
            yaml.safe_dump(full_scenario("mirror")).encode(),
        ),
        damaged_scenario,
        load_scenario,
        lambda path, out: ["look", str(path), "--out", str(out)],
    ),
    parameter_reader("pneumatics.yaml", load_parameters),
    parameter_reader("control.yaml", load_control),
    parameter_reader("sound.yaml", lambda path: load_sound_config(str(path))),
    parameter_reader("tuning.yaml", load_tuning),
    parameter_reader(
        "variation.yaml",
        lambda path: VariationConfig(parameters=str(path)).load(),
    ),
    parameter_reader("robot_wire.yaml", load_wire),
    parameter_reader("robot_pid.yaml", load_robot_controller),
    parameter_reader("robot_log.yaml", load_limits),
    Reader(
        "log",
        lambda: ("mine.csv", good_log().encode()),
        damaged_csv,
        lambda path: read_log(path, JOINT, CONTROLLER),
        lambda path, out: [
            *("identify", "--fit", str(path), "--test", str(path)),
            *("--out", str(out)),
        ],
    ),
    Reader(
        "led",
        lambda: ("mine.csv", good_log().replace("rq5", "q5").encode()),
        damaged_led,
        lambda path: from_robot_csv(
            path, LIMITS, joints=["x"] * 5 + list(LIMITS)
        ),
    ),
    Reader(
        "demonstrations",
        lambda: ("mine.h5", good_bytes("hdf5")),
        damaged_hdf5,
        read_demonstrations,
    ),
    Reader(
        "trials",
        lambda: ("trials.sqlite", good_bytes("sqlite")),
        damaged_sqlite,
        read_sqlite,
    ),
    Reader(
        "results",
        lambda: ("results.json", json.dumps(good_results()[0]).encode()),
        damaged_results,
        lambda path: read_folder(path.parent),
        lambda path, out: ["report", str(path.parent), "--out", str(out)],
    ),
    Reader(
        "packet",
        lambda: ("packet", codec().write_command(np.full(26, 2e5))),
        damaged_packet,
        read_packet,
    ),
)
# How many of a hundred inputs are of each kind.
SHARES = (24, 4, 3, 4, 3, 3, 3, 3, 2, 12, 6, 9, 8, 10, 6)

# The share of refused inputs that a command is shown too.
SHOWN = 0.05


# --- Trying ------------------------------------------------------------------


class TooLongError(BaseException):
    """An input that keeps its reader busy."""


def _too_long(*_: Any) -> None:
    raise TooLongError


def try_input(reader: Reader, seed: int, folder: Path) -> Outcome:
    """Damages, reads and judges one input."""
    rng = np.random.default_rng([seed, 18])
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir()
    path, damage = reader.write(folder, rng)
    before = sorted(folder.iterdir())
    start = time.monotonic()
    end, told = "read", ""
    signal.signal(signal.SIGALRM, _too_long)
    signal.setitimer(signal.ITIMER_REAL, LONGEST)
    try:
        # On the way to its one line, or to a number: the overflow of what was
        # not checked.
        with warnings.catch_warnings():
            warnings.simplefilter("error", RuntimeWarning)
            reader.read(path)
    except InputError as error:
        told = " ".join(str(error).split())
        end = "refused"
        # In one line of a length that can be read, by the name of the file.
        if path.stem not in told or len(told) > 1000:
            end = "failed"
        if end == "refused" and reader.command and rng.random() < SHOWN:
            end, told = show(reader.command, path, folder / "out", told)
    except (TooLongError, Exception, SystemExit) as error:
        where = traceback.extract_tb(error.__traceback__)[-1]
        end = "failed"
        told = f"{type(error).__name__}: {error!s:.200} in {where.name}"
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)
    if end == "refused" and sorted(folder.iterdir()) != before:
        end, told = "failed", f"something was written: {told}"
    seconds = time.monotonic() - start
    return Outcome(reader.kind, seed, damage, end, told, seconds)


def show(
    command: Callable[[Path, Path], list[str]],
    path: Path,
    out: Path,
    told: str,
) -> tuple[str, str]:
    """Whether the command refuses the input as its reader does."""
    import contextlib
    import io

    errors, output = io.StringIO(), io.StringIO()
    with (
        contextlib.redirect_stderr(errors),
        contextlib.redirect_stdout(output),
    ):
        code = affetto(command(path, out))
    line = errors.getvalue()
    if code == 2 and line.count("\n") == 1 and path.stem in line:
        return "refused", told
    return "failed", f"`{' '.join(command(path, out))}`: {code}, {line[:300]}"


def plan_inputs(
    count: int, seed: int, wanted: Collection[str] = ()
) -> list[tuple[int, int]]:
    """Which reader and which seed each input has, of the kinds wanted."""
    kinds = np.repeat(np.arange(len(READERS)), SHARES)
    kinds = np.array(
        [k for k in kinds if not wanted or READERS[k].kind in wanted]
    )
    np.random.default_rng(seed).shuffle(kinds)
    return [
        (int(kinds[i % len(kinds)]), seed * 1_000_000 + i) for i in range(count)
    ]


def _work(connection: Any, folder: Path) -> None:
    """Tries the inputs that come through a connection, in a folder."""
    while (task := connection.recv()) is not None:
        number, seed = task
        connection.send(try_input(READERS[number], seed, folder))


def try_inputs(
    count: int, seed: int, wanted: Collection[str] = ()
) -> Iterator[Outcome]:
    """Tries `count` inputs, of the kinds that are wanted or of all.

    They are read in a process of their own, for a library that reads damaged
    bytes may end it, or never come back: then the next one goes on.
    """
    with tempfile.TemporaryDirectory() as folder:
        yield from _try_inputs(
            plan_inputs(count, seed, wanted), Path(folder) / "one"
        )


def _try_inputs(
    tasks: list[tuple[int, int]], folder: Path
) -> Iterator[Outcome]:
    # Not a fork of a process with threads: this one has none.
    fork = multiprocessing.get_context("fork")
    worker: Any = None
    for task in tasks:
        if worker is None:
            mine, theirs = fork.Pipe()
            worker = fork.Process(
                target=_work, args=(theirs, folder), daemon=True
            )
            worker.start()
            theirs.close()
        start = time.monotonic()
        mine.send(task)
        told = "the process is still busy and was killed"
        if mine.poll(LONGEST + 2.0):
            try:
                yield mine.recv()
                continue
            except EOFError:
                worker.join()
                told = f"the process ended with {worker.exitcode}"
        worker.kill()
        worker.join()
        worker = None
        number, one = task
        seconds = time.monotonic() - start
        yield Outcome(READERS[number].kind, one, "", "failed", told, seconds)
    if worker is not None:
        mine.send(None)
        worker.join()


def main() -> int:
    """Prints failures as they come, and at last the counts; 1 if any failed."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--count", type=int, default=5000)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument(
        "--kinds",
        nargs="+",
        default=(),
        choices=[reader.kind for reader in READERS],
        help="kinds of input; all by default",
    )
    parser.add_argument("--all", action="store_true", help="print all as JSON")
    args = parser.parse_args()
    counts: dict[str, dict[str, int]] = {}
    slowest = 0.0
    named = known = 0
    for outcome in try_inputs(args.count, args.seed, args.kinds):
        row = counts.setdefault(
            outcome.kind, {"read": 0, "refused": 0, "failed": 0}
        )
        row[outcome.end] += 1
        slowest = max(slowest, outcome.seconds)
        if outcome.end == "refused" and outcome.damage:
            known += 1
            last = outcome.damage.rpartition(".")[2]
            section = outcome.damage.partition(".")[0]
            named += last in outcome.told or section in outcome.told
        if args.all or outcome.end == "failed":
            print(json.dumps(dataclasses.asdict(outcome)), flush=True)
    for kind, row in counts.items():
        print(f"{kind:16}", *(f"{n:5} {end}" for end, n in row.items()))
    total = {
        end: sum(row[end] for row in counts.values())
        for end in ("read", "refused", "failed")
    }
    print(f"{'all':16}", *(f"{n:5} {end}" for end, n in total.items()))
    print(f"damaged field named in {named} of {known} refusals")
    print(f"slowest {slowest:.2f} s")
    return 1 if total["failed"] else 0


if __name__ == "__main__":
    sys.exit(main())
