"""What holds the desired posture against gravity, as an offset of the demand.

A joint's torque is linear in the pressure difference of its chambers, so that
the difference Δp = slope τ_g(q_des) + offset holds it without an error of the
angle.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike
from pydrake.multibody.plant import MultibodyPlant
from pydrake.systems.framework import (
    BasicVector,
    Context,
    DiscreteValues,
    LeafSystem,
)

from drake_affetto.common.errors import require_array, require_range
from drake_affetto.common.systems import input_port, output_port
from drake_affetto.common.typing import Array


class GravityFeedforward(LeafSystem):
    """u_eq of the controller: gravity at the desired posture, or a constant.

    .. pydrake_system::

        name: GravityFeedforward
        input_ports:
        - desired_state
        output_ports:
        - equilibrium_offset

    - `desired_state` (2n): [q_des; q̇_des], rad and rad/s.
    - `equilibrium_offset` (n): Pa; state, updated every `period`.

    The robot's model of its own masses is the plant's. Share of gravity that
    is compensated and a constant offset are a numeric parameter.
    """

    def __init__(
        self,
        plant: MultibodyPlant,
        joint_names: Sequence[str],
        slope: ArrayLike,
        offset: ArrayLike,
        *,
        share: float = 1.0,
        period: float = 0.02,
    ):
        """Declares ports, state and the periodic update.

        Args:
            plant: Finalized plant of the robot.
            joint_names: Names of the n joints of the ports.
            slope: Pressure difference per torque (n,), Pa/(N m).
            offset: Pressure difference without a torque (n,), Pa.
            share: Share of gravity that is compensated.
            period: Time between two updates, s.

        Raises:
            InputError: For arguments that do not fit.
        """
        super().__init__()
        require_range("share", share, 0.0, 1.0)
        require_range("period", period, 1e-4, 1.0)
        self._n = n = len(joint_names)
        self._slope = require_array("slope", slope, (n,), positive=True)
        self._bias = require_array("offset", offset, (n,))
        self._plant = plant
        self._plant_context = plant.CreateDefaultContext()
        joints = [plant.GetJointByName(name) for name in joint_names]
        self._q_index = np.array([j.position_start() for j in joints])
        self._v_index = np.array([j.velocity_start() for j in joints])
        self._positions = plant.GetPositions(self._plant_context)
        self._parameter = int(
            self.DeclareNumericParameter(
                BasicVector(np.append(share, np.zeros(n)))
            )
        )
        self.DeclareVectorInputPort("desired_state", 2 * n)
        self._offset = self.DeclareDiscreteState(n)
        self.DeclareStateOutputPort("equilibrium_offset", self._offset)
        self.DeclarePeriodicDiscreteUpdateEvent(
            period_sec=period, offset_sec=0.0, update=self._update
        )

    get_desired_state_input_port = input_port(
        "[q_des; q̇_des] (2n), rad and rad/s."
    )
    get_equilibrium_offset_output_port = output_port("u_eq (n), Pa.")

    def share(self, context: Context) -> float:
        """The share of gravity that is compensated in this context."""
        return float(context.get_numeric_parameter(self._parameter)[0])

    def holding(self, q: Array) -> Array:
        """Pressure differences (n,), Pa, that hold q (n,), rad."""
        self._positions[self._q_index] = q
        self._plant.SetPositions(self._plant_context, self._positions)
        gravity = self._plant.CalcGravityGeneralizedForces(self._plant_context)
        return -self._slope * gravity[self._v_index] + self._bias

    def reset(self, context: Context, q: Array) -> Array:
        """Puts the robot at rest at q (n,), rad; returns the offset, Pa."""
        offset = self.share(context) * self.holding(q)
        context.SetDiscreteState(self._offset, offset)
        return offset

    def set_constant(self, context: Context, offset: ArrayLike) -> None:
        """Replaces gravity by a constant offset (n,), Pa (paper Eq. 8)."""
        value = np.append(0.0, np.asarray(offset, float))
        vector = context.get_mutable_numeric_parameter(self._parameter)
        vector.SetFromVector(value)
        context.SetDiscreteState(self._offset, value[1:])

    def _update(self, context: Context, values: DiscreteValues) -> None:
        parameter = context.get_numeric_parameter(self._parameter).value()
        offset = parameter[1:].copy()
        if parameter[0] > 0.0:
            desired = self.EvalVectorInput(context, 0).value()
            offset += parameter[0] * self.holding(desired[: self._n])
        values.get_mutable_value(self._offset)[:] = offset
