"""Sounds as files."""

import numpy as np
import pytest
from scipy.io import wavfile

from drake_affetto.common.errors import InputError
from drake_affetto.sound.wav import write_wav


def test_wav_keeps_loudness_and_never_clips(tmp_path):
    rate = 16000
    tone = np.sin(2.0 * np.pi * 150.0 * np.arange(rate) / rate)
    write_wav(tmp_path / "loud.wav", 1.5 * tone, rate)
    write_wav(tmp_path / "soft.wav", 0.15 * tone, rate)
    found, loud = wavfile.read(tmp_path / "loud.wav")
    _, soft = wavfile.read(tmp_path / "soft.wav")
    assert found == rate
    assert loud.dtype == np.int16
    assert loud.astype(float).std() / soft.std() == pytest.approx(
        10.0, rel=1e-3
    )
    scale = write_wav(tmp_path / "bang.wav", 9.0 * tone, rate, full_scale=2.0)
    _, bang = wavfile.read(tmp_path / "bang.wav")
    assert scale == 16.0
    np.testing.assert_allclose(
        bang / 32767.0 * scale, 9.0 * tone, atol=scale / 32767.0
    )


def test_wav_that_cannot_be_written(tmp_path):
    with pytest.raises(InputError, match="nowhere"):
        write_wav(tmp_path / "nowhere" / "a.wav", np.zeros(10), 16000)
