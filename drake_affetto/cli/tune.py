"""`affetto tune`: searches the gains of the controllers on the whole robot."""

import argparse
from typing import Any

from drake_affetto.common.errors import require_range
from drake_affetto.common.output import (
    prepare_output,
)
from drake_affetto.tuning.config import DEFAULT_FILE, HELD_OUT, TRAINING
from drake_affetto.tuning.plan import START_FILE, load_plan
from drake_affetto.tuning.study import run_tune


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declares the command's options."""
    parser.add_argument(
        "--joints",
        nargs="+",
        metavar="JOINT",
        help="whose gains are searched; by default all active joints",
    )
    parser.add_argument(
        "--trials",
        type=int,
        default=216,
        metavar="N",
        help="how many trials the study shall have in the end",
    )
    parser.add_argument(
        "--workers",
        type=int,
        default=2,
        metavar="K",
        help="worker processes; 0 runs all in this one",
    )
    parser.add_argument(
        "--out", metavar="DIR", default="out/tune", help="where results go"
    )
    parser.add_argument("--seed", type=int, default=0, help="of the search")
    parser.add_argument(
        "--scenario", default="drumming", help="whose robot is tuned"
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
    parser.add_argument(
        "--restart",
        action="store_true",
        help="throw away what an earlier run has left in DIR",
    )


def run(args: argparse.Namespace) -> int:
    """Runs the study; returns the exit code."""
    require_range("--trials", args.trials, 1, 1_000_000)
    require_range("--workers", args.workers, 0, 256)
    require_range("--seed", args.seed, 0, 2**31 - 1)
    plan = load_plan(
        args.joints,
        seed=args.seed,
        scenario=args.scenario,
        start=args.start,
        tuning=args.tuning,
    )
    out = prepare_output(args.out)

    from rich.console import Console

    console = Console()
    try:
        results = run_tune(
            out,
            plan,
            trials=args.trials,
            workers=args.workers,
            restart=args.restart,
            console=console,
        )
    except KeyboardInterrupt:
        console.print(
            f"Finished trials are kept in {out}; the same command goes on "
            "from there."
        )
        raise
    _print_table(results, console)
    console.print(
        f"Gains, results and the study's page (study.html) are in {out}"
    )
    return 0


def _print_table(results: dict[str, Any], console: Any) -> None:
    from rich.table import Table

    hand, best = results["hand_tuned"], results["best"]
    table = Table(title="Tracking error, rms in degrees: by hand → tuned")
    table.add_column("joint")
    names = (TRAINING, *HELD_OUT)
    for name in names:
        table.add_column(name.replace("_", " "), justify="right")
    table.add_column("at rest [% of range]", justify="right")
    for joint in hand["gains"]:
        cells = []
        for name in names:
            before, after = (
                side["trajectories"][name]["tracking_error_deg"][joint]
                for side in (hand, best)
            )
            cells.append(f"{before:.2f} → {after:.2f}")
        before, after = (
            side["rest_oscillation_percent"][joint] for side in (hand, best)
        )
        table.add_row(joint, *cells, f"{before:.3f} → {after:.3f}")
    console.print(table)
    held = results["held_out_improvement"]
    console.print(
        f"Cost {hand['cost']:.3f} → {best['cost']:.3f} "
        f"({-results['improvement']:+.0%}); held out: "
        + ", ".join(f"{name} {-value:+.0%}" for name, value in held.items())
    )
