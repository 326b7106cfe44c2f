"""Joints' angles and speeds, of one and the same time.

A discrete plant's velocity is the mean over its last step: it belongs to half
a step before the angle. At a millisecond this matters little, at two and a
half it would add to the lag of whoever damps a motion by it. So the velocity
is carried on by half of its last change,

    q̇(t_k) = v_k + (v_k - v_{k-1})/2,

which leaves an error of the second order in the step.
"""

import numpy as np
from pydrake.systems.primitives import LinearSystem, MatrixGain

from drake_affetto.scene.joints import JointSelection


def make_joint_state(
    joints: JointSelection, time_step: float
) -> LinearSystem | MatrixGain:
    """A system from a model's state to [q; q̇] of n of its joints.

    Its discrete state (n) is the velocity before the last step, rad/s; zero
    for a robot at rest.

    Args:
        joints: The n joints.
        time_step: The plant's step, s; 0 for a continuous plant, whose
            velocities need no correction.
    """
    if time_step == 0.0:
        return MatrixGain(D=joints.state_matrix)
    n = len(joints.names)
    select_v = joints.state_matrix[n:]
    last = np.zeros((2 * n, n))
    last[n:] = -0.5 * np.eye(n)
    feedthrough = joints.state_matrix.copy()
    feedthrough[n:] *= 1.5
    return LinearSystem(
        A=np.zeros((n, n)),
        B=select_v,
        C=last,
        D=feedthrough,
        time_period=time_step,
    )
