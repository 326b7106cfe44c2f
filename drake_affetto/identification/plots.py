"""Figures of measured and predicted logs."""

from pathlib import Path

from drake_affetto.common.output import (
    atomic_path,
)
from drake_affetto.identification.bands import LEVEL
from drake_affetto.identification.prediction import Prediction


def draw_prediction(path: Path, prediction: Prediction) -> None:
    """Draws a log, measured and simulated, into the image file `path`."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    log = prediction.log
    figure = Figure(figsize=(11, 7), layout="constrained")
    FigureCanvasAgg(figure)
    axes = figure.subplots(
        2, 2, sharex=True, sharey="row", height_ratios=[3, 2]
    )
    for column, (kind, title) in enumerate(
        (
            ("closed_loop", "closed loop, the robot's own PID law"),
            ("open_loop", "open loop, the logged commands"),
        )
    ):
        simulated = getattr(prediction, kind)
        rms = simulated.rms(log)
        top, bottom = axes[:, column]
        top.set_title(
            f"{title}\nrms {rms[0]:.1f} %, {rms[1]:.1f} and {rms[2]:.1f} kPa",
            fontsize=10,
        )
        if column == 0:
            top.plot(log.t, log.q_des, "0.7", label="reference")
        top.plot(log.t, log.q, "k", label="measured")
        top.plot(simulated.t, simulated.q, "C3", label="simulated")
        band = prediction.bands.get(kind.removesuffix("_loop"))
        if band is not None:
            for axis, channel, color in (
                (top, 0, "C3"),
                (bottom, 1, "C0"),
                (bottom, 2, "C1"),
            ):
                axis.fill_between(
                    log.t,
                    band.lower[:, channel],
                    band.upper[:, channel],
                    color=color,
                    alpha=0.2,
                    lw=0,
                    label=f"{LEVEL:.0%} band" if axis is top else None,
                )
        for measured, model, color, name in (
            (log.p_a, simulated.p_a, "C0", "a"),
            (log.p_b, simulated.p_b, "C1", "b"),
        ):
            bottom.plot(log.t, measured, "k", lw=1)
            bottom.plot(simulated.t, model, color, label=f"chamber {name}")
        bottom.set_xlabel("time [s]")
        top.legend(loc="upper right", fontsize=8)
        bottom.legend(loc="lower right", fontsize=8)
        for axis in (top, bottom):
            axis.grid(alpha=0.3)
    axes[0, 0].set_ylabel("joint angle [% of range]")
    axes[1, 0].set_ylabel("pressure [kPa gauge]")
    figure.suptitle(log.name)
    with atomic_path(path) as fresh:
        figure.savefig(fresh, dpi=110)
