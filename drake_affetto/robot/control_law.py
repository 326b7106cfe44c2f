"""The control law that made the robot's logs.

    u = kP e + kD ė + kI Σe,  c_a = stiffness + u,  c_b = stiffness - u

with the error e in % of the joint's range and Σ over the samples.
"""

import math

import numpy as np

from drake_affetto.robot.controller import RobotController, RobotJoint
from drake_affetto.robot.log import RobotLog


def initial_error_sum(
    log: RobotLog, joint: RobotJoint, controller: RobotController
) -> float:
    """The sum Σe of the errors before the log begins, % samples.

    The controller keeps it from one run to the next. It is computed from the
    command in the log's first row.

    Args:
        log: Log of the joint.
        joint: Gains of the joint.
        controller: The robot's controller.
    """
    if joint.kI == 0.0:
        return 0.0
    error = log.q_des[0] - log.q_filtered[0]
    u = log.c_a[0] - controller.stiffness
    rest = u - joint.kP * error
    rest -= joint.kD * (log.dq_des[0] - log.dq_filtered[0])
    carried = rest / joint.kI - error
    return carried if math.isfinite(carried) else 0.0


def control_law_error(
    log: RobotLog, joint: RobotJoint, controller: RobotController
) -> float:
    """The rms difference between a log's commands and the control law, kPa.

    It is near zero if the log was made with these gains. Otherwise a closed
    loop that is simulated with them is not that of the robot.

    Args:
        log: Log of the joint.
        joint: Gains of the joint.
        controller: The robot's controller.
    """
    error = log.q_des - log.q_filtered
    total = initial_error_sum(log, joint, controller) + np.cumsum(error)
    u = joint.kP * error + joint.kD * (log.dq_des - log.dq_filtered)
    u += joint.kI * total
    command = np.clip(controller.stiffness + u, 0.0, controller.command_maximum)
    return float(np.sqrt(np.mean((command - log.c_a) ** 2)))
