"""`affetto teach`: demonstrations into a file."""

import argparse
from collections.abc import Sequence
from typing import Any

from drake_affetto.common.errors import require_range
from drake_affetto.experiments.teaching import _SEEDS, Course, Taught, teach


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declares the command's options."""
    parser.add_argument(
        "--out",
        metavar="FILE",
        required=True,
        help="HDF5 file of demonstrations; it is made, or added to",
    )
    parser.add_argument(
        "--scenario",
        default="drumming",
        help="a scenario's name, or its YAML file",
    )
    parser.add_argument(
        "--positions",
        type=int,
        default=25,
        metavar="N",
        help="at how many places of the drum",
    )
    parser.add_argument(
        "--seed", type=int, default=0, help="of the places and the teacher"
    )
    parser.add_argument(
        "--workers",
        type=int,
        default=2,
        metavar="W",
        help="worker processes; 0 runs all in this one",
    )
    parser.add_argument(
        "--by-hand",
        action="store_true",
        help="you teach, with the mouse, in a browser",
    )


def run(args: argparse.Namespace) -> int:
    """Teaches; returns the exit code."""
    require_range("--positions", args.positions, 1, _SEEDS)
    require_range("--seed", args.seed, 0, 2**31 - 1)
    require_range("--workers", args.workers, 0, 256)

    from rich.console import Console

    console = Console()
    course = Course(args.scenario, args.positions, args.seed, args.out)
    try:
        if args.by_hand:
            from drake_affetto.experiments.mouse_teaching import teach_by_hand

            taught = teach_by_hand(course, console)
        else:
            taught = teach(course, workers=args.workers, console=console)
    except KeyboardInterrupt:
        console.print(
            f"{len(course.taught)} of {args.positions} positions are in "
            f"{course.path}; the same command goes on from there."
        )
        raise
    print_taught(taught, console)
    console.print(f"{len(course.taught)} demonstrations are in {course.path}")
    return 0


def print_taught(taught: Sequence[Taught], console: Any) -> None:
    """Prints what came of each place, and of all."""
    from rich.table import Table

    table = Table(title="Taught by hand")
    for name in ("", "x [m]", "y [m]", "attempts", "reward", "pull [N]", ""):
        table.add_column(name, justify="right")
    for i, each in enumerate(taught):
        if not each.found:
            came_of_it = "drum not seen"
        else:
            came_of_it = "taught" if each.success else "no sound"
        table.add_row(
            str(i + 1),
            f"{each.xy[0]:.3f}",
            f"{each.xy[1]:.3f}",
            str(each.attempts),
            f"{each.reward:.2f}",
            f"{each.max_pull:.1f}",
            came_of_it,
        )
    console.print(table)
    count = len(taught)
    if count == 0:
        return
    good = [each for each in taught if each.success]
    first = sum(each.attempts == 1 for each in good)
    console.print(
        f"{len(good)} of {count} positions taught, {first} "
        f"({first / count:.0%}) at first try; greatest pull "
        f"{max(each.max_pull for each in taught):.1f} N"
    )
