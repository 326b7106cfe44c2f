"""How wrong a robot knows its camera, and the camera as it is then believed.

The optical map takes intrinsics, the camera's place on the head, the neck's
posture and the marker's height as given. A real robot has measured them, with
errors. Those of the camera and the height are the same in all views; the neck
stands elsewhere in each, where its sensors err anew.
"""

import dataclasses

import numpy as np

from drake_affetto.common.fields import check_ranges, number
from drake_affetto.common.typing import Array
from drake_affetto.geometry.optics import make_pose
from drake_affetto.perception.camera_model import CameraModel
from drake_affetto.perception.config import rotation_matrix


@dataclasses.dataclass
class CalibrationError:
    """Standard deviations of what is known of a camera, or its errors.

    Attributes:
        focal: of the focal length, relative.
        angle: of the camera's orientation on the head, rad.
        position: of its place, m.
        height: of the marker above the robot's base, m.
        neck: of the head's orientation in each view, rad.
    """

    focal: float = number(0.0, 0.0, 0.2)
    angle: float = number(0.0, 0.0, 0.5)
    position: float = number(0.0, 0.0, 0.1)
    height: float = number(0.0, 0.0, 0.1)
    neck: float = number(0.0, 0.0, 0.5)

    def check(self, where: str) -> None:
        """Raises InputError naming the first field that does not fit."""
        check_ranges(self, where)


def believed(
    models: tuple[CameraModel, ...],
    error: CalibrationError,
    rng: np.random.Generator,
) -> tuple[CameraModel, ...]:
    """The sights of one camera as they are believed to be.

    Each error has the given size: the focal length and the height are too
    great or too small, orientation and place are off in a random direction.

    Args:
        models: The sights as they are, one for each view.
        error: Sizes of the errors.
        rng: Source of their directions.
    """
    larger, higher = rng.choice([-1.0, 1.0], 2)
    # For a small angle, the rotation vector is roll, pitch and yaw.
    X_CC = make_pose(
        rotation_matrix((error.angle * _direction(rng)).tolist()),
        error.position * _direction(rng),
    )
    views = []
    for model in models:
        camera = dataclasses.replace(
            model.camera,
            focal_x=model.camera.focal_x * (1.0 + larger * error.focal),
            focal_y=model.camera.focal_y * (1.0 + larger * error.focal),
        )
        turn = rotation_matrix((error.neck * _direction(rng)).tolist())
        views.append(
            dataclasses.replace(
                model,
                camera=camera,
                X_AC=model.X_AC @ X_CC @ make_pose(turn, np.zeros(3)),
                marker_height=model.marker_height + higher * error.height,
            )
        )
    return tuple(views)


def _direction(rng: np.random.Generator) -> Array:
    way = rng.normal(size=3)
    return way / np.linalg.norm(way)
