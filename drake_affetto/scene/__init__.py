"""The world: robot, table, drum and mirror in a MultibodyPlant."""

from typing import TYPE_CHECKING

from drake_affetto.common.lazy import attach

if TYPE_CHECKING:
    from drake_affetto.scene.joint_state import make_joint_state
    from drake_affetto.scene.joints import JointSelection, select_joints
    from drake_affetto.scene.view import set_default_camera_pose, view_model
    from drake_affetto.scene.world import (
        WorldConfig,
        add_world,
        get_drum_position,
        get_posture,
        joint_limits,
        joint_names,
        set_drum_position,
        set_posture,
    )

__getattr__, __dir__, __all__ = attach(
    __name__,
    {
        "JointSelection": "joints",
        "WorldConfig": "world",
        "add_world": "world",
        "get_drum_position": "world",
        "get_posture": "world",
        "joint_limits": "world",
        "joint_names": "world",
        "make_joint_state": "joint_state",
        "select_joints": "joints",
        "set_default_camera_pose": "view",
        "set_drum_position": "world",
        "set_posture": "world",
        "view_model": "view",
    },
)
