"""When does transfer win? Three schemes over what may decide it.

    python analysis/experiments/when_transfer_wins.py [--repeats 3]
        [--samples 3 4 5 8 12] [--workers N] [--out out/conditions]

Before the mirror, one thing at a time is changed from how the study `affetto
mirror` has it: how much the teacher's demonstrations vary, how much of the
workspace is used, and whether samples are taken at random or spread out. In
each condition relearning, transfer in the paper's form and the default transfer
are given 3 to 12 samples. Every trial is simulated in full. Goes on where it
was interrupted. Writes results.json, which `affetto report` takes, and
when_transfer_wins.png.
"""

import argparse
import dataclasses
from pathlib import Path
import sys

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt

from drake_affetto.cli.options import make_plan
from drake_affetto.cli.study_command import StudyCommand
from drake_affetto.common.errors import InputError
from drake_affetto.common.output import atomic_path
from drake_affetto.experiments.mirror import run_mirror
from drake_affetto.experiments.plans import MirrorPlan
from drake_affetto.experiments.results import ConditionRow, ConditionsResults

# Factor and value, and what that changes in the plan.
CONDITIONS = {
    ("teacher", "as taught"): {},
    ("teacher", "no variation"): {"variability": 0.0},
    ("teacher", "twice as varied"): {"variability": 2.0},
    ("workspace", "half each way"): {"workspace": 0.5},
    ("positions", "spread out"): {"choice": "spread"},
}
SCHEMES = ("relearn", "transfer", "transfer_default")


def rows_of(condition, results):
    """The results of one condition, a row for each scheme and count."""
    factor, value = condition
    return [
        ConditionRow(
            factor,
            value,
            scheme,
            count,
            cell.success_rate,
            cell.per_repeat,
        )
        for scheme, by_count in results.schemes.items()
        for count, cell in by_count.items()
    ]


def draw(path: Path, rows, plan) -> None:
    """A panel for each condition: success over samples."""
    figure, panels = plt.subplots(
        1,
        len(CONDITIONS),
        figsize=(3.1 * len(CONDITIONS), 3.6),
        sharey=True,
        layout="constrained",
    )
    for axes, (factor, value) in zip(panels, CONDITIONS, strict=True):
        for i, scheme in enumerate(SCHEMES):
            points = [
                row
                for row in rows
                if (row.factor, row.value, row.scheme)
                == (factor, value, scheme)
            ]
            rates = [row.success_rate for row in points]
            # Side by side, so that all are seen where they are the same.
            axes.errorbar(
                [row.samples + 0.12 * (i - 1) for row in points],
                [rate.mean for rate in rates],
                yerr=[
                    [rate.mean - rate.low for rate in rates],
                    [rate.high - rate.mean for rate in rates],
                ],
                marker="o",
                ms=4,
                capsize=2,
                label=scheme.replace("_", ", "),
            )
        axes.set(xlabel="samples", ylim=(0.0, 1.05))
        axes.set_title(f"{factor}: {value}", fontsize=10)
        axes.grid(alpha=0.3)
    panels[0].set_ylabel("success")
    panels[0].legend(fontsize=8, loc="lower right")
    figure.suptitle(
        f"{plan.evaluations} unseen positions, {plan.repeats} repeats; "
        "bars: 95 %",
        fontsize=10,
    )
    with atomic_path(path) as fresh:
        figure.savefig(fresh, dpi=130)
    plt.close(figure)


class ConditionsCommand(StudyCommand[MirrorPlan]):
    """The mirror study under each condition."""

    command = "when_transfer_wins.py"
    plan = MirrorPlan
    out = "out/conditions"

    def make_plan(self, args):
        """The mirror study's plan, before a condition changes it."""
        return make_plan(
            MirrorPlan,
            args,
            samples=tuple(sorted(args.samples)),
            schemes=SCHEMES,
            # Something to choose from, also for the most samples.
            pool=max(6, *args.samples) + 2,
        )

    def scenarios(self, plan, args):
        """Direct view, in which the first trials teach the skill, and other."""
        return plan.direct, plan.scenario

    def study(self, call):
        """Runs the study under each condition; gives rows of success."""
        rows = []
        for condition, changes in CONDITIONS.items():
            name = ": ".join(condition)
            plan = dataclasses.replace(call.plan, name=name, **changes)
            rows += rows_of(condition, run_mirror(call.executor, plan).results)
        return rows

    def finish(self, call, found):
        """Draws the rows."""
        draw(call.out / "when_transfer_wins.png", found, call.plan)
        return ConditionsResults.of(call.plan, conditions=found)


def main() -> int:
    """Runs the study and draws it."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    command = ConditionsCommand()
    command.add_arguments(parser)
    parser.set_defaults(samples=[3, 4, 5, 8, 12], repeats=3)
    try:
        return command.run(parser.parse_args())
    except InputError as error:
        print(f"when_transfer_wins: {error}", file=sys.stderr)
        return 2
    except KeyboardInterrupt:
        return 130


if __name__ == "__main__":
    sys.exit(main())
