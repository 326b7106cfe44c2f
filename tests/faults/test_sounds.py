"""What a microphone with a fault records."""

import numpy as np
import pytest

from drake_affetto.faults.config import Fault
from drake_affetto.faults.schedule import FaultSchedule
from drake_affetto.faults.sounds import with_faults
from drake_affetto.sound.config import load_sound_config
from drake_affetto.sound.reward import reward, spectrogram, tap_prototypes
from drake_affetto.sound.voice import DrumVoice

CONFIG = load_sound_config()
VOICE = DrumVoice(CONFIG.voice)
START = 2.0


def record(*faults, seed=0, seconds=2.0):
    noise = 1e-3 * np.random.default_rng(1).standard_normal(
        int(seconds * VOICE.rate)
    )
    schedule = FaultSchedule(faults, (), seed, begin=0.0)
    return noise, with_faults(noise, VOICE, schedule, START, START)


def test_before_its_onset_nothing_is_wrong():
    noise, heard = record(Fault(kind="microphone_dead", onset=START + 1.0))
    half = len(noise) // 2
    assert np.array_equal(heard[:half], noise[:half])
    assert not heard[half + 1 :].any()


def test_it_takes_no_more_than_it_can():
    noise, heard = record(Fault(kind="microphone_clipped", size=1e-3))
    assert np.abs(noise).max() > 2e-3
    assert np.abs(heard).max() == 1e-3


def test_the_mains_hum_at_their_frequency():
    _, heard = record(Fault(kind="microphone_hum", size=0.1))
    power = np.abs(np.fft.rfft(heard))
    at = np.fft.rfftfreq(len(heard), 1.0 / VOICE.rate)
    assert at[np.argmax(power)] == pytest.approx(50.0, abs=1.0)


def test_someone_elses_drum_is_taken_for_ours_by_the_ear_alone():
    # This is why the supervisor asks where the hand was.
    prototypes = tap_prototypes(VOICE, CONFIG.reward)
    _, heard = record(Fault(kind="other_drum", size=1.0))

    def judged(sound):
        return reward(spectrogram(sound, VOICE.rate, CONFIG.reward), prototypes)

    noise, other = record(Fault(kind="other_drum", size=1.0), seed=5)
    assert judged(noise) < CONFIG.reward.threshold < judged(heard)
    assert not np.array_equal(heard, other)
