"""The robot's own PID law as a system, and set-points for our controllers."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike
from pydrake.systems.framework import (
    BasicVector,
    Context,
    DiscreteValues,
    LeafSystem,
)
from pydrake.systems.primitives import AffineSystem

from drake_affetto.common.errors import InputError
from drake_affetto.common.systems import input_port, output_port
from drake_affetto.common.typing import Array
from drake_affetto.robot.controller import RobotController
from drake_affetto.robot.wire import RobotWire

_KPA = 1e3


class RobotPid(LeafSystem):
    """u = kP e + kD ė + kI Σe; set-points are stiffness ± u.

    .. pydrake_system::

        name: RobotPid
        input_ports:
        - desired_state
        - estimated_state
        output_ports:
        - pressure_command

    - `desired_state`, `estimated_state` (2n): [q; q̇], rad, rad/s.
    - `pressure_command` (2n): [p_a; p_b], Pa absolute.

    The discrete state (2n) is the command; its other (n) is Σe, % samples.
    Gains are in the robot's units; chambers are those of our joints.
    """

    def __init__(self, controller: RobotController, wire: RobotWire):
        """Takes the gains of the wire's joints.

        Args:
            controller: Gains and stiffness of the robot's own software.
            wire: Joints and their ranges.

        Raises:
            InputError: If a joint of the wire has no gains.
        """
        super().__init__()
        gains = {joint.name: joint for joint in controller.joints}
        missing = [name for name in wire.names if name not in gains]
        if missing:
            raise InputError(f"no gains for {', '.join(missing)}")
        joints = [gains[name] for name in wire.names]
        n = len(joints)
        self._n = n
        self._gains = np.array([[j.kP, j.kD, j.kI] for j in joints]).T
        # The law counts in percent. Where they run the other way, so do both
        # the error and the chambers: what is left is the magnitude.
        span = np.radians([abs(j.at_100 - j.at_0) for j in wire.joints])
        self._percent = 100.0 / span
        self._middle = controller.stiffness
        self._maximum = controller.command_maximum
        self._atmosphere = wire.atmospheric_pressure
        self.DeclareVectorInputPort("desired_state", BasicVector(2 * n))
        self.DeclareVectorInputPort("estimated_state", BasicVector(2 * n))
        self._command = self.DeclareDiscreteState(
            np.full(2 * n, self._atmosphere)
        )
        self._sum = self.DeclareDiscreteState(n)
        self.DeclareStateOutputPort("pressure_command", self._command)
        self.DeclarePeriodicDiscreteUpdateEvent(
            1.0 / controller.control_rate, 0.0, self._update
        )

    get_desired_state_input_port = input_port("[q; q̇] (2n), rad, rad/s.")
    get_estimated_state_input_port = input_port("[q; q̇] (2n), rad, rad/s.")
    get_pressure_command_output_port = output_port("[p_a; p_b] (2n), Pa.")

    def _update(self, context: Context, values: DiscreteValues) -> None:
        n = self._n
        desired = self.get_desired_state_input_port().Eval(context)
        estimated = self.get_estimated_state_input_port().Eval(context)
        error = (desired - estimated).reshape(2, n) * self._percent
        total = values.get_mutable_value(self._sum)
        total += error[0]
        kP, kD, kI = self._gains
        u = kP * error[0] + kD * error[1] + kI * total
        gauge = np.concatenate([self._middle + u, self._middle - u])
        values.get_mutable_value(self._command)[:] = (
            self._atmosphere + _KPA * np.clip(gauge, 0.0, self._maximum)
        )


def make_set_points(mean: ArrayLike, num_joints: int) -> AffineSystem:
    """A system from wanted pressure differences to set-points.

    p_a = mean + u/2 and p_b = mean - u/2, with u (n), Pa, the `pid_output` of a
    `PidfController`. What is lost against PIDF in flow mode: the loop on the
    pressure difference (the robot's regulators close their own, each chamber
    by itself), the valves' openings, and the rate: a set-point waits for the
    wire's next packet.

    Args:
        mean: Mean pressure of both chambers, Pa absolute, one or (n).
        num_joints: Number n of joints.
    """
    n = num_joints
    half = 0.5 * np.eye(n)
    middle: Array = np.broadcast_to(np.asarray(mean, float), (n,))
    empty: Sequence[float] = []
    return AffineSystem(
        A=np.zeros((0, 0)),
        B=np.zeros((0, n)),
        f0=np.array(empty),
        C=np.zeros((2 * n, 0)),
        D=np.vstack([half, -half]),
        y0=np.concatenate([middle, middle]),
    )
