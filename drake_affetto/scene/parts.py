"""Frames and bodies of a scene by their scoped names, `model::name`."""

from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import (
    Frame,
    FrameIndex,
    ModelInstanceIndex,
    RigidBody,
)

from drake_affetto.common.errors import require


def find_frame(plant: MultibodyPlant, name: str, field: str = "frame") -> Frame:
    """The frame `model::frame` (or `frame`, if there is but one) of a plant.

    Args:
        plant: Plant, finalized or not.
        name: Name of the frame.
        field: What names the frame, for errors.

    Raises:
        InputError: If there is no such frame, or several.
    """
    model, _, frame = name.rpartition("::")
    expected = "one frame of the scene, as model::frame"
    if not model:
        found = [
            plant.get_frame(FrameIndex(i)) for i in range(plant.num_frames())
        ]
        found = [each for each in found if each.name() == frame]
        require(len(found) == 1, field, name, expected)
        return found[0]
    instance = _find_model(plant, model)
    has = instance is not None and plant.HasFrameNamed(frame, instance)
    require(has, field, name, expected)
    return plant.GetFrameByName(frame, instance)


def _find_model(plant: MultibodyPlant, name: str) -> ModelInstanceIndex | None:
    if not plant.HasModelInstanceNamed(name):
        return None
    return plant.GetModelInstanceByName(name)


def find_body(
    plant: MultibodyPlant, name: str, field: str = "body"
) -> RigidBody:
    """The body `model::body` of a plant.

    Args:
        plant: Plant, finalized or not.
        name: Name of the body, with its model's.
        field: What names the body, for errors.

    Raises:
        InputError: If there is no such body.
    """
    model, _, body = name.rpartition("::")
    instance = _find_model(plant, model)
    has = instance is not None and plant.HasBodyNamed(body, instance)
    require(has, field, name, "a body of the scene, as model::body")
    return plant.GetBodyByName(body, instance)
