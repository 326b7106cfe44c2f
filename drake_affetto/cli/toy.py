"""`affetto toy`: the paper's toy experiment of transfer (Fig. 2)."""

import argparse
from typing import TYPE_CHECKING, Any

from drake_affetto.cli.options import (
    STORE,
    add_output_argument,
    add_plan_arguments,
    add_workers_argument,
    make_plan,
    tells_how_to_continue,
    worker_count,
)
from drake_affetto.common.fields import check_ranges
from drake_affetto.common.output import prepare_output, write_json
from drake_affetto.experiments.plans import ToyPlan

if TYPE_CHECKING:
    from drake_affetto.experiments.results import ToyFigures, ToyResults


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declares the command's options."""
    add_plan_arguments(parser, ToyPlan)
    add_output_argument(parser, "out/toy")
    add_workers_argument(parser)


def run(args: argparse.Namespace) -> int:
    """Runs what is missing, prints the tables, writes `results.json`.

    Raises:
        InputError: If an option does not fit or the folder cannot be written.
    """
    plan = make_plan(ToyPlan, args)
    check_ranges(plan)
    workers = worker_count(args)
    out = prepare_output(args.out)

    from rich.console import Console

    from drake_affetto.experiments.toy import run_seed, run_toy
    from drake_affetto.runner.executor import TrialExecutor
    from drake_affetto.runner.store import TrialStore

    console = Console()
    with (
        tells_how_to_continue(console, out),
        TrialStore(out / STORE) as store,
        TrialExecutor(
            run_seed, store, workers=workers, quiet=not console.is_terminal
        ) as executor,
    ):
        results = run_toy(executor, plan)
        if executor.reused:
            console.print(
                f"{executor.reused} seeds were finished already and are kept"
            )
    write_json(out / "results.json", results)
    console.print(make_table(results, "[0, 1]²", paper=True))
    assert results.wide is not None
    console.print(make_table(results.wide, "[-1.3, 1.3]²"))
    console.print(f"f = {results.function}")
    console.print(f"results: {out / 'results.json'}")
    return 0


def make_table(
    figures: "ToyResults | ToyFigures", square: str, paper: bool = False
) -> Any:
    """The figures of one square as a table of rich.

    Args:
        figures: Figures of the square.
        square: Name of the square.
        paper: Whether the paper's figures are for this square.
    """
    from rich.table import Table

    from drake_affetto.experiments.toy import BASELINES, PAPER, TRANSFERS

    source = figures.source
    table = Table(
        title=f"Mean squared error on {square}, medians over the seeds",
        caption=(
            f"source: train {source.train_mse:.3f}, test "
            f"{source.test_mse:.3f}, turned {source.rotated_mse:.2f}"
            + ("; paper: 0.00, 0.06, 41.71" if paper else "")
        ),
    )
    table.add_column("after five points")
    for column in ("on those", "on the others", "± over subsets", "95 %"):
        table.add_column(column, justify="right")
    if paper:
        known = PAPER.transfer
        table.add_row(
            "paper",
            f"{known.train_mse_mean:.3f}",
            f"{known.other_mse_mean:.3f}",
            f"{known.other_mse_std:.3f}",
            "",
            end_section=True,
        )
    for group, names in (
        (figures.transfer, TRANSFERS),
        (figures.baselines, BASELINES),
    ):
        for i, (name, label) in enumerate(names.items()):
            row = group[name]
            table.add_row(
                label,
                f"{row.train_mse_mean:.3f}",
                f"{row.other_mse_mean:.3f}",
                f"{row.other_mse_std:.3f}",
                f"{row.other_mse_p95:.3f}",
                end_section=i == len(names) - 1,
            )
    return table
