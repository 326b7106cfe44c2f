"""Replay, camera, sounds and the curves of a trial."""

import base64
from collections.abc import Mapping
import dataclasses
import gzip
import io
from pathlib import Path
import struct

import numpy as np

from drake_affetto.experiments.results.self_calibration import REPLAY
from drake_affetto.report.parts import (
    Picture,
    Section,
    data_uri,
    picture_of_package,
    picture_of_study,
)
from drake_affetto.report.report_data import ReportData
from drake_affetto.report.study_folder import StudyFolder, read_media

REPLAY_TITLE = "3D replay of a direct and a mirrored trial"

_CAMERA = (
    (
        "camera_direct.png",
        "The robot's eye: directly",
        "Camera picture of the drum on the table; a ring marks the green "
        "disc on its head",
        "The drum seen directly. The upper body turns until the marker "
        "found (ring and cross) is centered; the frame is the calibrated "
        "part of the picture.",
    ),
    (
        "camera_mirror.png",
        "The robot's eye: in the mirror",
        "Camera picture of the mirror, in which the drum and the robot's "
        "own arm are seen; a ring marks the green disc on the drum",
        "The drum seen in the mirror, without turning. Left and right, "
        "near and far mean something else here: that is what has to be "
        "transferred.",
    ),
)


def make(data: ReportData) -> Section | None:
    """The section; None if no study has left any media."""
    folder = max(
        data.folders.values(), key=lambda s: len(_media(s)), default=None
    )
    if folder is None or not _media(folder):
        return None
    found = _media(folder)
    context = {
        "study": folder.study,
        "seed": folder.results.seed,
        "replay": None,
        "cameras": [
            (title, picture_of_study(found[name], alt), caption)
            for name, title, alt, caption in _CAMERA
            if name in found
        ],
        "sounds": _sounds(found),
        "trial": None,
    }
    if "replay.html" in found:
        context["replay"] = make_replay(found["replay.html"], REPLAY_TITLE)
    if "trial.png" in found:
        context["trial"] = picture_of_study(
            found["trial.png"],
            "Four curves over time of one trial: joint angles beside the "
            "desired ones, chamber pressures, contact force with one stroke, "
            "and the sound with a burst at the stroke",
        )
    return Section("seen", "See and hear", "See it, hear it", context)


def _media(folder: StudyFolder) -> dict[str, Path]:
    """What a folder holds of this section's media."""
    return {name: path for name, path in folder.media.items() if name != REPLAY}


@dataclasses.dataclass(frozen=True)
class Replay:
    """A replay in 3D, kept packed until the reader asks for it.

    Attributes:
        key: Name of the file without its suffix, for the page's elements.
        title: Title of the frame in which it runs.
        still: Picture that stands there before.
        megabytes: Size of the file in words, MB.
        packed: The file, packed by gzip and in base 64.
    """

    key: str
    title: str
    still: Picture
    megabytes: str
    packed: str


def make_replay(path: Path, title: str) -> Replay:
    """The replay in a file.

    Raises:
        InputError: If the file cannot be read.
    """
    page = read_media(path)
    packed = gzip.compress(page, 9, mtime=0)
    return Replay(
        path.stem,
        title,
        picture_of_package("replay.jpg", ""),
        f"{len(page) / 1e6:.0f}",
        base64.b64encode(packed).decode("ascii"),
    )


@dataclasses.dataclass(frozen=True)
class Sound:
    """A recording that can be played.

    Attributes:
        title: Heading.
        label: Name for screen readers.
        uri: Data URI of the WAV file.
        alt: Description of the waveform.
        points: Points of the waveform's polygon; empty for none.
        columns: Number of columns of the waveform.
    """

    title: str
    label: str
    uri: str
    alt: str
    points: str
    columns: int = 300


def _sounds(found: Mapping[str, Path]) -> list[Sound]:
    sounds = {
        name: read_media(found[name])
        for name in ("hit.wav", "miss.wav")
        if name in found
    }
    samples = {name: _samples(data) for name, data in sounds.items()}
    # One scale for both, so that the quiet one looks quiet.
    peak = max(
        (
            float(np.abs(each).max(initial=0.0))
            for each in samples.values()
            if each is not None
        ),
        default=0.0,
    )
    return [
        Sound(
            title,
            f"Sound of {title[0].lower()}{title[1:]}",
            data_uri(sounds[name], "audio/wav"),
            alt,
            _waveform(samples[name], peak or 1.0, Sound.columns),
        )
        for name, title, alt in (
            ("hit.wav", "A hit", "Waveform: silence, then a burst that rings"),
            ("miss.wav", "A miss", "Waveform of the trial that missed"),
        )
        if name in sounds
    ]


def _samples(data: bytes) -> np.ndarray | None:
    """The sound from -1 to 1; None if the form is not known."""
    from scipy.io import wavfile

    try:
        _, samples = wavfile.read(io.BytesIO(data))
    except (ValueError, EOFError, struct.error):
        return None
    if samples.dtype != np.int16 or samples.ndim != 1:
        return None
    return samples / 32768.0


def _waveform(samples: np.ndarray | None, peak: float, columns: int) -> str:
    """Points of the sound's envelope, with `peak` at the full height."""
    if samples is None or len(samples) < columns:
        return ""
    pieces = np.array_split(samples / peak, columns)
    # The root shows what is quiet as well as what is loud.
    high = [34.0 * np.sqrt(max(0.0, piece.max())) for piece in pieces]
    low = [34.0 * np.sqrt(max(0.0, -piece.min())) for piece in pieces]
    upper = " ".join(f"{i},{35 - v:.1f}" for i, v in enumerate(high))
    lower = " ".join(
        f"{i},{35 + v:.1f}" for i, v in reversed(list(enumerate(low)))
    )
    return f"{upper} {lower}"
