"""Media of a study: pictures, sounds and a 3D replay of trials.

The trials shown are run here once more, in this process and with Meshcat
recording them; they are the same simulations that the results come from.
"""

from collections.abc import Callable, Sequence
import dataclasses
from pathlib import Path
from typing import Any

import cv2
import matplotlib
from matplotlib.figure import Figure
import numpy as np
from numpy.typing import ArrayLike
from pydrake.geometry import Meshcat, MeshcatParams, MeshcatVisualizerParams

from drake_affetto.common.output import atomic_path, write_bytes_atomic
from drake_affetto.experiments.episode import (
    GazeOutcome,
    Recording,
    TrialRunner,
)
from drake_affetto.scene.view import set_default_camera_pose
from drake_affetto.skill.policy import Regressor
from drake_affetto.sound.wav import write_wav
from drake_affetto.station.scenario import Scenario

_FRAMES_PER_SECOND = 32.0
# Between the two trials of the replay, s.
_PAUSE = 1.0


@dataclasses.dataclass
class ShownTrial:
    """A trial to show.

    Attributes:
        name: Name of the trial, in file names and in the replay's scene tree.
        scenario: Scenario of the trial.
        skill: Regressor from task parameters to movements.
        xy: Position of the drum (2,), m.
    """

    name: str
    scenario: Scenario
    skill: Regressor
    xy: ArrayLike


def write_media(
    out: Path,
    direct: ShownTrial,
    mirror: ShownTrial,
    prototypes: list[np.ndarray],
    seed: int,
) -> None:
    """Writes replay.html, hit.wav, miss.wav, camera_*.png and trial.png.

    The miss is the direct trial's movement once more, with the drum moved to
    the other end of its region.

    Args:
        out: Folder, which exists.
        direct: First trial of the replay.
        mirror: Second trial of the replay.
        prototypes: Prototypes of the reward in the figure's title.
        seed: Seed of the noise.
    """

    def act(
        trial: ShownTrial,
    ) -> Callable[[TrialRunner], tuple[GazeOutcome, Recording | None]]:
        return lambda trials: trials.drum(
            np.asarray(trial.xy), trial.skill, seed
        )

    both = direct, mirror
    scenes = [Scene(each.name, each.scenario, act(each)) for each in both]
    recorded = record_replay(out / "replay.html", scenes)
    shown = [
        (trial, trials, *outcome)
        for trial, (trials, outcome) in zip(both, recorded, strict=True)
    ]
    for trial, trials, gaze, _ in shown:
        if gaze.found and trials.gaze(np.asarray(trial.xy), seed).found:
            draw_view(out / f"camera_{trial.name}.png", trials)
    _, trials, gaze, hit = shown[0]
    if hit is None:
        return
    _write_sound(out / "hit.wav", hit)
    corners = direct.scenario.drum_region.corners
    away = np.linalg.norm(corners - np.asarray(direct.xy), axis=1)
    far = corners[np.argmax(away)]
    theta = direct.skill.predict(gaze.task_parameter[None, :])
    miss = trials.strike(far, np.ravel(theta), seed)
    _write_sound(out / "miss.wav", miss)
    draw_trial(
        out / "trial.png",
        trials,
        gaze,
        hit,
        trials.reward(hit, prototypes),
    )


@dataclasses.dataclass
class Scene:
    """A part of a replay.

    Attributes:
        name: Name of the part in the replay's scene tree.
        scenario: Scenario of the part.
        act: What happens in it; returns what came of it.
    """

    name: str
    scenario: Scenario
    act: Callable[[TrialRunner], Any]


def record_replay(
    path: Path, scenes: Sequence[Scene]
) -> list[tuple[TrialRunner, Any]]:
    """Runs scenes one after another and writes them as a 3D replay.

    Args:
        path: File of the replay, a web page.
        scenes: What is shown, in order.

    Returns:
        The runner of each scene, and what came of it.
    """
    meshcat = Meshcat(MeshcatParams(host="localhost"))
    set_default_camera_pose(meshcat)
    meshcat.StartRecording(
        frames_per_second=_FRAMES_PER_SECOND,
        set_visualizations_while_recording=False,
    )
    begin = 0.0
    shown = []
    for scene in scenes:
        trials = TrialRunner(
            scene.scenario,
            meshcat,
            MeshcatVisualizerParams(
                prefix=scene.name,
                publish_period=1.0 / _FRAMES_PER_SECOND,
            ),
            start_time=begin,
        )
        outcome = scene.act(trials)
        end = trials.context.get_time()
        tree = f"/drake/{scene.name}"
        meshcat.SetProperty(tree, "visible", begin == 0.0, 0.0)
        meshcat.SetProperty(tree, "visible", True, begin)
        if scene is not scenes[-1]:
            meshcat.SetProperty(tree, "visible", False, end + 0.9 * _PAUSE)
        shown.append((trials, outcome))
        begin = float(np.ceil(end + _PAUSE))
    meshcat.StopRecording()
    meshcat.PublishRecording()
    write_bytes_atomic(path, meshcat.StaticHtml().encode())
    return shown


def _write_sound(path: Path, recording: Recording) -> None:
    with atomic_path(path) as fresh:
        write_wav(fresh, recording.sound, recording.sound_rate)


def draw_view(path: Path, trials: TrialRunner) -> None:
    """Writes what the camera sees now, the marker found drawn in, as PNG."""
    image = trials.port("camera.color_image").data[:, :, 2::-1].copy()
    u, v, area, confidence = trials.port("camera.blob_pixels")
    x_img, y_img, found = trials.port("camera.blob")
    scale = 3
    image = cv2.resize(
        image, None, fx=scale, fy=scale, interpolation=cv2.INTER_CUBIC
    )
    box = trials.scenario.blob.calibration
    first, last = (
        [round(scale * (value + 0.5)) for value in corner]
        for corner in ((box.u_min, box.v_min), (box.u_max, box.v_max))
    )
    cv2.rectangle(image, first, last, (255, 255, 255), 1, cv2.LINE_AA)
    text = "no marker"
    if found:
        center = (round(scale * (u + 0.5)), round(scale * (v + 0.5)))
        radius = round(scale * np.sqrt(area / np.pi))
        cv2.circle(image, center, radius + 4, (255, 60, 255), 2, cv2.LINE_AA)
        cv2.drawMarker(image, center, (255, 255, 255), cv2.MARKER_CROSS, 24, 2)
        text = (
            f"x_img {x_img:.3f}  y_img {y_img:.3f}  "
            f"area {area:.0f} px  confidence {confidence:.2f}"
        )
    band = np.full((36, image.shape[1], 3), 32, dtype=np.uint8)
    cv2.putText(
        band,
        text,
        (12, 25),
        cv2.FONT_HERSHEY_SIMPLEX,
        0.6,
        (240, 240, 240),
        1,
        cv2.LINE_AA,
    )
    done, data = cv2.imencode(".png", np.vstack([image, band]))
    if not done:
        raise RuntimeError("OpenCV could not encode the camera's view as PNG")
    write_bytes_atomic(path, data.tobytes())


def draw_trial(
    path: Path,
    trials: TrialRunner,
    gaze: GazeOutcome,
    recording: Recording,
    reward: float,
) -> None:
    """Draws angles, pressures, contact force and sound of a trial as PNG."""
    names = trials.station.joints.names
    n = len(names)
    figure = Figure(figsize=(11, 10), layout="constrained")
    axes = figure.subplots(4, 1, sharex=True)
    colors = matplotlib.colormaps["tab10"](np.arange(n) % 10)
    t = recording.joint_t
    angle = np.degrees(recording.joint_state[:, :n])
    desired = np.degrees(recording.desired_state[:, :n])
    pressure = recording.chamber_pressure / 1e3
    for i, name in enumerate(names):
        label = name.replace("_", " ")
        axes[0].plot(t, angle[:, i], color=colors[i], label=label)
        axes[0].plot(t, desired[:, i], color=colors[i], ls=":", lw=1)
        axes[1].plot(t, pressure[:, i], color=colors[i])
        axes[1].plot(t, pressure[:, n + i], color=colors[i], ls="--", lw=1)
    axes[0].set_ylabel("joint angle [°]\n(dotted: desired)")
    axes[0].legend(ncols=4, fontsize=8, loc="upper center")
    low, high = axes[0].get_ylim()
    axes[0].set_ylim(low, high + 0.35 * (high - low))
    axes[1].set_ylabel("pressure [kPa abs]\n(dashed: chamber b)")
    axes[2].plot(
        recording.t, recording.contact_force[:, 0], label="drum's head"
    )
    axes[2].plot(recording.t, recording.knock_force[:, 0], label="shell")
    axes[2].plot(recording.t, recording.knock_force[:, 1], label="table")
    axes[2].set_ylabel("contact force [N]")
    axes[2].legend(fontsize=8)
    sound_t = np.arange(len(recording.sound)) / recording.sound_rate
    axes[3].plot(sound_t + recording.t[0], recording.sound, lw=0.5)
    axes[3].set_ylabel("sound [Pa]")
    axes[3].set_xlabel("time since the movement's start [s]")
    for axis in axes:
        axis.grid(alpha=0.3)
        axis.margins(x=0.01)
    verdict = "hit" if reward > trials.reward_config.threshold else "miss"
    tau = ", ".join(f"{value:.3f}" for value in gaze.task_parameter)
    figure.suptitle(
        f"One trial: task parameter [{tau}], reward {reward:.2f} ({verdict})"
    )
    with atomic_path(path) as fresh:
        figure.savefig(fresh, dpi=110)
