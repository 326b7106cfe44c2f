"""Who made what in an output folder: no command overwrites another's work.

A folder of results belongs to the command that made it first. A hidden file in
it says so, and which single files other commands have put there since.

Nothing here imports more than the standard library.
"""

import contextlib
import json
from pathlib import Path
from typing import Any

from drake_affetto.common.errors import InputError
from drake_affetto.common.output import (
    prepare_output,
    remove_leftovers,
    write_json,
    write_target,
)

MARK = ".affetto.json"
"""File that says who made what, in its folder."""

# The command of a study whose results do not bear its name.
_COMMANDS = {"scenarios": "mirror", "conditions": "when_transfer_wins.py"}

# Files that a command puts into folders of others, since before there were
# marks.
_GUESTS = {"report.html": "report"}


def claim_folder(path: str | Path, command: str) -> Path:
    """Makes the folder `path` for a command's results.

    Args:
        path: The folder.
        command: Name of the command, such as "drum".

    Returns:
        The folder, with a leading `~` expanded.

    Raises:
        InputError: If another command's results are in it, or it cannot be
            written.
    """
    folder = prepare_output(path)
    mark = _read_mark(folder)
    owner = mark.get("command")
    if owner is None:
        write_json(folder / MARK, {**mark, "command": command})
    elif owner != command:
        raise InputError(
            f"--out: {path} holds what {_said(owner)} made; name another folder"
        )
    remove_leftovers(folder)
    return folder


def check_file(path: str | Path, command: str) -> Path:
    """Sees whether a command may write a file, and leaves no trace of it.

    For work that may find its input unfit before it writes anything.

    Args:
        path: The file.
        command: Name of the command, such as "export".

    Returns:
        The file, with a leading `~` expanded.

    Raises:
        InputError: If it is a folder, or another command made the file as a
            part of its results.
    """
    path = Path(path).expanduser()
    if not path.name or path.is_dir():
        raise InputError(f"{path} is a folder, expected the name of a file")
    _check_maker(path, _read_mark(write_target(path).parent), command)
    return path


def claim_file(path: str | Path, command: str) -> Path:
    """Makes the folder of a file that a command will write.

    Args:
        path: The file.
        command: Name of the command, such as "export".

    Returns:
        The file, with a leading `~` expanded.

    Raises:
        InputError: If it is a folder, another command made the file as a part
            of its results, or its folder cannot be written.
    """
    path = check_file(path, command)
    target = write_target(path)
    prepare_output(target.parent)
    mark = _read_mark(target.parent)
    if mark.get("command") is None:
        return path
    if _check_maker(path, mark, command) != command:
        mark["files"] = {**mark.get("files", {}), target.name: command}
        write_json(target.parent / MARK, mark)
    return path


def _check_maker(path: Path, mark: dict[str, Any], command: str) -> str | None:
    """The command that is known to make the file, if any is.

    Raises:
        InputError: If it is another one's.
    """
    owner = mark.get("command")
    if owner is None:
        return None
    target = write_target(path)
    files = {**_GUESTS, **mark.get("files", {})}
    maker = files.get(target.name, owner)
    if target.exists() and maker != command:
        raise InputError(
            f"{path} is a file that {_said(maker)} made; name another file"
        )
    return files.get(target.name)


def _said(command: str) -> str:
    """A command as one calls it; those of analysis are scripts."""
    return f"`{command}`" if "." in command else f"`affetto {command}`"


def _read_mark(folder: Path) -> dict[str, Any]:
    """The mark of a folder; of older ones what its results tell."""
    with contextlib.suppress(OSError, ValueError, RecursionError):
        mark = json.loads((folder / MARK).read_bytes())
        if isinstance(mark, dict) and isinstance(mark.get("files", {}), dict):
            return mark
    with contextlib.suppress(OSError, ValueError, RecursionError):
        results = json.loads((folder / "results.json").read_bytes())
        study = results.get("study") if isinstance(results, dict) else None
        if isinstance(study, str):
            return {"command": _COMMANDS.get(study, study)}
    return {}
