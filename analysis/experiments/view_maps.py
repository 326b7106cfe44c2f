"""How far simple maps carry from a changed view to the first one.

python analysis/experiments/view_maps.py [--out out/domain_maps] [--repeats 40]

Prints and writes, for each scenario of a changed view, the residuals of the
best affine, projective and quadratic map to the true one (table.md and
maps.png), and how maps of the mirror learn from few samples (samples.png).
"""

import argparse
from pathlib import Path

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np

from drake_affetto.common.output import (
    atomic_path,
    prepare_output,
    write_text_atomic,
)
from drake_affetto.experiments.view_maps import (
    CHANGED_VIEWS,
    REFERENCE,
    TrueMap,
    ViewDomain,
    fit_affine,
    fit_optical,
    fit_projective,
    fit_quadratic,
    learn_from_few,
    make_optical_map,
    measure_true_map,
    measurement_noise,
    with_wrong_camera,
)
from drake_affetto.perception.knowledge import CalibrationError
from drake_affetto.station.scenario import load_scenario

FITS = (fit_affine, fit_projective, fit_quadratic)
SAMPLES = [2, 3, 4, 5, 6, 8, 12, 20]
ERRORS = {
    "camera known exactly": CalibrationError(),
    "focal length 1 %": CalibrationError(focal=0.01),
    "orientation 1°": CalibrationError(angle=np.deg2rad(1.0)),
    "place 5 mm": CalibrationError(position=0.005),
    "height 3 mm": CalibrationError(height=0.003),
    "neck 0.2°": CalibrationError(neck=np.deg2rad(0.2)),
    "all of them": load_scenario("mirror").transfer.errors,
}


def describe(true: TrueMap) -> tuple[list[str], dict[str, np.ndarray]]:
    """A row of the table, and the distances [m] of each fit."""
    errors = true.view.rendered_error(true.view.sight.positions[::4])
    row = [
        true.view.name,
        f"{np.mean(np.isfinite(errors)):.0%}",
        f"{np.nanquantile(errors, 0.95):.2f}",
    ]
    distances = {}
    same = true.distance(true.target)
    row.append(f"{100 * np.sqrt(np.nanmean(same**2)):.1f}")
    for fitter in FITS:
        fit = fitter(true.target, true.source)
        distance = true.distance(fit.predict(true.target))
        distances[fit.name] = distance
        row.append(
            f"{100 * np.sqrt(np.mean(distance**2)):.2f} "
            f"({100 * distance.max():.2f})"
        )
    return row, distances


def draw_maps(
    maps: list[tuple[TrueMap, dict[str, np.ndarray]]], path: Path
) -> None:
    """Each changed view's τ̂ over the table, colored by the affine error."""
    columns = 4
    rows = -(-len(maps) // columns)
    figure, axes = plt.subplots(
        rows, columns, figsize=(3.4 * columns, 3.1 * rows), squeeze=False
    )
    top = max(100 * d["affine"].max() for _, d in maps)
    for axis in axes.flat[len(maps) :]:
        axis.set_visible(False)
    for axis, (true, distances) in zip(axes.flat, maps, strict=False):
        n = round(np.sqrt(len(true.target)))
        grid = true.target.reshape(n, n, 2)
        for line in (*grid, *np.swapaxes(grid, 0, 1)):
            axis.plot(*line.T, color="0.75", lw=0.8, zorder=1)
        dots = axis.scatter(
            *true.target.T,
            c=100 * distances["affine"],
            vmin=0,
            vmax=top,
            s=16,
            cmap="viridis",
            zorder=2,
        )
        rms = {k: 100 * np.sqrt(np.mean(d**2)) for k, d in distances.items()}
        axis.set_title(
            f"{true.view.name}\naffine {rms['affine']:.2f}, projective "
            f"{rms['projective']:.2f},\nquadratic {rms['quadratic']:.2f} cm",
            fontsize=9,
        )
        centered = true.view.sight.fixed_yaw is None
        axis.set_xlabel("y_img" if centered else "x_img", fontsize=8)
        axis.set_ylabel("q3* [rad]" if centered else "y_img", fontsize=8)
        axis.tick_params(labelsize=7)
    figure.tight_layout()
    figure.subplots_adjust(right=0.92)
    bar = figure.colorbar(dots, cax=figure.add_axes((0.94, 0.15, 0.012, 0.7)))
    bar.set_label("error of the best affine map [cm]", fontsize=8)
    with atomic_path(path) as fresh:
        figure.savefig(fresh, dpi=130)
    plt.close(figure)


def learn(true: TrueMap, reference: ViewDomain, repeats: int) -> list:
    """Curves of error against samples for the maps of a mirrored view."""
    noise = measurement_noise(true.view), measurement_noise(reference)
    optical = make_optical_map(true.view, reference)
    curves = [
        learn_from_few(
            true,
            lambda X, Y, rng, fitter=fitter: fitter(X, Y),
            name,
            [n for n in SAMPLES if n >= least],
            repeats,
            noise,
        )
        for name, least, fitter in (
            ("affine", 3, fit_affine),
            ("quadratic", 6, fit_quadratic),
        )
    ]
    for name, error in ERRORS.items():
        curves.append(
            learn_from_few(
                true,
                lambda X, Y, rng, error=error: fit_optical(
                    X,
                    Y,
                    with_wrong_camera(optical, error, rng),
                    noise[1],
                ),
                f"optical, {name}",
                SAMPLES,
                repeats,
                noise,
            )
        )
    return curves


def draw_curves(curves: list, path: Path) -> None:
    """Median error against the number of samples, with its quartiles."""
    figure, axis = plt.subplots(figsize=(8.0, 4.2))
    for k, curve in enumerate(curves):
        low, middle, high = 100 * np.quantile(
            curve.errors, [0.25, 0.5, 0.75], axis=1
        )
        style = "--" if not curve.name.startswith("optical") else "-"
        axis.plot(curve.samples, middle, style, color=f"C{k}", label=curve.name)
        axis.fill_between(
            curve.samples, low, high, color=f"C{k}", alpha=0.12, lw=0
        )
    axis.set_yscale("log")
    axis.set_xlabel("samples")
    axis.set_ylabel("root mean square error on the table [cm]")
    axis.set_xticks(SAMPLES)
    axis.grid(alpha=0.3, which="both")
    axis.legend(fontsize=8, loc="upper left", bbox_to_anchor=(1.01, 1.0))
    figure.tight_layout()
    with atomic_path(path) as fresh:
        figure.savefig(fresh, dpi=130)
    plt.close(figure)


def main() -> None:
    """Measures, prints and draws."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, default=Path("out/domain_maps"))
    parser.add_argument("--repeats", type=int, default=40)
    args = parser.parse_args()
    out = prepare_output(args.out)
    reference = ViewDomain.of(REFERENCE)
    rows = [
        [
            "view",
            "found",
            "pixels, 95 %",
            "unchanged [cm]",
            "affine [cm]",
            "projective [cm]",
            "quadratic [cm]",
        ]
    ]
    maps = []
    for name in CHANGED_VIEWS:
        true = measure_true_map(ViewDomain.of(name), reference)
        row, distances = describe(true)
        rows.append(row)
        maps.append((true, distances))
        print("  ".join(f"{cell:>18}" for cell in row), flush=True)
    lines = ["| " + " | ".join(row) + " |" for row in rows]
    lines.insert(1, "|" + "---|" * len(rows[0]))
    draw_maps(maps, out / "maps.png")
    curves = learn(maps[0][0], reference, args.repeats)
    lines += ["", "| map | " + " | ".join(map(str, SAMPLES)) + " |"]
    lines.append("|" + "---|" * (len(SAMPLES) + 1))
    for curve in curves:
        middle = dict(
            zip(
                curve.samples,
                100 * np.median(curve.errors, axis=1),
                strict=True,
            )
        )
        cells = [f"{middle[n]:.2f}" if n in middle else "" for n in SAMPLES]
        lines.append(f"| {curve.name} | " + " | ".join(cells) + " |")
    draw_curves(curves, out / "samples.png")
    write_text_atomic(out / "table.md", "\n".join(lines) + "\n")
    print("\n".join(lines))


if __name__ == "__main__":
    main()
