"""What the robot knows of its own body and eye, and how exactly.

The robot has a model of itself: chains of joints to its camera and to the
marker on its hand, and the camera's lens. The model is a little wrong. A
correction is one vector that says how: it is drawn to make a robot that knows
itself badly, and estimated to mend that.
"""

import dataclasses

import numpy as np

from drake_affetto.common.fields import check_ranges, number
from drake_affetto.common.typing import Array, Mask
from drake_affetto.geometry.kinematics import SerialChain
from drake_affetto.geometry.optics import (
    PinholeCamera,
    invert_pose,
    make_pose,
)
from drake_affetto.geometry.planes import normals, reflect
from drake_affetto.perception.blob import BlobCalibration
from drake_affetto.perception.camera_model import CameraModel
from drake_affetto.perception.config import rotation_matrix
from drake_affetto.perception.optical_map import OpticalMap

# Where the parts of a correction stand; the joints' zeros follow.
_ANGLE, _PLACE, _FOCAL, _HAND = slice(0, 3), slice(3, 6), 6, slice(7, 10)
_JOINTS = 10


@dataclasses.dataclass
class KnowledgeErrors:
    """How exactly the robot knows itself: standard deviations.

    Attributes:
        camera_angle: Of the camera's orientation about each axis, rad.
        camera_position: Of its place along each axis, m.
        focal: Of its focal length, relative.
        hand_offset: Of the marker's place on the hand along each axis, m.
        joint_zero: Of each joint's zero, rad.
    """

    camera_angle: float = number(0.0, 0.0, 0.5)
    camera_position: float = number(0.0, 0.0, 0.5)
    focal: float = number(0.0, 0.0, 0.5)
    hand_offset: float = number(0.0, 0.0, 0.5)
    joint_zero: float = number(0.0, 0.0, 0.5)

    def check(self, where: str) -> None:
        """Raises InputError naming the first field out of range."""
        check_ranges(self, where)

    def deviation(self, joints: int) -> Array:
        """(10 + joints,), of each number of a correction.

        Args:
            joints: Number of joints whose offsets are corrected.
        """
        return np.array(
            3 * [self.camera_angle]
            + 3 * [self.camera_position]
            + [self.focal]
            + 3 * [self.hand_offset]
            + joints * [self.joint_zero]
        )

    def draw(self, joints: int, rng: np.random.Generator) -> Array:
        """A correction (10 + joints,), normal within two deviations.

        Args:
            joints: Number of joints whose offsets are corrected.
        """
        deviation = self.deviation(joints)
        drawn = rng.standard_normal(len(deviation))
        return deviation * np.clip(drawn, -2.0, 2.0)


@dataclasses.dataclass(frozen=True)
class RobotKnowledge:
    """The robot's model of itself.

    Attributes:
        joints: Names of the n joints whose angles are read, in the order of
            the readings.
        camera: The lens.
        eye_chain: From the world to the camera, in the view with the mirror.
        hand_chain: From the world to the middle of the hand's marker.
        yaw_joint: Joint by which the robot turns its view.
        posture: Angles (n,) of the joints from which it looks for the drum
            in the mirror, rad.
        calibration: Of x_img and y_img there.
        source_chain: From the world to the camera in the direct view, in
            which the head may be turned elsewhere.
        source_posture: Angles (n,) from which it looks there; the yaw is what
            centers the drum, rad.
        source_calibration: Of y_img there.
        marker_height: Height of the drum's marker in the world, m.
        marker_radius: Its radius, m.
        zeros: What is added to readings (n,), rad.
    """

    joints: tuple[str, ...]
    camera: PinholeCamera
    eye_chain: SerialChain
    hand_chain: SerialChain
    yaw_joint: str
    posture: Array
    calibration: BlobCalibration
    source_chain: SerialChain
    source_posture: Array
    source_calibration: BlobCalibration
    marker_height: float
    marker_radius: float
    zeros: Array

    @property
    def corrections(self) -> int:
        """Size of a correction."""
        return _JOINTS + len(self.joints)

    def corrected(self, correction: Array) -> "RobotKnowledge":
        """The model with a correction (10 + n,) applied to it.

        Args:
            correction: Of camera, hand and joints, as `KnowledgeErrors.draw`
                gives it.
        """
        if not np.any(correction):
            return self
        X_CC = make_pose(
            # For small angles the rotation vector is roll, pitch and yaw.
            rotation_matrix(list(correction[_ANGLE])),
            np.asarray(correction[_PLACE]),
        )
        scale = 1.0 + correction[_FOCAL]
        X_HH = make_pose(np.eye(3), np.asarray(correction[_HAND]))
        return dataclasses.replace(
            self,
            camera=dataclasses.replace(
                self.camera,
                focal_x=self.camera.focal_x * scale,
                focal_y=self.camera.focal_y * scale,
            ),
            eye_chain=_extended(self.eye_chain, X_CC),
            source_chain=_extended(self.source_chain, X_CC),
            hand_chain=_extended(self.hand_chain, X_HH),
            zeros=self.zeros + correction[_JOINTS:],
        )

    def eye(self, readings: Array) -> Array:
        """X_WC (..., 4, 4) at readings (..., n).

        Args:
            readings: Angles of the n joints as they are read (..., n), rad.
        """
        return self._pose(self.eye_chain, readings)

    def hand(self, readings: Array) -> Array:
        """p_W (..., 3) of the hand's marker at readings (..., n).

        Args:
            readings: Angles of the n joints as they are read (..., n), rad.
        """
        return self._pose(self.hand_chain, readings)[..., :3, 3]

    def pixels(self, X_WC: Array, p_W: Array) -> Array:
        """Pixels (..., 2) of points p_W (..., 3), seen from (..., 4, 4)."""
        R, p = X_WC[..., :3, :3], X_WC[..., :3, 3]
        return self.camera.project(np.einsum("...ji,...j->...i", R, p_W - p))

    def places(self, planes: Array, reference: Array, pixels: Array) -> Array:
        """Where on the table drums are that are seen in mirrors (..., 2), m.

        NaN where a mirror would show nothing of the table.

        Args:
            planes: The mirrors' planes (..., 3).
            reference: Their reference point (3,), m.
            pixels: Where the drums' markers are seen (..., 2), px; they
                broadcast against the planes.
        """
        X_WC = self.eye(self.posture)
        eye = X_WC[:3, 3]
        ray = self.camera.direction(pixels) @ X_WC[:3, :3].T
        n = normals(planes)
        slope = np.sum(n * ray, axis=-1)
        # Light that comes from the eye's image.
        origin = reflect(planes, reference, eye)
        direction = ray - 2.0 * slope[..., None] * n
        with np.errstate(divide="ignore", invalid="ignore"):
            way = (self.marker_height - origin[..., 2]) / direction[..., 2]
            place = origin[..., :2] + way[..., None] * direction[..., :2]
        # The eye looks towards the mirror.
        shown = (slope < 0.0) & (way > 0.0)
        return np.where(shown[..., None], place, np.nan)

    @property
    def eye_position(self) -> Array:
        """Where the camera is as it looks for the drum in the mirror, (3,)."""
        return self.eye(self.posture)[:3, 3]

    def optical_map(self) -> OpticalMap:
        """The map from the mirrored to the direct view, but for the plane."""
        yaw = self.joints.index(self.yaw_joint)
        return OpticalMap(
            self._camera_model(self.eye_chain, self.posture),
            self.calibration,
            float(self.posture[yaw]),
            self._camera_model(self.source_chain, self.source_posture),
            self.source_calibration,
        )

    def _pose(self, chain: SerialChain, readings: Array) -> Array:
        order = [self.joints.index(name) for name in chain.names]
        return chain.pose((np.asarray(readings) + self.zeros)[..., order])

    def _camera_model(self, chain: SerialChain, posture: Array) -> CameraModel:
        posture = posture + self.zeros
        model = CameraModel.from_chain(
            self.camera,
            chain,
            self.yaw_joint,
            dict(zip(self.joints, posture, strict=True)),
            self.marker_height,
            self.marker_radius,
        )
        # A reading of 0 is the yaw's zero.
        zero = self.zeros[self.joints.index(self.yaw_joint)]
        return dataclasses.replace(
            model, X_AC=invert_pose(model.X_WA) @ model.camera_pose(zero)
        )


def _extended(chain: SerialChain, X_TT: Array) -> SerialChain:
    """The chain with its tip moved by X_TT (4, 4)."""
    return dataclasses.replace(chain, X_JT=chain.X_JT @ X_TT)


def in_image(knowledge: RobotKnowledge, readings: Array, margin: float) -> Mask:
    """Whether the hand's marker shows directly at readings (m, n): (m,).

    Args:
        knowledge: The robot's model of itself.
        readings: Angles of the joints, rad.
        margin: Distance from the image's edge that still counts, px.
    """
    X_WC = knowledge.eye(readings)
    uv = knowledge.pixels(X_WC, knowledge.hand(readings))
    return knowledge.camera.inside(uv, -margin)
