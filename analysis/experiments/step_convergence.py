"""Do outcomes depend on the plant's step? 200 strikes at several steps.

    python analysis/experiments/step_convergence.py [--steps 0.25 1 2.5]
        [--trials 200] [--seed 0] [--workers 2] [--out out/steps]

The first step, in ms, is the reference. Goes on where it was interrupted.
Prints a table and writes results.json.
"""

import argparse
from pathlib import Path
import sys

import numpy as np
from rich.console import Console
from rich.table import Table

from drake_affetto.common.errors import InputError, require_range
from drake_affetto.common.output import prepare_output, write_json
from drake_affetto.experiments.step_convergence import (
    run_step_convergence,
    run_step_trial,
)
from drake_affetto.runner import TrialExecutor, TrialStore

ROWS = (
    ("arrival, ms", "time", 1e3),
    ("palm at arrival, mm", "place", 1e3),
    ("peak force, %", "peak_force", 1e2),
    ("held pressure, kPa", "pressure", 1e-3),
    ("tracking error, deg", "tracking", np.degrees(1.0)),
    ("reward", "reward", 1.0),
)


def table(differences, reference) -> Table:
    """Median and 95th percentile of each difference, a column a step."""
    shown = Table(
        title=f"differences to a step of {reference:g} ms: median (95 %)"
    )
    shown.add_column("")
    for each in differences:
        shown.add_column(f"{1e3 * each.time_step:g} ms", justify="right")
    shown.add_row(
        "same judgement, %", *(f"{100 * d.agreement:.1f}" for d in differences)
    )
    shown.add_row("hits", *(f"{d.hits} of {d.trials}" for d in differences))
    for label, name, unit in ROWS:
        pairs = [np.array(getattr(d, name)) * unit for d in differences]
        shown.add_row(label, *(f"{m:.3f} ({p:.3f})" for m, p in pairs))
    return shown


def main() -> int:
    """Runs the study."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument(
        "--steps", type=float, nargs="+", default=[0.25, 1.0, 2.5], help="ms"
    )
    parser.add_argument("--trials", type=int, default=200)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--out", type=Path, default=Path("out/steps"))
    args = parser.parse_args()
    try:
        require_range("--trials", args.trials, 5, 100_000)
        require_range("--workers", args.workers, 1, 1000)
        out = prepare_output(args.out)
        with TrialExecutor(
            run_step_trial,
            TrialStore(out / "trials.sqlite"),
            workers=args.workers,
        ) as executor:
            differences = run_step_convergence(
                executor,
                [1e-3 * step for step in args.steps],
                trials=args.trials,
                seed=args.seed,
            )
    except InputError as error:
        print(f"step_convergence: {error}", file=sys.stderr)
        return 2
    except KeyboardInterrupt:
        return 130
    write_json(
        out / "results.json",
        {
            "reference": 1e-3 * args.steps[0],
            "seed": args.seed,
            "steps": differences,
        },
    )
    Console(width=100).print(table(differences, args.steps[0]))
    return 0


if __name__ == "__main__":
    sys.exit(main())
