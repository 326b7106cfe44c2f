"""`affetto drum`: learning to drum from demonstrations (paper Figs. 3b, 3c)."""

import argparse
from typing import Any

from drake_affetto.cli.study import (
    add_study_arguments,
    campaign,
    check_study_arguments,
)
from drake_affetto.common.output import prepare_output, write_json
from drake_affetto.experiments.drumming import DrumPlan, run_drum
from drake_affetto.station.scenario import load_scenario


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declares the command's options."""
    default = DrumPlan()
    parser.add_argument(
        "--demonstrations",
        type=int,
        default=default.demonstrations,
        metavar="N",
        help="how many are taught",
    )
    parser.add_argument(
        "--evaluations",
        type=int,
        default=default.evaluations,
        metavar="N",
        help="unseen positions drummed at after each demonstration",
    )
    parser.add_argument(
        "--repeats",
        type=int,
        default=default.repeats,
        metavar="K",
        help="how often, each time with other demonstrations",
    )
    parser.add_argument(
        "--after",
        type=int,
        nargs="+",
        default=[],
        metavar="N",
        help="try the skill only after so many demonstrations",
    )
    parser.add_argument(
        "--active",
        action="store_true",
        help="also let the skill choose which demonstration comes next",
    )
    parser.add_argument(
        "--scenario", default=default.scenario, help="name or YAML file"
    )
    add_study_arguments(parser, "out/drum")


def run(args: argparse.Namespace) -> int:
    """Runs the study; returns the exit code."""
    plan = DrumPlan(
        demonstrations=args.demonstrations,
        evaluations=args.evaluations,
        repeats=args.repeats,
        active=args.active,
        after=tuple(args.after),
        scenario=args.scenario,
        seed=args.seed,
    )
    plan.check()
    check_study_arguments(args)
    load_scenario(plan.scenario)
    out = prepare_output(args.out)

    from rich.console import Console

    console = Console()
    with campaign(args, out, console) as executor:
        results = run_drum(executor, plan)
    write_json(out / "results.json", results)
    _print(results, console)
    console.print(f"results: {out / 'results.json'}")
    return 0


def _print(results: dict[str, Any], console: Any) -> None:
    from rich.table import Table

    curves = {"random order": results["by_demonstrations"]}
    if results["active"]:
        curves["its own choice"] = results["active"]["by_demonstrations"]
    table = Table(title="Success at unseen positions")
    table.add_column("demonstrations", justify="right")
    for name in curves:
        table.add_column(name)
    for points in zip(*curves.values(), strict=True):
        table.add_row(
            str(points[0]["n"]),
            *(
                f"{rate['mean']:4.0%}  [{rate['low']:.0%}, {rate['high']:.0%}]"
                for rate in (point["success_rate"] for point in points)
            ),
        )
    console.print(table)
    told = results["separation"]
    console.print(
        f"{results['first_try']:.0%} of the demonstrations made the drum sound "
        f"at the first try. In {told['trials']} trials the sound took "
        f"{told['false_hits']} for hits that were none, and missed "
        f"{told['missed_hits']} of {told['hits']} hits."
    )
