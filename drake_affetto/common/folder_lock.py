"""Locks, so that two commands do not write into one study or file."""

from collections.abc import Iterator
import contextlib
import os
from pathlib import Path

from drake_affetto.common.errors import InputError
from drake_affetto.common.output import write_target


@contextlib.contextmanager
def lock_folder(
    folder: Path, command: str, *, wait: bool = False
) -> Iterator[None]:
    """Holds the lock of `folder` while the block runs.

    The operating system releases the lock however this process ends. Systems
    without file locks (other than Unix) are not protected.

    Args:
        folder: An existing folder; the file `.lock` is made in it.
        command: Name of the command, for the error message.
        wait: Whether to wait until no other process holds it.

    Raises:
        InputError: If another process holds the lock.
    """
    try:
        import fcntl
    except ImportError:
        yield
        return
    with (folder / ".lock").open("w") as file:
        try:
            fcntl.flock(file, fcntl.LOCK_EX | (0 if wait else fcntl.LOCK_NB))
        except OSError as error:
            raise InputError(
                f"another `{command}` is at work in {folder}"
            ) from error
        yield


@contextlib.contextmanager
def lock_file(path: Path, command: str) -> Iterator[None]:
    """Holds the lock of the file `path` while the block runs.

    The file need not exist. The lock is a hidden file beside it, which goes
    with the block, and is worth nothing where a killed process has left it.

    Args:
        path: A file in an existing folder.
        command: Name of the command, for the error message.

    Raises:
        InputError: If another process holds the lock, or the folder cannot be
            written.
    """
    try:
        import fcntl
    except ImportError:
        yield
        return
    path = write_target(path)
    beside = path.with_name(f".{path.name}.lock")
    while True:
        try:
            file = beside.open("w")
        except OSError as error:
            raise InputError(
                f"cannot write {path}: {error.strerror}"
            ) from error
        with file:
            try:
                fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except OSError as error:
                raise InputError(
                    f"another `{command}` is at work on {path}"
                ) from error
            # Who held the lock may have removed the file meanwhile.
            if not _is_open_file(file.fileno(), beside):
                continue
            try:
                yield
            finally:
                beside.unlink(missing_ok=True)
            return


def _is_open_file(descriptor: int, path: Path) -> bool:
    try:
        return os.path.samestat(os.fstat(descriptor), path.stat())
    except OSError:
        return False
