"""A small robot before a mirror, all of it geometry.

It has a trunk of two joints that carries an eye, and an arm of four.
"""

import numpy as np

from drake_affetto.calibration.config import SelfCalibrationConfig
from drake_affetto.calibration.ellipse import EllipseLook, expected_ellipse
from drake_affetto.calibration.hand import HandLook
from drake_affetto.calibration.knowledge import (
    KnowledgeErrors,
    RobotKnowledge,
)
from drake_affetto.calibration.plane import PlanePrior
from drake_affetto.geometry.kinematics import SerialChain
from drake_affetto.geometry.optics import PinholeCamera, make_pose
from drake_affetto.geometry.planes import reflect
from drake_affetto.perception.blob import BlobCalibration

JOINTS = ("yaw", "pitch", "raise", "spread", "turn", "elbow")
WORKSPACE = np.array([[0.16, -0.24], [0.34, -0.24], [0.34, 0.06], [0.16, 0.06]])
# Azimuth, elevation and distance from the eye of a mirror on the left.
MIRROR = np.array([-1.86, -0.18, 0.29])
BLUR = 0.289


def _shift(x: float, y: float, z: float) -> np.ndarray:
    return make_pose(np.eye(3), np.array([x, y, z]))


def _looking(forward) -> np.ndarray:
    """Rotation of a camera that looks along `forward`, its image upright."""
    z = np.asarray(forward, float) / np.linalg.norm(forward)
    x = np.cross(z, [0.0, 0.0, 1.0])
    x /= np.linalg.norm(x)
    return np.column_stack([x, np.cross(z, x), z])


def _chain(names, poses, axes, tip) -> SerialChain:
    count = len(names)
    return SerialChain(
        names=names,
        X_PJ=np.array(poses),
        axes=np.array(axes, float),
        X_JT=tip,
        lower=np.array([-0.8, -0.3, -0.3, -0.3, -0.3, -0.3])[:count],
        upper=np.array([0.8, 0.8, 2.0, 1.2, 1.0, 2.2])[:count],
    )


_TRUNK = [_shift(0, 0, 0.05), _shift(0, 0, 0.05)]
_AXES = [[0, 0, 1], [0, 1, 0]]


def _eye(forward) -> SerialChain:
    tip = make_pose(_looking(forward), np.array([0.07, 0.03, 0.29]))
    return _chain(JOINTS[:2], _TRUNK, _AXES, tip)


def robot(height: int = 240) -> RobotKnowledge:
    """The robot, with images of so many lines."""
    width = height * 4 // 3
    return RobotKnowledge(
        joints=JOINTS,
        camera=PinholeCamera.from_fov(width, height, 0.82),
        eye_chain=_eye([0.57, 0.69, -0.45]),
        hand_chain=_chain(
            JOINTS,
            [
                *_TRUNK,
                _shift(0, -0.12, 0.15),
                _shift(0, 0, 0),
                _shift(0, 0, -0.16),
                _shift(0, 0, 0),
            ],
            [*_AXES, [0, -1, 0], [-1, 0, 0], [0, 0, 1], [0, -1, 0]],
            _shift(0.03, 0.03, -0.18),
        ),
        yaw_joint="yaw",
        posture=np.zeros(6),
        calibration=BlobCalibration(-0.5, width - 0.5, -0.5, height - 0.5),
        source_chain=_eye([0.6, -0.2, -0.75]),
        source_posture=np.zeros(6),
        source_calibration=BlobCalibration(
            -0.5, width - 0.5, -0.5, height - 0.5
        ),
        marker_height=0.04,
        marker_radius=0.03,
        zeros=np.zeros(6),
    )


def settings() -> SelfCalibrationConfig:
    """Settings of its self-calibration."""
    config = SelfCalibrationConfig(
        prior=PlanePrior(),
        knowledge=KnowledgeErrors(0.006, 0.002, 0.003, 0.002, 0.005),
    )
    config.hand.space_low = [0.12, -0.3, 0.05]
    config.hand.space_high = [0.4, 0.2, 0.2]
    return config


def exact() -> KnowledgeErrors:
    """Of a robot that knows itself exactly."""
    return KnowledgeErrors()


def sees_hand(
    true: RobotKnowledge, mirror, readings, rng=None, noise: float = 0.0
) -> HandLook:
    """What it sees of its hand in the mirror at these readings."""
    image = reflect(mirror, true.eye_position, true.hand(readings))
    uv = true.pixels(true.eye(readings), image)
    if not true.camera.inside(uv, 3.0):
        return HandLook(readings, None)
    if rng is not None:
        uv = uv + noise * rng.normal(size=2)
    return HandLook(readings, uv)


def sees_ellipse(
    true: RobotKnowledge, mirror, xy, rng=None, noise: float = 0.0
) -> EllipseLook:
    """What it sees of the marker of a drum at xy."""
    center, moments = expected_ellipse(
        true, mirror, true.eye_position, np.asarray(xy), BLUR
    )
    if rng is not None:
        length = np.sqrt(moments[[0, 2]]) + noise * rng.normal(size=2)
        moments = np.array([length[0] ** 2, moments[1], length[1] ** 2])
        center = center + 0.2 * rng.normal(size=2)
    return EllipseLook(center, moments)


def tau_of(true: RobotKnowledge, mirror, xy) -> np.ndarray:
    """The task parameter in the mirror's view of a drum at xy."""
    return true.calibration.normalize(sees_ellipse(true, mirror, xy).center)


def misjudged(true: RobotKnowledge, errors: KnowledgeErrors, seed: int):
    """The robot's model of itself, wrong by these errors."""
    rng = np.random.default_rng(seed)
    return true.corrected(errors.draw(len(true.joints), rng))


def angle_between(a, b) -> float:
    """Angle of the normals of two planes, degrees."""
    from drake_affetto.geometry.planes import normals

    cosine = normals(np.asarray(a)) @ normals(np.asarray(b))
    return float(np.degrees(np.arccos(np.clip(cosine, -1.0, 1.0))))
