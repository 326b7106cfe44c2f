"""`affetto mirror`: drumming in a changed view, by transfer (paper Fig. 5)."""

import argparse
import dataclasses
from pathlib import Path
from typing import Any

from drake_affetto import __version__
from drake_affetto.cli.study import (
    add_study_arguments,
    campaign,
    check_study_arguments,
)
from drake_affetto.common.output import prepare_output, write_json
from drake_affetto.experiments.mirror import (
    MirrorOutcome,
    MirrorPlan,
    changed_views,
    run_mirror,
)
from drake_affetto.station.scenario import load_scenario


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declares the command's options."""
    default = MirrorPlan()
    which = parser.add_mutually_exclusive_group()
    which.add_argument(
        "--scenario",
        help=f"of the changed view, name or YAML file ({default.scenario})",
    )
    which.add_argument(
        "--all-scenarios",
        action="store_true",
        help="every changed view that comes with the package",
    )
    parser.add_argument(
        "--samples",
        type=int,
        nargs="+",
        default=list(default.samples),
        metavar="N",
        help="numbers of demonstrations the schemes are given",
    )
    for name, text in (
        ("repeats", "how often, each time with another skill and teacher"),
        ("evaluations", "unseen positions of each repeat"),
        ("demonstrations", "from which the skill is learned in direct view"),
    ):
        parser.add_argument(
            f"--{name}",
            type=int,
            default=getattr(default, name),
            metavar="N",
            help=text,
        )
    parser.add_argument(
        "--no-exhibits",
        action="store_true",
        help="without replay, pictures and sounds of a trial",
    )
    add_study_arguments(parser, "out/mirror")


def run(args: argparse.Namespace) -> int:
    """Runs the study; returns the exit code."""
    plan = MirrorPlan(
        scenario=args.scenario or MirrorPlan.scenario,
        samples=tuple(sorted(args.samples)),
        repeats=args.repeats,
        evaluations=args.evaluations,
        demonstrations=args.demonstrations,
        seed=args.seed,
    )
    plan.check()
    check_study_arguments(args)
    load_scenario(plan.scenario)
    out = prepare_output(args.out)

    from rich.console import Console

    console = Console()
    names = changed_views() if args.all_scenarios else [plan.scenario]
    found = {}
    with campaign(args, out, console) as executor:
        for name in names:
            outcome = run_mirror(
                executor, dataclasses.replace(plan, scenario=name)
            )
            found[name] = outcome.results
            _print(outcome.results, console)
    if not args.no_exhibits and not args.all_scenarios:
        console.print("Recording a direct and a mirrored trial ...")
        _show(out, outcome, plan)
    results = found[names[0]]
    if args.all_scenarios:
        results = {
            "study": "scenarios",
            "version": __version__,
            "seed": plan.seed,
            "scenarios": found,
        }
    write_json(out / "results.json", results)
    console.print(f"results: {out / 'results.json'}")
    return 0


def _show(out: Path, outcome: MirrorOutcome, plan: MirrorPlan) -> None:
    from drake_affetto.experiments.media import Exhibit, write_exhibits

    xy = outcome.tests[0]
    write_exhibits(
        out,
        Exhibit("direct", load_scenario(plan.direct), outcome.skill, xy),
        Exhibit(
            "mirror",
            load_scenario(plan.scenario),
            outcome.schemes["transfer_default"],
            xy,
        ),
        list(outcome.prototypes),
        plan.seed,
    )


def _print(results: dict[str, Any], console: Any) -> None:
    from rich.table import Table

    table = Table(title=f"Success in {results['scenario']!r}, unseen positions")
    table.add_column("scheme")
    for count in results["samples"]:
        table.add_column(f"{count} samples")
    for name, row in results["schemes"].items():
        rates = [
            row[str(count)]["success_rate"] for count in results["samples"]
        ]
        table.add_row(
            name,
            *(
                f"{rate['mean']:4.0%}  [{rate['low']:.0%}, {rate['high']:.0%}]"
                for rate in rates
            ),
        )
    console.print(table)
