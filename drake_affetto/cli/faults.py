"""`affetto faults`: what faults do to the robot, and whether it notices."""

import argparse
from typing import TYPE_CHECKING, Any

from drake_affetto.cli.study_command import Call, StudyCommand
from drake_affetto.common.errors import require
from drake_affetto.experiments.plans import FaultsPlan

if TYPE_CHECKING:
    from drake_affetto.experiments.results import FaultsResults


class FaultsCommand(StudyCommand[FaultsPlan]):
    """Injects faults of each kind and size into the whole chain."""

    command = "faults"
    plan = FaultsPlan
    out = "out/faults"

    def run(self, args: argparse.Namespace) -> int:
        """Runs the study; returns the exit code.

        Raises:
            InputError: If an option, the scenario or the catalog does not fit.
        """
        from drake_affetto.experiments.fault_catalog import load_catalog
        from drake_affetto.station.scenario import load_scenario

        catalog = load_catalog(args.catalog)
        scenario = load_scenario(args.scenario)
        require(
            scenario.supervisor.enabled,
            "--scenario",
            args.scenario,
            "a scenario with supervisor: {enabled: true}",
        )
        for joint in catalog.joints:
            require(
                joint in scenario.active_joints,
                "--catalog: joints",
                joint,
                f"active joints of {args.scenario}",
            )
        return super().run(args)

    def scenarios(
        self, plan: FaultsPlan, args: argparse.Namespace
    ) -> tuple[str, ...]:
        """That of the plan."""
        return (plan.scenario,)

    def study(self, call: Call[FaultsPlan]) -> "FaultsResults":
        """Runs the study."""
        from drake_affetto.experiments.faults import run_faults

        return run_faults(call.executor, call.plan)

    def show(self, results: "FaultsResults", console: Any) -> None:
        """Prints the table of faults and sizes, and what it comes to."""
        from rich.table import Table

        table = Table(title=f"Faults, {results.repeats} trials each")
        table.add_column("fault", no_wrap=True)
        for column in ("size", "success", "false", "detected"):
            table.add_column(column)
        for column in ("after [s]", "missed", "force [N]", "speed [rad/s]"):
            table.add_column(column, justify="right")
        for row in results.rows:
            size = "" if row.size is None else f"{row.size:g} {row.unit}"
            late = row.detection_time
            table.add_row(
                row.kind.replace("_", " "),
                size,
                str(row.success),
                str(row.false_success),
                str(row.detected),
                "-" if late is None else f"{late:.2f}",
                str(row.missed),
                f"{row.max_force:.1f}",
                f"{row.max_speed:.1f}",
            )
        console.print(table)
        sound = results.sound
        console.print(
            f"{results.faulted} trials with a fault: "
            f"{results.false_success} false successes, {results.missed} "
            f"changed unnoticed. {sound.trials} without: "
            f"{sound.false_alarms} false alarms, "
            f"{sound.false_success} false successes. "
            f"{results.beyond_limit} with more than {results.force_limit:g} N."
        )


_COMMAND = FaultsCommand()
add_arguments, run = _COMMAND.add_arguments, _COMMAND.run
