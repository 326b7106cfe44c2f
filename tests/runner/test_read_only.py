"""A study on a read-only disk, or one that a kill has left, can be read."""

import contextlib
import os
from pathlib import Path
import shutil
import sqlite3
import subprocess
import sys

import pytest

from drake_affetto.runner.read_only import ReadOnlyDatabase
from drake_affetto.runner.store import TrialStore

SPECS = [{"kind": "look", "seed": i} for i in range(3)]


@pytest.fixture
def study(tmp_path):
    """A store as a kill leaves it: rows in the log of writes alone."""
    whole, left = tmp_path / "whole", tmp_path / "left"
    whole.mkdir()
    left.mkdir()
    with TrialStore(whole / "trials.sqlite") as store:
        for spec in SPECS:
            store.put(spec, {"reward": 0.5}, {})
        for path in whole.iterdir():
            shutil.copyfile(path, left / path.name)
    assert (left / "trials.sqlite-wal").stat().st_size > 0
    return left / "trials.sqlite"


def rows(path: Path) -> int:
    with TrialStore(path, read_only=True) as store:
        assert [store.get(spec) for spec in SPECS] == [
            ({"reward": 0.5}, {})
        ] * len(SPECS)
        return len(store)


def refuse_files(monkeypatch, folder: Path) -> None:
    """Makes SQLite find that it cannot write in a folder.

    The tests may run as root, whom permissions do not stop.
    """
    connect = sqlite3.connect

    def refusing(database, *args, **more):
        name = str(database)
        if f"{folder}/" in name:
            error = sqlite3.OperationalError("unable to open database file")
            error.sqlite_errorcode = sqlite3.SQLITE_CANTOPEN
            return Refusing(error)
        return connect(database, *args, **more)

    monkeypatch.setattr(sqlite3, "connect", refusing)


class Refusing:
    def __init__(self, error: Exception) -> None:
        self.error = error

    def execute(self, *_: object) -> None:
        raise self.error

    def close(self) -> None:
        pass


def test_what_a_kill_left_is_read(study):
    assert rows(study) == len(SPECS)


def test_where_nothing_can_be_written_a_copy_is_read(study, monkeypatch):
    before = {path.name: path.read_bytes() for path in study.parent.iterdir()}
    refuse_files(monkeypatch, study.parent)
    found = ReadOnlyDatabase(study)
    assert found.path != study
    assert found.path.exists()
    with contextlib.closing(found):
        count = found.connection.execute("SELECT count(*) FROM trials")
        assert count.fetchone() == (len(SPECS),)
    assert not found.path.parent.exists()
    assert rows(study) == len(SPECS)
    after = {path.name: path.read_bytes() for path in study.parent.iterdir()}
    assert after == before


def test_its_trials_are_taken_over(study, monkeypatch, tmp_path):
    refuse_files(monkeypatch, study.parent)
    with TrialStore(tmp_path / "mine.sqlite") as mine:
        assert mine.merge(study) == len(SPECS)
        assert mine.get(SPECS[0]) == ({"reward": 0.5}, {})


def test_no_file_is_no_reason_for_a_copy(tmp_path):
    with pytest.raises(sqlite3.OperationalError):
        ReadOnlyDatabase(tmp_path / "none.sqlite")


def test_on_a_read_only_disk(study):
    """The same with a disk that really is, where one can be made."""
    program = (
        "from pathlib import Path; import sys; "
        "from drake_affetto.runner.store import TrialStore; "
        "store = TrialStore(Path(sys.argv[1]), read_only=True); "
        "print(len(store), len(list(store.rows())))"
    )
    script = 'mount --bind "$1" "$1" && mount -o remount,bind,ro "$1" || exit 9'
    script += '; touch "$1/x" 2>/dev/null && exit 8; exec "$2" -c "$3" "$4"'
    unshare = shutil.which("unshare")
    if unshare is None:
        pytest.skip("no unshare")
    words = [unshare, "--user", "--map-root-user", "--mount"]
    if os.geteuid() == 0:
        words = [unshare, "--mount"]
    done = subprocess.run(
        [
            *words,
            *("sh", "-c", script, "sh", str(study.parent)),
            *(sys.executable, program, str(study)),
        ],
        env={**os.environ, "PYTHONPATH": str(Path(__file__).parents[2])},
        capture_output=True,
        text=True,
        check=False,
    )
    if done.returncode == 9 or "unshare" in done.stderr:
        pytest.skip(f"no read-only disk can be made: {done.stderr}")
    assert done.stdout.split() == ["3", "3"], done.stderr
