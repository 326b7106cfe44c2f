"""`affetto mirror`: drumming in a changed view, by transfer (paper Fig. 5)."""

import argparse
import dataclasses
from pathlib import Path
from typing import TYPE_CHECKING, Any

from drake_affetto.cli.options import add_renamed_flag, make_plan
from drake_affetto.cli.study_command import Call, StudyCommand, rate_text
from drake_affetto.experiments.plans import MirrorPlan

if TYPE_CHECKING:
    from drake_affetto.experiments.mirror import MirrorOutcome
    from drake_affetto.experiments.results import MirrorResults

Outcomes = dict[str, "MirrorOutcome"]


def _views(plan: MirrorPlan, args: argparse.Namespace) -> list[str]:
    """The changed views that are asked for."""
    if not args.all_scenarios:
        return [plan.scenario]
    from drake_affetto.experiments.mirror import changed_views

    return changed_views()


class MirrorCommand(StudyCommand[MirrorPlan]):
    """Compares schemes of transfer, in one changed view or in all."""

    command = "mirror"
    plan = MirrorPlan
    out = "out/mirror"

    def add_options(self, parser: argparse.ArgumentParser) -> None:
        """Declares which views there are, and what is recorded."""
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
        add_renamed_flag(
            parser,
            "--no-media",
            "--no-exhibits",
            "do not record a replay, pictures and sounds of a trial",
        )

    def make_plan(self, args: argparse.Namespace) -> MirrorPlan:
        """The plan that the options describe."""
        return make_plan(
            MirrorPlan,
            args,
            scenario=args.scenario or MirrorPlan.scenario,
            samples=tuple(sorted(args.samples)),
        )

    def scenarios(
        self, plan: MirrorPlan, args: argparse.Namespace
    ) -> tuple[str, ...]:
        """Direct view, in which the first trials teach the skill, and other."""
        return plan.direct, *_views(plan, args)

    def study(self, call: Call[MirrorPlan]) -> Outcomes:
        """Runs the study of each view; prints its results as they come."""
        from drake_affetto.experiments.mirror import run_mirror

        plan = call.plan
        found = {}
        for name in _views(plan, call.args):
            found[name] = run_mirror(
                call.executor,
                dataclasses.replace(plan, scenario=name),
                call.out,
            )
            _print(found[name].results, call.console)
        return found

    def finish(self, call: Call[MirrorPlan], found: Outcomes) -> Any:
        """Records a trial of each view; gathers the results."""
        plan = call.plan
        if call.args.all_scenarios:
            from drake_affetto.experiments.results import ScenariosResults

            results = {name: each.results for name, each in found.items()}
            return ScenariosResults.of(plan, scenarios=results)
        outcome = found[plan.scenario]
        if not call.args.no_media:
            call.console.print("Recording a direct and a mirrored trial ...")
            _record(call.out, outcome, plan)
        return outcome.results


def _record(out: Path, outcome: "MirrorOutcome", plan: MirrorPlan) -> None:
    """Writes media of the first repeat: the skill, and transfer's default."""
    from drake_affetto.experiments.media import ShownTrial, write_media
    from drake_affetto.station.scenario import load_scenario

    xy = outcome.positions[0]
    direct, changed = map(load_scenario, outcome.scenarios)
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


_COMMAND = MirrorCommand()
add_arguments, run = _COMMAND.add_arguments, _COMMAND.run
