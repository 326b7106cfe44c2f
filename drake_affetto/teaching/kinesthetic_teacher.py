"""The simulated kinesthetic teacher as a system."""

from collections.abc import Sequence

import numpy as np
from pydrake.common.value import Value
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import JacobianWrtVariable
from pydrake.systems.framework import Context, DiagramBuilder, DiscreteValues

from drake_affetto.common.errors import require
from drake_affetto.common.systems import input_port
from drake_affetto.common.typing import Array
from drake_affetto.scene.parts import find_frame
from drake_affetto.teaching.hand_force import HandForce
from drake_affetto.teaching.stroke import (
    Stroke,
    TeacherConfig,
    TeacherState,
    advance_teacher,
    intended_position,
    tremor_force,
)


class KinestheticTeacher(HandForce):
    """A simulated person who moves the robot's palm along a stroke.

    This is the kinesthetic teaching of the paper, Sec. V. The teacher grasps
    the palm at `start_time`, at its position at that time, and applies a force
    there, but no torque. Without a stroke the output is an empty list.

    .. pydrake_system::

        name: KinestheticTeacher
        input_ports:
        - estimated_state
        output_ports:
        - spatial_force
        - pulling_force

    - estimated_state: angles and rates of the n joints (2n), rad, rad/s.
    - spatial_force: list[ExternallyAppliedSpatialForce], at most one entry.
    - pulling_force: the same force on the palm (3), world frame, N.

    The stroke and its start are an abstract parameter; see `set_stroke`.
    """

    def __init__(
        self,
        plant: MultibodyPlant,
        joint_names: Sequence[str],
        config: TeacherConfig,
        palm_frame: str = "right_palm",
    ):
        """Makes a teacher for a robot.

        Args:
            plant: Finalized plant of the robot, used for its kinematics only.
            joint_names: Names of the n joints, in the order of
                `estimated_state`.
            config: Parameters of the teacher.
            palm_frame: Frame at whose origin the force is applied.

        Raises:
            InputError: If `config` does not fit.
        """
        super().__init__()
        config.check("teaching")
        self._config = config
        self._plant = plant
        self._plant_context = plant.CreateDefaultContext()
        joints = [plant.GetJointByName(name) for name in joint_names]
        self._q_index = np.array([j.position_start() for j in joints])
        self._v_index = np.array([j.velocity_start() for j in joints])
        palm = find_frame(plant, palm_frame)
        # Their index, for frames and bodies keep the plant, see `weakly`.
        self._body_index = palm.body().index()
        self._p_BoPalm = palm.GetFixedPoseInBodyFrame().translation()
        n = len(joints)
        self._n = n
        self._dt = 1.0 / config.update_rate

        self._state_port = self.DeclareVectorInputPort(
            name="estimated_state", size=2 * n
        )
        self._stroke_index = self.DeclareAbstractParameter(
            Value({"stroke": None, "start_time": np.inf})
        )
        # held (0/1), grasp (3), intention (3), its rate (3), correction (3),
        # force (3)
        self._memory = self.DeclareDiscreteState(16)
        self.DeclarePeriodicDiscreteUpdateEvent(
            period_sec=self._dt, offset_sec=0.0, update=self._update
        )
        self._declare_outputs(palm.body(), {self.xd_ticket()})

    @staticmethod
    def AddToBuilder(
        *,
        builder: DiagramBuilder,
        plant: MultibodyPlant,
        joint_names: Sequence[str],
        config: TeacherConfig,
        palm_frame: str = "right_palm",
        name: str = "kinesthetic_teacher",
    ) -> "KinestheticTeacher":
        """Adds a teacher whose force acts on `plant`.

        The input `estimated_state` is left to be connected.

        Args:
            builder: Builder of the diagram.
            plant: Finalized plant in `builder`, whose applied_spatial_force
                port is not connected yet.
            joint_names: Names of the n joints of `estimated_state`.
            config: Parameters of the teacher.
            palm_frame: Frame at whose origin the force is applied.
            name: Name of the system.

        Raises:
            InputError: If `config` does not fit.
        """
        teacher = builder.AddNamedSystem(
            name, KinestheticTeacher(plant, joint_names, config, palm_frame)
        )
        builder.Connect(
            teacher.get_spatial_force_output_port(),
            plant.get_applied_spatial_force_input_port(),
        )
        return teacher

    get_estimated_state_input_port = input_port(
        "Angles and rates of the n joints (2n), rad, rad/s."
    )

    def set_posture(self, q: Array) -> None:
        """Sets the positions of the joints that are not in the input.

        Args:
            q: Positions of the whole plant (nq,). Those of the n joints are
                replaced by the input's at each update.
        """
        self._plant.SetPositions(self._plant_context, q)

    def set_stroke(
        self, context: Context, stroke: Stroke | None, start_time: float
    ) -> None:
        """Sets the stroke, and the time at which the palm is grasped.

        Args:
            context: Context of this system.
            stroke: The intended motion, or None to release the robot.
            start_time: Time of the grasp, s; finite where there is a stroke.

        Raises:
            InputError: If `start_time` is not finite.
        """
        require(
            stroke is None or np.isfinite(start_time),
            "start_time",
            start_time,
            "a finite time where there is a stroke",
        )
        context.get_mutable_abstract_parameter(self._stroke_index).set_value(
            {"stroke": stroke, "start_time": float(start_time)}
        )
        # The next update is a new grasp.
        context.get_mutable_discrete_state(self._memory).SetFromVector(
            np.zeros(16)
        )

    def palm(self, state: Array) -> tuple[Array, Array]:
        """Position (3,), m, and velocity (3,), m/s, of the palm, world frame.

        Args:
            state: Angles and rates (2n), as in `estimated_state`.
        """
        plant, context, world = (
            self._plant,
            self._plant_context,
            self._plant.world_frame(),
        )
        q = plant.GetPositions(context)
        q[self._q_index] = state[: self._n]
        plant.SetPositions(context, q)
        body = self._plant.get_body(self._body_index)
        X_WB = body.EvalPoseInWorld(context)
        J = plant.CalcJacobianTranslationalVelocity(
            context,
            JacobianWrtVariable.kV,
            body.body_frame(),
            self._p_BoPalm,
            world,
            world,
        )
        return X_WB @ self._p_BoPalm, J[:, self._v_index] @ state[self._n :]

    def _update(self, context: Context, values: DiscreteValues) -> None:
        task = context.get_abstract_parameter(self._stroke_index).get_value()
        stroke, start_time = task["stroke"], task["start_time"]
        memory = values.get_mutable_value(self._memory)
        # Half an update of slack: a start on the grid is not missed by 1 ulp.
        t = context.get_time() - start_time
        if stroke is None or t < -0.5 * self._dt:
            memory[:] = 0.0
            return
        palm, velocity = self.palm(self._state_port.Eval(context))
        if memory[0] == 0.0:
            memory[0] = 1.0
            memory[1:4] = palm
            state = TeacherState.at(palm)
        elif t > self._config.duration:
            # The demonstration is over: the teacher releases the palm.
            memory[13:16] = 0.0
            return
        else:
            state = TeacherState(
                memory[4:7], memory[7:10], memory[10:13], memory[13:16]
            )
        state = advance_teacher(
            self._config,
            state,
            intended_position(stroke, memory[1:4].copy(), max(t, 0.0)),
            palm,
            velocity,
            tremor_force(stroke, t),
            self._dt,
        )
        memory[4:16] = np.concatenate(
            [
                state.intention,
                state.intention_rate,
                state.correction,
                state.force,
            ]
        )

    def _pull(self, context: Context) -> tuple[Array, Array] | None:
        """See base class."""
        memory = context.get_discrete_state(self._memory).value()
        return None if memory[0] == 0.0 else (self._p_BoPalm, memory[13:16])
