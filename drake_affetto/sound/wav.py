"""Writes sounds as WAV files."""

from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike
from scipy.io import wavfile

from drake_affetto.common.errors import (
    InputError,
    require_array,
    require_range,
)


def write_wav(
    path: str | Path,
    pressure: ArrayLike,
    rate: float,
    full_scale: float = 2.0,
) -> float:
    """Writes a recording as 16-bit mono WAV.

    The gain is fixed, so that the loudness of two files can be compared; only
    a sound beyond `full_scale` is written more quietly, by whole steps of
    6 dB, rather than clipped.

    Args:
        path: the file.
        pressure: sound pressure (S), Pa.
        rate: sampling rate, Hz.
        full_scale: pressure of the largest sample value, Pa.

    Returns:
        The full scale that was used, Pa.

    Raises:
        InputError: if the file cannot be written, or a value does not fit.
    """
    samples = require_array(
        "pressure", pressure, (None,), expected="one number a sample"
    )
    require_range("rate", rate, 1.0, 1e7)
    require_range("full_scale", full_scale, 1e-9)
    peak = float(np.max(np.abs(samples), initial=0.0))
    while peak > full_scale:
        full_scale *= 2.0
    data = np.round(samples / full_scale * 32767.0).astype(np.int16)
    try:
        wavfile.write(path, round(rate), data)
    except OSError as error:
        raise InputError(f"cannot write {path}: {error.strerror}") from error
    return full_scale
