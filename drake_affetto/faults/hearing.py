"""Whether what was heard of a stroke can be believed.

The robot knows when its hand was low, from its own angles; how near it came to
where the drum was seen; and what the microphone recorded.
"""

import numpy as np
from scipy import signal

from drake_affetto.common.typing import Array, Mask
from drake_affetto.faults.supervision import Check, SupervisorParameters

# Blocks over which loudness is taken, s; and what the drum sounds in, Hz.
_BLOCK = 0.03
_SILENCE = 0.1
_HIGHEST = 1000.0

# Before this time of a movement no hand is low, s.
_QUIET = 0.3

# A score where there is nothing to divide by.
_FAR_BEYOND = 10.0


def sound_scores(
    parameters: SupervisorParameters,
    sound: Array,
    rate: float,
    low: Mask,
    step: float,
    distances: tuple[float, float] | None,
    heard: bool,
) -> dict[Check, float]:
    """Scores of a recording and the stroke that it is of.

    Args:
        parameters: Thresholds.
        sound: Recording (samples,) from the movement's start on, Pa.
        rate: Its sampling rate, 1/s.
        low: Whether the palm was so low that it may touch (T,), by the angles
            as read.
        step: Time between two of them, s.
        distances: Least distances of the low palm and of the deep one from
            where the drum was seen, level with the table, m; infinite if it was
            never so low; None if the place is not known.
        heard: Whether the reward calls it a success.
    """
    quiet = sound[: max(1, int(_QUIET * rate))]
    filtered = signal.sosfilt(
        signal.butter(4, _HIGHEST, fs=rate, output="sos"), sound
    )
    drum = _loudness(filtered, rate, _BLOCK)
    at_low = np.flatnonzero(low) * step
    away = np.ones(len(drum), dtype=bool)
    if at_low.size:
        t = _BLOCK * np.arange(len(drum))
        away = (t + _BLOCK < at_low[0] - _BLOCK) | (
            t > at_low[-1] + parameters.ringing
        )
    loudest = max(
        parameters.sound_elsewhere * float(drum.max()), parameters.sound_loud
    )
    everything = _loudness(sound, rate, _SILENCE)
    before = float(np.sqrt(np.mean(filtered[: len(quiet)] ** 2)))
    scores = {
        Check.SOUND_DEAD: parameters.sound_dead
        / max(float(everything.min()), 1e-9),
        Check.SOUND_CLIPPED: _clipped(sound) / parameters.sound_clipped,
        Check.SOUND_NOISY: before / max(parameters.sound_loud, 1e-9),
        Check.SOUND_ELSEWHERE: float(drum[away].max(initial=0.0)) / loudest,
    }
    if distances is None:
        return scores
    if heard:
        beyond = distances[0] / max(parameters.far, 1e-9)
        scores[Check.SOUND_UNREACHED] = min(beyond, _FAR_BEYOND)
    else:
        near = parameters.near / max(distances[1], 1e-3)
        scores[Check.SOUND_MISSING] = min(near, _FAR_BEYOND)
    return scores


def _loudness(sound: Array, rate: float, block: float) -> Array:
    """Sound pressure (rms) of each block of so many seconds."""
    size = max(1, int(block * rate))
    count = max(1, len(sound) // size)
    blocks = np.resize(sound, (count, size))
    return np.asarray(np.sqrt(np.mean(blocks**2, axis=1)))


def _clipped(sound: Array) -> int:
    """How many samples are at the recording's very extremes."""
    return max(
        int(np.count_nonzero(sound == extreme))
        for extreme in (sound.max(), sound.min())
    )
