"""`affetto drum`: learning to drum from demonstrations (paper Figs. 3b, 3c)."""

import argparse
from typing import TYPE_CHECKING, Any

from drake_affetto.cli.options import (
    add_plan_arguments,
    add_study_arguments,
    check_study_arguments,
    make_plan,
    rate_text,
    study,
)
from drake_affetto.common.output import write_json
from drake_affetto.experiments.plans import DrumPlan

if TYPE_CHECKING:
    from drake_affetto.experiments.results import DrumResults


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declares the command's options."""
    add_plan_arguments(parser, DrumPlan)
    add_study_arguments(parser, "out/drum")


def run(args: argparse.Namespace) -> int:
    """Runs the study; returns the exit code."""
    plan = make_plan(DrumPlan, args)
    plan.check()
    check_study_arguments(args)

    from rich.console import Console

    console = Console()
    with study(args, console, plan.scenario) as (out, executor):
        from drake_affetto.experiments.drumming import run_drum

        results = run_drum(executor, plan)
    write_json(out / "results.json", results)
    _print(results, console)
    console.print(f"results: {out / 'results.json'}")
    return 0


def _print(results: "DrumResults", console: Any) -> None:
    from rich.table import Table

    curves = {"random order": results.by_demonstrations}
    if results.active is not None:
        curves["its own choice"] = results.active.by_demonstrations
    table = Table(title="Success at test positions")
    table.add_column("demonstrations", justify="right")
    for name in curves:
        table.add_column(name)
    for points in zip(*curves.values(), strict=True):
        rates = [point.success_rate for point in points]
        table.add_row(str(points[0].n), *map(rate_text, rates))
    console.print(table)
    evaluation = results.separation
    console.print(
        f"{results.first_try:.0%} of the demonstrations made the drum sound "
        f"at the first try. In {evaluation.trials} trials there were "
        f"{evaluation.false_hits} successes without a hit, and "
        f"{evaluation.missed_hits} of {evaluation.hits} hits were not heard."
    )
