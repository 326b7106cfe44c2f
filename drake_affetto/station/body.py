"""A robot's body that departs from the model: what nobody has measured exactly.

Masses, friction, valves, air supply and the places of camera, drum and mirror
are estimates. A claim should hold whatever they are within reason: a `Body`
says how one robot departs from its model, and `BodyRanges` what such robots are
drawn from. The robot's own software knows the model only.
"""

from collections.abc import Mapping, Sequence
import dataclasses

import numpy as np
from pydrake.geometry import ProximityProperties, RoleAssign, SceneGraph
from pydrake.multibody.plant import MultibodyPlant
from pydrake.systems.framework import Context

from drake_affetto.common.errors import require_array, require_range
from drake_affetto.common.fields import check_ranges, number
from drake_affetto.perception.config import CameraConfig
from drake_affetto.pneumatics.parameters import (
    JointActuator,
    PneumaticParameters,
)
from drake_affetto.scene.world import FramePose, WorldConfig, get_joint

DEFAULT_FILE = "package://drake_affetto/bodies.yaml"

# The fields of an actuator that each factor of a body scales.
_SCALED = {
    "friction": ("coulomb_torque", "breakaway_torque", "dwell_torque"),
    "conductance": (
        "fill_conductance",
        "exhaust_conductance",
        "leak_conductance",
    ),
    "volume": ("dead_volume",),
}

_STIFFNESS = ("material", "point_contact_stiffness")

# Factors by joint.
Factors = dict[str, float]


def _zeros() -> list[float]:
    return [0.0, 0.0, 0.0]


@dataclasses.dataclass
class Body:
    """How a robot and its surroundings depart from their model.

    Attributes:
        mass: Joint -> factor of the masses and inertias of the links that it
            moves, up to the next active joint.
        friction: Joint -> factor of its actuator's dry friction.
        conductance: Joint -> factor of its valves' conductances.
        volume: Joint -> factor of its chambers' dead volumes.
        supply: Factor of the air supply's gauge pressure.
        hand_stiffness: Factor of the soft hand's stiffness.
        camera_translation: Added to the camera's place on its frame (3,), m.
        camera_rotation: Added to its roll, pitch and yaw (3,), rad.
        drum_height: Added to the height of the table with the drum, m.
        mirror_translation: Added to the mirror's place (3,), m.
        mirror_rotation: Added to its roll, pitch and yaw (3,), deg.
    """

    mass: Factors = dataclasses.field(default_factory=dict)
    friction: Factors = dataclasses.field(default_factory=dict)
    conductance: Factors = dataclasses.field(default_factory=dict)
    volume: Factors = dataclasses.field(default_factory=dict)
    supply: float = number(1.0, 0.2, 5.0)
    hand_stiffness: float = number(1.0, 0.1, 10.0)
    camera_translation: list[float] = dataclasses.field(default_factory=_zeros)
    camera_rotation: list[float] = dataclasses.field(default_factory=_zeros)
    drum_height: float = number(0.0, -0.1, 0.1)
    mirror_translation: list[float] = dataclasses.field(default_factory=_zeros)
    mirror_rotation: list[float] = dataclasses.field(default_factory=_zeros)

    def check(self, where: str) -> None:
        """Raises InputError naming the first field that does not fit."""
        check_ranges(self, where)
        for name in ("mass", *_SCALED):
            for joint, factor in getattr(self, name).items():
                require_range(f"{where}.{name}.{joint}", factor, 0.1, 10.0)
        for field in dataclasses.fields(self):
            if field.name.endswith(("_translation", "_rotation")):
                value = getattr(self, field.name)
                require_array(f"{where}.{field.name}", value, (3,))

    def actuators(
        self, parameters: PneumaticParameters, joints: Sequence[str]
    ) -> PneumaticParameters:
        """Air supply and actuators of `joints` as this body has them.

        Raises:
            InputError: If a factor names another joint.
        """
        changed = dict(parameters.joints)
        for name in joints:
            resolved = parameters.actuator_of(name)
            override = dict(changed[name].override)
            for kind, fields in _SCALED.items():
                factor = getattr(self, kind).get(name, 1.0)
                for field in fields:
                    override[field] = factor * getattr(resolved, field)
            changed[name] = JointActuator(changed[name].actuator, override)
        gauge = parameters.supply_pressure - parameters.atmospheric_pressure
        return dataclasses.replace(
            parameters,
            joints=changed,
            supply_pressure=parameters.atmospheric_pressure
            + self.supply * gauge,
        )

    def camera(self, config: CameraConfig) -> CameraConfig:
        """The camera as this body has it."""
        return dataclasses.replace(
            config,
            translation=_sum(config.translation, self.camera_translation),
            rotation=_sum(config.rotation, self.camera_rotation),
        )

    def world(self, config: WorldConfig) -> WorldConfig:
        """Table, drum and mirror as they stand around this body."""
        if not self.moves:
            return config
        return dataclasses.replace(
            config,
            offsets={
                **config.offsets,
                "table_pose": FramePose([0.0, 0.0, self.drum_height]),
                "mirror_pose": FramePose(
                    self.mirror_translation, self.mirror_rotation
                ),
            },
        )

    def set_masses(self, plant: MultibodyPlant, context: Context) -> None:
        """Gives a plant's links this body's masses, in a fresh context.

        Raises:
            InputError: If a factor names a joint that does not move.
        """
        for name, factor in self.mass.items():
            joint = get_joint(plant, name)
            for body in plant.GetBodiesWeldedTo(joint.child_body()):
                body.SetMass(context, factor * body.default_mass())

    def set_hand(self, plant: MultibodyPlant, scene_graph: SceneGraph) -> None:
        """Makes the right hand as soft as this body's."""
        if self.hand_stiffness == 1.0:
            return
        inspector = scene_graph.model_inspector()
        hand = plant.GetBodyByName("right_hand")
        for geometry in plant.GetCollisionGeometriesForBody(hand):
            properties = ProximityProperties(
                inspector.GetProximityProperties(geometry)
            )
            stiffness = properties.GetProperty(*_STIFFNESS)
            properties.UpdateProperty(
                *_STIFFNESS, self.hand_stiffness * stiffness
            )
            scene_graph.AssignRole(
                plant.get_source_id(),
                geometry,
                properties,
                RoleAssign.kReplace,
            )

    @property
    def moves(self) -> bool:
        """Whether something stands elsewhere than in the model."""
        return bool(
            self.drum_height
            or any(self.mirror_translation)
            or any(self.mirror_rotation)
        )

    def numbers(self) -> dict[str, float]:
        """All that departs, each number by a name of its own."""
        found: dict[str, float] = {}
        for field in dataclasses.fields(self):
            value = getattr(self, field.name)
            if isinstance(value, list):
                value = dict(zip("xyz", value, strict=True))
            if not isinstance(value, Mapping):
                found[field.name] = value
                continue
            for key, part in value.items():
                found[f"{field.name}.{key}"] = part
        return found


@dataclasses.dataclass
class BodyRanges:
    """What bodies are drawn from, evenly; factors from 1 - x to 1 + x.

    Attributes:
        mass, conductance, volume, supply, hand_stiffness: x, relative.
        friction: Greatest factor; the least is its inverse, and the logarithm
            is drawn evenly.
        camera_position: Greatest error along each axis, m.
        camera_angle: Greatest error about each axis, rad.
        drum_height: Greatest error, m.
        mirror_position: Greatest error along each axis, m.
        mirror_angle: Greatest error about each axis, deg.
    """

    mass: float = number(0.2, 0.0, 0.8)
    friction: float = number(2.0, 1.0, 5.0)
    conductance: float = number(0.2, 0.0, 0.8)
    volume: float = number(0.2, 0.0, 0.8)
    supply: float = number(0.1, 0.0, 0.5)
    hand_stiffness: float = number(0.3, 0.0, 0.8)
    camera_position: float = number(0.02, 0.0, 0.1)
    camera_angle: float = number(0.035, 0.0, 0.5)
    drum_height: float = number(0.01, 0.0, 0.1)
    mirror_position: float = number(0.03, 0.0, 0.2)
    mirror_angle: float = number(5.0, 0.0, 45.0)

    def check(self, where: str) -> None:
        """Raises InputError naming the first field that does not fit."""
        check_ranges(self, where)

    def draw(self, joints: Sequence[str], rng: np.random.Generator) -> Body:
        """Draws a robot.

        Args:
            joints: Names of the active joints.
            rng: Source of the draws.
        """

        def around(middle: float, most: float) -> float:
            return float(middle + rng.uniform(-most, most))

        def each(most: float) -> Factors:
            return {name: around(1.0, most) for name in joints}

        def vector(most: float) -> list[float]:
            return [around(0.0, most) for _ in range(3)]

        slack = float(np.log(self.friction))
        return Body(
            mass=each(self.mass),
            friction={
                name: float(np.exp(around(0.0, slack))) for name in joints
            },
            conductance=each(self.conductance),
            volume=each(self.volume),
            supply=around(1.0, self.supply),
            hand_stiffness=around(1.0, self.hand_stiffness),
            camera_translation=vector(self.camera_position),
            camera_rotation=vector(self.camera_angle),
            drum_height=around(0.0, self.drum_height),
            mirror_translation=vector(self.mirror_position),
            mirror_rotation=vector(self.mirror_angle),
        )


def _sum(first: Sequence[float], second: Sequence[float]) -> list[float]:
    return [a + b for a, b in zip(first, second, strict=True)]
