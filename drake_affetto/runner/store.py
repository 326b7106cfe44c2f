"""Finished trials in one SQLite file, so that nothing finished is lost.

A trial is keyed by everything that determines its result. A study that was
killed starts again and finds what it had; two half-finished studies of the
same trials join to a whole by copying rows.
"""

from collections.abc import Mapping, Sequence
import dataclasses
import io
import json
from pathlib import Path
import sqlite3
from typing import Any

import numpy as np

from drake_affetto.common.errors import InputError
from drake_affetto.common.fingerprint import text_digest
from drake_affetto.common.nested import map_leaves

_SCHEMA = """
CREATE TABLE IF NOT EXISTS trials (
    key TEXT PRIMARY KEY,
    kind TEXT NOT NULL,
    spec TEXT NOT NULL,
    result TEXT NOT NULL,
    arrays BLOB,
    finished_at TEXT NOT NULL
        DEFAULT (strftime('%Y-%m-%dT%H:%M:%fZ', 'now'))
);
CREATE TABLE IF NOT EXISTS plans (
    label TEXT NOT NULL,
    position INTEGER NOT NULL,
    key TEXT NOT NULL,
    PRIMARY KEY (label, position)
)
"""


def _key_values(value: Any) -> Any:
    """The plain data that stand for `value` in a key and a stored spec."""

    def leaf(value: Any) -> Any:
        if isinstance(value, (np.floating, np.integer, np.bool_)):
            return value.item()
        if value is None or isinstance(value, (str, int, float, bool)):
            return value
        # Arrays, estimators: the digest of their content.
        import joblib

        return f"{type(value).__name__}:{joblib.hash(value)}"

    return map_leaves(value, leaf)


def trial_key(spec: Mapping[str, Any]) -> str:
    """The key of the trial that `spec` determines."""
    text = json.dumps(_key_values(spec), sort_keys=True)
    return text_digest(text, length=None)


def pack_arrays(arrays: Mapping[str, np.ndarray]) -> bytes:
    """Arrays as the bytes of an npz archive."""
    buffer = io.BytesIO()
    np.savez_compressed(buffer, allow_pickle=False, **arrays)  # type: ignore[arg-type]
    return buffer.getvalue()


def unpack_arrays(data: bytes) -> dict[str, np.ndarray]:
    """The inverse of `pack_arrays`."""
    with np.load(io.BytesIO(data), allow_pickle=False) as archive:
        return {name: archive[name] for name in archive.files}


@dataclasses.dataclass(frozen=True)
class Phase:
    """The progress of one phase of a study.

    Attributes:
        label: Name of the phase.
        total: Number of its trials.
        done: Number of its finished trials.
    """

    label: str
    total: int
    done: int


def remove_store(path: Path) -> None:
    """Deletes a store, with the files that SQLite keeps beside it."""
    for old in (path, *(Path(f"{path}{s}") for s in ("-wal", "-shm"))):
        old.unlink(missing_ok=True)


class TrialStore:
    """One study's trials; safe against a kill at any moment."""

    def __init__(self, path: str | Path, *, read_only: bool = False):
        """Opens or makes the file.

        Args:
            path: Path of the file.
            read_only: Whether to only read an existing file, which another
                process may be writing.

        Raises:
            InputError: If it cannot be written or is not such a file.
        """
        self.path = Path(path)
        try:
            if read_only:
                uri = f"{self.path.resolve().as_uri()}?mode=ro"
                self._db = sqlite3.connect(uri, timeout=30.0, uri=True)
                self._db.execute("SELECT key FROM trials LIMIT 1")
                return
            self._db = sqlite3.connect(self.path, timeout=30.0)
            self._db.execute("PRAGMA journal_mode=WAL")
            self._db.execute("PRAGMA synchronous=NORMAL")
            self._db.executescript(_SCHEMA)
            self._db.commit()
        except sqlite3.Error as error:
            verb = "read" if read_only else "keep"
            raise InputError(
                f"cannot {verb} trials in {self.path}: {error}"
            ) from error

    def get(
        self, spec: Mapping[str, Any]
    ) -> tuple[dict[str, Any], dict[str, np.ndarray]] | None:
        """Result and arrays of a finished trial, or None."""
        row = self._db.execute(
            "SELECT result, arrays FROM trials WHERE key = ?",
            (trial_key(spec),),
        ).fetchone()
        if row is None:
            return None
        return json.loads(row[0]), unpack_arrays(row[1])

    def put(
        self,
        spec: Mapping[str, Any],
        result: Mapping[str, Any],
        arrays: Mapping[str, np.ndarray],
    ) -> None:
        """Keeps a finished trial.

        Raises:
            InputError: if the row cannot be written (a full disk, say); rows
                that were written before stay.
        """
        try:
            with self._db:
                self._db.execute(
                    "INSERT OR IGNORE INTO trials "
                    "(key, kind, spec, result, arrays) VALUES (?, ?, ?, ?, ?)",
                    (
                        trial_key(spec),
                        str(spec.get("kind", "")),
                        json.dumps(_key_values(spec), sort_keys=True),
                        json.dumps(_key_values(result), allow_nan=False),
                        pack_arrays(arrays),
                    ),
                )
        except sqlite3.Error as error:
            raise InputError(
                f"cannot write to {self.path}: {error}; "
                f"{len(self)} finished trials are kept"
            ) from error

    def plan(self, label: str, specs: Sequence[Mapping[str, Any]]) -> None:
        """Stores the trials of a phase, for `phases` to count.

        Raises:
            InputError: if it cannot be written.
        """
        keys = dict.fromkeys(trial_key(spec) for spec in specs)
        rows = [(label, i, key) for i, key in enumerate(keys)]
        try:
            with self._db:
                self._db.execute("DELETE FROM plans WHERE label = ?", (label,))
                self._db.executemany("INSERT INTO plans VALUES (?, ?, ?)", rows)
        except sqlite3.Error as error:
            raise InputError(f"cannot write to {self.path}: {error}") from error

    def phases(self) -> list[Phase]:
        """The phases planned so far, in their order."""
        rows = self._db.execute(
            "SELECT label, COUNT(*), COUNT(trials.key) FROM plans "
            "LEFT JOIN trials USING (key) GROUP BY label ORDER BY "
            "MIN(plans.rowid)"
        )
        return [Phase(*row) for row in rows]

    def merge(self, path: str | Path) -> int:
        """Takes over the finished trials of another study's file.

        Trials have one key wherever they ran, so the halves of a study that
        ran on two machines make up the whole one.

        Returns:
            How many trials were new.

        Raises:
            InputError: if there is no such file, or it holds no trials.
        """
        other = Path(path)
        if not other.is_file():
            raise InputError(f"no file of trials: {other}")
        columns = "key, kind, spec, result, arrays, finished_at"
        before = len(self)
        try:
            self._db.execute("ATTACH DATABASE ? AS other", (str(other),))
            try:
                with self._db:
                    self._db.execute(
                        f"INSERT OR IGNORE INTO trials ({columns}) "
                        f"SELECT {columns} FROM other.trials"
                    )
            finally:
                self._db.execute("DETACH DATABASE other")
        except sqlite3.Error as error:
            raise InputError(
                f"cannot take trials over from {other}: {error}"
            ) from error
        return len(self) - before

    def finished_at(self) -> list[str]:
        """When each trial was finished, UTC in ISO 8601, earliest first."""
        rows = self._db.execute(
            "SELECT finished_at FROM trials ORDER BY finished_at"
        )
        return [row[0] for row in rows]

    def __len__(self) -> int:
        return self._db.execute("SELECT COUNT(*) FROM trials").fetchone()[0]

    def close(self) -> None:
        """Closes the file."""
        self._db.close()

    def __enter__(self) -> "TrialStore":
        return self

    def __exit__(self, *_: object) -> None:
        self.close()
