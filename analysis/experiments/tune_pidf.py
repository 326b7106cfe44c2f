"""Before and after tuning: each joint on a trajectory, and its errors.

    affetto tune --out out/tune
    python analysis/experiments/tune_pidf.py --study out/tune
        [--trajectory chirp]

Simulates the hand-tuned gains and those of the study along one trajectory
(two runs of some seconds) and draws what the joints do.
"""

import argparse
import json
from pathlib import Path

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np

from drake_affetto.common.errors import require_file
from drake_affetto.common.output import atomic_path
from drake_affetto.control.pidf import load_control
from drake_affetto.tuning.config import HELD_OUT, TRAINING
from drake_affetto.tuning.environment import environment, run_reference
from drake_affetto.tuning.plan import load_plan

DESIRED, BEFORE, AFTER = "0.55", "#d55e00", "#0072b2"


def main() -> None:
    """Writes TRAJECTORY.png into the folder of the study, or --figure."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--study", default="out/tune", help="study's folder")
    parser.add_argument(
        "--trajectory", default=TRAINING, choices=[TRAINING, *HELD_OUT]
    )
    parser.add_argument("--figure", help="image file to write")
    args = parser.parse_args()
    folder = Path(args.study)
    results = json.loads(
        require_file("--study", folder / "results.json").read_text()
    )
    plan = load_plan(
        results["joints"],
        seed=results["seed"],
        scenario=results["scenario"],
        start=results["start"],
        tuning=results["tuning"],
    )
    robot = environment(plan)
    reference = robot.reference(args.trajectory)
    runs = [
        run_reference(
            plan, args.trajectory, control.for_joints(robot.names).to_array()
        )
        for control in (
            load_control(plan.start),
            load_control(plan.start, (folder / "gains.yaml",)),
        )
    ]

    n = len(robot.names)
    rows = (n + 1) // 2
    figure, axes = plt.subplots(
        rows, 2, figsize=(11, 2.1 * rows), sharex=True, squeeze=False
    )
    for i, name in enumerate(robot.names):
        ax = axes.flat[i]
        ax.plot(
            reference.t, np.degrees(reference.q[:, i]), color=DESIRED, lw=2.5
        )
        errors = []
        for run, color in zip(runs, (BEFORE, AFTER), strict=True):
            q = np.degrees(run.q[:, i])
            ax.plot(reference.t[: len(q)], q, color=color, lw=1.1)
            error = run.q[:, i] - reference.q[: len(q), i]
            error = error[reference.counted[: len(q)]]
            errors.append(np.degrees(np.sqrt(np.mean(error**2))))
        label = name.replace("_", " ")
        ax.set_title(
            f"{label}: {errors[0]:.2f}° → {errors[1]:.2f}° rms",
            fontsize=9,
            loc="left",
        )
        ax.set_ylabel("angle [°]")
        ax.margins(x=0)
    for ax in axes[-1]:
        ax.set_xlabel("time [s]")
    for ax in list(axes.flat)[n:]:
        ax.set_axis_off()
    figure.legend(
        axes.flat[0].get_lines(),
        ["desired", "hand-tuned", "tuned"],
        loc="upper right",
        ncols=3,
        frameon=False,
    )
    figure.tight_layout(rect=(0, 0, 1, 0.97))
    target = Path(args.figure or folder / f"{args.trajectory}.png")
    with atomic_path(target) as fresh:
        figure.savefig(fresh, dpi=130)
    print(target)


if __name__ == "__main__":
    main()
