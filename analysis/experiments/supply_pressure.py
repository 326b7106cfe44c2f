"""Which air supply do the robot's logs show? Steps after the initializer.

    python analysis/experiments/supply_pressure.py LOG...

Before the first row of a log the robot's initializer raises the commands of all
chambers b at 56.5 kPa/s to 564.7 kPa; then all chambers are sent to 400 kPa.
For each supply pressure the two conductances are fitted, over a grid, to the
mean of the joints that stand still, each log with the dead time that suits it
best, and the remaining squared error is printed.
"""

import argparse
from collections.abc import Sequence
import dataclasses
import itertools
from pathlib import Path

import numpy as np

from drake_affetto.common.csv_columns import read_columns
from drake_affetto.common.typing import Array
from drake_affetto.pneumatics.chamber import (
    REGULATOR_MODE,
    Row,
    memory_size,
    step_joints,
)
from drake_affetto.pneumatics.parameters import (
    JointActuator,
    PneumaticParameters,
    load_parameters,
)

JOINTS = 13
ROWS = 22
PERIOD = 1.0 / 30.0
STEP = 0.001
# Commands of chambers b before a log begins, kPa gauge and kPa/s.
RAMP_END, RAMP_RATE, RAMP_TIME = 564.7, 56.47, 1.2
STEP_LEVEL = 400.0
# A joint that moves by more in the first rows does not stand still, %.
STILL = 4.0
DELAYS = np.arange(0.05, 0.14, 0.004)
# Any chamber: only conductance by volume matters.
VOLUME = 1e-5


def mean_steps(path: Path) -> Array:
    """Pressures (ROWS, 2) of chambers a and b, mean of still joints, kPa.

    Sensors' offsets are taken off: at rest a chamber has what was commanded.
    """
    names = ["t"]
    for kind in ("rq", "rpa", "rpb", "ca", "cb"):
        names += [f"{kind}{j}" for j in range(JOINTS)]
    data = read_columns(path, names, [])
    courses = []
    for j in range(JOINTS):
        if np.ptp(data[f"rq{j}"]) > STILL:
            continue
        off = np.median(data[f"rpb{j}"][60:] - data[f"cb{j}"][60:] * 600 / 255)
        courses.append([data[f"rpa{j}"][:ROWS], data[f"rpb{j}"][:ROWS] - off])
    return np.mean(courses, axis=0).T


def simulate(
    parameters: PneumaticParameters,
    supply: float,
    fill: float,
    exhaust: float,
    delay: float,
) -> Array:
    """The same of the model (ROWS, 2), kPa gauge.

    Args:
        parameters: Parameters of the robot.
        supply: Supply pressure, kPa gauge.
        fill: Conductance for filling, 1/s of the volume.
        exhaust: The same of the exhaust.
        delay: Dead time, s.
    """
    atmosphere = parameters.atmospheric_pressure
    # A chamber whose volume does not change, and the same for b.
    actuator = dataclasses.replace(
        parameters.classes["rotation"],
        torque_constant=1e-12,
        dead_volume=VOLUME,
        fill_conductance=fill * VOLUME / 1.2e5,
        exhaust_conductance=exhaust * VOLUME / 1.2e5,
        leak_conductance=0.05 * VOLUME / 1.2e5,
        dead_time=delay,
    )
    array = dataclasses.replace(
        parameters,
        supply_pressure=1e3 * supply + atmosphere,
        classes={"still": actuator},
        joints={"joint": JointActuator("still")},
    ).for_joints(["joint"], [0.0], [1.0])
    times = np.arange(-RAMP_TIME, ROWS * PERIOD, STEP)
    last = np.minimum(np.floor(times / PERIOD) * PERIOD, 0.0)
    ramp = RAMP_END + RAMP_RATE * last
    before = times < -1e-9
    commands = 1e3 * np.stack(
        [
            np.where(before, 0.0, STEP_LEVEL),
            np.where(before, ramp, STEP_LEVEL),
        ],
        axis=1,
    )
    pressure = commands[0] + atmosphere
    memory = np.zeros(memory_size(1, STEP, float(array[Row.DEAD_TIME, 0])))
    torque, flow, still = np.zeros(1), np.zeros(2), np.zeros(2)
    course = np.empty((times.size, 2))
    for i, command in enumerate(commands):
        course[i] = pressure
        step_joints(
            STEP,
            REGULATOR_MODE,
            0.0,
            array,
            command + atmosphere,
            still,
            pressure,
            torque,
            flow,
            memory,
        )
    rows = np.searchsorted(times, PERIOD * np.arange(ROWS) - 1e-9)
    return 1e-3 * (course[rows] - atmosphere)


def misfit(
    parameters: PneumaticParameters,
    measured: Sequence[Array],
    supply: float,
    fill: float,
    exhaust: float,
) -> float:
    """Squared error over all logs, kPa²."""
    candidates = [
        simulate(parameters, supply, fill, exhaust, delay) for delay in DELAYS
    ]
    return sum(
        min(float(np.sum((each - log) ** 2)) for each in candidates)
        for log in measured
    )


def main() -> None:
    """Runs the study."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("logs", nargs="+", type=Path, metavar="LOG")
    parser.add_argument(
        "--supply",
        nargs="+",
        type=float,
        default=[558.0, 580.0, 600.0, 640.0],
        help="supply pressures, kPa gauge",
    )
    args = parser.parse_args()
    parameters = load_parameters()
    measured = [mean_steps(path) for path in args.logs]
    rows = np.mean(measured, axis=0)
    print("chambers b, first rows [kPa]:", *(f"{x:.1f}" for x in rows[:3, 1]))
    print("supply [kPa]   fill, exhaust [1/s]   rms error [kPa]")
    for supply in args.supply:
        best = min(
            (misfit(parameters, measured, supply, fill, exhaust), fill, exhaust)
            for fill, exhaust in itertools.product(
                (4.4, 4.7, 5.0, 5.3), (1.7, 1.8, 1.9)
            )
        )
        rms = (best[0] / (2 * ROWS * len(measured))) ** 0.5
        print(
            f"{supply:8.0f} {best[1]:14.1f} {best[2]:6.1f} {rms:17.2f}",
            flush=True,
        )


if __name__ == "__main__":
    main()
