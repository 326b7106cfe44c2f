"""Output folders and files that are either whole or not there.

Nothing here imports more than the standard library: a command checks its
output folder before it imports anything heavy.
"""

from collections.abc import Iterator
import contextlib
import json
import math
import os
from pathlib import Path
import re
import secrets
import time
from typing import Any

from drake_affetto.common.errors import InputError
from drake_affetto.common.typed_json import to_plain

# A study's finished trials, in its folder.
STORE = "trials.sqlite"


def prepare_output(path: str | Path) -> Path:
    """Makes the folder `path` with its parents, and sees that it takes files.

    Returns:
        The folder, with a leading `~` expanded.

    Raises:
        InputError: if it cannot be made or written. No folder that was made on
            the way is then left behind.
    """
    made: list[Path] = []
    try:
        if not str(path):
            raise InputError("the output folder has no name")
        folder = Path(path).expanduser()
        missing = [p for p in (folder, *folder.parents) if not p.exists()]
        for each in reversed(missing):
            each.mkdir(exist_ok=True)
            made.append(each)
        if not folder.is_dir():
            raise InputError(f"the output folder {path} is a file")
        # Permission bits do not tell (of root, of read-only mounts); a file
        # does.
        probe = _sibling(folder / "probe.tmp")
        os.close(os.open(probe, os.O_CREAT | os.O_EXCL | os.O_WRONLY))
        probe.unlink()
    except (OSError, ValueError, RuntimeError) as error:
        for each in reversed(made):
            with contextlib.suppress(OSError):
                each.rmdir()
        if isinstance(error, InputError):
            raise
        raise InputError(
            f"the output folder {path} cannot be written: {_reason(error)}"
        ) from error
    return folder


@contextlib.contextmanager
def output_folder(path: str | Path) -> Iterator[Path]:
    """The folder `path`, made with its parents, for a block that checks more.

    Where the block raises InputError, folders that were made for it and are
    empty do not stay.

    Raises:
        InputError: if it cannot be made or written.
    """
    wanted = Path(path).expanduser()
    missing = [p for p in (wanted, *wanted.parents) if not p.exists()]
    try:
        yield prepare_output(path)
    except InputError:
        for each in missing:
            with contextlib.suppress(OSError):
                each.rmdir()
        raise


def write_target(path: str | Path) -> Path:
    """The file that is written where `path` is: a symbolic link's target."""
    path = Path(path)
    return Path(os.path.realpath(path)) if path.is_symlink() else path


@contextlib.contextmanager
def atomic_path(path: str | Path) -> Iterator[Path]:
    """A path to write to, which becomes `path` where the block succeeds.

    It stands in the folder of `path`, has its suffix (many writers go by that)
    and is removed where the block fails; `path` then stays as it was. Where
    `path` is a symbolic link, its target is written.

    Raises:
        InputError: for an operating system's error, in the block or in the
            renaming: no such folder, no permission, a full disk.
    """
    path = write_target(path)
    fresh = _sibling(path)
    try:
        yield fresh
        os.replace(fresh, path)
    except OSError as error:
        raise InputError(f"cannot write {path}: {_reason(error)}") from error
    finally:
        with contextlib.suppress(OSError):
            fresh.unlink()


def write_bytes_atomic(path: str | Path, data: bytes) -> None:
    """Writes `data` to `path`, whole or not at all.

    Raises:
        InputError: if it cannot be written.
    """
    with atomic_path(path) as fresh, fresh.open("xb") as file:
        file.write(data)
        file.flush()
        os.fsync(file.fileno())


def write_text_atomic(path: str | Path, text: str) -> None:
    """Writes `text` to `path` in UTF-8, whole or not at all.

    Raises:
        InputError: if it cannot be written.
    """
    write_bytes_atomic(path, text.encode("utf-8"))


def write_json(path: str | Path, obj: Any) -> None:
    """Writes `obj` to `path` as JSON, whole or not at all.

    Dataclasses become objects, numpy's arrays and scalars become lists and
    numbers. Keys keep their order, and floats are written so that reading
    gives back the same number.

    Raises:
        InputError: if `path` cannot be written.
        ValueError: for a number that is not finite, which JSON cannot hold;
            the message names its place.
        TypeError: for what has no form in JSON.
    """
    plain = to_plain(obj)
    _require_finite(plain, "")
    text = json.dumps(plain, indent=2, allow_nan=False, ensure_ascii=False)
    write_text_atomic(path, text + "\n")


def _require_finite(plain: Any, where: str) -> None:
    if isinstance(plain, float) and not math.isfinite(plain):
        raise ValueError(f"{where or 'the value'} is {plain}: not for JSON")
    if isinstance(plain, dict):
        for key, value in plain.items():
            _require_finite(value, f"{where}.{key}".lstrip("."))
    elif isinstance(plain, list):
        for i, value in enumerate(plain):
            _require_finite(value, f"{where}[{i}]")


def _sibling(path: Path) -> Path:
    """A new, hidden name beside `path`, with its suffix."""
    token = secrets.token_hex(4)
    return path.with_name(f".{path.stem[:100]}.{token}{path.suffix}")


_SIBLING = re.compile(r"\..+\.[0-9a-f]{8}(\.[^.]*)?")

# A writer that is at work has touched its file since, s.
_LONG_AGO = 3600.0


def remove_leftovers(folder: Path) -> None:
    """Removes from a folder of results what killed writers have left in it.

    What may be written at this moment, by another command, stays.
    """
    for path in folder.glob(".*"):
        with contextlib.suppress(OSError):
            old = time.time() - path.lstat().st_mtime > _LONG_AGO
            if old and _SIBLING.fullmatch(path.name) and path.is_file():
                path.unlink()


def _reason(error: Exception) -> str:
    """What went wrong, without a number and the path once more."""
    return getattr(error, "strerror", None) or str(error)
