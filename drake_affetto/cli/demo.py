"""`affetto demo`: the whole story at small scale."""

import argparse
from typing import Any

import numpy as np

from drake_affetto.common.errors import require_range
from drake_affetto.common.output import prepare_output
from drake_affetto.experiments.demo import run_demo


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declares the command's options."""
    parser.add_argument(
        "--out", metavar="DIR", default="out/demo", help="where results go"
    )
    parser.add_argument(
        "--seed", type=int, default=0, help="of everything that is random"
    )
    parser.add_argument(
        "--workers",
        type=int,
        default=2,
        metavar="N",
        help="worker processes; 0 runs all in this one",
    )
    parser.add_argument(
        "--meshcat",
        action="store_true",
        help="watch the trials in a browser as they run (one process)",
    )
    parser.add_argument(
        "--restart",
        action="store_true",
        help="run trials again that an earlier run into DIR has finished",
    )


def run(args: argparse.Namespace) -> int:
    """Runs the demo; returns the exit code."""
    require_range("--seed", args.seed, 0, 2**31 - 1)
    require_range("--workers", args.workers, 0, 256)
    out = prepare_output(args.out)

    from rich.console import Console

    console = Console()
    try:
        results = run_demo(
            out,
            seed=args.seed,
            workers=args.workers,
            watch=args.meshcat,
            restart=args.restart,
            console=console,
        )
    except KeyboardInterrupt:
        console.print(
            f"Finished trials are kept in {out}; the same command goes on "
            "from there."
        )
        raise
    _print_tables(results, console)
    from drake_affetto.report import write_report

    page = write_report([out], out / "report.html")
    console.print(
        f"Results, pictures, sounds and the replay are in {out}; the page "
        f"that shows them all is {page}"
    )
    return 0


def _print_tables(results: dict[str, Any], console: Any) -> None:
    from rich.table import Table

    drum = results["drumming"]
    table = Table(title="Drum seen directly: unseen positions")
    for name in ("x [m]", "y [m]", "y_img", "q3* [°]", "reward", ""):
        table.add_column(name, justify="right")
    for row in drum["positions"]:
        y_img, yaw = row["tau"]
        table.add_row(
            f"{row['xy'][0]:.3f}",
            f"{row['xy'][1]:.3f}",
            f"{y_img:.3f}",
            f"{np.degrees(yaw):.1f}",
            f"{row['reward']:.2f}",
            "hit" if row["success"] else "miss",
        )
    console.print(table)
    console.print(
        f"After {drum['demonstrations']} demonstrations: "
        f"{drum['success_rate']:.0%} of {len(drum['positions'])} positions"
    )
    mirror = results["mirror"]
    table = Table(
        title=f"Drum seen in the mirror, {mirror['samples']} demonstrations"
    )
    for name in ("scheme", "success", "rewards"):
        table.add_column(name)
    for name, row in mirror["schemes"].items():
        table.add_row(
            name,
            f"{row['success_rate']:.0%}",
            " ".join(f"{value:.2f}" for value in row["rewards"]),
        )
    console.print(table)
