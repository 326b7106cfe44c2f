"""Cameras on a turning trunk, for tests of the camera's model."""

import numpy as np

from drake_affetto.geometry import optics
from drake_affetto.geometry.optics import FisheyeCamera, PinholeCamera
from drake_affetto.perception.camera_model import CameraModel, Mirror
from drake_affetto.perception.config import rotation_matrix

PINHOLE = PinholeCamera.from_fov(320, 240, 0.9)

FISHEYE = FisheyeCamera.from_fov(320, 240, 1.3, -0.02, 0.0)

HEIGHT = 0.05


def camera_in_torso(pan=0.0, roll=0.0):
    """X_AC of a camera that looks forward and down."""
    R = rotation_matrix([-np.pi / 2 - 0.7, 0.0, -np.pi / 2 + pan])
    return optics.make_pose(
        R @ rotation_matrix([0, 0, roll]), [0.06, 0.01, 0.3]
    )


def make(camera=PINHOLE, pan=0.0, roll=0.0, tilt=0.0):
    X_WA = optics.make_pose(
        rotation_matrix([tilt, 0.5 * tilt, 0.2]), [0, 0, 0.1]
    )
    return CameraModel(
        camera,
        X_WA,
        np.array([0.0, 0.0, 1.0]),
        camera_in_torso(pan, roll),
        HEIGHT,
        0.03,
    )


MIRROR = Mirror(
    optics.make_pose(
        rotation_matrix([np.pi / 2 + 0.15, 0, 0]), [0.3, 0.3, 0.2]
    ),
    0.6,
    0.5,
)
