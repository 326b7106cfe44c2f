"""Predictions of logs with the values of a fit."""

from collections.abc import Mapping
import dataclasses

import numpy as np

from drake_affetto.identification.bands import (
    LOOPS,
    Band,
    BandScale,
    member_courses,
)
from drake_affetto.identification.fit import FitState
from drake_affetto.identification.simulator import (
    JUDGED_FROM,
    JointSimulator,
    Simulated,
)
from drake_affetto.robot.log import (
    RobotLog,
)


@dataclasses.dataclass(frozen=True)
class Prediction:
    """A log and its two simulations.

    Attributes:
        log: The log.
        start_delay: Dead time of its start, from its first second, s.
        closed_loop: Simulation under the robot's own control law.
        open_loop: Simulation under the logged commands.
        bands: Prediction intervals by loop, "closed" and "open"; none where
            the fit had a single log.
        drift_per_kpa: By how much the angle in open loop changes (rms), where
            chamber a is commanded 1 kPa more throughout, %.
    """

    log: RobotLog
    start_delay: float
    closed_loop: Simulated
    open_loop: Simulated
    bands: Mapping[str, Band] = dataclasses.field(default_factory=dict)
    drift_per_kpa: float = 0.0


def predict(
    simulator: JointSimulator,
    state: FitState,
    log: RobotLog,
    scales: Mapping[str, BandScale] | None = None,
) -> Prediction:
    """Simulates `log` free-running, in closed and in open loop.

    Args:
        simulator: Simulator of the joint.
        state: State of the finished fit.
        log: Log to predict.
        scales: Scales of the bands by loop; None for no bands.
    """
    values = state.values
    delay = simulator.estimate_start_delay(values, log)
    closed = simulator.run(values, log, start_delay=delay)
    opened = simulator.run(values, log, start_delay=delay, closed_loop=False)
    more = dataclasses.replace(log, c_a=log.c_a + 1.0)
    shifted = simulator.run(values, more, start_delay=delay, closed_loop=False)
    moved = (shifted.q - opened.q)[opened.t >= JUDGED_FROM]
    bands = {}
    if scales:
        courses = member_courses(simulator, state, log)
        for loop, center in zip(LOOPS, (closed, opened), strict=True):
            bands[loop] = scales[loop].band(
                center, list(courses[loop].values())
            )
    return Prediction(
        log=log,
        start_delay=delay,
        closed_loop=closed,
        open_loop=opened,
        bands=bands,
        drift_per_kpa=float(np.sqrt(np.mean(moved**2))),
    )
