"""Damaged inputs of every kind end well, or in one line that names the file.

`tests/support/input_corpus.py` makes them. More of them on demand:

    cd tests && python -m support.input_corpus --count 5000 --seed 1
"""

import json
import os
from pathlib import Path
import re
import signal
import subprocess
import sys

import numpy as np
import pytest

from drake_affetto.common.errors import InputError
from support import input_corpus
from support.input_corpus import READERS, SHARES, Outcome, Reader

ROOT = Path(__file__).parents[1]
COUNT = 520

# What is stored in trials.sqlite has a test of its own.
KINDS = [reader.kind for reader in READERS if reader.kind != "trials"]


def run_corpus(*words: str) -> tuple[str, list[dict]]:
    """The printed counts, and the inputs that failed.

    In a process of its own: a library that reads damaged bytes may end it.
    """
    done = subprocess.run(
        [sys.executable, "-m", "support.input_corpus", *words],
        cwd=ROOT / "tests",
        env={**os.environ, "PYTHONPATH": str(ROOT)},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode in (0, 1), done.stderr
    lines = done.stdout.splitlines()
    failed = [json.loads(line) for line in lines if line.startswith("{")]
    assert (done.returncode == 1) == bool(failed)
    return done.stdout, failed


def test_five_hundred_damaged_inputs_end_well_or_in_one_line():
    printed, failed = run_corpus(
        "--count", str(COUNT), "--seed", "7", "--kinds", *KINDS
    )
    assert failed == []
    row = re.search(r"^all +(\d+) read +(\d+) refused", printed, re.MULTILINE)
    assert row is not None
    read, refused = map(int, row.groups())
    assert read + refused == COUNT
    # Damage that nobody notices would show nothing.
    assert refused > 0.5 * COUNT
    assert read > 0.05 * COUNT
    told = re.search(r"named in (\d+) of (\d+) refusals", printed)
    assert told is not None
    named, known = map(int, told.groups())
    assert named > 0.93 * known


def test_damaged_trials_are_refused():
    assert run_corpus("--count", "150", "--kinds", "trials")[1] == []


def test_every_kind_has_a_share():
    assert len(READERS) == len(SHARES)
    assert sum(SHARES) == 100


@pytest.mark.parametrize("reader", READERS, ids=lambda reader: reader.kind)
def test_what_is_not_damaged_is_read(reader, tmp_path):
    """Else all would be refused for another reason than the damage."""
    name, content = reader.whole()
    path = tmp_path / name
    path.write_bytes(content)
    reader.read(path)


def test_a_seed_gives_the_same_damage(tmp_path):
    for reader in READERS:
        if reader.kind in ("demonstrations", "trials"):
            continue  # Their files hold times and addresses.
        contents = []
        for _ in range(2):
            rng = np.random.default_rng(5)
            contents.append(reader.write(tmp_path, rng)[0].read_bytes())
        assert contents[0] == contents[1]


@pytest.mark.parametrize(
    ("read", "end"),
    [
        (lambda path: None, "read"),
        (lambda path: refuse(f"{path}: gain is 3"), "refused"),
        (lambda path: refuse("something does not fit"), "failed"),
        (lambda path: refuse(f"{path}: {'x' * 2000}"), "failed"),
        (lambda path: {}["key"], "failed"),
        (lambda path: sys.exit(3), "failed"),
        (lambda path: np.float64(1e308) * 10.0, "failed"),
    ],
)
def test_ends_are_told_apart(read, end, tmp_path):
    def write(folder, rng):
        path = folder / "mine.yaml"
        path.write_text("a: 1")
        return path, ""

    outcome = input_corpus.try_input(
        Reader("probe", dict, write, read), 1, tmp_path / "one"
    )
    assert isinstance(outcome, Outcome)
    assert outcome.end == end


def test_a_reader_that_writes_or_takes_too_long_has_failed(
    tmp_path, monkeypatch
):
    def write(folder, rng):
        return folder / "mine.yaml", ""

    def leave_half(path):
        path.with_name("half.json").write_text("{")
        refuse(f"{path} is damaged")

    def wait(path):
        while True:
            pass

    monkeypatch.setattr(input_corpus, "LONGEST", 0.2)
    for read, told in ((leave_half, "was written"), (wait, "TooLong")):
        reader = Reader("probe", dict, write, read)
        outcome = input_corpus.try_input(reader, 1, tmp_path / "one")
        assert outcome.end == "failed"
        assert told in outcome.told


def refuse(message: str) -> None:
    raise InputError(message)


def test_a_process_that_ends_or_hangs_is_a_failure_and_the_next_goes_on(
    monkeypatch,
):
    def write(folder, rng):
        return folder / "mine.yaml", ""

    def end(path):
        os._exit(3)

    def hang(path):
        signal.pthread_sigmask(signal.SIG_BLOCK, [signal.SIGALRM])
        while True:
            pass

    readers = (
        Reader("ends", dict, write, end),
        Reader("hangs", dict, write, hang),
        Reader("well", dict, write, lambda path: None),
    )
    monkeypatch.setattr(input_corpus, "READERS", readers)
    monkeypatch.setattr(input_corpus, "SHARES", (1, 1, 1))
    monkeypatch.setattr(input_corpus, "LONGEST", 1.0)
    found = {o.kind: o for o in input_corpus.try_inputs(3, 1)}
    assert found["well"].end == "read"
    assert found["ends"].told == "the process ended with 3"
    assert "still busy" in found["hangs"].told
