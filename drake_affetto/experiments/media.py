"""What the demo shows a person: pictures, sounds and a replay to turn round.

The trials shown are run here once more, in this process and with Meshcat
recording them; they are the same simulations that the results come from.
"""

import dataclasses
from pathlib import Path

import cv2
import matplotlib
from matplotlib.figure import Figure
import numpy as np
from pydrake.geometry import Meshcat, MeshcatParams, MeshcatVisualizerParams

from drake_affetto.common.output import atomic_path, write_bytes_atomic
from drake_affetto.experiments.episode import Look, Recording, TrialRunner
from drake_affetto.scene.view import stand_before
from drake_affetto.skill.policy import Regressor
from drake_affetto.sound.voice import write_wav
from drake_affetto.station.scenario import Scenario

_FRAMES_PER_SECOND = 32.0
# Between the two trials of the replay, s.
_PAUSE = 1.0


@dataclasses.dataclass
class Exhibit:
    """A trial to show.

    Attributes:
        name: of the trial, in file names and in the replay's scene tree.
        scenario: what it happens in.
        skill: the regressor that is used.
        xy: (2,) where the drum stands, m.
    """

    name: str
    scenario: Scenario
    skill: Regressor
    xy: np.ndarray


def write_exhibits(
    out: Path,
    direct: Exhibit,
    mirror: Exhibit,
    prototypes: list[np.ndarray],
    seed: int,
) -> None:
    """Writes replay.html, hit.wav, miss.wav, camera_*.png and trial.png.

    The miss is the direct trial's movement once more, with the drum moved to
    the other end of its region.

    Args:
        out: an existing folder.
        direct, mirror: the two trials of the replay.
        prototypes: of the reward in the figure's title.
        seed: of the noise.
    """
    meshcat = Meshcat(MeshcatParams(host="localhost"))
    stand_before(meshcat)
    meshcat.StartRecording(
        frames_per_second=_FRAMES_PER_SECOND,
        set_visualizations_while_recording=False,
    )
    begin = 0.0
    shown = []
    for exhibit in (direct, mirror):
        trials = TrialRunner(
            exhibit.scenario,
            meshcat,
            MeshcatVisualizerParams(
                prefix=exhibit.name,
                publish_period=1.0 / _FRAMES_PER_SECOND,
            ),
            start_time=begin,
        )
        look, recording = trials.drum(exhibit.xy, exhibit.skill, seed)
        end = trials.context.get_time()
        shown.append((exhibit, trials, look, recording, begin, end))
        begin = float(np.ceil(end + _PAUSE))
    for exhibit, _, _, _, first, last in shown:
        path = f"/drake/{exhibit.name}"
        meshcat.SetProperty(path, "visible", first == 0.0, 0.0)
        meshcat.SetProperty(path, "visible", True, first)
        if exhibit is not mirror:
            meshcat.SetProperty(path, "visible", False, last + 0.9 * _PAUSE)
    meshcat.StopRecording()
    meshcat.PublishRecording()
    write_bytes_atomic(out / "replay.html", meshcat.StaticHtml().encode())

    for exhibit, trials, look, _, _, _ in shown:
        if look.found and trials.look(exhibit.xy, seed).found:
            draw_view(out / f"camera_{exhibit.name}.png", trials)
    _, trials, look, hit, _, _ = shown[0]
    if hit is None:
        return
    _write_sound(out / "hit.wav", hit)
    region = direct.scenario.drum_region
    low = np.array([region.x[0], region.y[0]])
    high = np.array([region.x[1], region.y[1]])
    far = np.where(direct.xy > 0.5 * (low + high), low, high)
    theta = direct.skill.predict(look.task_parameter[None, :])
    miss = trials.play(far, np.ravel(theta), seed)
    _write_sound(out / "miss.wav", miss)
    draw_trial(
        out / "trial.png",
        trials,
        look,
        hit,
        trials.reward(hit, prototypes),
    )


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
    look: Look,
    recording: Recording,
    reward: float,
) -> None:
    """Draws angles, pressures, contact force and sound of a trial as PNG."""
    names = trials.station.joints.names
    n = len(names)
    figure = Figure(figsize=(11, 10), layout="constrained")
    axes = figure.subplots(4, 1, sharex=True)
    colours = matplotlib.colormaps["tab10"](np.arange(n) % 10)
    t = recording.joint_t
    angle = np.degrees(recording.joint_state[:, :n])
    desired = np.degrees(recording.desired_state[:, :n])
    pressure = recording.chamber_pressure / 1e3
    for i, name in enumerate(names):
        label = name.replace("_", " ")
        axes[0].plot(t, angle[:, i], color=colours[i], label=label)
        axes[0].plot(t, desired[:, i], color=colours[i], ls=":", lw=1)
        axes[1].plot(t, pressure[:, i], color=colours[i])
        axes[1].plot(t, pressure[:, n + i], color=colours[i], ls="--", lw=1)
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
    tau = ", ".join(f"{value:.3f}" for value in look.task_parameter)
    figure.suptitle(
        f"One trial: task parameter [{tau}], reward {reward:.2f} ({verdict})"
    )
    with atomic_path(path) as fresh:
        figure.savefig(fresh, dpi=110)
