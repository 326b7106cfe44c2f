"""`affetto drum`: learning to drum from demonstrations (paper Figs. 3b, 3c)."""

import argparse
from typing import TYPE_CHECKING, Any

from drake_affetto.cli.study_command import Call, StudyCommand, rate_text
from drake_affetto.experiments.plans import DrumPlan

if TYPE_CHECKING:
    from drake_affetto.experiments.results import DrumResults


class DrumCommand(StudyCommand[DrumPlan]):
    """Teaches, and tests the skill after each demonstration."""

    command = "drum"
    plan = DrumPlan
    out = "out/drum"

    def scenarios(
        self, plan: DrumPlan, args: argparse.Namespace
    ) -> tuple[str, ...]:
        """That of the plan."""
        return (plan.scenario,)

    def study(self, call: Call[DrumPlan]) -> "DrumResults":
        """Runs the study."""
        from drake_affetto.experiments.drumming import run_drum

        return run_drum(call.executor, call.plan, call.out)

    def show(self, results: "DrumResults", console: Any) -> None:
        """Prints success over demonstrations, and how good the reward is."""
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
            f"{results.first_try:.0%} of the demonstrations made the drum "
            f"sound at the first try. In {evaluation.trials} trials there "
            f"were {evaluation.false_hits} successes without a hit, and "
            f"{evaluation.missed_hits} of {evaluation.hits} hits were not "
            "heard."
        )


_COMMAND = DrumCommand()
add_arguments, run = _COMMAND.add_arguments, _COMMAND.run
