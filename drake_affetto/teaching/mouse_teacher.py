"""Mouse teaching: a person moves the robot's hand in the browser."""

import numpy as np
from pydrake.common.value import Value
from pydrake.geometry import Meshcat, SceneGraph
from pydrake.lcm import DrakeLcm
from pydrake.math import RigidTransform
from pydrake.multibody.math import SpatialVelocity
from pydrake.multibody.plant import (
    ExternallyAppliedSpatialForce,
    MultibodyPlant,
)
from pydrake.systems.framework import (
    Context,
    DiagramBuilder,
    DiscreteValues,
    InputPort,
    OutputPort,
    System,
)

from drake_affetto.common.errors import InputError
from drake_affetto.common.systems import connect, input_port
from drake_affetto.common.typing import Array
from drake_affetto.scene.parts import find_frame
from drake_affetto.teaching.hand_force import HandForce
from drake_affetto.teaching.stroke import TeacherConfig

# The field by which Drake offers its mouse spring.
_STIFFNESS = "mouse_interaction_stiffness"


def require_mouse_spring() -> None:
    """Raises InputError on a Drake that has no mouse spring."""
    from pydrake.visualization import VisualizationConfig

    if not any(f.name == _STIFFNESS for f in VisualizationConfig.__fields__):
        raise InputError(
            "teaching by mouse needs a Drake whose Meshcat has a mouse spring "
            "(1.58 has it, 1.51 does not)"
        )


class MouseTeacher(HandForce):
    """Impedance of a teacher's arm, between the mouse and the robot's hand.

    Drake's mouse spring has three properties that do not suit teaching: it
    acts on any body, its force has no limit, and it starts from the position
    of the grasped point that the browser drew last, some hundredths of a
    second ago, so that a stiff spring shakes the arm. This system passes a
    force to the hand only. The grasped point is fixed to the hand, and
    stiffness, damping and maximum force are those of the teacher.

    .. pydrake_system::

        name: MouseTeacher
        input_ports:
        - mouse_force
        - body_poses
        - body_spatial_velocities
        output_ports:
        - spatial_force
        - pulling_force

    - mouse_force: list[ExternallyAppliedSpatialForce] of Drake's mouse spring.
    - body_poses, body_spatial_velocities: the plant's outputs.
    - spatial_force: list[ExternallyAppliedSpatialForce], at most one entry.
    - pulling_force: its force (3), world frame, N; zero without a grasp.

    The discrete state (4) is 1 during a grasp, else 0, and the grasped point
    in the hand's frame, m.
    """

    def __init__(
        self,
        plant: MultibodyPlant,
        config: TeacherConfig,
        palm_frame: str = "right_palm",
    ):
        """Makes a teacher for a robot.

        Args:
            plant: Finalized plant of the robot.
            config: Parameters of the teacher.
            palm_frame: Any frame of the hand.

        Raises:
            InputError: If `config` does not fit.
        """
        super().__init__()
        config.check("teaching")
        self._config = config
        hand = find_frame(plant, palm_frame).body()
        # The mouse spring is as stiff, and critically damped for the hand.
        self._mouse_damping = (config.stiffness * hand.default_mass()) ** 0.5
        self._force_in = self.DeclareAbstractInputPort(
            "mouse_force", Value([ExternallyAppliedSpatialForce()])
        )
        self._poses_in = self.DeclareAbstractInputPort(
            "body_poses", Value([RigidTransform()])
        )
        self._velocities_in = self.DeclareAbstractInputPort(
            "body_spatial_velocities", Value([SpatialVelocity()])
        )
        self._grip = self.DeclareDiscreteState(4)
        self.DeclarePeriodicDiscreteUpdateEvent(
            1.0 / config.update_rate, 0.0, self._update
        )
        needed = {
            self._force_in.ticket(),
            self._poses_in.ticket(),
            self._velocities_in.ticket(),
            self.xd_ticket(),
        }
        self._declare_outputs(hand, needed)

    get_mouse_force_input_port = input_port("Forces of Drake's mouse spring.")

    @staticmethod
    def AddToBuilder(
        *,
        builder: DiagramBuilder,
        plant: MultibodyPlant,
        scene_graph: SceneGraph,
        meshcat: Meshcat,
        config: TeacherConfig,
        palm_frame: str = "right_palm",
        name: str = "mouse_teacher",
    ) -> "MouseTeacher":
        """Adds Drake's mouse spring and, between it and the plant, a teacher.

        Args:
            builder: Builder of the diagram.
            plant: Finalized plant in `builder`, whose applied_spatial_force
                port is not connected yet.
            scene_graph: Scene graph in `builder`, with the plant's shapes.
            meshcat: Meshcat in whose browser window the person drags.
            config: Parameters of the teacher.
            palm_frame: Any frame of the hand.
            name: Name of the system.

        Raises:
            InputError: If this version of Drake has no mouse spring.
        """
        # It imports Matplotlib, and every station imports this module.
        from pydrake.visualization import (
            ApplyVisualizationConfig,
            VisualizationConfig,
        )

        require_mouse_spring()
        hand = find_frame(plant, palm_frame).body()
        visualization = VisualizationConfig(
            publish_illustration=False,
            publish_proximity=False,
            publish_contacts=False,
            publish_inertia=False,
        )
        # Drake's stiffness is per kilogram of the body that is dragged.
        setattr(
            visualization, _STIFFNESS, config.stiffness / hand.default_mass()
        )
        ApplyVisualizationConfig(
            visualization,
            builder,
            plant=plant,
            scene_graph=scene_graph,
            meshcat=meshcat,
            lcm=DrakeLcm("memq://null"),
        )
        # Drake has connected the spring to the plant: put the teacher between
        # the two.
        port = plant.get_applied_spatial_force_input_port()
        spring = _source(builder, plant, port)
        builder.Disconnect(spring, port)
        teacher = builder.AddNamedSystem(
            name, MouseTeacher(plant, config, palm_frame)
        )
        builder.Connect(spring, teacher.get_mouse_force_input_port())
        connect(
            builder, plant, teacher, "body_poses", "body_spatial_velocities"
        )
        builder.Connect(teacher.get_spatial_force_output_port(), port)
        return teacher

    def _drag(self, context: Context) -> ExternallyAppliedSpatialForce | None:
        """The mouse spring's force on the hand, if there is one."""
        for force in self._force_in.Eval(context):
            if force.body_index == self._hand:
                return force
        return None

    def _update(self, context: Context, values: DiscreteValues) -> None:
        drag = self._drag(context)
        grip = values.get_mutable_value(self._grip)
        if drag is None:
            grip[:] = 0.0
        elif grip[0] == 0.0:
            grip[0] = 1.0
            grip[1:] = drag.p_BoBq_B

    def _pull(self, context: Context) -> tuple[Array, Array] | None:
        """See base class."""
        drag = self._drag(context)
        if drag is None:
            return None
        config = self._config
        X_WB = self._poses_in.Eval(context)[self._hand]
        V_WB = self._velocities_in.Eval(context)[self._hand]

        def move(p_BoBq_B: Array) -> tuple[Array, Array]:
            V_WBq = V_WB.Shift(X_WB.rotation() @ p_BoBq_B)
            return X_WB @ p_BoBq_B, V_WBq.translational()

        # The position of the mouse, from the spring's force.
        p_WBq, v_WBq = move(drag.p_BoBq_B)
        f = drag.F_Bq_W.translational() + self._mouse_damping * v_WBq
        mouse = p_WBq + f / config.stiffness
        # The teacher's impedance between it and the grasped point.
        grip = context.get_discrete_state(self._grip).value()
        held = grip[1:].copy() if grip[0] else drag.p_BoBq_B
        p_WBq, v_WBq = move(held)
        force = config.stiffness * (mouse - p_WBq) - config.damping * v_WBq
        size = float(np.linalg.norm(force))
        if size > config.max_force:
            force = force * (config.max_force / size)
        return held, force


def _source(
    builder: DiagramBuilder, system: System, port: InputPort
) -> OutputPort:
    """The output that is connected to an input port."""
    source, index = builder.connection_map()[(system, port.get_index())]
    return source.get_output_port(index)
