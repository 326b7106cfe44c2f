"""`affetto toy`: the paper's toy experiment of transfer (Fig. 2)."""

import argparse
from typing import Any

from drake_affetto import __version__
from drake_affetto.common.errors import require, require_range
from drake_affetto.common.output import prepare_output, write_json
from drake_affetto.experiments.toy import (
    BASELINES,
    DOMAINS,
    FUNCTION,
    PAPER,
    TRANSFERS,
    gather,
    plan,
    run_seed,
)


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declares the command's options."""
    parser.add_argument(
        "--repeats",
        type=int,
        default=100,
        metavar="N",
        help="choices of five points for each seed",
    )
    parser.add_argument(
        "--seeds",
        type=int,
        default=20,
        metavar="K",
        help="how many draws of data and hidden layer",
    )
    parser.add_argument(
        "--seed", type=int, default=0, help="the first of the seeds"
    )
    parser.add_argument(
        "--out", metavar="DIR", default="out/toy", help="where results go"
    )
    parser.add_argument(
        "--workers",
        type=int,
        default=2,
        metavar="N",
        help="worker processes; 0 runs all in this one",
    )


def run(args: argparse.Namespace) -> int:
    """Runs what is missing, prints the tables, writes `results.json`.

    Raises:
        InputError: if an option does not fit or the folder cannot be written.
    """
    require_range("--repeats", args.repeats, 1, 100_000)
    require_range("--seeds", args.seeds, 1, 100_000)
    require_range("--workers", args.workers, 0, 1024)
    require(args.seed >= 0, "--seed", args.seed, "a number of at least 0")
    out = prepare_output(args.out)

    from rich.console import Console

    from drake_affetto.runner.executor import TrialExecutor
    from drake_affetto.runner.store import TrialStore

    console = Console()
    results: dict[str, Any] = {
        "study": "toy",
        "version": __version__,
        "seed": args.seed,
        "seeds": args.seeds,
        "repeats": args.repeats,
        "function": FUNCTION,
        "paper": PAPER,
    }
    with (
        TrialStore(out / "trials.sqlite") as store,
        TrialExecutor(
            run_seed,
            store,
            workers=args.workers,
            quiet=not console.is_terminal,
        ) as executor,
    ):
        found = {
            name: gather(
                list(
                    executor.run(
                        f"{name} square",
                        dict(
                            enumerate(
                                plan(name, args.seeds, args.seed, args.repeats)
                            )
                        ),
                    ).values()
                )
            )
            for name in DOMAINS
        }
        if executor.reused:
            console.print(
                f"{executor.reused} seeds were finished already and are kept"
            )
    # The paper's experiment at the top, the harder one beside it.
    results.update(found["unit"])
    results["wide"] = found["wide"]
    write_json(out / "results.json", results)
    for name, title in (("unit", "[0, 1]²"), ("wide", "[-1.3, 1.3]²")):
        console.print(make_table(found[name], title, name == "unit"))
    console.print(f"f = {FUNCTION}")
    console.print(f"results: {out / 'results.json'}")
    return 0


def make_table(figures: dict[str, Any], square: str, paper: bool) -> Any:
    """The figures of one square as a table of rich, beside the paper's."""
    from rich.table import Table

    source = figures["source"]
    table = Table(
        title=f"Mean squared error on {square}, medians over the seeds",
        caption=(
            f"source: train {source['train_mse']:.3f}, test "
            f"{source['test_mse']:.3f}, turned {source['rotated_mse']:.2f}"
            + ("; paper: 0.00, 0.06, 41.71" if paper else "")
        ),
    )
    table.add_column("after five points")
    for column in ("on those", "on the others", "± over subsets", "95 %"):
        table.add_column(column, justify="right")
    if paper:
        known = PAPER["transfer"]
        table.add_row(
            "paper",
            f"{known['train_mse_mean']:.3f}",
            f"{known['other_mse_mean']:.3f}",
            f"{known['other_mse_std']:.3f}",
            "",
            end_section=True,
        )
    for group, names in (("transfer", TRANSFERS), ("baselines", BASELINES)):
        for i, (name, label) in enumerate(names.items()):
            row = figures[group][name]
            table.add_row(
                label,
                f"{row['train_mse_mean']:.3f}",
                f"{row['other_mse_mean']:.3f}",
                f"{row['other_mse_std']:.3f}",
                f"{row['other_mse_p95']:.3f}",
                end_section=i == len(names) - 1,
            )
    return table
