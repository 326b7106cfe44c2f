"""`affetto teach`: demonstrations into a file."""

import argparse
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from drake_affetto.cli.options import (
    add_plan_arguments,
    add_study_arguments,
    check_study_arguments,
    make_plan,
    trial_executor,
    worker_pool,
)
from drake_affetto.common.fields import check_ranges
from drake_affetto.experiments.plans import TeachPlan

if TYPE_CHECKING:
    from drake_affetto.experiments.results import DemonstrationResult


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declares the command's options."""
    parser.add_argument(
        "--out",
        metavar="FILE",
        required=True,
        help="HDF5 file of demonstrations; new ones are added to it",
    )
    add_plan_arguments(parser, TeachPlan)
    parser.add_argument(
        "--mouse",
        action="store_true",
        help="you are the teacher: move the hand with the mouse in a browser",
    )
    # Its name in version 0.1.0.
    parser.add_argument(
        "--by-hand",
        dest="mouse",
        action="store_true",
        default=argparse.SUPPRESS,
        help=argparse.SUPPRESS,
    )
    add_study_arguments(parser, None)


def run(args: argparse.Namespace) -> int:
    """Teaches; returns the exit code."""
    plan = make_plan(TeachPlan, args)
    check_ranges(plan)
    check_study_arguments(args)

    from rich.console import Console

    from drake_affetto.experiments.teaching import teach
    from drake_affetto.experiments.teaching_session import TeachingSession

    console = Console()
    session = TeachingSession(plan, args.out)
    try:
        if args.mouse:
            from drake_affetto.experiments.mouse_teaching import teach_by_mouse

            outcomes = teach_by_mouse(session, console)
        else:
            with worker_pool(args, plan.scenario) as pool:
                outcomes = teach(
                    session,
                    lambda path: trial_executor(args, path, console, pool),
                )
    except KeyboardInterrupt:
        console.print(
            f"{len(session.taught)} of {plan.demonstrations} positions are in "
            f"{session.path}; the same command goes on from there."
        )
        raise
    print_outcomes(outcomes, console)
    console.print(f"{len(session.taught)} demonstrations are in {session.path}")
    return 0


def print_outcomes(
    outcomes: Sequence["DemonstrationResult"], console: Any
) -> None:
    """Prints the outcome at each position, and a summary."""
    from rich.table import Table

    table = Table(title="Demonstrations")
    for name in ("", "x [m]", "y [m]", "attempts", "reward", "pull [N]", ""):
        table.add_column(name, justify="right")
    for i, each in enumerate(outcomes):
        if not each.found:
            outcome = "drum not seen"
        else:
            outcome = "taught" if each.success else "no sound"
        table.add_row(
            str(i + 1),
            f"{each.xy[0]:.3f}",
            f"{each.xy[1]:.3f}",
            str(each.attempts),
            f"{each.reward:.2f}",
            f"{each.max_pull:.1f}",
            outcome,
        )
    console.print(table)
    count = len(outcomes)
    if count == 0:
        return
    good = [each for each in outcomes if each.success]
    first = sum(each.attempts == 1 for each in good)
    console.print(
        f"{len(good)} of {count} positions taught, {first} "
        f"({first / count:.0%}) at first try; greatest pull "
        f"{max(each.max_pull for each in outcomes):.1f} N"
    )
