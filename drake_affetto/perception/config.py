"""Settings of camera, mirrors, lights, blob sensor and gaze servo.

Plain data, loadable by Drake's `yaml_load_typed`; this module imports no
Drake.
"""

import dataclasses
import math

import numpy as np

from drake_affetto.common.errors import require, require_range
from drake_affetto.common.fields import check_ranges, number
from drake_affetto.geometry.optics import (
    Camera,
    FisheyeCamera,
    PinholeCamera,
    make_pose,
)
from drake_affetto.perception.imaging import ImageEffects

# Beyond it a pinhole's image of a wide-angle view is far too large.
_MAX_ANGLE = 1.3


def _zeros() -> list[float]:
    return [0.0, 0.0, 0.0]


def _ones() -> list[float]:
    return [1.0, 1.0, 1.0]


def require_vector(
    field: str, value, size: int, low=-math.inf, high=math.inf
) -> None:
    """Raises InputError unless `value` is `size` numbers in [low, high]."""
    fits = isinstance(value, (list, tuple)) and len(value) == size
    require(fits, field, value, f"{size} numbers")
    for index, entry in enumerate(value):
        require_range(f"{field}[{index}]", entry, low, high)


def rotation_matrix(rpy: list[float]) -> np.ndarray:
    """Rotation (3, 3) of roll, pitch, yaw [rad] about fixed x, y, z."""
    (cr, cp, cy), (sr, sp, sy) = np.cos(rpy), np.sin(rpy)
    return np.array(
        [
            [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
            [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
            [-sp, cp * sr, cp * cr],
        ]
    )


@dataclasses.dataclass
class LensConfig:
    """A wide-angle lens instead of a pinhole, see `optics.FisheyeCamera`.

    Attributes:
        k1: first coefficient of the radial polynomial.
        k2: second coefficient of the radial polynomial.
    """

    k1: float = number(0.0, -0.2, 1.0)
    k2: float = number(0.0, -0.1, 1.0)

    def check(self, where: str) -> None:
        """Raises InputError if a value is out of range."""
        check_ranges(self, where)


@dataclasses.dataclass
class CameraConfig:
    """The camera, where it sits and what its sensor does to the image.

    Attributes:
        frame: the frame it sits on, `model::frame` (z forward, x right, y
            down).
        translation: offset [m] of the camera from that frame, in the frame.
        rotation: roll, pitch, yaw [rad] of the camera in that frame; as the
            frame's z looks forward, the third one rolls the image.
        width: image width [pixels].
        height: image height [pixels].
        fov_y: vertical field of view [rad], with the lens if there is one.
        lens: a wide-angle lens; none is a pinhole.
        near: nearest depth [m] that is rendered.
        far: farthest depth [m] that is rendered.
        rate: images per second.
        latency: time [s] from exposure until an image can be used.
        effects: exposure, white balance, noise, motion blur.
        renderer: "vtk" renders images; "analytic" asks for the twin that
            projects the marker without rendering (see
            `perception.analytic`).
    """

    frame: str = "affetto::eye_camera"
    translation: list[float] = dataclasses.field(default_factory=_zeros)
    rotation: list[float] = dataclasses.field(default_factory=_zeros)
    width: int = number(320, 16, 4096)
    height: int = number(240, 16, 4096)
    fov_y: float = number(0.8188, 0.05, 2.6)
    lens: LensConfig | None = None
    near: float = number(0.05, 1e-3, 1.0)
    far: float = number(5.0, 0.1, 100.0)
    rate: float = number(10.0, 0.5, 200.0)
    latency: float = number(0.05, 0.0, 1.0)
    effects: ImageEffects = dataclasses.field(default_factory=ImageEffects)
    renderer: str = "vtk"

    def check(self, where: str) -> None:
        """Raises InputError if a value is out of range."""
        require_vector(f"{where}.translation", self.translation, 3, -1, 1)
        require_vector(f"{where}.rotation", self.rotation, 3, -4, 4)
        check_ranges(self, where)
        require(
            self.near < self.far,
            f"{where}.near",
            self.near,
            f"less than {where}.far, {self.far:g}",
        )
        if self.lens is not None:
            corner = np.array([-0.5, -0.5])
            model = self.model()
            ray = model.direction(corner)
            seen = bool(ray[2] > math.cos(_MAX_ANGLE)) and bool(
                np.all(np.abs(model.project(ray) - corner) < 0.01)
            )
            require(
                seen,
                f"{where}.fov_y",
                self.fov_y,
                "less: the lens does not map the image's corners, or they "
                f"are more than {_MAX_ANGLE:g} rad off the axis",
            )
        effects = f"{where}.effects"
        require_range(f"{effects}.exposure", self.effects.exposure, -6, 6)
        require_vector(
            f"{effects}.white_balance",
            self.effects.white_balance,
            3,
            0.05,
            20.0,
        )
        require_range(f"{effects}.noise", self.effects.noise, 0, 100)
        require_vector(
            f"{effects}.motion_blur", self.effects.motion_blur, 2, -100, 100
        )
        require(
            self.renderer in ("vtk", "analytic"),
            f"{where}.renderer",
            self.renderer,
            "'vtk' or 'analytic'",
        )

    def model(self) -> Camera:
        """The camera's geometry."""
        if self.lens is None:
            return PinholeCamera.from_fov(self.width, self.height, self.fov_y)
        return FisheyeCamera.from_fov(
            self.width, self.height, self.fov_y, self.lens.k1, self.lens.k2
        )

    def X_FC(self) -> np.ndarray:
        """Pose (4, 4) of the camera in its frame."""
        return make_pose(
            rotation_matrix(self.rotation), np.array(self.translation)
        )


@dataclasses.dataclass
class MirrorConfig:
    """A planar mirror and the quality of its reflection.

    Attributes:
        frame: the frame in the middle of its face, `model::frame`; z is the
            normal into the room.
        width: size of the face along the frame's x [m]; by default that of
            the visual box of its body.
        height: size of the face along the frame's y [m]; by default likewise.
        tint: reflectance in red, green and blue.
        blur: standard deviation [pixels] of the reflection's blur.
    """

    frame: str = "mirror::mirror"
    width: float | None = None
    height: float | None = None
    tint: list[float] = dataclasses.field(default_factory=_ones)
    blur: float = 0.0

    def check(self, where: str) -> None:
        """Raises InputError if a value is out of range."""
        for name in ("width", "height"):
            size = getattr(self, name)
            if size is not None:
                require_range(f"{where}.{name}", size, 0.01, 10.0)
        require_vector(f"{where}.tint", self.tint, 3, 0.0, 1.0)
        require_range(f"{where}.blur", self.blur, 0.0, 20.0)


@dataclasses.dataclass
class LightConfig:
    """A light that stands still in the world.

    Attributes:
        type: "point", "spot" or "directional".
        position: where it is [m] (point, spot).
        direction: where it shines to (spot, directional).
        color: red, green and blue in [0, 1].
        intensity: its strength.
        cone_angle: half angle of a spot [deg].
    """

    type: str = "directional"
    position: list[float] = dataclasses.field(default_factory=_zeros)
    direction: list[float] = dataclasses.field(
        default_factory=lambda: [0.0, 0.0, -1.0]
    )
    color: list[float] = dataclasses.field(default_factory=_ones)
    intensity: float = 1.0
    cone_angle: float = 45.0

    def check(self, where: str) -> None:
        """Raises InputError if a value is out of range."""
        require(
            self.type in ("point", "spot", "directional"),
            f"{where}.type",
            self.type,
            "'point', 'spot' or 'directional'",
        )
        require_vector(f"{where}.position", self.position, 3)
        require_vector(f"{where}.direction", self.direction, 3)
        require_vector(f"{where}.color", self.color, 3, 0.0, 1.0)
        require_range(f"{where}.intensity", self.intensity, 0.0, 100.0)
        require_range(f"{where}.cone_angle", self.cone_angle, 0.1, 90.0)


def _room_lights() -> list[LightConfig]:
    # A main light from above and before the robot, and weaker ones from both
    # sides: no face is black, and shadows of form stay visible.
    return [
        LightConfig(direction=[-0.35, 0.25, -1.0], intensity=0.75),
        LightConfig(direction=[1.0, 0.4, -0.5], intensity=0.30),
        LightConfig(direction=[-0.6, -1.0, -0.3], intensity=0.25),
    ]


@dataclasses.dataclass
class RenderConfig:
    """Light and background, the same for direct and mirrored views.

    Attributes:
        lights: the lights, fixed in the world.
        background: color behind everything, red, green and blue in [0, 1].
        cast_shadows: whether things throw shadows (slower).
    """

    lights: list[LightConfig] = dataclasses.field(default_factory=_room_lights)
    background: list[float] = dataclasses.field(
        default_factory=lambda: [0.75, 0.78, 0.80]
    )
    cast_shadows: bool = False

    def check(self, where: str) -> None:
        """Raises InputError if a value is out of range."""
        require(bool(self.lights), f"{where}.lights", [], "at least one light")
        for index, light in enumerate(self.lights):
            light.check(f"{where}.lights[{index}]")
        require_vector(f"{where}.background", self.background, 3, 0.0, 1.0)
