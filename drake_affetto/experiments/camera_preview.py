"""`affetto look`: what the robot's camera sees, and what it makes of it."""

from collections.abc import Iterator
import dataclasses
import itertools
from pathlib import Path

import cv2
import numpy as np
from pydrake.systems.analysis import ApplySimulatorConfig, Simulator
from pydrake.systems.framework import Context

from drake_affetto.common.errors import InputError
from drake_affetto.common.output import atomic_path
from drake_affetto.perception import gaze as gaze_state
from drake_affetto.perception.blob import BlobCalibration
from drake_affetto.perception.camera_model import Mirror, SightModel
from drake_affetto.perception.drawing import TRUTH, WORKSPACE, Canvas
from drake_affetto.perception.gaze import GazePhase
from drake_affetto.perception.plant_camera_model import (
    calibrate_view,
    make_sight_model,
    mirrors_in_world,
)
from drake_affetto.scene import world
from drake_affetto.station.scenario import Scenario
from drake_affetto.station.station import AffettoStation

Array = np.ndarray

_FRAME_RATE = 20.0  # of the video
_CALIBRATION_GRID = 9  # positions along each side of the drum's region


@dataclasses.dataclass
class Sight:
    """A station's geometry of seeing, at its start posture.

    Attributes:
        model: camera, yaw and marker.
        mirrors: the mirrors in the scene.
        positions: (m, 2) places that span the drum's region [m].
        fixed_yaw: from which the scenario looks; None if it centres.
    """

    model: SightModel
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
            InputError: if no yaw centres the marker.
        """
        if self.fixed_yaw is not None:
            return self.fixed_yaw
        yaw = float(self.model.direct_pixels(xy)[0][0])
        if not np.isfinite(yaw):
            raise InputError(
                f"the marker of a drum at {np.round(xy, 3).tolist()} cannot "
                "be centred: the yaw would be beyond its limits "
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
        image = calibration.normalise(uv)
        if self.fixed_yaw is None:
            return np.stack([image[:, 1], yaw], axis=-1)
        return image


def region_grid(scenario: Scenario, n: int) -> Array:
    """(n², 2) places that fill the scenario's drum region [m]."""
    (x0, x1), (y0, y1) = scenario.drum_region.x, scenario.drum_region.y
    x, y = np.linspace(x0, x1, n), np.linspace(y0, y1, n)
    return np.stack(np.meshgrid(x, y, indexing="ij"), axis=-1).reshape(-1, 2)


def make_sight(station: AffettoStation, context: Context) -> Sight:
    """The geometry of seeing in a station's context."""
    scenario = station.scenario
    plant_context = station.plant.GetMyContextFromRoot(context)
    return Sight(
        make_sight_model(
            station.plant, plant_context, scenario.camera, scenario.yaw_joint
        ),
        mirrors_in_world(
            station.camera, station.camera.GetMyContextFromRoot(context)
        ),
        region_grid(scenario, _CALIBRATION_GRID),
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
    image: Array, pixels: Array, sight: Sight, yaw: float, scenario: Scenario
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
    sight: Sight, yaw: float, scenario: Scenario
) -> list[Array]:
    """The drum region's border at the marker's height, as it is seen (n, 2).

    Directly, or else in the mirrors: NaN where it is not within a face.
    """
    (x0, x1), (y0, y1) = scenario.drum_region.x, scenario.drum_region.y
    s = np.linspace(0.0, 1.0, 20)[:, None]
    corners = np.array([[x0, y0], [x1, y0], [x1, y1], [x0, y1], [x0, y0]])
    border = np.concatenate(
        [a + s * (b - a) for a, b in itertools.pairwise(corners)]
    )
    middle = np.array([0.5 * (x0 + x1), 0.5 * (y0 + y1)])
    seen_in, _ = sight.model.seen_by(middle, yaw, sight.mirrors)
    mirror = None if seen_in is None else sight.mirrors[seen_in]
    return [sight.model.image_of(border, yaw, mirror)]


def calibration_yaml(box: BlobCalibration) -> str:
    """The lines of a scenario that hold a calibration."""
    lines = ["blob:", "  calibration:"]
    for name, value in dataclasses.asdict(box).items():
        lines.append(f"    {name}: {value:.2f}")
    return "\n".join(lines)


def write_image(path: Path, image: Array) -> None:
    """Writes an RGB image (h, w, 3) of uint8 as PNG."""
    with atomic_path(path) as fresh:
        if not cv2.imwrite(str(fresh), np.ascontiguousarray(image[..., ::-1])):
            raise InputError(f"cannot write {path}")


def write_gaze_video(
    path: Path, scenario: Scenario, xy: Array, seed: int
) -> None:
    """Simulates the gaze servo looking for a drum at xy; writes an MP4.

    Raises:
        InputError: if the file cannot be written.
    """
    trial = LookTrial(scenario)
    camera = scenario.camera
    scale = 3
    with atomic_path(path) as fresh:
        writer = cv2.VideoWriter(
            str(fresh),
            cv2.VideoWriter.fourcc(*"mp4v"),
            _FRAME_RATE,
            (scale * camera.width, scale * camera.height),
        )
        if not writer.isOpened():
            raise InputError(f"cannot write {path}: no MP4 encoder")
        try:
            trial.begin(xy, seed)
            for image in _gaze_frames(trial):
                writer.write(np.ascontiguousarray(image[..., ::-1]))
        finally:
            writer.release()


class _Rest:
    """A skill that does not move: θ = 0."""

    def __init__(self, size: int) -> None:
        self._size = size

    def predict(self, X: Array) -> Array:
        return np.zeros((len(X), self._size))


class LookTrial:
    """The station looking for a drum, and nothing else."""

    def __init__(self, scenario: Scenario) -> None:
        """Builds the station; see `AffettoStation` for what is raised."""
        self.scenario = scenario
        self.station = AffettoStation(scenario)
        self.context = self.station.CreateDefaultContext()
        self.simulator = Simulator(self.station, self.context)
        ApplySimulatorConfig(scenario.simulator_config, self.simulator)
        self._settled: Context | None = None
        self._begin = 0.0

    def begin(self, xy: Array, seed: int) -> None:
        """Starts to look for the drum at xy (2,), robot at rest."""
        station = self.station
        if self._settled is None:
            self.simulator.Initialize()
            self.simulator.AdvanceTo(self.scenario.settling_duration)
            self._settled = self.context.Clone()
        self.context.SetTimeStateAndParametersFrom(self._settled)
        self._begin = self.context.get_time()
        station.set_drum_position(self.context, xy)
        n = station.num_joints * self.scenario.dmp.n_basis
        station.policy.set_regressor(
            station.policy.GetMyMutableContextFromRoot(self.context), _Rest(n)
        )
        station.gaze.set_enabled(
            station.gaze.GetMyMutableContextFromRoot(self.context), True
        )
        station.camera.set_seed(
            station.camera.GetMyMutableContextFromRoot(self.context), seed
        )
        self.simulator.Initialize()

    @property
    def elapsed(self) -> float:
        """Time [s] since the look began."""
        return self.context.get_time() - self._begin

    def advance(self, duration: float) -> None:
        """Goes on for `duration` s."""
        self.simulator.AdvanceTo(self.context.get_time() + duration)

    def port(self, name: str) -> Array:
        """The value of a port of the station."""
        return self.station.GetOutputPort(name).Eval(self.context)

    @property
    def yaw(self) -> float:
        """The yaw joint's angle [rad]."""
        index = self.station.joints.names.index(self.scenario.yaw_joint)
        return float(self.port("affetto.estimated_state")[index])

    @property
    def phase(self) -> GazePhase:
        """Where the gaze servo stands."""
        servo = self.station.gaze.GetMyContextFromRoot(self.context)
        state = servo.get_discrete_state(0).CopyToVector()
        return GazePhase(int(state[gaze_state.PHASE]))

    def finish(self) -> tuple[bool, Array, float]:
        """Runs until settled or failed.

        Returns:
            Whether it settled, τ (2,), and the time it took [s].
        """
        while self.phase not in (GazePhase.SETTLED, GazePhase.FAILED):
            self.advance(0.02)
        return (
            self.phase == GazePhase.SETTLED,
            self.port("affetto.task_parameter"),
            self.elapsed,
        )


def _gaze_frames(trial: LookTrial) -> Iterator[Array]:
    """Images of a look, until a second after it has settled."""
    sight = make_sight(trial.station, trial.context)
    end = trial.scenario.gaze.timeout + 2.0
    while trial.elapsed < end:
        trial.advance(1.0 / _FRAME_RATE)
        image = trial.station.GetOutputPort("camera.color_image").Eval(
            trial.context
        )
        canvas = draw_view(
            image.data,
            trial.port("camera.blob_pixels"),
            sight,
            trial.yaw,
            trial.scenario,
        )
        canvas.cross(sight.model.camera.image_center, TRUTH, size=4.0)
        phase = trial.phase
        canvas.text(
            f"{trial.elapsed:4.2f} s  {phase.name.lower()}  "
            f"yaw {trial.yaw:+.3f}",
            (4.0, 12.0),
        )
        if phase in (GazePhase.SETTLED, GazePhase.FAILED):
            end = min(end, trial.elapsed + 1.0)
            tau = trial.port("affetto.task_parameter")
            canvas.text(f"tau {tau[0]:.3f}, {tau[1]:+.3f}", (4.0, 24.0))
        yield canvas.image
