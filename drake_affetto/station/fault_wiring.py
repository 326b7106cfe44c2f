"""Faults and the supervisor in the station: added where a scenario has them."""

from collections.abc import Sequence
import dataclasses
import math
from typing import Any, Protocol

import numpy as np
from numpy.typing import ArrayLike
from pydrake.geometry import (
    CollisionFilterDeclaration,
    GeometrySet,
    SceneGraph,
)
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import ModelInstanceIndex
from pydrake.systems.framework import (
    Context,
    DiagramBuilder,
    OutputPort,
)
from pydrake.systems.primitives import ConstantVectorSource

from drake_affetto.common.errors import require
from drake_affetto.common.typing import Array
from drake_affetto.faults.camera_faults import CameraFaults
from drake_affetto.faults.command_link import CommandLink
from drake_affetto.faults.config import Fault
from drake_affetto.faults.fault_source import FaultSource
from drake_affetto.faults.schedule import FaultSchedule
from drake_affetto.faults.supervision import second_difference_deviation
from drake_affetto.faults.supervisor import Supervisor, Verdict
from drake_affetto.perception.gaze_servo import GazeServo
from drake_affetto.perception.mirror_camera import MirrorCamera
from drake_affetto.pneumatics.chamber import Row
from drake_affetto.pneumatics.driver import PneumaticSystems
from drake_affetto.pneumatics.parameters import (
    load_parameters,
    parameter_array,
)
from drake_affetto.scene import world
from drake_affetto.scene.joints import select_joints
from drake_affetto.sensing.joint_sensors import JointSensors
from drake_affetto.sensing.readings import SensorParameters
from drake_affetto.skill.policy import SkillPolicy
from drake_affetto.station.supervision import SupervisionConfig

# Faults that change parameters of the scene or the camera as they begin and
# end; all others are signals.
_EVENTS = (
    "hand_lost",
    "drum_moved",
    "camera_dark",
    "camera_overexposed",
    "camera_blurred",
)


class FaultScenario(Protocol):
    """What of a scenario faults and supervisor depend on; see `Scenario`."""

    faults: list[Fault]
    supervisor: SupervisionConfig
    active_joints: list[str]
    variation: Any
    camera: Any
    look: Any
    blob: Any
    drum_region: Any
    control: Any
    pneumatics: Any
    plant_config: Any
    motion_source: str
    valve_source: str


def check_faults(scenario: FaultScenario, where: str) -> None:
    """Checks a scenario's faults and supervisor against the rest of it.

    Raises:
        InputError: For the first fault that cannot be, or that this station
            has no place for.
    """
    for i, fault in enumerate(scenario.faults):
        fault.check(f"{where}.faults[{i}]", scenario.active_joints)
    if not wants_faults(scenario):
        return
    asked = "faults" if scenario.faults else "supervisor"
    for name, value, needed in (
        ("variation.enabled", scenario.variation.enabled, True),
        ("valve_source", scenario.valve_source, "pidf"),
        ("motion_source", scenario.motion_source, "skill"),
        ("camera.renderer", scenario.camera.renderer, "vtk"),
    ):
        require(
            value == needed,
            f"{where}.{name}",
            value,
            f"{needed!r} for {where}.{asked}",
        )


def wants_faults(scenario: FaultScenario) -> bool:
    """Whether a scenario's station has places for faults, and a supervisor."""
    return bool(scenario.faults) or scenario.supervisor.enabled


class FaultWiring:
    """The systems of faults and supervisor, and what else a fault changes."""

    def __init__(
        self,
        scenario: FaultScenario,
        builder: DiagramBuilder,
        plant: MultibodyPlant,
        scene_graph: SceneGraph,
        robot: ModelInstanceIndex,
        actuators: Any,
        sensors: SensorParameters,
    ):
        """Adds the source of faults.

        Args:
            scenario: Scenario with faults or a supervisor.
            builder: Builder of the station.
            plant: Finalized plant in it.
            scene_graph: Its scene, in which contacts are found.
            robot: The robot's model.
            actuators: Parameters of this robot's actuators.
            sensors: Its sensors.
        """
        self.scenario = scenario
        self._builder = builder
        self._plant = plant
        self._scene_graph = scene_graph
        self._joints = select_joints(plant, scenario.active_joints, robot)
        self._sensors = sensors
        array = parameter_array(
            load_parameters(actuators.parameters, actuators.overlays),
            self._joints,
        )
        # What the robot's software knows is the model, not this body.
        known = scenario.pneumatics
        self._known = parameter_array(
            load_parameters(known.parameters, known.overlays), self._joints
        )
        self.source = builder.AddNamedSystem(
            "fault_source",
            FaultSource(
                self._joints.lower,
                array[Row.C_EXHAUST],
                float(array[Row.SUPPLY, 0] - array[Row.ATMOSPHERE, 0]),
                scenario.control.period,
            ),
        )
        self.supervisor: Supervisor | None = None
        self.camera_faults: CameraFaults | None = None
        # Where the drum was put, whether a trial has changed the scene, and the
        # filter that keeps a lost hand from touching anything.
        self._drum = np.zeros(2)
        self._changed = False
        self._filter: Any = None

    # Places in the diagram

    def carry(self, opening: OutputPort) -> OutputPort:
        """Adds what carries the controller's commands to the valves."""
        self.link = CommandLink.AddToBuilder(
            builder=self._builder,
            command=opening,
            ticks=self.source.get_ticks_output_port(),
            period=self.scenario.control.period,
            # After the controller, before the valves.
            lag=0.25 * self.scenario.plant_config.time_step,
        )
        return self.link.get_carried_command_output_port()

    def add_body(
        self, systems: PneumaticSystems, sensors: JointSensors
    ) -> None:
        """Connects sensors and valves to their faults."""
        self._systems = systems
        self._builder.Connect(
            self.source.get_readings_output_port(),
            sensors.get_faults_input_port(),
        )
        self._builder.Connect(
            self.source.get_valve_conditions_output_port(),
            systems.actuation.get_valve_conditions_input_port(),
        )

    def add_camera(
        self, camera: MirrorCamera, marker_radius: float
    ) -> OutputPort:
        """Adds what stands between camera and blob; returns the image.

        Args:
            camera: The camera.
            marker_radius: Radius of the drum's marker, m.
        """
        self._camera = camera
        frame = world.find_frame(self._plant, "drum::marker")
        self.camera_faults = CameraFaults.AddToBuilder(
            builder=self._builder,
            color_image=camera.get_color_image_output_port(),
            sight=camera.get_sight_output_port(),
            body_poses=self._plant.get_body_poses_output_port(),
            camera_faults=self.source.get_camera_output_port(),
            system=CameraFaults(
                camera.camera_model,
                self.scenario.blob,
                marker_radius,
                (frame.body().index(), frame.GetFixedPoseInBodyFrame()),
                self.scenario.drum_region.corners,
                self.scenario.camera.rate,
            ),
        )
        return self.camera_faults.get_faulty_image_output_port()

    def add_supervisor(
        self,
        desired: OutputPort,
        policy: SkillPolicy,
        gaze: GazeServo,
        blob_pixels: OutputPort,
    ) -> None:
        """Connects the movement's start; adds the supervisor, or none.

        Args:
            desired: [q; q̇] (2n) desired.
            policy: Skill, which tells when the movement begins.
            gaze: Gaze servo.
            blob_pixels: What the blob sensor finds (4).
        """
        builder, scenario = self._builder, self.scenario
        builder.Connect(
            policy.get_start_time_output_port(),
            self.source.get_start_time_input_port(),
        )
        assert self.camera_faults is not None
        action = self._systems.actuation.get_valve_action_input_port()
        if not scenario.supervisor.enabled:
            calm = builder.AddNamedSystem(
                "no_supervisor", ConstantVectorSource(np.zeros(1))
            )
            builder.Connect(calm.get_output_port(), action)
            return
        names = self._joints.names
        period = scenario.control.period
        scales = self._sensors.scales(
            names, self._joints.lower, self._joints.upper
        )
        self.supervisor = builder.AddNamedSystem(
            "supervisor",
            Supervisor(
                scenario.supervisor.load(),
                self._known,
                second_difference_deviation(self._sensors, scales, period),
                tuple(names),
                (scenario.camera.width, scenario.camera.height),
                action=scenario.supervisor.action,
                centered=scenario.look.mode == "centre",
                period=period,
                rate=scenario.camera.rate,
            ),
        )
        watched = {
            "desired_state": desired,
            "estimated_state": self._systems.estimated_state,
            "chamber_pressure": self._systems.chamber_pressure,
            "valve_opening": (
                self._systems.controller.get_valve_opening_output_port()
            ),
            "tick_time": self.link.get_tick_time_output_port(),
            "statistics": self.camera_faults.get_statistics_output_port(),
            "blob_pixels": blob_pixels,
            "settled": gaze.get_settled_output_port(),
            "failed": gaze.GetOutputPort("failed"),
        }
        for name, port in watched.items():
            builder.Connect(port, self.supervisor.GetInputPort(name))
        builder.Connect(self.supervisor.get_valve_action_output_port(), action)

    # In a trial

    def begin(
        self, root: Context, faults: Sequence[Fault], seed: int, xy: ArrayLike
    ) -> None:
        """Begins a trial now: its faults act from their onsets on.

        Args:
            root: Context of the whole diagram.
            faults: Faults of the trial.
            seed: Seed of the trial.
            xy: Where the drum stands (2,), m.
        """
        self._drum = np.array(xy, dtype=float)
        self.source.set_schedule(
            self.source.GetMyMutableContextFromRoot(root),
            FaultSchedule(
                tuple(faults), self._joints.names, seed, root.get_time()
            ),
        )
        self.watch(root, False)
        self.apply(root)

    def watch(self, root: Context, on: bool) -> None:
        """Has the supervisor watch, from now on and anew, or not."""
        if self.supervisor is not None:
            self.supervisor.watch(
                self.supervisor.GetMyMutableContextFromRoot(root), on
            )

    def verdict(self, root: Context) -> Verdict:
        """What the supervisor has said so far; valid without one."""
        if self.supervisor is None:
            return Verdict()
        return self.supervisor.verdict(
            self.supervisor.GetMyContextFromRoot(root)
        )

    def scores(self, root: Context) -> Array:
        """Greatest score of each check so far, see `Supervisor`."""
        assert self.supervisor is not None
        port = self.supervisor.get_scores_output_port()
        return np.array(port.Eval(self.supervisor.GetMyContextFromRoot(root)))

    def schedule(self, root: Context) -> FaultSchedule:
        """The faults of the trial."""
        return self.source.schedule(self.source.GetMyContextFromRoot(root))

    def movement(self, root: Context) -> float:
        """When the trial's movement begins, s; infinite: not yet."""
        return self.source.movement(self.source.GetMyContextFromRoot(root))

    def next_change(self, root: Context, until: float) -> float:
        """When the simulation has to pause for `apply`, s; at most `until`."""
        schedule, movement = self.schedule(root), self.movement(root)
        times = [
            time
            for fault in schedule.faults
            if fault.kind in _EVENTS
            for time in fault.span(schedule.begin, movement)
        ]
        now = root.get_time()
        return min((t for t in times if now + 1e-9 < t < until), default=until)

    def apply(self, root: Context) -> None:
        """Makes scene and camera what the faults that act now make of them."""
        schedule = self.schedule(root)
        if not schedule.acts_on("scene", "camera"):
            if self._changed:
                self._restore(root)
            return
        self._changed = True
        active = list(
            schedule.active(
                root.get_time(), self.movement(root), "scene", "camera"
            )
        )
        lost = any(fault.kind == "hand_lost" for _, fault, _ in active)
        self._lose_hand(root, lost)
        moved = [each for each in active if each[1].kind == "drum_moved"]
        self._put_drum(root, schedule, moved)
        base = self.scenario.camera.effects
        exposure, blur = base.exposure, list(base.motion_blur)
        for number, fault, _ in active:
            if fault.kind == "camera_dark":
                exposure -= fault.size
            elif fault.kind == "camera_overexposed":
                exposure += fault.size
            elif fault.kind == "camera_blurred":
                angle = schedule.rng(number).uniform(0.0, math.pi)
                blur[0] += fault.size * math.cos(angle)
                blur[1] += fault.size * math.sin(angle)
        self._set_effects(root, exposure, blur)

    def _restore(self, root: Context) -> None:
        """Puts right what a trial before has left changed."""
        self._changed = False
        self._lose_hand(root, False)
        base = self.scenario.camera.effects
        self._set_effects(root, base.exposure, base.motion_blur)

    def _set_effects(
        self, root: Context, exposure: float, blur: Sequence[float]
    ) -> None:
        self._camera.set_effects(
            self._camera.GetMyMutableContextFromRoot(root),
            dataclasses.replace(
                self.scenario.camera.effects,
                exposure=exposure,
                motion_blur=list(blur),
            ),
        )

    def _put_drum(
        self,
        root: Context,
        schedule: FaultSchedule,
        moved: Sequence[tuple[int, Fault, float]],
    ) -> None:
        """Puts the drum where it stood, or was moved to: on the table."""
        context = self._plant.GetMyMutableContextFromRoot(root)
        place = np.array(self._drum)
        low, high = world.drum_limits(self._plant, context)
        for number, fault, _ in moved:
            angles = schedule.rng(number).uniform(0.0, 2.0 * math.pi, 64)
            ways = np.stack([np.cos(angles), np.sin(angles)], axis=1)
            places = place + fault.size * ways
            good = np.all((places >= low) & (places <= high), axis=1)
            place = places[int(np.argmax(good))]
        world.set_drum_position(self._plant, context, np.clip(place, low, high))

    def _lose_hand(self, root: Context, lost: bool) -> None:
        """Lets the hand touch nothing, or all again."""
        if lost == (self._filter is not None):
            return
        manager = self._scene_graph.collision_filter_manager(
            self._scene_graph.GetMyMutableContextFromRoot(root)
        )
        if not lost:
            manager.RemoveDeclaration(self._filter)
            self._filter = None
            return
        plant = self._plant
        hand = plant.GetBodyByName("right_hand")
        geometries = plant.GetCollisionGeometriesForBody(hand)
        everything = self._scene_graph.model_inspector().GetAllGeometryIds()
        self._filter = manager.ApplyTransient(
            CollisionFilterDeclaration().ExcludeBetween(
                GeometrySet(geometries), GeometrySet(everything)
            )
        )
