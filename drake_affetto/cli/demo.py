"""`affetto demo`: the whole story at small scale."""

import argparse
import contextlib
import math
from typing import TYPE_CHECKING, Any

from drake_affetto.cli.options import (
    add_output_argument,
    add_plan_arguments,
    add_restart_argument,
    add_workers_argument,
    make_plan,
    tells_how_to_continue,
    worker_count,
    worker_pool,
)
from drake_affetto.common.fields import check_ranges
from drake_affetto.common.output import prepare_output
from drake_affetto.experiments.plans import DemoPlan

if TYPE_CHECKING:
    from drake_affetto.experiments.results import DemoResults


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declares the command's options."""
    add_output_argument(parser, "out/demo")
    add_plan_arguments(parser, DemoPlan)
    add_workers_argument(parser)
    parser.add_argument(
        "--meshcat",
        action="store_true",
        help="show the trials in a browser as they run, in one process",
    )
    add_restart_argument(parser)


def run(args: argparse.Namespace) -> int:
    """Runs the demo; returns the exit code."""
    plan = make_plan(DemoPlan, args)
    check_ranges(plan)
    worker_count(args)
    out = prepare_output(args.out)

    from rich.console import Console

    console = Console()
    with contextlib.ExitStack() as stack:
        stack.enter_context(tells_how_to_continue(console, out))
        pool = None
        if not args.meshcat:
            pool = stack.enter_context(worker_pool(args, plan.drum.scenario))
        with console.status("Starting"):
            from drake_affetto.experiments.demo import run_demo
        results = run_demo(
            out,
            plan,
            pool=pool,
            watch=args.meshcat,
            restart=args.restart,
            console=console,
        )
    _print_tables(results, console)

    from drake_affetto.report import write_report

    page = write_report([out], out / "report.html")
    console.print(
        f"Results, pictures, sounds and the replay are in {out}; the page "
        f"that shows them all is {page}"
    )
    return 0


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
