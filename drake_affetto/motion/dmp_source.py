"""A Dynamic Movement Primitive as a Drake system."""

from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from pydrake.systems.framework import (
    BasicVector,
    Context,
    DiagramBuilder,
    DiscreteValues,
    LeafSystem,
)

from drake_affetto.common.errors import require, require_array, require_range
from drake_affetto.common.systems import input_port, output_port
from drake_affetto.motion.dmp import Dmp


class DmpSource(LeafSystem):
    """Plays the movement that the policy parameters describe.

    .. pydrake_system::

        name: DmpSource
        input_ports:
        - policy_parameters
        - start_time
        output_ports:
        - desired_state

    - policy_parameters (F = n·K): θ, rad/s², joint after joint.
    - start_time (1): s; infinite as long as there is nothing to play.
    - desired_state (2n): [q; q̇], rad and rad/s.

    Discrete state: [q; q̇] (2n) and the phase x (1), updated periodically. Until
    `start_time` the phase is held at 1 and the posture at the goal. From the
    first update at or after `start_time` on, each update is one exact step of
    `Dmp`: the output i periods later equals sample i of `Dmp.rollout`. When x
    has come to 0 the posture settles at the goal, and stays there.

    The goal is the start posture, which is a parameter of the context, as is
    the duration. Both inputs are read at each update. A change of θ on the way
    changes the acceleration and so never makes q jump; a `start_time` moved
    into the future sends the arm back to its start posture as the spring of
    the DMP does, to begin anew from wherever it then is.

    Args:
        dmp: the movement primitive.
        num_joints: n.
        update_period: s.
        start_posture: (n,), rad, in a default context; zeros when None.

    Raises:
        InputError: if a value does not fit.
    """

    # Indices of the input ports, in the order of their declaration.
    _THETA, _START = 0, 1

    def __init__(
        self,
        dmp: Dmp,
        num_joints: int,
        *,
        update_period: float = 0.005,
        start_posture: ArrayLike | None = None,
    ) -> None:
        super().__init__()
        require(num_joints > 0, "num_joints", num_joints, "at least one joint")
        require_range("update_period", update_period, 1e-5, 10.0)
        self._dmp = dmp
        self._n = num_joints
        self._period = float(update_period)
        # Of the latest duration: each context has its own.
        self._table = dmp.step_table(self._period, dmp.duration)
        posture = np.zeros(num_joints)
        if start_posture is not None:
            posture[:] = self._checked_posture(start_posture)

        n_basis = dmp.n_basis
        self.DeclareVectorInputPort(
            name="policy_parameters", size=num_joints * n_basis
        )
        self.DeclareVectorInputPort(name="start_time", size=1)
        self._posture_index = self.DeclareNumericParameter(BasicVector(posture))
        self._duration_index = self.DeclareNumericParameter(
            BasicVector(np.array([dmp.duration]))
        )
        state = np.concatenate([posture, np.zeros(num_joints)])
        state_index = self.DeclareDiscreteState(BasicVector(state))
        phase_index = self.DeclareDiscreteState(BasicVector(np.ones(1)))
        self._state_index = int(state_index)
        self._phase_index = int(phase_index)
        self.DeclareStateOutputPort(
            name="desired_state", state_index=state_index
        )
        self.DeclarePeriodicDiscreteUpdateEvent(
            period_sec=self._period, offset_sec=0.0, update=self._update
        )

    @property
    def dmp(self) -> Dmp:
        """The movement primitive that this system plays."""
        return self._dmp

    @property
    def num_joints(self) -> int:
        """n."""
        return self._n

    get_policy_parameters_input_port = input_port("θ (F,), rad/s².")
    get_start_time_input_port = input_port("When the movement starts (1,), s.")
    get_desired_state_output_port = output_port("[q; q̇] (2n,), rad and rad/s.")

    def set_start_posture(self, context: Context, q: ArrayLike) -> None:
        """Makes q (n,), rad, the start posture and goal, and rests there.

        The phase is set to 1. Set it before a simulation, not within one: the
        desired posture jumps to q.

        Args:
            q: Angles of the joints (n,), rad.

        Raises:
            InputError: if q has another size or is not finite.
        """
        posture = self._checked_posture(q)
        context.get_mutable_numeric_parameter(
            self._posture_index
        ).SetFromVector(posture)
        context.SetDiscreteState(
            self._state_index, np.concatenate([posture, np.zeros(self._n)])
        )
        context.SetDiscreteState(self._phase_index, np.ones(1))

    def set_duration(self, context: Context, duration: float) -> None:
        """Sets the duration of the movement, s.

        Args:
            duration: Duration, s.

        Raises:
            InputError: if it is no positive number.
        """
        require_range("duration", float(duration), 1e-3, 1e6)
        context.get_mutable_numeric_parameter(
            self._duration_index
        ).SetFromVector(np.array([float(duration)]))

    def get_phase(self, context: Context) -> float:
        """x: 1 before and at the start, 0 from the end of the movement on."""
        return float(context.get_discrete_state(self._phase_index).value()[0])

    def get_start_posture(self, context: Context) -> np.ndarray:
        """(n,), rad."""
        return context.get_numeric_parameter(self._posture_index).CopyToVector()

    def get_duration(self, context: Context) -> float:
        """s."""
        parameter = context.get_numeric_parameter(self._duration_index)
        return float(parameter.value()[0])

    def _checked_posture(self, q: ArrayLike) -> np.ndarray:
        return require_array("start_posture", q, (self._n,))

    def _update(self, context: Context, values: DiscreteValues) -> None:
        dmp = self._dmp
        # Views of the new values, which hold the old ones still.
        state: Any = values.get_mutable_vector(
            self._state_index
        ).get_mutable_value()
        phase: Any = values.get_mutable_vector(
            self._phase_index
        ).get_mutable_value()
        goal = context.get_numeric_parameter(self._posture_index).value()
        duration = context.get_numeric_parameter(self._duration_index).value()
        table = self._table
        if table.duration != duration[0]:
            table = dmp.step_table(self._period, float(duration[0]))
            self._table = table
        # Views of the inputs: a port's `Eval` would copy.
        start_time: Any = self.EvalVectorInput(context, self._START).value()
        # Times of events are products of the period, and round differently
        # from sums such as "now plus a delay".
        started = context.get_time() >= start_time[0] - 1e-6 * self._period
        if not started:
            phase[0] = 1.0
            dmp.advance(0.0, state.reshape(2, -1), None, goal, table)
            return
        weights: Any = self.EvalVectorInput(context, self._THETA).value()
        phase[0] = dmp.advance(
            float(phase[0]),
            state.reshape(2, -1),
            weights.reshape(self._n, -1),
            goal,
            table,
        )

    @staticmethod
    def AddToBuilder(
        *,
        builder: DiagramBuilder,
        dmp: Dmp,
        num_joints: int,
        update_period: float = 0.005,
        name: str = "dmp_source",
    ) -> "DmpSource":
        """Adds a DmpSource of that name to the builder and returns it.

        Args:
            dmp: The movement primitive.
            num_joints: Number of joints, n.
            update_period: Period of the updates, s.
        """
        system = DmpSource(dmp, num_joints, update_period=update_period)
        return builder.AddNamedSystem(name, system)
