"""The progress display of a study: one look for all commands."""

from typing import Any

from rich.progress import (
    BarColumn,
    MofNCompleteColumn,
    Progress,
    ProgressColumn,
    Task,
    TextColumn,
    TimeElapsedColumn,
    TimeRemainingColumn,
)
from rich.text import Text


class RateColumn(ProgressColumn):
    """How many trials are finished in a second, or seconds each takes."""

    def render(self, task: Task) -> Text:
        """The text of one cell."""
        speed = task.finished_speed or task.speed
        if not speed:
            return Text("")
        return Text(f"{speed:.1f}/s" if speed >= 1.0 else f"{1 / speed:.1f} s")


def make_progress(
    *, note: bool = False, console: Any = None, quiet: bool = False
) -> Progress:
    """A display with a line for each task: bar, count, rate and times.

    Args:
        note: Whether tasks carry a text in their field `note`.
        console: A rich console; None for the standard output.
        quiet: Whether nothing is shown.
    """
    return Progress(
        TextColumn("{task.description:<32}"),
        BarColumn(),
        MofNCompleteColumn(),
        *([TextColumn("{task.fields[note]}")] if note else []),
        RateColumn(),
        TimeElapsedColumn(),
        TimeRemainingColumn(),
        console=console,
        disable=quiet,
    )
