"""`affetto look`: what the robot's camera sees, and what it makes of it."""

import dataclasses
import itertools
from pathlib import Path

import cv2
import numpy as np
from pydrake.systems.framework import Context

from drake_affetto.common.errors import InputError
from drake_affetto.common.output import atomic_path
from drake_affetto.common.typing import Array, Image
from drake_affetto.experiments.episode import FRAME_PERIOD, TrialRunner
from drake_affetto.geometry.region import grid_inside
from drake_affetto.perception.blob import BlobCalibration
from drake_affetto.perception.camera_model import CameraModel, Mirror
from drake_affetto.perception.drawing import TRUTH, WORKSPACE, Canvas
from drake_affetto.perception.gaze import GazePhase
from drake_affetto.perception.plant_camera_model import (
    calibrate_view,
    make_camera_model,
    mirrors_in_world,
)
from drake_affetto.scene import world
from drake_affetto.station.scenario import Scenario
from drake_affetto.station.station import AffettoStation

_CALIBRATION_GRID = 9  # positions along each side of the drum's region


@dataclasses.dataclass
class GazeGeometry:
    """A station's geometry of seeing, at its start posture.

    Attributes:
        model: camera, yaw and marker.
        mirrors: the mirrors in the scene.
        positions: (m, 2) places that span the drum's region [m].
        fixed_yaw: from which the scenario looks; None if it centers.
    """

    model: CameraModel
    mirrors: list[Mirror]
    positions: Array
    fixed_yaw: float | None

    def calibration(self) -> BlobCalibration:
        """The box of pixels that the drum's region fills.

        Raises:
            InputError: if the marker cannot be seen at 3 places of it.
        """
        return calibrate_view(
            self.model, self.positions, self.fixed_yaw, self.mirrors
        )

    def looking_yaw(self, xy: Array) -> float:
        """The yaw [rad] from which the drum at xy is looked at.

        Raises:
            InputError: if no yaw centers the marker.
        """
        if self.fixed_yaw is not None:
            return self.fixed_yaw
        yaw = float(self.model.direct_pixels(xy)[0][0])
        if not np.isfinite(yaw):
            raise InputError(
                f"the marker of a drum at {np.round(xy, 3).tolist()} cannot "
                "be centered: the yaw would be beyond its limits "
                f"{self.model.yaw_min:.3g} to {self.model.yaw_max:.3g} rad"
            )
        return yaw

    def pixels(self, xy: Array) -> tuple[Array, Array]:
        """(yaw (n,), uv (n, 2)) when looked at; NaN where not wholly seen."""
        xy = np.atleast_2d(xy)
        if self.fixed_yaw is None:
            return self.model.direct_pixels(xy)
        uv = self.model.fixed_yaw_pixels(xy, self.fixed_yaw, self.mirrors)
        return np.full(len(xy), self.fixed_yaw), uv

    def task_parameters(self, xy: Array, calibration: BlobCalibration) -> Array:
        """τ or τ̂ (n, 2) of drums at xy (n, 2), by geometry alone."""
        yaw, uv = self.pixels(xy)
        image = calibration.normalize(uv)
        if self.fixed_yaw is None:
            return np.stack([image[:, 1], yaw], axis=-1)
        return image


def make_gaze_geometry(
    station: AffettoStation, context: Context
) -> GazeGeometry:
    """The geometry of seeing in a station's context."""
    scenario = station.scenario
    plant_context = station.plant.GetMyContextFromRoot(context)
    return GazeGeometry(
        make_camera_model(
            station.plant, plant_context, scenario.camera, scenario.yaw_joint
        ),
        mirrors_in_world(
            station.camera, station.camera.GetMyContextFromRoot(context)
        ),
        grid_inside(scenario.drum_region.corners, _CALIBRATION_GRID),
        scenario.look.fixed_yaw if scenario.look.mode == "fixed_yaw" else None,
    )


def turn_to(station: AffettoStation, context: Context, yaw: float) -> None:
    """Sets the yaw joint, the other joints staying as they are."""
    world.set_posture(
        station.plant,
        station.plant.GetMyMutableContextFromRoot(context),
        {station.scenario.yaw_joint: yaw},
    )


def draw_view(
    image: Image,
    pixels: Array,
    sight: GazeGeometry,
    yaw: float,
    scenario: Scenario,
) -> Canvas:
    """An image with blob, calibration grid and the drum's region.

    Args:
        image: the camera's (h, w, 4).
        pixels: what the blob sensor found in it, (4,).
        sight: the geometry of seeing.
        yaw: from which the image was taken [rad].
        scenario: its drum region is drawn, and its calibration.
    """
    canvas = Canvas(image)
    canvas.calibration(scenario.blob.calibration)
    for outline in _region_outlines(sight, yaw, scenario):
        canvas.polyline(outline, WORKSPACE, width=2)
    canvas.blob(pixels)
    return canvas


def _region_outlines(
    sight: GazeGeometry, yaw: float, scenario: Scenario
) -> list[Array]:
    """The drum region's border at the marker's height, as it is seen (n, 2).

    Directly, or else in the mirrors: NaN where it is not within a face.
    """
    region = scenario.drum_region
    s = np.linspace(0.0, 1.0, 20)[:, None]
    corners = [*region.corners, region.corners[0]]
    border = np.concatenate(
        [a + s * (b - a) for a, b in itertools.pairwise(corners)]
    )
    seen_in, _ = sight.model.seen_by(region.middle, yaw, sight.mirrors)
    mirror = None if seen_in is None else sight.mirrors[seen_in]
    return [sight.model.image_of(border, yaw, mirror)]


def calibration_yaml(box: BlobCalibration) -> str:
    """The lines of a scenario that hold a calibration."""
    lines = ["blob:", "  calibration:"]
    for name, value in dataclasses.asdict(box).items():
        lines.append(f"    {name}: {value:.2f}")
    return "\n".join(lines)


def write_image(path: Path, image: Image) -> None:
    """Writes an RGB image (h, w, 3) of uint8 as PNG."""
    with atomic_path(path) as fresh:
        if not cv2.imwrite(str(fresh), np.ascontiguousarray(image[..., ::-1])):
            raise InputError(f"cannot write {path}")


def write_gaze_video(
    path: Path, scenario: Scenario, xy: Array, seed: int
) -> None:
    """Simulates the gaze servo searching for a drum at xy; writes an MP4.

    Raises:
        InputError: If the file cannot be written.
    """
    trials = TrialRunner(scenario)
    camera = scenario.camera
    scale = 3
    with atomic_path(path) as fresh:
        writer = cv2.VideoWriter(
            str(fresh),
            cv2.VideoWriter.fourcc(*"mp4v"),
            1.0 / FRAME_PERIOD,
            (scale * camera.width, scale * camera.height),
        )
        if not writer.isOpened():
            raise InputError(f"cannot write {path}: no MP4 encoder")

        def film(elapsed: float) -> None:
            image = _gaze_frame(trials, sight, elapsed)
            writer.write(np.ascontiguousarray(image[..., ::-1]))

        try:
            sight = make_gaze_geometry(trials.station, trials.context)
            trials.gaze(xy, seed, film, linger=1.0)
        finally:
            writer.release()


def _gaze_frame(
    trials: TrialRunner, sight: GazeGeometry, elapsed: float
) -> Image:
    """The camera's image at one moment of a search, with what it found."""
    scenario = trials.scenario
    index = trials.station.joints.names.index(scenario.yaw_joint)
    yaw = float(trials.port("affetto.estimated_state")[index])
    canvas = draw_view(
        trials.port("camera.color_image").data,
        trials.port("camera.blob_pixels"),
        sight,
        yaw,
        scenario,
    )
    canvas.cross(sight.model.camera.image_center, TRUTH, size=4.0)
    phase = trials.gaze_phase
    canvas.text(
        f"{elapsed:4.2f} s  {phase.name.lower()}  yaw {yaw:+.3f}", (4.0, 12.0)
    )
    if phase in (GazePhase.SETTLED, GazePhase.FAILED):
        tau = trials.port("affetto.task_parameter")
        canvas.text(f"tau {tau[0]:.3f}, {tau[1]:+.3f}", (4.0, 24.0))
    return canvas.image
