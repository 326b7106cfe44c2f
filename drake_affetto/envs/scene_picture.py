"""Pictures of a station from outside, for `render()` of the environments."""

import numpy as np
from pydrake.geometry import (
    ClippingRange,
    ColorRenderCamera,
    Meshcat,
    RenderCameraCore,
)
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.systems.framework import Context
from pydrake.systems.sensors import CameraInfo

from drake_affetto.common.typing import Image
from drake_affetto.perception.mirror_camera import make_renderer
from drake_affetto.scene.view import (
    CAMERA_POSITION,
    CAMERA_TARGET,
    set_default_camera_pose,
)
from drake_affetto.station.station import AffettoStation

RENDER_MODES = ["rgb_array", "human"]

# The renderer for which the models name what is seen from outside.
_OUTSIDE = "outside"
_FOV_Y = 0.75


def take_picture(
    station: AffettoStation,
    context: Context,
    width: int = 480,
    height: int = 360,
) -> Image:
    """A picture of robot, drum and mirror (height, width, 3), RGB of uint8.

    Args:
        station: The station.
        context: The root's context.
        width: Width of the picture, pixels.
        height: Height of the picture, pixels.
    """
    scene = station.GetSubsystemByName("seen_scene")
    mine = scene.GetMyMutableContextFromRoot(context)
    # The robot's own renderers leave out its head, or the mirror.
    if not scene.HasRenderer(mine, _OUTSIDE):
        scene.AddRenderer(
            mine, _OUTSIDE, make_renderer(station.scenario.rendering)
        )
    query = scene.get_query_output_port().Eval(mine)
    core = RenderCameraCore(
        _OUTSIDE,
        CameraInfo(width=width, height=height, fov_y=_FOV_Y),
        ClippingRange(0.05, 5.0),
        RigidTransform(),
    )
    image = query.RenderColorImage(
        ColorRenderCamera(core, False),
        query.inspector().world_frame_id(),
        _look_at(np.array(CAMERA_POSITION), np.array(CAMERA_TARGET)),
    )
    return image.data[:, :, :3].copy()


def open_window() -> Meshcat:
    """A Meshcat server for render mode "human"; prints its address."""
    meshcat = Meshcat()
    set_default_camera_pose(meshcat)
    print(f"The robot is at {meshcat.web_url()}", flush=True)
    return meshcat


def _look_at(eye: np.ndarray, target: np.ndarray) -> RigidTransform:
    """X_WC of a camera that looks along z, with y down."""
    forward = (target - eye) / np.linalg.norm(target - eye)
    right = np.cross(forward, [0.0, 0.0, 1.0])
    right /= np.linalg.norm(right)
    down = np.cross(forward, right)
    return RigidTransform(
        RotationMatrix(np.column_stack([right, down, forward])), eye
    )
