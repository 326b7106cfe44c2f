"""`affetto demo`: the whole story at small scale."""

import argparse
import contextlib
import math
from typing import TYPE_CHECKING, Any

from drake_affetto.cli.options import add_restart_argument
from drake_affetto.cli.study_command import (
    StudyCommand,
    tells_how_to_continue,
    worker_pool,
)
from drake_affetto.common.owner import claim_folder
from drake_affetto.experiments.plans import DemoPlan

if TYPE_CHECKING:
    from drake_affetto.experiments.results import DemoResults


class DemoCommand(StudyCommand[DemoPlan]):
    """Runs a small drum and a small mirror study, and shows them on a page."""

    command = "demo"
    plan = DemoPlan
    out = "out/demo"

    def add_options(self, parser: argparse.ArgumentParser) -> None:
        """Declares whether to watch and whether to begin anew."""
        parser.add_argument(
            "--meshcat",
            action="store_true",
            help="show the trials in a browser as they run, in one process",
        )
        add_restart_argument(parser)

    def work(
        self, plan: DemoPlan, args: argparse.Namespace, console: Any
    ) -> None:
        """Runs the demo and writes its page."""
        out = claim_folder(args.out, self.command)
        with contextlib.ExitStack() as stack:
            stack.enter_context(tells_how_to_continue(console, out))
            pool = None
            if not args.meshcat:
                pool = stack.enter_context(
                    worker_pool(args, plan.drum.scenario)
                )
            with console.status("Starting"):
                from drake_affetto.experiments.demo import run_demo
            results = run_demo(
                out,
                plan,
                pool=pool,
                watch=args.meshcat,
                restart=args.restart,
                reuse=args.reuse,
                console=console,
            )
        _print_tables(results, console)

        from drake_affetto.report import write_report

        page = write_report([out], out / "report.html")
        console.print(
            f"Results, pictures, sounds and the replay are in {out}; the page "
            f"that shows them all is {page}"
        )


def _print_tables(results: "DemoResults", console: Any) -> None:
    from rich.table import Table

    drum = results.drumming
    table = Table(title="Drum seen directly: test positions")
    for name in ("x [m]", "y [m]", "y_img", "q3* [°]", "reward", ""):
        table.add_column(name, justify="right")
    for row in drum.positions:
        y_img, yaw = row.tau
        table.add_row(
            f"{row.xy[0]:.3f}",
            f"{row.xy[1]:.3f}",
            f"{y_img:.3f}",
            f"{math.degrees(yaw):.1f}",
            f"{row.reward:.2f}",
            "hit" if row.success else "miss",
        )
    console.print(table)
    console.print(
        f"After {drum.demonstrations} demonstrations: "
        f"{drum.success_rate:.0%} of {len(drum.positions)} positions"
    )
    mirror = results.mirror
    table = Table(
        title=f"Drum seen in the mirror, {mirror.samples} demonstrations"
    )
    for name in ("scheme", "success", "rewards"):
        table.add_column(name)
    for name, scheme in mirror.schemes.items():
        table.add_row(
            name,
            f"{scheme.success_rate:.0%}",
            " ".join(f"{value:.2f}" for value in scheme.rewards),
        )
    console.print(table)


_COMMAND = DemoCommand()
add_arguments, run = _COMMAND.add_arguments, _COMMAND.run
