"""Predictions of logs with the values of a fit."""

import dataclasses

from drake_affetto.identification.simulator import (
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
    """

    log: RobotLog
    start_delay: float
    closed_loop: Simulated
    open_loop: Simulated


def predict(
    simulator: JointSimulator, values: dict[str, float], log: RobotLog
) -> Prediction:
    """Simulates `log` free-running, in closed and in open loop.

    Args:
        simulator: Simulator of the joint.
        values: Values by the parameter's name.
    """
    delay = simulator.estimate_start_delay(values, log)
    return Prediction(
        log=log,
        start_delay=delay,
        closed_loop=simulator.run(values, log, start_delay=delay),
        open_loop=simulator.run(
            values, log, start_delay=delay, closed_loop=False
        ),
    )
