"""Fig. 2: a skill on its square, on the turned square, and after transfer.

    python analysis/figures/fig2_toy.py [--seed N] [--repeat N]
        [--domain unit|wide] [--results DIR] [--out DIR]

Draws, for one seed and one choice of five points, what the ELM predicts (as
colors between black contours of the truth, which the predictions should
follow): (a) where it has learned, (b) on the turned square, (c) there, through
the map h of the default transfer, and beside it of the paper's way.
With `--results`, the folder of an `affetto toy`, the lowest row shows how the
errors on the other points are distributed over all seeds. Writes fig2_toy.png.
"""

import argparse
import sys
import warnings

import matplotlib.pyplot as plt
import numpy as np
import study_figure

from drake_affetto.common.errors import InputError
from drake_affetto.common.output import prepare_output
from drake_affetto.experiments import toy


def grid(low, high, turn, n=60):
    """Points (n², 2) of the square, and what they stand for when turned."""
    axis = np.linspace(low, high, n)
    Z = np.stack(np.meshgrid(axis, axis), axis=-1).reshape(-1, 2)
    return Z, Z @ turn.T


def panel(axes, X, values, truth, levels, title, points, labeled):
    """One map of predictions with contours of the truth."""
    n = round(np.sqrt(len(X)))
    x, y = X[:, 0].reshape(n, n), X[:, 1].reshape(n, n)
    filled = axes.contourf(
        x, y, values.reshape(n, n), levels, cmap="viridis", extend="both"
    )
    axes.contour(
        x, y, truth.reshape(n, n), levels[::3], colors="k", linewidths=0.6
    )
    axes.scatter(*points.T, s=7, c="white", linewidths=0)
    if labeled is not None:
        axes.scatter(*labeled.T, s=55, c="red", edgecolors="white")
    error = np.mean((values - truth) ** 2)
    axes.set_title(f"{title}\nmean squared error {error:.3g}", fontsize=10)
    axes.set(xlabel="$x_1$", ylabel="$x_2$", aspect="equal")
    return filled


def maps(figure, domain, seed, repeat):
    """Panels a, b, c, and c as the paper does it."""
    problem = toy.make_problem(domain, seed)
    known = toy.subset(seed, repeat)
    Z, turned = grid(domain.low, domain.high, toy.TURN)
    truth = toy.toy_function(Z)
    levels = np.linspace(truth.min(), truth.max(), 19)
    X, y = problem.X_target[known], problem.y_target[known]
    fitted = {}
    with warnings.catch_warnings():
        # Five points, six parameters: that is the experiment.
        warnings.simplefilter("ignore", UserWarning)
        for name in ("default", "paper"):
            transfer = toy.make_transfer(name, problem.source, repeat)
            fitted[name] = transfer.fit(X, y).predict(turned)
    source = problem.source
    panels = [
        ("(a) where it was learned", Z, source.predict(Z), problem.X, None),
        (
            "(b) turned, unchanged",
            turned,
            source.predict(turned),
            problem.X_target,
            None,
        ),
        (
            "(c) turned, after transfer",
            turned,
            fitted["default"],
            problem.X_target[~known],
            X,
        ),
        (
            "(c') after the paper's way",
            turned,
            fitted["paper"],
            problem.X_target[~known],
            X,
        ),
    ]
    axes = figure.subplots(1, len(panels))
    for a, (title, where, values, points, labeled) in zip(
        axes, panels, strict=True
    ):
        filled = panel(a, where, values, truth, levels, title, points, labeled)
    figure.colorbar(filled, ax=axes, label="f", shrink=0.8)


def distributions(figure, results):
    """Mean errors on the other points by method, a dot for each seed."""
    squares = {"[0, 1]²": results, "[-1.3, 1.3]²": results["wide"]}
    names = {
        name: ("transfer", label) for name, label in toy.TRANSFERS.items()
    } | {
        name: ("baselines", label)
        for name, label in toy.BASELINES.items()
        if name != "unchanged"
    }
    axes = figure.subplots(1, 2, sharey=True)
    for a, (square, figures) in zip(axes, squares.items(), strict=True):
        for row, (name, (group, _)) in enumerate(names.items()):
            found = figures[group][name]
            values = found["per_seed"]["other_mse_mean"]
            color = "C0" if group == "transfer" else "C1"
            a.plot(values, np.full(len(values), row), "o", c=color, alpha=0.3)
            a.plot(found["other_mse_mean"], row, "|", c="k", ms=16, mew=2)
        a.set(xscale="log", xlabel="mean squared error on the others")
        a.set_title(f"{square}: dots seeds, lines medians", fontsize=10)
        a.grid(axis="x", alpha=0.3)
    paper = results["paper"]["transfer"]["other_mse_mean"]
    axes[0].axvline(paper, ls="--", c="gray", label="paper")
    axes[0].legend(fontsize=8)
    axes[0].set_yticks(
        range(len(names)), [label for _, label in names.values()], fontsize=8
    )
    axes[0].invert_yaxis()


def main() -> int:
    """Draws and writes the figure."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--repeat", type=int, default=0)
    parser.add_argument("--domain", choices=list(toy.DOMAINS), default="unit")
    parser.add_argument("--results", metavar="DIR")
    parser.add_argument("--out", metavar="DIR", default="out/toy")
    args = parser.parse_args()
    try:
        out = prepare_output(args.out)
        results = None
        if args.results is not None:
            results = study_figure.load_results(args.results, ["toy"])
    except InputError as error:
        print(f"fig2_toy: {error}", file=sys.stderr)
        return 2
    rows = 1 if results is None else 2
    figure = plt.figure(figsize=(15, 4.0 * rows), layout="constrained")
    parts = figure.subfigures(rows, 1, squeeze=False)[:, 0]
    maps(parts[0], toy.DOMAINS[args.domain], args.seed, args.repeat)
    if results is not None:
        distributions(parts[1], results)
    study_figure.save(figure, out, "fig2_toy")
    return 0


if __name__ == "__main__":
    sys.exit(main())
