"""The robot's logs beside the simulation's, both taken at the wire.

The simulation's logs are made over the wire of `affetto serve` from the
references of the robot's (`tests/support/record_over_wire.py`). Compares lag,
tracking error, the answer to the first steps of pressure, and settled
pressures. Writes a table:

    python analysis/experiments/wire_comparison.py --robot LOG... --simulation \
        LOG... --out wire_comparison.md
"""

import argparse
from pathlib import Path

import numpy as np

from drake_affetto.robot.controller import (
    RobotController,
    load_robot_controller,
)
from drake_affetto.robot.log import RobotLog, read_log

ELBOW = 5
# Joints that stand still in all logs, at the lower stop or held by friction.
STILL = (3, 4, 9, 10, 11)
# The tracking is judged after the start, s.
_FROM = 1.0
_LAGS = np.arange(0, 16)


def tracking(log: RobotLog) -> tuple[float, float, float]:
    """Rms tracking error, %, best lag, s, and rms error after it, %."""
    rows = log.t >= _FROM
    error = float(np.sqrt(np.mean((log.q - log.q_des)[rows] ** 2)))
    left = []
    for lag in _LAGS:
        moved = log.q[lag:] - log.q_des[: log.q.size - lag]
        left.append(np.sqrt(np.mean(moved[rows[: moved.size]] ** 2)))
    best = int(np.argmin(left[:-1]))
    near = slice(max(0, best - 1), best + 2)
    # Rows are 33 ms apart: the least of a parabola through three of them.
    curve, slope, _ = np.polyfit(_LAGS[near], left[near], 2)
    lag = -0.5 * slope / curve * np.mean(np.diff(log.t))
    return error, float(lag), float(left[best])


def step_times(log: RobotLog) -> tuple[float, float]:
    """When chamber a, filled from empty, passes 20 and 200 kPa, s."""
    rise = log.p_a - np.mean(log.p_a[:2])
    return tuple(
        float(np.interp(level, rise[:12], log.t[:12]))
        for level in (20.0, 200.0)
    )


def fall_time(log: RobotLog) -> float:
    """When chamber b, vented from its start, has fallen by half of 158 kPa."""
    fall = np.max(log.p_b[:4]) - log.p_b
    return float(np.interp(79.0, fall[2:16], log.t[2:16]))


def compare(
    paths: list[str], controller: RobotController
) -> list[tuple[str, float, float]]:
    """Name, mean and standard deviation over logs of each quantity."""
    values: dict[str, list[float]] = {}

    def add(name: str, value: float) -> None:
        values.setdefault(name, []).append(value)

    for path in paths:
        elbow = read_log(path, ELBOW, controller)
        error, lag, left = tracking(elbow)
        add("left elbow: rms tracking error [%]", error)
        add("left elbow: best lag [ms]", 1e3 * lag)
        add("left elbow: rms error after that lag [%]", left)
        add(
            "left elbow: greatest speed [%/s]",
            np.max(np.abs(elbow.dq_filtered)),
        )
        still = [read_log(path, k, controller, driven=False) for k in STILL]
        add("first row: p_b [kPa]", np.mean([log.p_b[0] for log in still]))
        for name, index in (("20", 0), ("200", 1)):
            times = [1e3 * step_times(log)[index] for log in still]
            add(f"0 to 400 kPa: passes {name} kPa [ms]", np.mean(times))
        falls = [1e3 * fall_time(log) for log in still]
        add("to 400 kPa from above: half way [ms]", np.mean(falls))
        for chamber in ("a", "b"):
            settled = [getattr(log, f"p_{chamber}")[60:] for log in still]
            add(f"settled at 400: p_{chamber} [kPa]", np.mean(settled))
    return [
        (name, float(np.mean(each)), float(np.std(each)))
        for name, each in values.items()
    ]


def draw(robot: RobotLog, simulation: RobotLog, path: str) -> None:
    """Draws one reference, and how both followed it at the wire."""
    import matplotlib.pyplot as plt

    figure, (top, bottom) = plt.subplots(2, 1, sharex=True, figsize=(8, 6))
    top.plot(robot.t, robot.q_des, "0.6", label="reference")
    for log, color, name in (
        (robot, "tab:blue", "robot"),
        (simulation, "tab:orange", "simulation"),
    ):
        top.plot(log.t, log.q, color, label=name)
        bottom.plot(log.t, log.p_a, color, label=f"{name}, chamber a")
        bottom.plot(log.t, log.p_b, color, ls="--", label=f"{name}, chamber b")
    top.set_ylabel("left elbow [% of range]")
    bottom.set_ylabel("pressure [kPa gauge]")
    bottom.set_xlabel("time [s]")
    top.legend(loc="upper right")
    bottom.legend(loc="upper right", ncols=2, fontsize=8)
    figure.tight_layout()
    figure.savefig(path, dpi=110)
    plt.close(figure)


def main() -> None:
    """Prints and writes the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    for side in ("robot", "simulation"):
        parser.add_argument(
            f"--{side}", nargs="+", required=True, metavar="LOG"
        )
    parser.add_argument("--out", metavar="FILE", help="write the table there")
    parser.add_argument(
        "--picture", metavar="FILE", help="draw the first log of each"
    )
    args = parser.parse_args()
    controller = load_robot_controller()
    robot = compare(args.robot, controller)
    simulation = compare(args.simulation, controller)
    lines = ["| | robot | simulation |", "|---|---|---|"]
    for (name, a, sa), (_, b, sb) in zip(robot, simulation, strict=True):
        lines.append(f"| {name} | {a:.1f} ± {sa:.1f} | {b:.1f} ± {sb:.1f} |")
    table = "\n".join(lines)
    print(table)
    if args.picture:
        first = (args.robot[0], args.simulation[0])
        draw(*(read_log(p, ELBOW, controller) for p in first), args.picture)
    if args.out:
        Path(args.out).write_text(table + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
