"""Fig. 5: schemes of transfer side by side, and which of them differ.

    python analysis/figures/fig5_mirror_transfer.py [--results out/mirror]
        [--out out/mirror]

Draws from the folder of an `affetto mirror`: success of each scheme with 3, 4
and 5 samples, with 95 % intervals (5a); and for each number of samples the
corrected p of all pairs (5b), colored where it is below 0.05. Of an `affetto
mirror --all-scenarios` it draws success by scheme and scenario instead. Writes
fig5_mirror_transfer.png.
"""

import sys

import matplotlib.pyplot as plt
import numpy as np
import study_figure

NAMES = {
    "unchanged": "unchanged",
    "relearn": "relearn",
    "continue": "continue",
    "transfer": "transfer\n(paper)",
    "transfer_default": "transfer\n(default)",
    "transfer_affine": "transfer\n(affine)",
    "gaussian_process": "Gaussian\nprocess",
    "affine_regression": "linear\nregression",
}


def rates(results, name, count):
    """Success rate of a scheme: mean, low, high."""
    found = results["schemes"][name][str(count)]["success_rate"]
    return found["mean"], found["low"], found["high"]


def bars(axes, results) -> None:
    """5a: success of each scheme by the number of samples."""
    schemes, counts = list(results["schemes"]), results["samples"]
    width = 0.8 / len(counts)
    for i, count in enumerate(counts):
        mean, low, high = np.array(
            [rates(results, name, count) for name in schemes]
        ).T
        axes.bar(
            np.arange(len(schemes)) + (i - 0.5 * (len(counts) - 1)) * width,
            mean,
            width,
            yerr=[mean - low, high - mean],
            capsize=3,
            color=plt.colormaps["viridis"](0.25 + 0.6 * i / len(counts)),
            label=f"{count} samples",
        )
    axes.set_xticks(
        range(len(schemes)), [NAMES.get(name, name) for name in schemes]
    )
    axes.set(ylabel="success", ylim=(0.0, 1.05))
    axes.set_title(
        f"(a) {results['scenario']}: {results['evaluations']} unseen "
        f"positions, {results['repeats']} repeats; bars: 95 %"
    )
    axes.legend(fontsize=8, loc="upper left")


def significance(axes, results, count) -> None:
    """5b: which differences are more than chance."""
    schemes = list(results["schemes"])
    axes.set_xlim(-0.5, len(schemes) - 0.5)
    axes.set_ylim(len(schemes) - 0.5, -0.5)
    for row in results["comparisons"]:
        if row["samples"] != count or row["measure"] != "success":
            continue
        i, j = schemes.index(row["a"]), schemes.index(row["b"])
        # The row's scheme against the column's.
        for y, x, sign in ((i, j, 1), (j, i, -1)):
            clear = row["p_corrected"] < 0.05
            better = sign * row["difference"] > 0
            color = ("#9fd3a8" if better else "#f0b7a4") if clear else "#eeeeee"
            axes.add_patch(
                plt.Rectangle((x - 0.5, y - 0.5), 1, 1, fc=color, ec="white")
            )
            axes.text(
                x,
                y,
                f"{100 * sign * row['difference'] + 0.0:+.0f}\n"
                f"p {row['p_corrected']:.3f}",
                ha="center",
                va="center",
                fontsize=6.5,
            )
    ticks = [NAMES.get(name, name) for name in schemes]
    axes.set_xticks(range(len(schemes)), ticks, fontsize=6, rotation=45)
    axes.set_yticks(range(len(schemes)), ticks, fontsize=6)
    axes.set_aspect("equal")
    axes.set_title(f"(b) {count} samples: row minus column, %", fontsize=9)


def table(figure, results) -> None:
    """Success by scheme and scenario."""
    found = results["scenarios"]
    first = next(iter(found.values()))
    schemes, count = list(first["schemes"]), first["samples"][-1]
    mean = np.array(
        [
            [rates(each, name, count)[0] for name in schemes]
            for each in found.values()
        ]
    )
    axes = figure.subplots()
    image = axes.imshow(mean, vmin=0.0, vmax=1.0, cmap="viridis", aspect="auto")
    for i, each in enumerate(found.values()):
        for j, name in enumerate(schemes):
            _, low, high = rates(each, name, count)
            axes.text(
                j,
                i,
                f"{mean[i, j]:.0%}\n{low:.0%} to {high:.0%}",
                ha="center",
                va="center",
                fontsize=8,
                color="white" if mean[i, j] < 0.6 else "black",
            )
    axes.set_xticks(range(len(schemes)), [NAMES.get(n, n) for n in schemes])
    axes.set_yticks(range(len(found)), [n.replace("_", " ") for n in found])
    axes.set_title(
        f"success with {count} samples, {first['evaluations']} unseen "
        f"positions, {first['repeats']} repeats; below: 95 % intervals"
    )
    figure.colorbar(image, ax=axes, label="success")


def draw(results) -> plt.Figure:
    """One view's figure, or the table of all views."""
    if results["study"] == "scenarios":
        figure = plt.figure(figsize=(11, 6), layout="constrained")
        table(figure, results)
        return figure
    counts = results["samples"]
    figure = plt.figure(figsize=(12, 8.5), layout="constrained")
    upper, lower = figure.subfigures(2, 1, height_ratios=[1, 1.1])
    bars(upper.subplots(), results)
    panels = lower.subplots(1, len(counts), squeeze=False)[0]
    for axes, count in zip(panels, counts, strict=True):
        significance(axes, results, count)
    return figure


if __name__ == "__main__":
    sys.exit(
        study_figure.run(
            "fig5_mirror_transfer",
            __doc__.splitlines()[0],
            ["mirror", "scenarios"],
            draw,
        )
    )
