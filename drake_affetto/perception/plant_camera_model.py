"""The geometry of seeing, as read from a plant: see `sight_model`."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from pydrake.multibody.plant import MultibodyPlant
from pydrake.systems.framework import Context

from drake_affetto.perception.blob import BlobCalibration, calibrate
from drake_affetto.perception.camera_model import CameraModel, Mirror
from drake_affetto.perception.config import CameraConfig
from drake_affetto.perception.mirror_camera import MirrorCamera
from drake_affetto.scene import world


def make_camera_model(
    plant: MultibodyPlant,
    context: Context,
    config: CameraConfig,
    yaw_joint: str,
) -> CameraModel:
    """The sight model at the posture and drum height of a plant's context.

    Args:
        plant: the finalized plant, wired to its SceneGraph.
        context: the plant's context; its posture is that of all joints but
            the yaw.
        config: the camera.
        yaw_joint: the joint by which the camera turns.
    """
    query: Any = plant.get_geometry_query_input_port().Eval(context)
    return CameraModel.from_chain(
        config.model(),
        world.serial_chain(plant, config.frame),
        yaw_joint,
        world.get_posture(plant, context),
        float(world.marker_position(plant, context)[2]),
        world.find_marker_radius(plant, query.inspector()),
        config.X_FC(),
    )


def mirrors_in_world(camera: MirrorCamera, context: Context) -> list[Mirror]:
    """The mirrors that a camera knows, where they are in its context."""
    return [
        Mirror(X_WM.GetAsMatrix4(), width, height)
        for X_WM, width, height in camera.mirrors(context)
    ]


def calibrate_view(
    sight: CameraModel,
    positions: np.ndarray,
    fixed_yaw: float | None = None,
    mirrors: Sequence[Mirror] = (),
    margin: float = 0.05,
) -> BlobCalibration:
    """The box of pixels for a workspace of drum positions (n, 2).

    Args:
        sight: the geometry of seeing.
        positions: where the drum may stand, x and y in W [m].
        fixed_yaw: the yaw [rad] to look from; None to center the marker, and
            then x spans the whole image.
        mirrors: in which the marker may be seen.
        margin: what to add on each side, as a fraction of the box.

    Raises:
        InputError: if the marker is seen at fewer than 3 places.
    """
    if fixed_yaw is None:
        _, pixels = sight.direct_pixels(positions)
        return calibrate(pixels, margin, sight.camera.width)
    pixels = sight.fixed_yaw_pixels(positions, fixed_yaw, mirrors)
    return calibrate(pixels, margin)
