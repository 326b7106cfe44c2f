"""What teachers as systems have in common: the force on the robot's hand."""

import numpy as np
from pydrake.common.value import Value
from pydrake.multibody.math import SpatialForce
from pydrake.multibody.plant import ExternallyAppliedSpatialForce
from pydrake.multibody.tree import RigidBody
from pydrake.systems.framework import BasicVector, Context, LeafSystem

from drake_affetto.common.systems import output_port, weakly
from drake_affetto.common.typing import Array


class HandForce(LeafSystem):
    """A force, but no torque, on one body: its output ports.

    A subclass declares its inputs and its state, then calls
    `_declare_outputs`, and says in `_pull` how it pulls.
    """

    def _declare_outputs(self, hand: RigidBody, prerequisites: set) -> None:
        """Declares the outputs, which depend on `prerequisites`."""
        self._hand = hand.index()
        self.DeclareAbstractOutputPort(
            name="spatial_force",
            alloc=lambda: Value([ExternallyAppliedSpatialForce()]),
            calc=weakly(self._calc_spatial_force),
            prerequisites_of_calc=prerequisites,
        )
        self.DeclareVectorOutputPort(
            name="pulling_force",
            size=3,
            calc=self._calc_pulling_force,
            prerequisites_of_calc=prerequisites,
        )

    def _pull(self, context: Context) -> tuple[Array, Array] | None:
        """Grasped point (3,), hand frame, m, and force (3,), world frame, N.

        None without a grasp.
        """
        raise NotImplementedError

    get_spatial_force_output_port = output_port(
        "The list for MultibodyPlant's applied_spatial_force."
    )
    get_pulling_force_output_port = output_port(
        "Force on the hand (3), world frame, N."
    )

    def _calc_spatial_force(self, context: Context, output: Value) -> None:
        pull = self._pull(context)
        if pull is None:
            output.set_value([])
            return
        force = ExternallyAppliedSpatialForce()
        force.body_index = self._hand
        force.p_BoBq_B, f = pull
        force.F_Bq_W = SpatialForce(tau=np.zeros(3), f=f)
        output.set_value([force])

    def _calc_pulling_force(
        self, context: Context, output: BasicVector
    ) -> None:
        pull = self._pull(context)
        output.SetFromVector(np.zeros(3) if pull is None else pull[1])
