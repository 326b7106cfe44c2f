"""`affetto toy`: the paper's toy experiment of transfer (Fig. 2)."""

import argparse
from typing import TYPE_CHECKING, Any

from drake_affetto.cli.study_command import Call, StudyCommand
from drake_affetto.experiments.plans import ToyPlan

if TYPE_CHECKING:
    from drake_affetto.experiments.results import ToyFigures, ToyResults


class ToyCommand(StudyCommand[ToyPlan]):
    """Transfers a function of two inputs, without the robot."""

    command = "toy"
    plan = ToyPlan
    out = "out/toy"
    trials = "seeds"

    def scenarios(
        self, plan: ToyPlan, args: argparse.Namespace
    ) -> tuple[str, ...]:
        """None."""
        return ()

    def runs_trials(self) -> Any:
        """The function that runs one seed."""
        from drake_affetto.experiments.toy import run_seed

        return run_seed

    def study(self, call: Call[ToyPlan]) -> "ToyResults":
        """Runs what is missing on all domains."""
        from drake_affetto.experiments.toy import run_toy

        return run_toy(call.executor, call.plan)

    def show(self, results: "ToyResults", console: Any) -> None:
        """Prints the tables of both squares."""
        console.print(make_table(results, "[0, 1]²", paper=True))
        assert results.wide is not None
        console.print(make_table(results.wide, "[-1.3, 1.3]²"))
        console.print(f"f = {results.function}")


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

    from drake_affetto.experiments.results import PAPER
    from drake_affetto.experiments.toy import BASELINES, TRANSFERS

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


_COMMAND = ToyCommand()
add_arguments, run = _COMMAND.add_arguments, _COMMAND.run
