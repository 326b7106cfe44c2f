"""`affetto mirror`: drumming in a changed view, by transfer (paper Fig. 5)."""

import argparse
import dataclasses
from pathlib import Path
from typing import TYPE_CHECKING, Any

from drake_affetto import __version__
from drake_affetto.cli.options import (
    add_plan_arguments,
    add_study_arguments,
    check_study_arguments,
    make_plan,
    rate_text,
    study,
)
from drake_affetto.common.output import write_json
from drake_affetto.experiments.plans import MirrorPlan

if TYPE_CHECKING:
    from drake_affetto.experiments.mirror import MirrorOutcome
    from drake_affetto.experiments.results import MirrorResults


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declares the command's options."""
    which = parser.add_mutually_exclusive_group()
    which.add_argument(
        "--scenario",
        help=f"scenario of the changed view, by name or YAML file "
        f"({MirrorPlan.scenario})",
    )
    which.add_argument(
        "--all-scenarios",
        action="store_true",
        help="run every changed view that comes with the package",
    )
    add_plan_arguments(parser, MirrorPlan)
    parser.add_argument(
        "--no-media",
        action="store_true",
        help="do not record a replay, pictures and sounds of a trial",
    )
    # Its name in version 0.1.0.
    parser.add_argument(
        "--no-exhibits",
        dest="no_media",
        action="store_true",
        default=argparse.SUPPRESS,
        help=argparse.SUPPRESS,
    )
    add_study_arguments(parser, "out/mirror")


def run(args: argparse.Namespace) -> int:
    """Runs the study; returns the exit code."""
    plan = make_plan(
        MirrorPlan,
        args,
        scenario=args.scenario or MirrorPlan.scenario,
        samples=tuple(sorted(args.samples)),
    )
    plan.check()
    check_study_arguments(args)

    from rich.console import Console

    console = Console()
    found = {}
    # The first trials teach the skill in direct view.
    with study(args, console, plan.direct, plan.scenario) as (out, executor):
        from drake_affetto.experiments.mirror import changed_views, run_mirror

        names = changed_views() if args.all_scenarios else [plan.scenario]
        for name in names:
            outcome = run_mirror(
                executor, dataclasses.replace(plan, scenario=name)
            )
            found[name] = outcome.results
            _print(outcome.results, console)
    if not args.no_media and not args.all_scenarios:
        console.print("Recording a direct and a mirrored trial ...")
        _show(out, outcome, plan)
    results: Any = found[names[0]]
    if args.all_scenarios:
        from drake_affetto.experiments.results import ScenariosResults

        results = ScenariosResults("scenarios", __version__, plan.seed, found)
    write_json(out / "results.json", results)
    console.print(f"results: {out / 'results.json'}")
    return 0


def _show(out: Path, outcome: "MirrorOutcome", plan: MirrorPlan) -> None:
    """Writes media of the first repeat: the skill, and transfer's default."""
    from drake_affetto.experiments.media import ShownTrial, write_media
    from drake_affetto.station.scenario import load_scenario

    xy = outcome.positions[0]
    direct, changed = map(load_scenario, (plan.direct, plan.scenario))
    scheme = outcome.schemes["transfer_default"]
    write_media(
        out,
        ShownTrial("direct", direct, outcome.skill, xy),
        ShownTrial("mirror", changed, scheme, xy),
        list(outcome.prototypes),
        plan.seed,
    )


def _print(results: "MirrorResults", console: Any) -> None:
    from rich.table import Table

    table = Table(title=f"Success in {results.scenario!r}, test positions")
    table.add_column("scheme")
    for count in results.samples:
        table.add_column(f"{count} samples")
    for name, cells in results.schemes.items():
        rates = [cells[count].success_rate for count in results.samples]
        table.add_row(name, *map(rate_text, rates))
    console.print(table)
