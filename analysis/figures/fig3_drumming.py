"""Figs. 3b and 3c: what the drum sounds like, and success over demonstrations.

    python analysis/figures/fig3_drumming.py [--results out/drum]
        [--out out/drum]

Draws from the folder of an `affetto drum`: the reward as the prototypes slide
over a hit and a miss (3b); success at unseen positions after each
demonstration, with 95 % intervals, in random order and, if `--active` was
given, in the skill's own (3c); the workspace from above with what was taught
and how each test ended; rewards of trials that touched the head and that did
not. Writes fig3_drumming.png.
"""

import sys

import matplotlib.pyplot as plt
import numpy as np
import study_figure


def similarity(axes, results) -> None:
    """3b: the reward at each place of the prototypes."""
    shown = results["similarity"]
    if shown is None:
        axes.set_title("(b) no miss to show", fontsize=10)
        return
    axes.plot(shown["t"], shown["hit"], label="a hit")
    axes.plot(shown["t"], shown["miss"], label="a miss")
    axes.axhline(results["separation"]["threshold"], c="k", ls="--", lw=1)
    axes.set(xlabel="time [s]", ylabel="similarity to the prototypes")
    axes.set_title("(b) dashed: what counts as a success", fontsize=10)
    axes.legend(fontsize=8)


def curves(axes, results) -> None:
    """3c: success after each demonstration."""
    shown = {"random order": results["by_demonstrations"]}
    if results["active"]:
        shown["the skill's own choice"] = results["active"]["by_demonstrations"]
    for name, points in shown.items():
        n = [point["n"] for point in points]
        rates = [point["success_rate"] for point in points]
        (line,) = axes.plot(n, [r["mean"] for r in rates], "o-", ms=3)
        line.set_label(name)
        axes.fill_between(
            n,
            [r["low"] for r in rates],
            [r["high"] for r in rates],
            color=line.get_color(),
            alpha=0.2,
            lw=0,
        )
    axes.set(xlabel="demonstrations", ylabel="success", ylim=(-0.02, 1.03))
    axes.set_title(
        f"(c) {results['evaluations']} unseen positions, "
        f"{results['repeats']} repeats; bands: 95 %",
        fontsize=10,
    )
    axes.legend(fontsize=8, loc="lower right")


def workspace(axes, results) -> None:
    """From above, as the robot has it: x ahead, y to its left."""
    taught = np.array([row["xy"] for row in results["taught"]])
    axes.plot(taught[:, 1], taught[:, 0], "k+", ms=5, label="taught")
    positions = results["final"]["positions"]
    xy = np.array([row["xy"] for row in positions])
    rewards = [row["reward"] for row in positions]
    points = axes.scatter(
        xy[:, 1], xy[:, 0], c=rewards, s=40, vmin=0.0, vmax=1.0, cmap="viridis"
    )
    missed = np.array([not row["success"] for row in positions])
    if missed.any():
        axes.scatter(
            xy[missed, 1],
            xy[missed, 0],
            s=120,
            facecolors="none",
            edgecolors="red",
            label="missed",
        )
    plt.colorbar(points, ax=axes, label="reward at the end")
    axes.set(xlabel="y [m]", ylabel="x [m]", aspect="equal")
    axes.invert_xaxis()
    axes.set_title("positions of the drum", fontsize=10)
    axes.legend(fontsize=8, loc="lower right")


def separation(axes, results) -> None:
    """What the sound says against what happened."""
    told = results["separation"]
    rewards = np.array([row["reward"] for row in results["rewards"]])
    impulse = np.array([row["impulse"] for row in results["rewards"]])
    touched = impulse > told["impulse_threshold"]
    axes.hist(
        [rewards[touched], rewards[~touched]],
        bins=np.linspace(min(0.0, rewards.min()), 1.0, 41),
        stacked=True,
        label=["head struck", "head not struck"],
    )
    axes.axvline(told["threshold"], c="k", ls="--", lw=1)
    axes.set_yscale("symlog", linthresh=10)
    axes.set(xlabel="reward", ylabel="trials")
    axes.set_title(
        f"{told['trials']} trials: {told['false_hits']} false, "
        f"{told['missed_hits']} missed hits",
        fontsize=10,
    )
    axes.legend(fontsize=8)


def draw(results) -> plt.Figure:
    """The four panels of the figure."""
    figure, axes = plt.subplots(2, 2, figsize=(11, 8), layout="constrained")
    for panel, where in zip(
        (similarity, curves, workspace, separation), axes.flat, strict=True
    ):
        panel(where, results)
    return figure


if __name__ == "__main__":
    title = __doc__.splitlines()[0]
    sys.exit(study_figure.run("fig3_drumming", title, ["drum"], draw))
