"""`affetto tune`: searches the gains of the controllers on the whole robot."""

import argparse
from typing import TYPE_CHECKING, Any

from drake_affetto.cli.options import (
    add_output_argument,
    add_restart_argument,
    add_seed_argument,
    add_workers_argument,
    whole_number,
    worker_count,
)
from drake_affetto.cli.study_command import tells_how_to_continue
from drake_affetto.common.errors import require_range
from drake_affetto.common.owner import claim_folder
from drake_affetto.tuning.config import (
    DEFAULT_FILE,
    HELD_OUT,
    START_FILE,
    TRAINING,
)

if TYPE_CHECKING:
    from drake_affetto.tuning.results import TuningResults


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declares the command's options."""
    parser.add_argument(
        "--joints",
        nargs="+",
        metavar="JOINT",
        help="joints whose gains are searched; by default all active ones",
    )
    parser.add_argument(
        "--trials",
        type=whole_number,
        default=216,
        metavar="N",
        help="number of trials, those of earlier runs included",
    )
    add_workers_argument(parser)
    add_output_argument(parser, "out/tune")
    add_seed_argument(parser, "seed of the search")
    parser.add_argument(
        "--scenario", default="easy_drumming", help="scenario of the robot"
    )
    parser.add_argument(
        "--start",
        metavar="FILE",
        default=START_FILE,
        help="gains to start from and to compare with",
    )
    parser.add_argument(
        "--tuning",
        metavar="FILE",
        default=DEFAULT_FILE,
        help="trajectories, cost and search",
    )
    add_restart_argument(parser)


def run(args: argparse.Namespace) -> int:
    """Runs the study; returns the exit code.

    Raises:
        InputError: If an option, a file or the folder does not fit.
    """
    require_range("--trials", args.trials, 1, 1_000_000)
    workers = worker_count(args)
    require_range("--seed", args.seed, 0, 2**31 - 1)

    from rich.console import Console

    from drake_affetto.report import write_report
    from drake_affetto.tuning.plan import load_plan
    from drake_affetto.tuning.study import run_tune

    plan = load_plan(
        args.joints,
        seed=args.seed,
        scenario=args.scenario,
        start=args.start,
        tuning=args.tuning,
    )
    out = claim_folder(args.out, "tune")
    console = Console()
    with tells_how_to_continue(console, out):
        results = run_tune(
            out,
            plan,
            trials=args.trials,
            workers=workers,
            restart=args.restart,
            console=console,
        )
    write_report([out], out / "study.html")
    _print_table(results, console)
    console.print(
        f"Gains, results and the study's page (study.html) are in {out}"
    )
    return 0


def _print_table(results: "TuningResults", console: Any) -> None:
    from rich.table import Table

    before, after = results.hand_tuned, results.best
    table = Table(title="Tracking error, rms in degrees: hand-tuned → tuned")
    table.add_column("joint")
    names = (TRAINING, *HELD_OUT)
    for name in names:
        table.add_column(name.replace("_", " "), justify="right")
    table.add_column("at rest [% of range]", justify="right")
    for joint in before.gains:
        cells = []
        for name in names:
            error, tuned_error = (
                gains.trajectories[name].tracking_error_deg[joint]
                for gains in (before, after)
            )
            cells.append(f"{error:.2f} → {tuned_error:.2f}")
        rest, tuned_rest = (
            gains.rest_oscillation_percent[joint] for gains in (before, after)
        )
        table.add_row(joint, *cells, f"{rest:.3f} → {tuned_rest:.3f}")
    console.print(table)
    held_out = ", ".join(
        f"{name} {-value:+.0%}"
        for name, value in results.held_out_improvement.items()
    )
    console.print(
        f"Cost {before.cost:.3f} → {after.cost:.3f} "
        f"({-results.improvement:+.0%}); held out: {held_out}"
    )
