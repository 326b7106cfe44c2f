"""The one Diagram: robot, drum and mirror, and all that acts on them.

Long: all wires of the Diagram stand side by side.
"""

from collections.abc import Sequence
import dataclasses

import numpy as np
from numpy.typing import ArrayLike
from pydrake.geometry import (
    Meshcat,
    MeshcatVisualizer,
    MeshcatVisualizerParams,
    SceneGraph,
)
from pydrake.math import RigidTransform
from pydrake.multibody.plant import AddMultibodyPlant, MultibodyPlant
from pydrake.systems.framework import (
    Context,
    Diagram,
    DiagramBuilder,
    LeafSystem,
    OutputPort,
)
from pydrake.systems.primitives import (
    PassThrough,
)
from pydrake.systems.sensors import CameraInfo

from drake_affetto.common.errors import require
from drake_affetto.common.systems import connect, export, make_room_for
from drake_affetto.control.gravity_feedforward import GravityFeedforward
from drake_affetto.motion.dmp import Dmp
from drake_affetto.motion.dmp_source import DmpSource
from drake_affetto.perception.analytic_blob_sensor import AnalyticBlobSensor
from drake_affetto.perception.blob_sensor import BlobSensor
from drake_affetto.perception.gaze import GazeMode, GazeTask
from drake_affetto.perception.gaze_servo import GazeServo, gaze_view
from drake_affetto.perception.mirror_camera import MirrorCamera
from drake_affetto.pneumatics.actuation import PneumaticActuationConfig
from drake_affetto.pneumatics.driver import (
    AddPneumaticDriver,
    PneumaticDriver,
    PneumaticSystems,
)
from drake_affetto.pneumatics.parameters import (
    JointActuator,
    load_parameters,
    pressure_differences,
)
from drake_affetto.scene import world
from drake_affetto.scene.damping import set_joint_damping
from drake_affetto.scene.joints import JointSelection
from drake_affetto.sensing.joint_sensors import JointSensors
from drake_affetto.skill.policy import SkillPolicy
from drake_affetto.sound.microphone import DrumMicrophone
from drake_affetto.station.fault_wiring import FaultWiring, wants_faults
from drake_affetto.station.gaze_turn import add_gaze_turn
from drake_affetto.station.model_check import check_scene
from drake_affetto.station.scenario import Scenario
from drake_affetto.teaching.kinesthetic_teacher import KinestheticTeacher
from drake_affetto.teaching.mouse_teacher import MouseTeacher

_PALM = "affetto::right_palm"
_MODES = {"centre": GazeMode.CENTER, "fixed_yaw": GazeMode.FIXED_YAW}


class AffettoStation(Diagram):
    """Affetto at its drum: plant, pneumatics, control, sight and hearing.

    Built once and used for any number of trials: the drum's place, the
    posture, what is taught and what is played are parameters and state of the
    context (`set_drum_position`, `reset`, and the systems' own setters).

    Joints that are not active are welded at the scenario's posture. Contexts
    from `CreateDefaultContext` of this class are ready. A `Simulator` made
    without a context makes its own: call `reset` on it first.

    .. pydrake_system::

        name: AffettoStation
        input_ports:
        - affetto.desired_state (motion_source external)
        - affetto.valve_opening (valve_source external, flow mode)
        - affetto.pressure_command (valve_source external, regulator mode)
        output_ports:
        - affetto.joint_state
        - affetto.estimated_state
        - affetto.desired_state
        - affetto.valve_opening
        - affetto.pid_output
        - affetto.actuation
        - affetto.chamber_pressure
        - affetto.mass_flow
        - affetto.policy_parameters
        - affetto.start_time
        - affetto.task_parameter
        - affetto.settled
        - camera.color_image
        - camera.label_image
        - camera.blob
        - camera.blob_pixels
        - drum.contact_force
        - drum.knock_force
        - teacher.pulling_force

    With n active joints, in the scenario's order:

    - affetto.joint_state, affetto.desired_state (2n): rad, rad/s, both at the
      same time (see `joint_state`).
    - affetto.estimated_state (2n): the same as the robot's sensors have it.
    - affetto.valve_opening (n): v⁺ in [-1, 1].
    - affetto.pressure_command (2n): set-points [p_a; p_b], Pa absolute.
    - affetto.pid_output (n): u_PID, Pa.
    - affetto.actuation (n): N m.
    - affetto.chamber_pressure (2n): [p_a; p_b] as read, Pa absolute.
    - affetto.mass_flow (2n): into the chambers, kg/s.
    - affetto.policy_parameters (n·K): θ, rad/s².
    - affetto.start_time (1): when θ is played, s.
    - affetto.task_parameter (2): τ or τ̂.
    - affetto.settled (1): whether τ is final.
    - camera.color_image (ImageRgba8U), camera.label_image (ImageLabel16I):
      calculated when evaluated.
    - camera.blob (3), camera.blob_pixels (4): see `BlobSensor`.
    - drum.contact_force (2): N on the head, m from its center.
    - drum.knock_force (2): N on the shell, N on the table.
    - teacher.pulling_force (3): N, in the world.

    The ports of the gaze and the skill are there only with motion_source
    "skill", those of the controller only with valve_source "pidf".
    """

    def __init__(
        self,
        scenario: Scenario,
        meshcat: Meshcat | None = None,
        meshcat_params: MeshcatVisualizerParams | None = None,
        *,
        by_mouse: bool = False,
    ):
        """Builds the diagram.

        Args:
            scenario: from `load_scenario`; it is checked again.
            meshcat: shows the robot there as it moves.
            meshcat_params: how it is shown; Drake's defaults if None.
            by_mouse: whoever drags the hand in `meshcat` teaches, in place of
                the simulated teacher (Ctrl and the left button).

        Raises:
            InputError: if the scenario does not fit itself or the models, or
                this version of Drake has no mouse spring.
        """
        super().__init__()
        make_room_for(self)
        scenario.check()
        require(
            meshcat is not None or not by_mouse,
            "by_mouse",
            by_mouse,
            "False without a meshcat",
        )
        self.scenario = scenario
        self._variation = scenario.variation.load()
        builder = DiagramBuilder()
        self.plant: MultibodyPlant
        self.scene_graph: SceneGraph
        self.plant, self.scene_graph = AddMultibodyPlant(
            scenario.plant_config, builder
        )
        world.add_world(self.plant, scenario.body.world(scenario.world))
        world.weld_inactive(self.plant, scenario.active_joints)
        set_joint_damping(self.plant, scenario.joint_damping)
        self.plant.Finalize()
        scenario.body.set_hand(self.plant, self.scene_graph)
        self._yaw = scenario.active_joints.index(scenario.yaw_joint)
        self._robot = world.robot_instance(self.plant)
        self.pneumatics = self._add_pneumatics(builder)
        self.joints = self.pneumatics.joints
        self.actuation = self.pneumatics.actuation
        self.controller = self.pneumatics.controller
        self._joint_state = self.pneumatics.joint_state
        self._true_state = self._joint_state.get_output_port()
        builder.ExportOutput(self._true_state, "affetto.joint_state")
        self._estimated_state = self.pneumatics.estimated_state
        self.start_posture = np.array(
            [
                world.get_joint(self.plant, name).get_default_angle()
                for name in self.joints.names
            ]
        )
        self._add_teacher(builder, meshcat if by_mouse else None)
        self._add_sight(builder)
        self._add_hearing(builder)
        desired = self._add_motion(builder)
        self._add_control(builder, desired)
        if self.faults is not None:
            self.faults.add_supervisor(
                desired,
                self.policy,
                self.gaze,
                self.blob_sensor.get_blob_pixels_output_port(),
            )
        if meshcat is not None:
            MeshcatVisualizer.AddToBuilder(
                builder,
                self.scene_graph,
                meshcat,
                meshcat_params or MeshcatVisualizerParams(),
            )
        builder.BuildInto(self)
        self.set_name("affetto_station")
        check_scene(self, self.plant, self.camera, scenario, "scenario")

    @property
    def num_joints(self) -> int:
        """n, how many joints are active."""
        return len(self.joints.names)

    @property
    def camera_info(self) -> CameraInfo:
        """The camera's intrinsics."""
        return self.camera.camera_info

    @property
    def mirrors(self) -> list[tuple[RigidTransform, float, float]]:
        """(X_WM, width, height) of each mirror; M's z is its normal."""
        return self.camera.mirrors(
            self.camera.GetMyContextFromRoot(self.CreateDefaultContext())
        )

    def CreateDefaultContext(self) -> Context:
        """A context at the start posture."""
        context = super().CreateDefaultContext()
        self.reset(context)
        if self.faults is not None:
            # Whoever simulates a larger diagram begins them there.
            self.faults.begin(
                context,
                self.scenario.faults,
                self.scenario.random_seed,
                self.drum_position(context),
            )
        return context

    def reset(self, context: Context) -> None:
        """Puts robot, drum and all systems where a trial starts.

        The robot rests at the start posture: the pressures in its chambers
        carry gravity and the controller's integral asks for just these. The
        time is left as it is.

        Args:
            context: the station's, also within a context of a larger diagram.
        """
        mine = self._mine(context)
        self.SetDefaultContext(mine)
        self.scenario.body.set_masses(
            self.plant, self._sub(self.plant, context)
        )
        held = self.pneumatics.hold_posture(self, mine)
        if self.controller is not None:
            known = self._gravity.reset(
                self._sub(self._gravity, context), self.start_posture
            )
            self.controller.set_integral(
                self._sub(self.controller, context), held - known
            )
        self.set_seed(context, self.scenario.random_seed)
        self._reset_sensors(context)
        if self.scenario.motion_source == "skill":
            look = self.scenario.look
            self.gaze.set_task(
                self._sub(self.gaze, context),
                GazeTask(
                    enabled=False,
                    mode=_MODES[look.mode],
                    fixed_yaw=look.fixed_yaw,
                    start_yaw=float(self.start_posture[self._yaw]),
                ),
            )
            self.dmp_source.set_start_posture(
                self._sub(self.dmp_source, context), self.start_posture
            )

    def set_drum_position(self, context: Context, xy: ArrayLike) -> None:
        """Puts the drum at xy (2,), m, on the table in the world frame.

        Raises:
            InputError: if it would not stand wholly on the table.
        """
        world.set_drum_position(self.plant, self._sub(self.plant, context), xy)

    def set_mirror_pose(self, context: Context, pose: world.FramePose) -> None:
        """Puts the mirror elsewhere; the pose is that of `mirror_pose`.

        Args:
            pose: Pose of the mirror.

        Raises:
            InputError: for a pose that is out of range.
        """
        world.set_mirror_pose(self.plant, self._sub(self.plant, context), pose)

    def drum_position(self, context: Context) -> np.ndarray:
        """Where the drum stands, (2,) m in the world frame."""
        return world.get_drum_position(
            self.plant, self._sub(self.plant, context)
        )

    def marker_position(self, context: Context) -> np.ndarray:
        """p_WMarker, the center of the drum's marker, (3,) m."""
        return world.marker_position(self.plant, self._sub(self.plant, context))

    def head_center_position(self, context: Context) -> np.ndarray:
        """The middle of the drum's head, (3,) m in the world."""
        return world.head_center_position(
            self.plant, self._sub(self.plant, context)
        )

    def touching_position(self, context: Context) -> np.ndarray:
        """Where the palm is as the hand touches the head's middle, (3,) m."""
        radius = world.hand_radius(self.plant, self._sub(self.plant, context))
        return self.head_center_position(context) + [0.0, 0.0, radius]

    def camera_pose(self, context: Context) -> RigidTransform:
        """X_WC; C looks along z, with x to the right and y down."""
        return self.camera.camera_pose(self._sub(self.camera, context))

    def set_posture(self, context: Context, q: ArrayLike) -> None:
        """Sets the active joints to q (n,), rad, at rest.

        Args:
            q: Angles of the active joints (n,), rad.

        Raises:
            InputError: if an angle is beyond its joint's limits.
        """
        world.set_posture(
            self.plant,
            self._sub(self.plant, context),
            dict(zip(self.joints.names, np.asarray(q, float), strict=True)),
        )
        self._joint_state.SetDefaultContext(
            self._sub(self._joint_state, context)
        )
        self._reset_sensors(context)

    def set_seed(self, context: Context, seed: int) -> None:
        """Sets the seed of all that differs from trial to trial."""
        self.camera.set_seed(self._sub(self.camera, context), seed)
        if self.sensors is not None:
            self.sensors.set_seed(self._sub(self.sensors, context), seed)
            self.actuation.vary(
                self._sub(self.actuation, context),
                self._variation.actuators,
                seed,
            )

    def _reset_sensors(self, context: Context) -> None:
        """Lets the sensors read a robot that has just been put at rest."""
        if self.sensors is not None:
            self.sensors.reset(
                self._sub(self.sensors, context),
                self._true_state.Eval(self._sub(self._joint_state, context)),
                self.actuation.get_chamber_pressure_output_port().Eval(
                    self._sub(self.actuation, context)
                ),
            )

    def _mine(self, context: Context) -> Context:
        """The station's context, from itself or from the root's."""
        try:
            self.ValidateContext(context)
        except RuntimeError:
            return self.GetMyMutableContextFromRoot(context)
        return context

    def _sub(self, system: LeafSystem, context: Context) -> Context:
        """The system's context, from the station's or from the root's."""
        return self.GetMutableSubsystemContext(system, self._mine(context))

    def _add_pneumatics(self, builder: DiagramBuilder) -> PneumaticSystems:
        scenario = self.scenario
        controlled = scenario.valve_source == "pidf"
        self.sensors: JointSensors | None = None

        self.faults: FaultWiring | None = None
        if wants_faults(scenario):
            self.faults = FaultWiring(
                scenario,
                builder,
                self.plant,
                self.scene_graph,
                self._robot,
                self._actuators(),
                self._variation.sensors,
            )

        def sense(
            joints: JointSelection,
            state: OutputPort,
            pressure: OutputPort,
        ) -> tuple[OutputPort, OutputPort]:
            """Adds the sensors; returns [q; q̇] and [p_a; p_b] as read."""
            self.sensors = JointSensors.AddToBuilder(
                builder=builder,
                joint_state=state,
                true_pressure=pressure,
                parameters=self._variation.sensors,
                joint_names=joints.names,
                limits=(joints.lower, joints.upper),
                period=scenario.control.period,
                # With the actuators' update: the joints are by then those of
                # the tick, the pressures those of one step before.
                lead=0.5 * scenario.plant_config.time_step,
                faulty=self.faults is not None,
            )
            return (
                self.sensors.get_estimated_state_output_port(),
                self.sensors.get_chamber_pressure_output_port(),
            )

        systems = AddPneumaticDriver(
            PneumaticDriver(
                joints={
                    name: JointActuator() for name in scenario.active_joints
                },
                pneumatics=self._actuators(),
                control=scenario.control if controlled else None,
            ),
            self.plant,
            self._robot,
            builder,
            sense if scenario.variation.enabled else None,
            longest_delay=self._variation.actuators.longest_delay,
            carry=None if self.faults is None else self.faults.carry,
        )
        if self.faults is not None:
            assert self.sensors is not None
            self.faults.add_body(systems, self.sensors)
        return systems

    def _actuators(self) -> PneumaticActuationConfig:
        """Actuators and air supply as the robot's body has them."""
        pneumatics = self.scenario.pneumatics
        known = load_parameters(pneumatics.parameters, pneumatics.overlays)
        return dataclasses.replace(
            pneumatics,
            parameters=self.scenario.body.actuators(
                known, self.scenario.active_joints
            ),
            overlays=[],
        )

    def _add_teacher(
        self, builder: DiagramBuilder, mouse: Meshcat | None
    ) -> None:
        teaching = self.scenario.teaching
        if mouse is not None:
            self.mouse_teacher = MouseTeacher.AddToBuilder(
                builder=builder,
                plant=self.plant,
                scene_graph=self.scene_graph,
                meshcat=mouse,
                config=teaching,
                palm_frame=_PALM,
            )
            pull = self.mouse_teacher.get_pulling_force_output_port()
        else:
            self.teacher = KinestheticTeacher.AddToBuilder(
                builder=builder,
                plant=self.plant,
                joint_names=self.joints.names,
                config=teaching,
                palm_frame=_PALM,
            )
            builder.Connect(
                self._true_state,
                self.teacher.get_estimated_state_input_port(),
            )
            pull = self.teacher.get_pulling_force_output_port()
        builder.ExportOutput(pull, "teacher.pulling_force")

    def _add_sight(self, builder: DiagramBuilder) -> None:
        # The renderers stand in a copy of the scene: a SceneGraph hands each
        # new pose to all its render engines, which would triple the cost of
        # every physics step. The copy is only asked when an image is.
        seen = self.scene_graph.Clone()
        seen.set_name("seen_scene")
        builder.AddSystem(seen)
        builder.Connect(
            self.plant.get_geometry_pose_output_port(),
            seen.get_source_pose_port(self.plant.get_source_id()),
        )
        self.camera = MirrorCamera.AddToBuilder(
            builder=builder,
            plant=self.plant,
            scene_graph=seen,
            config=self.scenario.body.camera(self.scenario.camera),
            mirrors=self.scenario.mirrors,
            render_config=self.scenario.rendering,
        )
        image = self.camera.get_color_image_output_port()
        if self.faults is not None:
            radius = world.find_marker_radius(
                self.plant, seen.model_inspector()
            )
            image = self.faults.add_camera(self.camera, radius)
        self.blob_sensor: BlobSensor | AnalyticBlobSensor
        if self.scenario.camera.renderer == "analytic":
            self.blob_sensor = AnalyticBlobSensor.AddToBuilder(
                builder=builder,
                plant=self.plant,
                query_object=seen.get_query_output_port(),
                camera=self.camera,
                config=self.scenario.blob,
                radius=world.find_marker_radius(
                    self.plant, seen.model_inspector()
                ),
            )
        else:
            self.blob_sensor = BlobSensor.AddToBuilder(
                builder=builder,
                color_image=image,
                config=self.scenario.blob,
            )
        builder.ExportOutput(image, "camera.color_image")
        export(
            builder,
            "camera",
            self.camera.get_label_image_output_port(),
            self.blob_sensor.get_blob_output_port(),
            self.blob_sensor.get_blob_pixels_output_port(),
        )

    def _add_hearing(self, builder: DiagramBuilder) -> None:
        self.microphone = DrumMicrophone.AddToBuilder(
            builder=builder, plant=self.plant
        )
        export(
            builder,
            "drum",
            self.microphone.get_contact_force_output_port(),
            self.microphone.get_knock_force_output_port(),
        )

    def _add_motion(self, builder: DiagramBuilder) -> OutputPort:
        """Adds what moves the robot; returns [q; q̇] desired."""
        n = self.num_joints
        if self.scenario.motion_source == "external":
            desired = builder.AddNamedSystem(
                "desired_state", PassThrough(2 * n)
            )
            builder.ExportInput(
                desired.get_input_port(), "affetto.desired_state"
            )
            return desired.get_output_port()

        self.gaze = GazeServo.AddToBuilder(
            builder=builder,
            blob=self.blob_sensor.get_blob_output_port(),
            estimated_state=self._estimated_state,
            yaw_index=self._yaw,
            view=gaze_view(
                self.camera.camera_model, self.scenario.blob.calibration
            ),
            config=self.scenario.gaze,
            rate=self.scenario.camera.rate,
            latency=self.scenario.camera.latency,
        )
        dmp = Dmp(self.scenario.dmp)
        self.policy = SkillPolicy.AddToBuilder(
            builder=builder,
            num_parameters=n * dmp.n_basis,
            config=self.scenario.policy,
        )
        self.dmp_source = DmpSource.AddToBuilder(
            builder=builder, dmp=dmp, num_joints=n
        )
        connect(builder, self.gaze, self.policy, "task_parameter")
        builder.Connect(
            self.gaze.get_ready_output_port(),
            self.policy.get_settled_input_port(),
        )
        connect(
            builder,
            self.policy,
            self.dmp_source,
            "policy_parameters",
            "start_time",
        )
        export(
            builder,
            "affetto",
            self.policy.get_policy_parameters_output_port(),
            self.policy.get_start_time_output_port(),
            self.gaze.get_task_parameter_output_port(),
            self.gaze.get_settled_output_port(),
        )
        return add_gaze_turn(
            builder,
            self.dmp_source.get_desired_state_output_port(),
            self.gaze.get_yaw_command_output_port(),
            self._yaw,
            self.start_posture[self._yaw],
        )

    def _add_control(
        self, builder: DiagramBuilder, desired: OutputPort
    ) -> None:
        builder.ExportOutput(desired, "affetto.desired_state")
        if self.controller is None:
            command = self.actuation.get_command_input_port()
            builder.ExportInput(command, f"affetto.{command.get_name()}")
            return
        self._gravity = builder.AddNamedSystem(
            "gravity_feedforward",
            GravityFeedforward(
                self.plant,
                self.joints.names,
                *pressure_differences(self.actuation.parameters),
                share=self.scenario.control.gravity_share,
            ),
        )
        builder.Connect(desired, self._gravity.get_desired_state_input_port())
        builder.Connect(desired, self.controller.get_desired_state_input_port())
        builder.Connect(
            self._gravity.get_equilibrium_offset_output_port(),
            self.controller.get_equilibrium_offset_input_port(),
        )

    def set_equilibrium_offset(
        self, context: Context, offset: Sequence[float] | np.ndarray
    ) -> None:
        """Sets the offset (n,), Pa, that is added to u_PID (paper Eq. 8).

        It takes the place of the gravity that the controller compensates.

        Args:
            offset: Offset of each active joint (n,), Pa.
        """
        self._gravity.set_constant(self._sub(self._gravity, context), offset)
