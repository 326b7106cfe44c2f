"""`affetto mirror`: drumming in a changed view, by transfer (paper Fig. 5)."""

import argparse
import dataclasses
from pathlib import Path
import sys
from typing import TYPE_CHECKING, Any

from drake_affetto.cli.options import make_plan, real_number
from drake_affetto.cli.study_command import Call, StudyCommand, rate_text
from drake_affetto.common.errors import require
from drake_affetto.common.fields import option_name
from drake_affetto.experiments.plans import MirrorPlan, SelfCalibrationPlan

if TYPE_CHECKING:
    from drake_affetto.experiments.mirror import MirrorOutcome
    from drake_affetto.experiments.results import MirrorResults
    from drake_affetto.experiments.self_calibration_study import (
        SelfCalibrationOutcome,
    )

Outcomes = dict[str, "MirrorOutcome"]

# Options that say which mirrors the robot finds by itself.
_OF_MIRRORS = ("rotation", "translation")


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
        parser.add_argument(
            "--self-calibrate",
            action="store_true",
            help="the robot finds mirrors by itself, without a demonstration",
        )
        for field in dataclasses.fields(SelfCalibrationPlan):
            if field.name in _OF_MIRRORS:
                parser.add_argument(
                    option_name(field),
                    type=real_number,
                    metavar="X",
                    help=f"{field.metadata['help']} ({field.default:g})",
                )
        parser.add_argument(
            "--calibration",
            metavar="FILE",
            default=SelfCalibrationPlan.settings,
            help="YAML file of the self-calibration's settings",
        )
        parser.add_argument(
            "--no-media",
            action="store_true",
            help="do not record a replay, pictures and sounds of a trial",
        )

    def make_plan(self, args: argparse.Namespace) -> MirrorPlan:
        """The plan that the options describe."""
        return make_plan(
            MirrorPlan,
            args,
            scenario=args.scenario or MirrorPlan.scenario,
            samples=tuple(sorted(args.samples)),
        )

    def run(self, args: argparse.Namespace) -> int:
        """Runs the study; 1 if the robot finds no mirror by itself.

        Raises:
            InputError: If an option or the file of settings does not fit.
        """
        from drake_affetto.calibration.config import load_self_calibration
        from drake_affetto.calibration.plane import CalibrationFailure

        if args.self_calibrate:
            require(
                not args.all_scenarios,
                "--self-calibrate",
                True,
                "one changed view, without --all-scenarios",
            )
            load_self_calibration(args.calibration)
            _self_calibration_plan(self.make_plan(args), args).check()
            _require_mirror(args.scenario or MirrorPlan.scenario)
        for name in _OF_MIRRORS:
            require(
                args.self_calibrate or vars(args)[name] is None,
                f"--{name}",
                vars(args)[name],
                "nothing without --self-calibrate",
            )
        try:
            return super().run(args)
        except CalibrationFailure as failure:
            print(f"affetto: no calibration: {failure}", file=sys.stderr)
            return 1

    def scenarios(
        self, plan: MirrorPlan, args: argparse.Namespace
    ) -> tuple[str, ...]:
        """Direct view, in which the first trials teach the skill, and other."""
        return plan.direct, *_views(plan, args)

    def study(self, call: Call[MirrorPlan]) -> Any:
        """Runs the study of each view; prints its results as they come."""
        if call.args.self_calibrate:
            return _self_calibrate(call)
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

    def finish(self, call: Call[MirrorPlan], found: Any) -> Any:
        """Records a trial of each view; gathers the results."""
        plan = call.plan
        if call.args.self_calibrate:
            if not call.args.no_media and found.repeat is not None:
                call.console.print("Recording the looks and a strike ...")
                _record_calibration(call.out, found, call.args.calibration)
            return found.results
        if call.args.all_scenarios:
            from drake_affetto.experiments.results import ScenariosResults

            results = {name: each.results for name, each in found.items()}
            return ScenariosResults.of(plan, scenarios=results)
        outcome = found[plan.scenario]
        if not call.args.no_media and "transfer_default" in plan.schemes:
            call.console.print("Recording a direct and a mirrored trial ...")
            _record(call.out, outcome, plan)
        return outcome.results


def _require_mirror(scenario: str) -> None:
    """Raises InputError unless a scenario looks into a mirror."""
    from drake_affetto.station.scenario import load_scenario

    loaded = load_scenario(scenario)
    require(
        loaded.look.mode == "fixed_yaw" and bool(loaded.mirrors),
        "--scenario",
        scenario,
        "with --self-calibrate a view into a mirror from a fixed yaw",
    )


def _self_calibration_plan(
    plan: MirrorPlan, args: argparse.Namespace
) -> SelfCalibrationPlan:
    """The plan that the options describe; its own defaults elsewhere."""
    shared = {
        name: value
        for name, value in vars(plan).items()
        if name in SelfCalibrationPlan.__dataclass_fields__
        and value != getattr(MirrorPlan, name)
    }
    asked = {
        name: vars(args)[name]
        for name in _OF_MIRRORS
        if vars(args)[name] is not None
    }
    return SelfCalibrationPlan(settings=args.calibration, **shared, **asked)


def _self_calibrate(call: Call[MirrorPlan]) -> "SelfCalibrationOutcome":
    """Has the robot find mirrors by itself; prints how well."""
    from drake_affetto.experiments.self_calibration_study import (
        run_self_calibration,
    )

    plan = _self_calibration_plan(call.plan, call.args)
    outcome = run_self_calibration(call.executor, plan, call.out)
    _print(outcome.results, call.console)
    _print_methods(outcome.results, call.console)
    return outcome


def _record_calibration(
    out: Path, found: "SelfCalibrationOutcome", settings: str
) -> None:
    """Writes the replay of the first repeat that found its mirror."""
    from drake_affetto.experiments.calibration_media import (
        write_calibration_replay,
    )

    assert found.repeat is not None
    assert found.by_hand is not None
    seed = found.results.seed
    write_calibration_replay(out, settings, found.repeat, found.by_hand, seed)


def _print_methods(results: "MirrorResults", console: Any) -> None:
    from rich.table import Table

    found = results.self_calibration
    assert found is not None
    table = Table(title="Without a demonstration, the same positions")
    for column in ("method", "success", "looks", "strokes", "plane off by"):
        table.add_column(column)
    for name, method in found.methods.items():
        off = "-"
        if method.angle_error is not None and method.offset_error is not None:
            off = f"{method.angle_error:.2f}°, {method.offset_error:.1f} mm"
        table.add_row(
            name,
            rate_text(method.success_rate),
            f"{method.looks:.1f}",
            f"{method.strokes:.0f}",
            off,
        )
    console.print(table)


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
