"""The world: robot, table, drum and mirror in a MultibodyPlant."""

from typing import TYPE_CHECKING

from drake_affetto.common.lazy import attach

if TYPE_CHECKING:
    from drake_affetto.scene.view import set_default_camera_pose, view_model
    from drake_affetto.scene.world import (
        JointSelection,
        WorldConfig,
        add_world,
        get_drum_position,
        get_posture,
        joint_limits,
        joint_names,
        select_joints,
        set_drum_position,
        set_posture,
    )

__getattr__, __dir__, __all__ = attach(
    __name__,
    {
        "JointSelection": "world",
        "WorldConfig": "world",
        "add_world": "world",
        "get_drum_position": "world",
        "get_posture": "world",
        "joint_limits": "world",
        "joint_names": "world",
        "select_joints": "world",
        "set_default_camera_pose": "view",
        "set_drum_position": "world",
        "set_posture": "world",
        "view_model": "view",
    },
)
