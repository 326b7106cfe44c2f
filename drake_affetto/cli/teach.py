"""`affetto teach`: demonstrations into a file."""

import argparse
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from drake_affetto.cli.study_command import (
    StudyCommand,
    trial_executor,
    worker_pool,
)
from drake_affetto.common.errors import require
from drake_affetto.common.folder_lock import lock_file
from drake_affetto.common.output import output_folder, write_target
from drake_affetto.common.owner import claim_file
from drake_affetto.experiments.plans import TeachPlan

if TYPE_CHECKING:
    from drake_affetto.experiments.results import DemonstrationResult


class TeachCommand(StudyCommand[TeachPlan]):
    """Adds demonstrations to a file, of a simulated teacher or a person."""

    command = "teach"
    plan = TeachPlan

    def add_options(self, parser: argparse.ArgumentParser) -> None:
        """Declares the file and who teaches."""
        parser.add_argument(
            "--out",
            metavar="FILE",
            required=True,
            help="HDF5 file of demonstrations; new ones are added to it",
        )
        parser.add_argument(
            "--mouse",
            action="store_true",
            help="you are the teacher: move the hand by mouse in a browser",
        )

    def work(
        self, plan: TeachPlan, args: argparse.Namespace, console: Any
    ) -> int:
        """Teaches at the positions that the file does not have."""
        require(bool(args.out), "--out", args.out, "the name of a file")
        folder = write_target(Path(args.out).expanduser()).parent
        # Before the imports: the second of two commands is told at once.
        with output_folder(folder):
            path = demonstrations_file(args.out)
            with lock_file(path, "affetto teach"):
                return self._teach(plan, path, args, console)

    def _teach(
        self,
        plan: TeachPlan,
        path: Path,
        args: argparse.Namespace,
        console: Any,
    ) -> int:
        from drake_affetto.experiments.teaching import teach
        from drake_affetto.experiments.teaching_session import TeachingSession

        session = TeachingSession(plan, path)
        try:
            if args.mouse:
                from drake_affetto.experiments.mouse_teaching import (
                    teach_by_mouse,
                )

                outcomes = teach_by_mouse(session, console)
            else:
                run = self.runs_trials()
                with worker_pool(args, plan.scenario) as pool:
                    outcomes = teach(
                        session,
                        lambda path: trial_executor(
                            args, path, console, pool, run
                        ),
                    )
        except KeyboardInterrupt:
            console.print(
                f"{len(session.taught)} of {plan.demonstrations} positions "
                f"are in {session.path}; the same command goes on from there."
            )
            raise
        print_outcomes(outcomes, console)
        if not session.taught:
            console.print("Nothing was taught, and no file was written.")
            return 1
        console.print(
            f"{len(session.taught)} demonstrations are in {session.path}"
        )
        return 0


def demonstrations_file(out: str) -> Path:
    """The file that --out names, in a folder that is made if need be.

    Raises:
        InputError: If it is a folder, or its folder cannot be written.
    """
    require(bool(out), "--out", out, "the name of a file")
    require(
        not Path(out).expanduser().is_dir(),
        "--out",
        out,
        "a file, not a folder",
    )
    return claim_file(out, "teach")


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


_COMMAND = TeachCommand()
add_arguments, run = _COMMAND.add_arguments, _COMMAND.run
