"""From a recording to a reward: spectrogram, similarity, Eqs. 9 and 10.

The spectrogram is compressed logarithmically above a floor, so that what the
microphone and the valves always do counts for nothing, and of each frame only
what stands out from the octaves around it is kept: a drum rings at its modes,
a knock on something solid is as broad as it is short. The prototypes' norm
then measures the drum alone, and R is 1 for the same sound, near 0 for
silence, misses and knocks, and negative for other loud tones.
"""

from collections.abc import Sequence
import dataclasses
import math

import numpy as np
from numpy.typing import ArrayLike
from scipy import fft, ndimage, signal

from drake_affetto.common.errors import require, require_array, require_range
from drake_affetto.common.fields import check_ranges, number
from drake_affetto.common.typing import Array
from drake_affetto.sound import impact
from drake_affetto.sound.voice import DrumVoice

SUCCESS_THRESHOLD = 0.15
"""A trial succeeded if its reward is above this (the paper's value)."""


@dataclasses.dataclass
class RewardConfig:
    """How a recording is heard.

    Attributes:
        window: Length of the Hann window of a frame, s.
        hop: Time from frame to frame, s.
        bands: Number of bands m, evenly spaced in log frequency.
        low: Lower edge of the lowest band, Hz.
        high: Upper edge of the highest band, Hz.
        floor: Sound pressure (rms in a band) that just begins to count, Pa.
        contrast: Share of the local mean over bands that is taken off; 0: none.
        contrast_width: Width of that local mean, octaves.
        threshold: Reward above which a trial is a success.
        lead: Part of a prototype before its loudest frame, s.
        length: Length of a prototype, s.
    """

    window: float = number(0.064, 1e-3, 1.0)
    hop: float = 0.016
    bands: int = number(30, 1, 1000)
    low: float = number(60.0, 1e-3, math.inf)
    high: float = 2600.0
    floor: float = number(5e-4, 1e-12, math.inf)
    contrast: float = number(1.0, 0.0, 1.0)
    contrast_width: float = number(2.0, 0.0, math.inf)
    threshold: float = number(SUCCESS_THRESHOLD, 0.0, 1.0)
    lead: float = 0.064
    length: float = 0.4

    def check(self, where: str) -> None:
        """Raises InputError naming the field that does not fit."""
        check_ranges(self, where)
        require_range(f"{where}.hop", self.hop, 1e-4, self.window)
        require_range(f"{where}.high", self.high, self.low * 1.01)
        require_range(f"{where}.length", self.length, self.hop)
        require_range(f"{where}.lead", self.lead, 0.0, self.length)


def _filterbank(config: RewardConfig, rate: float, size: int) -> Array:
    """Weights (bands, size // 2 + 1): triangles on a log frequency axis."""
    frequency = np.fft.rfftfreq(size, 1.0 / rate)
    edges = np.geomspace(config.low, config.high, config.bands + 2)
    position = np.interp(
        np.log(np.maximum(frequency, 1e-3)),
        np.log(edges),
        np.arange(config.bands + 2, dtype=float),
    )
    center = np.arange(1, config.bands + 1)[:, None]
    return np.maximum(1.0 - np.abs(position[None, :] - center), 0.0)


def _padded_size(config: RewardConfig, rate: float, size: int) -> int:
    """Length of the transform: at least two bins in the narrowest band."""
    ratio = (config.high / config.low) ** (1.0 / (config.bands + 1))
    narrowest = config.low * (ratio - 1.0)
    return fft.next_fast_len(max(size, int(2.0 * rate / narrowest)), real=True)


def spectrogram(
    pressure: ArrayLike, rate: float, config: RewardConfig | None = None
) -> Array:
    """What stands out of a recording: compressed band levels.

    From L = log10(1 + P / floor^2), P the mean square sound pressure of a
    frame in a band, Pa^2, the mean of L over the neighboring bands is taken
    off (`contrast`); what is left below zero counts as zero.

    Args:
        pressure: the recording (S), Pa.
        rate: its sampling rate, Hz.
        config: bands and frames.

    Returns:
        (bands, frames), non-negative.

    Raises:
        InputError: if the recording is shorter than one window or not finite,
            the rate is none, or the bands do not fit it.
    """
    config = RewardConfig() if config is None else config
    config.check("reward")
    require_range("rate", rate, 1.0, 1e7)
    sound = require_array("pressure", pressure)
    size = round(config.window * rate)
    hop = max(1, round(config.hop * rate))
    require(
        sound.ndim == 1 and len(sound) >= size,
        "pressure",
        f"an array of shape {sound.shape}",
        f"at least {size} samples, one window",
    )
    require_range("reward.high", config.high, high=0.5 * rate)
    # Nothing above the highest band matters: most samples can go first.
    spare = max(1, int(rate / (2.5 * config.high)))
    fewer = max(
        d for d in range(1, spare + 1) if size % d == 0 and hop % d == 0
    )
    if fewer > 1:
        sound = signal.resample_poly(sound, 1, fewer)
        rate, size, hop = rate / fewer, size // fewer, hop // fewer
    window = signal.windows.hann(size, sym=False)
    frames = np.lib.stride_tricks.sliding_window_view(sound, size)[::hop]
    # Padded so that even the lowest, narrowest band has bins of its own.
    padded = _padded_size(config, rate, size)
    spectrum = fft.rfft(frames * window, n=padded, axis=1)
    # One-sided, and scaled so that the sum over all bins is the mean square.
    power = (spectrum.real**2 + spectrum.imag**2) * (
        2.0 / (padded * np.sum(window**2))
    )
    weights = _filterbank(config, rate, padded)
    levels = np.log10(1.0 + weights @ power.T / config.floor**2)
    if config.contrast > 0.0:
        per_octave = (config.bands + 1) / np.log2(config.high / config.low)
        width = 2 * int(0.5 * config.contrast_width * per_octave) + 1
        levels -= config.contrast * ndimage.uniform_filter1d(
            levels, width, axis=0, mode="nearest"
        )
        np.maximum(levels, 0.0, out=levels)
    return levels


def similarity(s: ArrayLike, p: ArrayLike) -> float:
    """The distance s * p of Eq. 9: how near `p` comes to anything in `s`.

    The prototype slides over the recording, 0 <= o <= t_s - t_p, and the
    least Frobenius distance of all places counts; 0 means that the recording
    holds the prototype itself.

    Args:
        s: spectrogram of a recording (bands, t_s).
        p: spectrogram of a prototype (bands, t_p), t_p <= t_s.

    Raises:
        InputError: if the bands differ or the prototype is longer.
    """
    recording = _spectrogram_array("s", s)
    prototype = _spectrogram_array("p", p)
    return float(_distances(recording, prototype[None])[0])


def reward(recording: ArrayLike, prototypes: Sequence[ArrayLike]) -> float:
    """Eq. 10: R = max_i (|f*_i| - f * f*_i) / |f*_i|.

    Args:
        recording: spectrogram (bands, t_s) of the trial.
        prototypes: spectrograms (bands, t_i) of the demonstrations.

    Returns:
        At most 1. Above 0.15 the paper calls the trial a success.

    Raises:
        InputError: if there is no prototype, one of them is all silence, or
            the shapes do not fit.
    """
    trial = _spectrogram_array("recording", recording)
    require(len(prototypes) > 0, "prototypes", "none", "at least one")
    groups: dict[int, list[Array]] = {}
    for i, prototype in enumerate(prototypes):
        array = _spectrogram_array(f"prototypes[{i}]", prototype)
        require(
            bool(array.any()),
            f"prototypes[{i}]",
            "all zero",
            "the spectrogram of a sound",
        )
        groups.setdefault(array.shape[1], []).append(array)
    best = -np.inf
    for group in groups.values():
        stack = np.stack(group)
        norms = np.sqrt(np.sum(stack**2, axis=(1, 2)))
        ratio = _distances(trial, stack) / norms
        best = max(best, 1.0 - float(np.min(ratio)))
    return best


def reward_over_time(
    recording: ArrayLike, prototypes: Sequence[ArrayLike]
) -> Array:
    """What Eq. 10 would be with the prototypes held at one place of Eq. 9.

    Args:
        recording: spectrogram (bands, t_s) of the trial.
        prototypes: spectrograms (bands, t_p) of the demonstrations, all of
            one length.

    Returns:
        (t_s - t_p + 1,) for the places o = 0, 1, ... [hops]; its greatest
        value is `reward`.

    Raises:
        InputError: as `reward` does, or if the lengths differ.
    """
    trial = _spectrogram_array("recording", recording)
    require(len(prototypes) > 0, "prototypes", "none", "at least one")
    arrays = [_spectrogram_array("prototypes", p) for p in prototypes]
    require(
        len({array.shape for array in arrays}) == 1,
        "prototypes",
        sorted({array.shape for array in arrays}),
        "one shape",
    )
    stack = np.stack(arrays)
    rows, columns = _places(trial, stack)
    norms = np.linalg.norm(columns, axis=1)
    require(bool(norms.all()), "prototypes", "all zero", "sounds")
    square = (
        np.sum(rows**2, axis=1)[:, None] - 2.0 * rows @ columns.T + norms**2
    )
    # Where the two are alike the sum has lost its digits; it is near 0 then.
    return np.max(1.0 - np.sqrt(np.maximum(square, 0.0)) / norms, axis=1)


def _distances(recording: Array, stack: Array) -> Array:
    """Least distances (N) of prototypes (N, bands, t_p) in a recording."""
    rows, columns = _places(recording, stack)
    # |a - b|^2 by correlation finds the place; there the difference itself is
    # taken, because the sum loses all digits where the two are alike.
    square = np.sum(rows**2, axis=1)[:, None] - 2.0 * rows @ columns.T
    best = np.argmin(square, axis=0)
    return np.linalg.norm(rows[best] - columns, axis=1)


def _places(recording: Array, stack: Array) -> tuple[Array, Array]:
    """Each place of the recording (places, m), each prototype (N, m)."""
    count, bands, frames = stack.shape
    require(
        bands == recording.shape[0],
        "prototype",
        f"{bands} bands",
        f"{recording.shape[0]} bands, as the recording has",
    )
    require(
        frames <= recording.shape[1],
        "prototype",
        f"{frames} frames",
        f"at most the {recording.shape[1]} frames of the recording",
    )
    # (places, bands, frames) -> one row for each place.
    places = np.lib.stride_tricks.sliding_window_view(
        recording, frames, axis=1
    ).swapaxes(0, 1)
    return places.reshape(len(places), -1), stack.reshape(count, -1)


def cut_prototype(
    recording: ArrayLike, config: RewardConfig | None = None
) -> Array:
    """The part of a recording around its loudest moment.

    Args:
        recording: spectrogram (bands, frames) by `spectrogram`.
        config: the one with which the spectrogram was made.

    Returns:
        (bands, t_p), `config.length` long or the whole recording if that is
        shorter.

    Raises:
        InputError: if the recording is silent.
    """
    config = RewardConfig() if config is None else config
    sound = _spectrogram_array("recording", recording)
    loudness = np.sum(sound**2, axis=0)
    require(
        bool(loudness.any()), "recording", "silence", "a recording with sound"
    )
    frames = min(max(1, round(config.length / config.hop)), sound.shape[1])
    lead = round(config.lead / config.hop)
    start = int(np.argmax(loudness)) - lead
    start = min(max(start, 0), sound.shape[1] - frames)
    return sound[:, start : start + frames].copy()


def tap_recordings(voice: DrumVoice, rng: np.random.Generator) -> list[Array]:
    """What the microphone records when the experimenter taps the drum.

    A few firm taps with a hand as soft as the robot's, short and long, at the
    center, half-way to the rim and near it, one recording each, Pa.
    """
    t = np.arange(0.0, 1.5, 1e-3)
    a = voice.config.membrane.radius
    recordings = []
    for place in (0.1, 0.5, 0.75):
        for depth, fall, dwell in (
            (0.01, 0.3, 0.0),
            (0.02, 0.4, 0.1),
            (0.02, 0.4, 0.25),
        ):
            force = impact.contact_force(
                t, impact.stroke(t, 0.2, 0.06, depth, fall, dwell, fall)
            )
            recordings.append(
                voice.synthesize(t, force, np.full_like(t, place * a), rng=rng)
            )
    return recordings


def tap_prototypes(
    voice: DrumVoice,
    config: RewardConfig | None = None,
    rng: np.random.Generator | None = None,
) -> list[Array]:
    """Prototypes (bands, t_p) from the experimenter's own taps.

    They judge the first demonstrations, when the robot has not drummed yet.

    Args:
        voice: The drum.
    """
    config = RewardConfig() if config is None else config
    rng = np.random.default_rng(0) if rng is None else rng
    return [
        cut_prototype(spectrogram(recording, voice.rate, config), config)
        for recording in tap_recordings(voice, rng)
    ]


def _spectrogram_array(field: str, values: ArrayLike) -> Array:
    array = require_array(
        field, values, (None, None), expected="a spectrogram (bands, frames)"
    )
    require(array.size > 0, field, array.shape, "bands and frames")
    return array
