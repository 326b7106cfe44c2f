"""`affetto status`: how far a study has come, while it runs or after."""

import argparse
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any

from drake_affetto.cli.options import STORE
from drake_affetto.common.errors import InputError

if TYPE_CHECKING:
    from drake_affetto.runner.store import TrialStore

# The rate is that of the last so many trials.
_RECENT = 30


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declares the command's options."""
    parser.add_argument(
        "folders", metavar="DIR", nargs="+", help="folder of a study"
    )


def run(args: argparse.Namespace) -> int:
    """Prints how far the studies are; returns the exit code.

    Raises:
        InputError: for a folder without a study.
    """
    paths = [Path(folder) / STORE for folder in args.folders]
    for path in paths:
        if not path.is_file():
            raise InputError(f"there is no study in {path.parent}: no {STORE}")

    from rich.console import Console

    from drake_affetto.runner.store import TrialStore

    console = Console()
    for path in paths:
        with TrialStore(path, read_only=True) as store:
            _print(path.parent, store, console)
    return 0


def rate(finished_at: list[str]) -> float | None:
    """Trials a second over the last of them; None from fewer than two."""
    recent = [datetime.fromisoformat(time) for time in finished_at[-_RECENT:]]
    if len(recent) < 2:
        return None
    seconds = (recent[-1] - recent[0]).total_seconds()
    return (len(recent) - 1) / seconds if seconds > 0.0 else None


def _print(folder: Path, store: "TrialStore", console: Any) -> None:
    from rich.table import Table

    phases = store.phases()
    table = Table(title=str(folder))
    for name in ("phase", "done", "of", ""):
        table.add_column(name, justify="left" if name == "phase" else "right")
    for phase in phases:
        table.add_row(
            phase.label,
            str(phase.done),
            str(phase.total),
            f"{phase.done / max(phase.total, 1):.0%}",
        )
    console.print(table)
    times = store.finished_at()
    text = f"{len(times)} trials are finished"
    if times:
        ago = datetime.now(UTC) - datetime.fromisoformat(times[-1])
        text += f", the last {_duration(ago.total_seconds())} ago"
    left = sum(phase.total - phase.done for phase in phases)
    speed = rate(times)
    if left:
        text += f"; {left} are planned and not finished"
    if left and speed:
        text += f", about {_duration(left / speed)} at the last rate"
    done = (folder / "results.json").is_file()
    console.print(text + ("; the results are written." if done else "."))


def _duration(seconds: float) -> str:
    seconds = max(0.0, seconds)
    if seconds < 90.0:
        return f"{seconds:.0f} s"
    if seconds < 5400.0:
        return f"{seconds / 60.0:.0f} min"
    return f"{seconds / 3600.0:.1f} h"
