"""A lock on a folder, so that two commands do not write into one study."""

from collections.abc import Iterator
import contextlib
from pathlib import Path

from drake_affetto.common.errors import InputError


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
