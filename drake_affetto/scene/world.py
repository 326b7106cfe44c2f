"""The world a trial happens in: robot, table, mirror, and a drum to place.

Everything here reads names, limits and sizes from the parsed models; nothing
is repeated in code. All functions that take a `context` want the plant's own
context, i.e. `plant.GetMyContextFromRoot(root_context)`. Long: all that a scene
has stands side by side.
"""

from collections.abc import Iterator, Mapping, Sequence
import contextlib
import dataclasses
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from pydrake.common.eigen_geometry import AngleAxis
from pydrake.geometry import (
    Box,
    Cylinder,
    Role,
    SceneGraphInspector,
    Sphere,
)
from pydrake.math import RigidTransform, RollPitchYaw
from pydrake.multibody.parsing import (
    LoadModelDirectives,
    ModelDirectives,
    Parser,
    ProcessModelDirectives,
)
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import (
    FixedOffsetFrame,
    Frame,
    ModelInstanceIndex,
    RevoluteJoint,
    RigidBody,
    WeldJoint,
)
from pydrake.systems.framework import Context

from drake_affetto.common.errors import (
    InputError,
    naming,
    one_line,
    require,
    require_array,
    require_range,
)
from drake_affetto.common.fields import file_name
from drake_affetto.common.resources import configure_parser, resolve
from drake_affetto.common.strict_yaml import check_yaml
from drake_affetto.geometry.kinematics import SerialChain
from drake_affetto.scene import joints
from drake_affetto.scene.parts import find_body, find_frame

ACTIVE_JOINTS = (
    "waist_roll",
    "waist_pitch",
    "waist_yaw",
    "right_shoulder_elevation",
    "right_shoulder_abduction",
    "right_shoulder_flexion",
    "right_elbow_rotation",
    "right_elbow_flexion",
)
"""The joints that drum, unless a scenario names others, in their order."""

_PLACEMENT = "drum_placement"
_MIRROR = "mirror_pose"


@dataclasses.dataclass
class FramePose:
    """Where a frame of the directives is instead.

    Attributes:
        translation: x, y, z in the frame that the directives name as its
            base [m].
        rotation: roll, pitch, yaw about the base's axes [deg].
    """

    translation: list[float] = dataclasses.field(
        default_factory=lambda: [0.0, 0.0, 0.0]
    )
    rotation: list[float] = dataclasses.field(
        default_factory=lambda: [0.0, 0.0, 0.0]
    )

    def check(self, where: str) -> None:
        """Raises InputError naming the first field that does not fit."""
        for field, limit in (("translation", 10.0), ("rotation", 360.0)):
            value = getattr(self, field)
            require(len(value) == 3, f"{where}.{field}", value, "three numbers")
            for i, number in enumerate(value):
                require_range(f"{where}.{field}[{i}]", number, -limit, limit)

    def transform(self) -> RigidTransform:
        """The pose as Drake has it."""
        return RigidTransform(
            RollPitchYaw(np.radians(self.rotation)), self.translation
        )


@dataclasses.dataclass
class WorldConfig:
    """Which models make the world.

    Attributes:
        directives: Model directives of everything but the drum. They must
            weld `affetto::pelvis`, `table::table_top` (through a frame
            `table_pose`) and `mirror::mirror` to the world.
        drum: Model of the drum; its root link is the one that stands on the
            table.
        drum_position: Position of the drum in a default context, world x and
            y, m.
        default_posture: Joint -> angle in the default context, rad; joints
            that are not named are at zero.
        frames: Frame of the directives -> its other pose, for instance of
            `affetto_base` or `mirror_pose`.
        offsets: Frame of the directives -> what is added to its pose.
    """

    directives: str = file_name(
        "package://drake_affetto/scenes/drumming.dmd.yaml"
    )
    drum: str = file_name("package://drake_affetto/sdf/drum.sdf")
    drum_position: list[float] = dataclasses.field(
        default_factory=lambda: [0.235, -0.09]
    )
    default_posture: dict[str, float] = dataclasses.field(default_factory=dict)
    frames: dict[str, FramePose] = dataclasses.field(default_factory=dict)
    offsets: dict[str, FramePose] = dataclasses.field(default_factory=dict)

    def check(self, where: str) -> None:
        """Raises InputError naming the first field that does not fit."""
        for field in ("directives", "drum"):
            with naming(f"{where}.{field}"):
                resolve(getattr(self, field))
        require(
            len(self.drum_position) == 2,
            f"{where}.drum_position",
            self.drum_position,
            "two numbers (x and y in meters)",
        )
        for i, value in enumerate(self.drum_position):
            require_range(f"{where}.drum_position[{i}]", value, -10, 10)
        for name, angle in self.default_posture.items():
            require_range(
                f"{where}.default_posture.{name}", angle, -np.pi, np.pi
            )
        for field in ("frames", "offsets"):
            for name, pose in getattr(self, field).items():
                pose.check(f"{where}.{field}.{name}")


def add_world(plant: MultibodyPlant, config: WorldConfig) -> None:
    """Adds the models of `config` to `plant`, which must not be finalized.

    The drum stands on the frame `drum_placement`, an offset from the world
    that is a parameter of the context (`set_drum_position`).

    Raises:
        InputError: for a file that is missing, a scene that lacks a part, or
            a posture beyond the joints' limits.
    """
    config.check("world")
    parser = Parser(plant)
    configure_parser(parser)
    path = resolve(config.directives)
    check_yaml(path)
    with _reading(config.directives):
        directives = LoadModelDirectives(str(path))
        _move_frames(directives, config)
        ProcessModelDirectives(directives, parser)
    _require_scene(plant, config.directives)
    with _reading(config.drum):
        models = parser.AddModels(str(resolve(config.drum)))
    root = _require_drum(plant, models, config.drum)
    X_WT = find_frame(plant, "table_pose").GetFixedPoseInBodyFrame()
    placement = plant.AddFrame(
        FixedOffsetFrame(
            _PLACEMENT,
            plant.world_frame(),
            RigidTransform([*config.drum_position, X_WT.translation()[2]]),
        )
    )
    plant.WeldFrames(placement, root.body_frame())
    check_posture(plant, config.default_posture, "world.default_posture")
    for name, angle in config.default_posture.items():
        get_joint(plant, name).set_default_angle(angle)


def _move_frames(directives: ModelDirectives, config: WorldConfig) -> None:
    """Puts frames elsewhere than the file has them.

    Those of `config.frames` first, then those of `config.offsets`, whose turns
    are about the axes of the frame's base.
    """
    added = {
        directive.add_frame.name: directive.add_frame
        for directive in directives.directives
        if directive.add_frame is not None
    }
    for field in ("frames", "offsets"):
        for name, pose in getattr(config, field).items():
            if name not in added:
                raise InputError(
                    f"world.{field}: {config.directives} has no frame "
                    f"{name!r}, expected one of {', '.join(added)}"
                )
            X_PF = added[name].X_PF
            translation = np.array(pose.translation, dtype=float)
            turn = pose.transform().rotation()
            if field == "offsets":
                before = X_PF.GetDeterministicValue()
                translation = translation + before.translation()
                turn = turn @ before.rotation()
            X_PF.translation = translation
            X_PF.rotation.set_rpy_deg(np.rad2deg(RollPitchYaw(turn).vector()))


@contextlib.contextmanager
def _reading(uri: str) -> Iterator[None]:
    """Tells what Drake cannot read in one line that names the file."""
    try:
        yield
    except RuntimeError as error:
        raise InputError(f"cannot read {uri}: {one_line(error)}") from error


def _require_scene(plant: MultibodyPlant, uri: str) -> None:
    """Raises InputError unless the directives' models are as they must be."""
    welded = plant.GetBodiesWeldedTo(plant.world_body())
    for name in ("affetto::pelvis", "table::table_top", "mirror::mirror"):
        if _required_frame(plant, name, uri).body() not in welded:
            raise InputError(
                f"{uri}: {name} is not welded to the world, as it must be"
            )
    for name in ("table_pose", "affetto::right_palm"):
        _required_frame(plant, name, uri)


def _required_frame(plant: MultibodyPlant, name: str, uri: str) -> Frame:
    """The frame `name`; raises InputError naming the file without it."""
    try:
        return find_frame(plant, name)
    except InputError:
        raise InputError(f"{uri} has no frame {name!r}") from None


def _require_drum(
    plant: MultibodyPlant, models: Sequence[ModelInstanceIndex], uri: str
) -> RigidBody:
    """The root link of a drum that has what a drum needs.

    Raises:
        InputError: For a drum of another name, one that lacks a part, or one
            that is fixed in the world already.
    """
    names = [plant.GetModelInstanceName(model) for model in models]
    require(names == ["drum"], f"models in {uri}", names, "one, named drum")
    for name in ("shell", "head"):
        if not plant.HasBodyNamed(name, models[0]):
            raise InputError(f"{uri} has no link {name!r}")
    for name in ("head_center", "marker"):
        _required_frame(plant, f"drum::{name}", uri)
    bodies = [plant.get_body(i) for i in plant.GetBodyIndices(models[0])]
    fixed = plant.GetBodiesWeldedTo(plant.world_body())
    for body in bodies:
        if body in fixed:
            raise InputError(
                f"{uri}: {body.scoped_name()} is static or welded to the "
                "world, expected a drum that can be placed"
            )
    together = plant.GetBodiesWeldedTo(bodies[0])
    for body in bodies:
        if body not in together:
            raise InputError(
                f"{uri}: {body.scoped_name()} is not fixed to "
                f"{bodies[0].scoped_name()}, expected a drum in one piece"
            )
    return bodies[0]


def robot_instance(plant: MultibodyPlant) -> ModelInstanceIndex:
    """The robot's model instance."""
    return plant.GetModelInstanceByName("affetto")


def get_joint(plant: MultibodyPlant, name: str) -> RevoluteJoint:
    """The robot's joint `name`.

    Raises:
        InputError: if there is none; the message offers the nearest name.
    """
    return joints.find_joint(plant, robot_instance(plant), name)


def joint_names(plant: MultibodyPlant) -> list[str]:
    """The names of the robot's actuated joints, in the model's order."""
    return joints.joint_names(plant, robot_instance(plant))


def joint_limits(
    plant: MultibodyPlant, names: Sequence[str]
) -> tuple[np.ndarray, np.ndarray]:
    """Lower and upper limits [rad] of the joints `names`, each (n,)."""
    found = [get_joint(plant, name) for name in names]
    return (
        np.array([joint.position_lower_limit() for joint in found]),
        np.array([joint.position_upper_limit() for joint in found]),
    )


def effort_limits(plant: MultibodyPlant, names: Sequence[str]) -> np.ndarray:
    """Effort limits [N m] of the actuators of the joints `names`, (n,)."""
    return np.array(
        [
            plant.GetJointActuatorByName(
                n, robot_instance(plant)
            ).effort_limit()
            for n in names
        ]
    )


def check_posture(
    plant: MultibodyPlant, posture: Mapping[str, float], where: str
) -> None:
    """Raises InputError for an unknown joint or an angle beyond its limits."""
    for name, angle in posture.items():
        with naming(where):
            joint = get_joint(plant, name)
        require_range(
            f"{where}.{name}",
            angle,
            joint.position_lower_limit(),
            joint.position_upper_limit(),
        )


def set_posture(
    plant: MultibodyPlant, context: Context, posture: Mapping[str, float]
) -> None:
    """Sets the joints named in `posture` [rad], at rest.

    Raises:
        InputError: for an unknown joint or an angle beyond its limits.
    """
    check_posture(plant, posture, "posture")
    for name, angle in posture.items():
        joint = get_joint(plant, name)
        joint.set_angle(context, angle)
        joint.set_angular_rate(context, 0.0)


def get_posture(plant: MultibodyPlant, context: Context) -> dict[str, float]:
    """All of the robot's joint angles [rad] by name."""
    return {
        name: get_joint(plant, name).get_angle(context)
        for name in joint_names(plant)
    }


def weld_inactive(plant: MultibodyPlant, active: Sequence[str]) -> None:
    """Welds all of the robot's joints but `active`, at their default angles.

    A locked joint keeps its place in the plant's equations, which makes each
    step about three times as costly as one of a plant without it.

    Args:
        plant: Plant with the robot, not finalized yet.
        active: Names of the joints that stay.

    Raises:
        InputError: For an unknown joint.
    """
    for name in active:
        get_joint(plant, name)
    actuators = {
        plant.get_joint_actuator(i).joint().name(): i
        for i in plant.GetJointActuatorIndices()
    }
    for name in joint_names(plant):
        if name in active:
            continue
        joint = get_joint(plant, name)
        turn = AngleAxis(joint.get_default_angle(), joint.revolute_axis())
        weld = WeldJoint(
            name,
            joint.frame_on_parent(),
            joint.frame_on_child(),
            RigidTransform(turn, [0.0, 0.0, 0.0]),
        )
        plant.RemoveJointActuator(plant.get_joint_actuator(actuators[name]))
        plant.RemoveJoint(joint)
        plant.AddJoint(weld)


def _inspector(plant: MultibodyPlant, context: Context) -> SceneGraphInspector:
    query = plant.get_geometry_query_input_port().Eval(context)
    return query.inspector()


def _shapes(
    plant: MultibodyPlant,
    context: Context,
    body: RigidBody,
    kind: type,
    role: Role = Role.kProximity,
    name: str = "",
) -> list[tuple[RigidTransform, Any]]:
    """Poses and shapes of the body's geometries of that kind, role, name."""
    inspector = _inspector(plant, context)
    frame = plant.GetBodyFrameIdOrThrow(body.index())
    found = [
        (inspector.GetPoseInFrame(i), inspector.GetShape(i))
        for i in inspector.GetGeometries(frame, role)
        if isinstance(inspector.GetShape(i), kind)
        and inspector.GetName(i).endswith(name)
    ]
    what = f"{role.name[1:].lower()} {kind.__name__} {name}".rstrip()
    if not found:
        raise InputError(f"{body.scoped_name()} has no {what}")
    return found


def table_extents(
    plant: MultibodyPlant, context: Context
) -> tuple[np.ndarray, np.ndarray]:
    """Lower and upper corner [m] of the table top's box, each (3,), in world.

    The plant must be connected to its SceneGraph. The table is level and
    square to the world.
    """
    body = find_body(plant, "table::table_top")
    X_TG, box = _shapes(plant, context, body, Box)[0]
    X_WG = plant.EvalBodyPoseInWorld(context, body) @ X_TG
    half = 0.5 * np.abs(X_WG.rotation().matrix()) @ box.size()
    return X_WG.translation() - half, X_WG.translation() + half


def drum_radius(plant: MultibodyPlant, context: Context) -> float:
    """Radius [m] of the drum's shell, its widest part."""
    body = find_body(plant, "drum::shell")
    shapes = _shapes(plant, context, body, Cylinder)
    return max(shape.radius() for _, shape in shapes)


def head_radius(plant: MultibodyPlant, context: Context) -> float:
    """Radius [m] of the drum's head, as far as it can be struck."""
    body = find_frame(plant, "drum::head_center").body()
    shapes = _shapes(plant, context, body, Cylinder)
    return max(shape.radius() for _, shape in shapes)


def hand_radius(plant: MultibodyPlant, context: Context) -> float:
    """Radius [m] of the soft right hand, about the palm's frame."""
    body = find_body(plant, "affetto::right_hand")
    shapes = _shapes(plant, context, body, Sphere)
    return max(shape.radius() for _, shape in shapes)


def marker_radius(plant: MultibodyPlant, context: Context) -> float:
    """Radius of the colored disc on the drum's head, m."""
    query = plant.get_geometry_query_input_port().Eval(context)
    return find_marker_radius(plant, query.inspector())


def find_marker_radius(
    plant: MultibodyPlant, inspector: SceneGraphInspector
) -> float:
    """Radius of the drum's marker, from its visual geometry, m.

    Raises:
        InputError: If the drum has no visual cylinder named `marker`.
    """
    body = find_frame(plant, "drum::marker").body()
    frame = plant.GetBodyFrameIdOrThrow(body.index())
    for geometry in inspector.GetGeometries(frame, Role.kPerception):
        shape = inspector.GetShape(geometry)
        name = inspector.GetName(geometry).rpartition("::")[2]
        if name == "marker" and isinstance(shape, Cylinder):
            return float(shape.radius())
    raise InputError("the drum's model has no visual cylinder named 'marker'")


def mirror_size(plant: MultibodyPlant, context: Context) -> np.ndarray:
    """Extents [m] of the glass along the mirror's x and y, (2,)."""
    body = find_frame(plant, "mirror::mirror").body()
    shapes = _shapes(plant, context, body, Box, Role.kPerception, "glass")
    return shapes[0][1].size()[:2]


def drum_limits(
    plant: MultibodyPlant, context: Context
) -> tuple[np.ndarray, np.ndarray]:
    """Least and greatest x, y [m] of a drum wholly on the table, each (2,)."""
    lower, upper = table_extents(plant, context)
    radius = drum_radius(plant, context)
    return lower[:2] + radius, upper[:2] - radius


def require_on_table(
    plant: MultibodyPlant, context: Context, field: str, *places: np.ndarray
) -> None:
    """Raises InputError unless drums at x, y (2,) are wholly on the table.

    Args:
        plant: The finalized plant.
        context: The plant's context.
        field: What names the places, for errors.
        places: World x, y (2,) each, m.
    """
    low, high = drum_limits(plant, context)
    for place in places:
        require(
            bool(np.all(place >= low) and np.all(place <= high)),
            field,
            place.tolist(),
            f"x from {low[0]:.3f} to {high[0]:.3f} and y from {low[1]:.3f} to "
            f"{high[1]:.3f} m (the drum stands wholly on the table)",
        )


def set_drum_position(
    plant: MultibodyPlant, context: Context, xy: ArrayLike
) -> None:
    """Puts the drum on the table at world x, y [m].

    Raises:
        InputError: if the drum would not stand wholly on the table.
    """
    place = require_array("drum position", xy, (2,))
    require_on_table(plant, context, "drum position", place)
    frame = plant.GetFrameByName(
        _PLACEMENT, plant.world_body().model_instance()
    )
    height = table_extents(plant, context)[1][2]
    frame.SetPoseInParentFrame(context, RigidTransform([*place, height]))


def set_mirror_pose(
    plant: MultibodyPlant, context: Context, pose: FramePose
) -> None:
    """Puts the mirror elsewhere than the directives have it.

    Args:
        plant: The finalized plant.
        context: The plant's context.
        pose: Pose of the frame `mirror_pose`; its z is the mirror's normal.

    Raises:
        InputError: For a pose that is out of range.
    """
    pose.check("mirror")
    frame: Any = plant.GetFrameByName(_MIRROR)
    frame.SetPoseInParentFrame(context, pose.transform())


def get_mirror_pose(plant: MultibodyPlant, context: Context) -> FramePose:
    """The pose of the frame `mirror_pose`."""
    frame: Any = plant.GetFrameByName(_MIRROR)
    X = frame.GetPoseInParentFrame(context)
    rotation = RollPitchYaw(X.rotation()).vector()
    return FramePose(X.translation().tolist(), np.degrees(rotation).tolist())


def get_drum_position(plant: MultibodyPlant, context: Context) -> np.ndarray:
    """The drum's world x, y [m], (2,)."""
    frame = plant.GetFrameByName(
        _PLACEMENT, plant.world_body().model_instance()
    )
    return frame.GetPoseInParentFrame(context).translation()[:2].copy()


def marker_position(plant: MultibodyPlant, context: Context) -> np.ndarray:
    """World position [m] of the center of the drum's marker, (3,)."""
    frame = find_frame(plant, "drum::marker")
    return frame.CalcPoseInWorld(context).translation()


def head_center_position(plant: MultibodyPlant, context: Context) -> np.ndarray:
    """World position [m] of the top center of the drum's head, (3,)."""
    frame = find_frame(plant, "drum::head_center")
    return frame.CalcPoseInWorld(context).translation()


def serial_chain(plant: MultibodyPlant, frame_name: str) -> SerialChain:
    """The chain of revolute joints from the world to the frame `frame_name`.

    The plant must be finalized; welds are folded into the fixed poses.
    """
    frame = find_frame(plant, frame_name)
    moved_by = {
        int(plant.get_joint(i).child_body().index()): plant.get_joint(i)
        for i in plant.GetJointIndices()
    }
    names: list[str] = []
    offsets: list[np.ndarray] = []
    axes: list[np.ndarray] = []
    limits: list[tuple[float, float]] = []
    # From the tip inwards, `X` is the pose of the part already walked.
    X = frame.GetFixedPoseInBodyFrame()
    body = frame.body()
    X_JT = None
    while body.index() != plant.world_body().index():
        joint = moved_by[int(body.index())]
        X = joint.frame_on_child().GetFixedPoseInBodyFrame().inverse() @ X
        if joint.num_positions() == 1:
            if X_JT is None:
                X_JT = X
            else:
                offsets.append(X.GetAsMatrix4())
            names.append(joint.name())
            axes.append(joint.revolute_axis())
            limits.append(
                (joint.position_lower_limit(), joint.position_upper_limit())
            )
            X = RigidTransform()
        else:
            X = joint.X_FM() @ X
        X = joint.frame_on_parent().GetFixedPoseInBodyFrame() @ X
        body = joint.parent_body()
    if X_JT is None:
        raise InputError(f"frame {frame_name!r} is fixed in the world")
    offsets.append(X.GetAsMatrix4())
    lower, upper = np.array(limits[::-1]).T
    return SerialChain(
        names=tuple(names[::-1]),
        X_PJ=np.array(offsets[::-1]),
        axes=np.array(axes[::-1]),
        X_JT=X_JT.GetAsMatrix4(),
        lower=lower,
        upper=upper,
    )
