"""Geometry of cameras, mirrors and joint chains: arrays in, arrays out."""

from typing import TYPE_CHECKING

from drake_affetto.common.lazy import attach

if TYPE_CHECKING:
    from drake_affetto.geometry.kinematics import SerialChain, solve_position
    from drake_affetto.geometry.optics import (
        FisheyeCamera,
        PinholeCamera,
        disc_outline,
        invert_pose,
        make_pose,
        reflect_camera,
        reflect_points,
        transform_points,
    )

__getattr__, __dir__, __all__ = attach(
    __name__,
    {
        "FisheyeCamera": "optics",
        "PinholeCamera": "optics",
        "SerialChain": "kinematics",
        "disc_outline": "optics",
        "invert_pose": "optics",
        "make_pose": "optics",
        "reflect_camera": "optics",
        "reflect_points": "optics",
        "solve_position": "kinematics",
        "transform_points": "optics",
    },
)
