"""Viscous friction of joints that differs from the model's."""

from collections.abc import Mapping

from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import RevoluteJoint

from drake_affetto.common.errors import naming, require, require_range
from drake_affetto.scene.world import get_joint


def set_joint_damping(
    plant: MultibodyPlant, damping: Mapping[str, float]
) -> None:
    """Sets the viscous friction of the robot's joints.

    Args:
        plant: Plant of the world, before `Finalize`.
        damping: Joint -> N m s/rad; others keep the model's.

    Raises:
        InputError: For a joint that is not there, or a value that cannot be.
    """
    for name, value in damping.items():
        require_range(f"joint_damping.{name}", value, 0.0, 100.0)
        with naming("joint_damping"):
            joint = get_joint(plant, name)
        require(
            isinstance(joint, RevoluteJoint),
            f"joint_damping.{name}",
            value,
            "the damping of an active joint: this one is welded",
        )
        joint.set_default_damping(value)
