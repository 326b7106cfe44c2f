"""Finished trials in one SQLite file, so that nothing finished is lost.

A trial is keyed by everything that determines its result. A study that was
killed starts again and finds what it had; two half-finished studies of the
same trials join to a whole by copying rows. The arrays of a spec are kept too,
each once, so that a trial can be run again from its row.
"""

from collections.abc import Iterator, Mapping, Sequence
import contextlib
import dataclasses
from datetime import datetime
import hashlib
import json
from pathlib import Path
import re
import sqlite3
from typing import Any

import numpy as np

from drake_affetto.common.errors import InputError, one_line, require
from drake_affetto.common.fingerprint import text_digest
from drake_affetto.common.nested import leaves, map_leaves
from drake_affetto.runner.arrays import pack_arrays, unpack_arrays
from drake_affetto.runner.read_only import ReadOnlyDatabase

FORMAT_VERSION = 1
"""Version of the file's tables, increased when they change."""

# What tells SQLite's files of this program from others: "AFFT".
_APPLICATION = 0x41464654

_SCHEMA = """
CREATE TABLE IF NOT EXISTS trials (
    key TEXT PRIMARY KEY,
    kind TEXT NOT NULL,
    spec TEXT NOT NULL,
    result TEXT NOT NULL,
    arrays BLOB,
    finished_at TEXT NOT NULL
        DEFAULT (strftime('%Y-%m-%dT%H:%M:%fZ', 'now')),
    digest TEXT
);
CREATE TABLE IF NOT EXISTS plans (
    label TEXT NOT NULL,
    position INTEGER NOT NULL,
    key TEXT NOT NULL,
    PRIMARY KEY (label, position)
);
CREATE TABLE IF NOT EXISTS inputs (
    name TEXT PRIMARY KEY,
    arrays BLOB NOT NULL
)
"""

# What reading a damaged file may raise.
_DAMAGE = (sqlite3.Error, UnicodeDecodeError, MemoryError, OverflowError)

# Columns that each table has since version 0.1.0, which had no inputs.
_COLUMNS = {
    "trials": {"key", "kind", "spec", "result", "arrays", "finished_at"},
    "plans": {"label", "position", "key"},
    "inputs": {"name", "arrays"},
}


def _content_name(value: Any) -> str:
    """An array's or estimator's type and the digest of its content."""
    import joblib

    return f"{type(value).__name__}:{joblib.hash(value)}"


def _key_values(value: Any) -> Any:
    """The plain data that stand for `value` in a key and a stored spec."""

    def leaf(value: Any) -> Any:
        if isinstance(value, (np.floating, np.integer, np.bool_)):
            return value.item()
        if value is None or isinstance(value, (str, int, float, bool)):
            return value
        return _content_name(value)

    return map_leaves(value, leaf)


# What joblib's hash looks like.
_DIGEST = re.compile("[0-9a-f]{32}")


def _object(text: str, where: str) -> dict[str, Any]:
    """The JSON object in `text`; raises InputError naming `where`."""
    try:
        plain = json.loads(text)
    except (ValueError, TypeError, RecursionError) as error:
        raise InputError(f"{where} is damaged: {one_line(error)}") from error
    require(isinstance(plain, dict), where, plain, "an object")
    return plain


def _determining(value: Any) -> Any:
    """`value` without the entries whose names begin with "@"."""
    if isinstance(value, Mapping):
        return {
            name: _determining(each)
            for name, each in value.items()
            if not str(name).startswith("@")
        }
    if isinstance(value, (list, tuple)):
        return [_determining(each) for each in value]
    return value


def trial_key(spec: Mapping[str, Any]) -> str:
    """The key of the trial that `spec` determines.

    Entries whose names begin with "@", anywhere in it, are kept with the trial
    but do not determine it: where something was found, for instance.
    """
    text = json.dumps(_key_values(_determining(spec)), sort_keys=True)
    return text_digest(text, length=None)


def _result_digest(result: str, arrays: bytes) -> str:
    """The digest that is kept of a row's result, to tell damage."""
    return hashlib.sha256(result.encode() + b"\0" + arrays).hexdigest()[:16]


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


@dataclasses.dataclass(frozen=True)
class TrialRow:
    """One finished trial as it is stored.

    Attributes:
        key: Its key, see `trial_key`.
        kind: Kind of trial.
        spec: What determined it; names stand for arrays and estimators.
        result: Its result, without arrays.
        finished_at: When it was finished, UTC in ISO 8601.
        phase: Name of the first phase that planned it; None if none did.
    """

    key: str
    kind: str
    spec: dict[str, Any]
    result: dict[str, Any]
    finished_at: str
    phase: str | None


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
        self._digests: bool | None = None
        self._read: ReadOnlyDatabase | None = None
        verb = "read" if read_only else "keep"
        try:
            if read_only:
                self._read = ReadOnlyDatabase(self.path)
                self._db = self._read.connection
                self._check_format("main", self.path)
                self._db.execute("SELECT key FROM trials LIMIT 1")
                return
            self._db = sqlite3.connect(self.path, timeout=30.0)
            # Before anything is written: it may be another program's file.
            self._check_format("main", self.path)
            self._db.execute("PRAGMA journal_mode=WAL")
            self._db.execute("PRAGMA synchronous=NORMAL")
            self._db.executescript(_SCHEMA)
            if "digest" not in self._columns("main", "trials"):
                self._db.execute("ALTER TABLE trials ADD COLUMN digest TEXT")
            if self._pragma("main", "application_id") == 0:
                self._db.execute(f"PRAGMA application_id = {_APPLICATION}")
                self._db.execute(f"PRAGMA user_version = {FORMAT_VERSION}")
            self._db.commit()
        except (*_DAMAGE, OSError) as error:
            raise InputError(
                f"cannot {verb} trials in {self.path}: {one_line(error)}"
            ) from error

    def _check_format(self, schema: str, path: Path) -> None:
        """Raises InputError for a file of another program or later version."""
        application = self._pragma(schema, "application_id")
        version = self._pragma(schema, "user_version")
        rows = self._db.execute(
            f"SELECT name FROM {schema}.sqlite_master WHERE type = 'table' "
            "AND name NOT LIKE 'sqlite%'"
        )
        tables = {name for (name,) in rows}
        if application not in (0, _APPLICATION) or (
            tables and "trials" not in tables
        ):
            raise InputError(f"{path} is another program's file, not of trials")
        if application == _APPLICATION and version > FORMAT_VERSION:
            raise InputError(
                f"{path} was written by a later version of drake_affetto: its "
                f"format is {version}, this version knows {FORMAT_VERSION}"
            )
        for table, columns in _COLUMNS.items():
            missing = columns - self._columns(schema, table)
            if table in tables and missing:
                raise InputError(
                    f"{path} is damaged: its table {table} has no column "
                    f"{', '.join(sorted(missing))}"
                )

    def _pragma(self, schema: str, name: str) -> int:
        return self._db.execute(f"PRAGMA {schema}.{name}").fetchone()[0]

    def _columns(self, schema: str, table: str) -> set[str]:
        rows = self._db.execute(f"PRAGMA {schema}.table_info({table})")
        return {row[1] for row in rows}

    @contextlib.contextmanager
    def _reading(self) -> Iterator[None]:
        """Tells what SQLite cannot read in one line that names the file."""
        try:
            yield
        except _DAMAGE as error:
            raise InputError(
                f"cannot read trials in {self.path}: {one_line(error)}"
            ) from error

    def verify(self) -> None:
        """Reads the whole file, so that damage shows before work starts.

        Raises:
            InputError: For a damaged page or row.
        """
        with self._reading():
            (found,) = self._db.execute("PRAGMA quick_check(1)").fetchone()
            if found != "ok":
                raise InputError(f"{self.path} is damaged: {one_line(found)}")
            keys = self._db.execute("SELECT key FROM trials").fetchall()
        for (key,) in keys:
            self._require_text("key", key, key)
            self._result(key)

    def _require_text(self, column: str, value: Any, key: Any) -> None:
        where = f"{self.path}: trial {key}: {column}"
        require(isinstance(value, str), where, value, "a text")

    def get(
        self, spec: Mapping[str, Any]
    ) -> tuple[dict[str, Any], dict[str, np.ndarray]] | None:
        """Result and arrays of a finished trial, or None.

        Args:
            spec: All that determines the trial.

        Raises:
            InputError: If its row is damaged.
        """
        row = self._result(trial_key(spec))
        if row is None:
            return None
        result, arrays, where = row
        try:
            return result, unpack_arrays(arrays)
        except InputError as error:
            raise InputError(
                f"{where}: its arrays are damaged: {one_line(error)}"
            ) from error

    def _result(self, key: str) -> tuple[dict[str, Any], bytes, str] | None:
        """Result and packed arrays of a row, and its name in errors."""
        where = f"{self.path}: trial {key}"
        digest = "digest" if self._has_digest() else "NULL"
        with self._reading():
            row = self._db.execute(
                f"SELECT result, arrays, {digest} FROM trials WHERE key = ?",
                (key,),
            ).fetchone()
        if row is None:
            return None
        text, arrays, digest = row
        result = _object(text, f"{where}: its result")
        if not isinstance(arrays, bytes):
            raise InputError(f"{where}: its arrays are missing")
        if digest is not None and digest != _result_digest(text, arrays):
            raise InputError(
                f"{where} is damaged: its result is not the one that was "
                "written"
            )
        return result, arrays, where

    def _has_digest(self) -> bool:
        """Whether results have digests; in version 0.1.0 they have none."""
        if self._digests is None:
            self._digests = "digest" in self._columns("main", "trials")
        return self._digests

    def put(
        self,
        spec: Mapping[str, Any],
        result: Mapping[str, Any],
        arrays: Mapping[str, np.ndarray],
    ) -> None:
        """Keeps a finished trial.

        Args:
            spec: All that determines the trial.
            result: What came of it.
            arrays: Arrays that belong to the result.

        Raises:
            InputError: if the row cannot be written (a full disk, say); rows
                that were written before stay.
        """
        text = json.dumps(_key_values(result), allow_nan=False)
        packed = pack_arrays(arrays)
        try:
            with self._db:
                self._db.execute(
                    "INSERT OR IGNORE INTO trials "
                    "(key, kind, spec, result, arrays, digest) "
                    "VALUES (?, ?, ?, ?, ?, ?)",
                    (
                        trial_key(spec),
                        str(spec.get("kind", "")),
                        json.dumps(_key_values(spec), sort_keys=True),
                        text,
                        packed,
                        _result_digest(text, packed),
                    ),
                )
                self._db.executemany(
                    "INSERT OR IGNORE INTO inputs VALUES (?, ?)",
                    (
                        (_content_name(leaf), pack_arrays({"value": leaf}))
                        for leaf in leaves(spec)
                        if isinstance(leaf, np.ndarray)
                    ),
                )
        except _DAMAGE as error:
            kept = ""
            with contextlib.suppress(InputError):
                kept = f"; {len(self)} finished trials are kept"
            raise InputError(
                f"cannot write to {self.path}: {one_line(error)}{kept}"
            ) from error

    def plan(self, label: str, specs: Sequence[Mapping[str, Any]]) -> None:
        """Stores the trials of a phase, for `phases` to count.

        Args:
            label: Name of the phase.
            specs: All that determines each trial.

        Raises:
            InputError: if it cannot be written.
        """
        keys = dict.fromkeys(trial_key(spec) for spec in specs)
        rows = [(label, i, key) for i, key in enumerate(keys)]
        try:
            with self._db:
                self._db.execute("DELETE FROM plans WHERE label = ?", (label,))
                self._db.executemany("INSERT INTO plans VALUES (?, ?, ?)", rows)
        except _DAMAGE as error:
            raise InputError(
                f"cannot write to {self.path}: {one_line(error)}"
            ) from error

    def outdated(
        self, label: str, specs: Sequence[Mapping[str, Any]]
    ) -> tuple[int, dict[str, Any]]:
        """The finished trials of a phase's last plan that it has no more.

        Args:
            label: Name of the phase, which is not planned anew yet.
            specs: What is planned now.

        Returns:
            Their number, and the spec of one of them, {} if there are none.

        Raises:
            InputError: If the file cannot be read.
        """
        wanted = {trial_key(spec) for spec in specs}
        with self._reading():
            found = self._db.execute(
                "SELECT key, spec FROM plans JOIN trials USING (key) "
                "WHERE label = ?",
                (label,),
            ).fetchall()
        old = [(key, spec) for key, spec in found if key not in wanted]
        if not old:
            return 0, {}
        key, text = old[0]
        return len(old), _object(text, f"{self.path}: trial {key}: spec")

    def phases(self) -> list[Phase]:
        """The phases planned so far, in their order."""
        with self._reading():
            rows = self._db.execute(
                "SELECT label, COUNT(*), COUNT(trials.key) FROM plans "
                "LEFT JOIN trials USING (key) GROUP BY label ORDER BY "
                "MIN(plans.rowid)"
            ).fetchall()
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
        with TrialStore(other, read_only=True) as checked:
            checked.verify()
            before = len(self)
            try:
                self._take_over(checked)
            except _DAMAGE as error:
                raise InputError(
                    f"cannot take trials over from {other}: {one_line(error)}"
                ) from error
        return len(self) - before

    def _take_over(self, other: "TrialStore") -> None:
        """Copies the rows of an open store that this one has not."""
        columns = "key, kind, spec, result, arrays, finished_at"
        if other._has_digest():
            columns += ", digest"
        path = other.path if other._read is None else other._read.path
        self._db.execute("ATTACH DATABASE ? AS other", (str(path),))
        try:
            with self._db:
                self._db.execute(
                    f"INSERT OR IGNORE INTO trials ({columns}) "
                    f"SELECT {columns} FROM other.trials"
                )
                if self._has_inputs("other"):
                    self._db.execute(
                        "INSERT OR IGNORE INTO inputs "
                        "SELECT name, arrays FROM other.inputs"
                    )
        finally:
            self._db.execute("DETACH DATABASE other")

    def rows(self) -> Iterator[TrialRow]:
        """All finished trials, in the order in which they were finished.

        Raises:
            InputError: If a row is damaged.
        """
        with self._reading():
            for key, kind, spec, result, at, phase in self._db.execute(
                "SELECT key, kind, spec, result, finished_at, (SELECT label "
                "FROM plans WHERE plans.key = trials.key ORDER BY rowid "
                "LIMIT 1) FROM trials ORDER BY finished_at, rowid"
            ):
                where = f"{self.path}: trial {key}"
                self._require_text("key", key, key)
                self._require_text("kind", kind, key)
                yield TrialRow(
                    key,
                    kind,
                    _object(spec, f"{where}: spec"),
                    _object(result, f"{where}: result"),
                    at,
                    phase,
                )

    def spec(self, key: str) -> tuple[str, dict[str, Any]]:
        """The whole key and the spec of a finished trial, with its arrays.

        Args:
            key: The trial's key, or as much of it as no other trial's has.

        Raises:
            InputError: If no trial, or several, have such a key, or an input
                is not kept: only arrays are, and only since they are.
        """
        with self._reading():
            found = self._db.execute(
                "SELECT key, spec FROM trials WHERE substr(key, 1, ?) = ?",
                (len(key), key),
            ).fetchall()
            if len(found) != 1 or not key:
                raise InputError(
                    f"key is {key!r}, expected that of one trial in "
                    f"{self.path}; {len(found)} fit"
                )
            whole, text = found[0]
            where = f"{self.path}: trial {whole}"
            stored = _object(text, f"{where}: spec")
            if trial_key(stored) != whole:
                raise InputError(f"{where}: its spec is damaged")
            spec = map_leaves(stored, lambda leaf: self._input(leaf, where))
        return whole, spec

    def _input(self, leaf: Any, where: str) -> Any:
        """The array that a text in a stored spec stands for; others stay."""
        name, _, digest = str(leaf).partition(":")
        if not (isinstance(leaf, str) and _DIGEST.fullmatch(digest)):
            return leaf
        row = None
        if self._has_inputs():
            row = self._db.execute(
                "SELECT arrays FROM inputs WHERE name = ?", (leaf,)
            ).fetchone()
        if row is None:
            raise InputError(f"{where} was run with a {name} that is not kept")
        try:
            return unpack_arrays(row[0])["value"]
        except (InputError, KeyError, TypeError) as error:
            raise InputError(f"{where}: its {name} is damaged") from error

    def _has_inputs(self, schema: str = "main") -> bool:
        """Whether a file keeps inputs; those of version 0.1.0 do not."""
        return bool(
            self._db.execute(
                f"SELECT 1 FROM {schema}.sqlite_master WHERE name = 'inputs'"
            ).fetchone()
        )

    def finished_at(self) -> list[str]:
        """When each trial was finished, UTC in ISO 8601, earliest first.

        Raises:
            InputError: If one of them is no time.
        """
        with self._reading():
            rows = self._db.execute(
                "SELECT key, finished_at FROM trials ORDER BY finished_at"
            ).fetchall()
        for key, at in rows:
            try:
                datetime.fromisoformat(at)
            except (TypeError, ValueError) as error:
                raise InputError(
                    f"{self.path}: trial {key}: finished_at is {at!r}, "
                    "expected a time in ISO 8601"
                ) from error
        return [at for _, at in rows]

    def __len__(self) -> int:
        with self._reading():
            query = self._db.execute("SELECT COUNT(*) FROM trials")
            return query.fetchone()[0]

    def close(self) -> None:
        """Closes the file."""
        (self._read or self._db).close()

    def __enter__(self) -> "TrialStore":
        return self

    def __exit__(self, *_: object) -> None:
        self.close()
