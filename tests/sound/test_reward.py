"""Eqs. 9 and 10 against their plain reading; what counts as a hit."""

import time

from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp
import numpy as np
import pytest

from drake_affetto.common.errors import InputError
from drake_affetto.sound.reward import (
    RewardConfig,
    cut_prototype,
    reward,
    reward_over_time,
    similarity,
    spectrogram,
    tap_prototypes,
    tap_recordings,
)
from drake_affetto.sound.separation import (
    HITS,
    made_up_trial,
    made_up_trials,
    separation,
)
from drake_affetto.sound.voice import DrumVoice

PLAIN = RewardConfig(contrast=0.0)


def plain_distance(s, p):
    """Eq. 9 as one reads it."""
    places = range(s.shape[1] - p.shape[1] + 1)
    return min(np.linalg.norm(s[:, o : o + p.shape[1]] - p) for o in places)


@st.composite
def sounds(draw):
    bands = draw(st.integers(1, 5))
    shape = st.integers(1, 12)
    levels = st.floats(0.0, 10.0, width=32)
    long, short = sorted((draw(shape), draw(shape)), reverse=True)
    return (
        draw(hnp.arrays(float, (bands, long), elements=levels)),
        draw(hnp.arrays(float, (bands, short), elements=levels)),
    )


@given(sounds())
def test_similarity_is_equation_9(pair):
    s, p = pair
    assert similarity(s, p) == pytest.approx(
        plain_distance(s, p), abs=1e-9, rel=1e-9
    )


@given(sounds())
def test_reward_is_equation_10(pair):
    s, p = pair
    other = p[:, : max(1, p.shape[1] // 2)] + 1.0
    expected = max(
        1.0 - plain_distance(s, f) / np.linalg.norm(f) for f in (p + 0.5, other)
    )
    assert reward(s, [p + 0.5, other]) == pytest.approx(expected, abs=1e-9)
    assert reward(s, [p + 0.5]) <= 1.0


def test_a_recording_that_holds_the_prototype():
    rng = np.random.default_rng(0)
    recording = rng.uniform(size=(20, 200))
    prototype = recording[:, 71:96].copy()
    assert similarity(recording, prototype) == 0.0
    assert reward(recording, [rng.uniform(size=(20, 30)), prototype]) == 1.0


def test_silence_is_worth_nothing_and_other_sounds_less():
    rng = np.random.default_rng(0)
    prototype = np.zeros((4, 10))
    prototype[1] = rng.uniform(1.0, 2.0, 10)
    silence = np.zeros((4, 50))
    assert reward(silence, [prototype]) == pytest.approx(0.0)
    other = np.full((4, 50), 1.0)
    other[1] = 0.0
    assert reward(other, [prototype]) < -0.2
    louder = np.pad(1.3 * prototype, ((0, 0), (20, 20)))
    assert reward(louder, [prototype]) == pytest.approx(0.7)


def test_one_reward_takes_milliseconds():
    rng = np.random.default_rng(0)
    recording = rng.uniform(size=(20, 250))
    prototypes = [rng.uniform(size=(20, 25)) for _ in range(25)]

    def once():
        start = time.process_time()
        reward(recording, prototypes)
        return time.process_time() - start

    assert min(once() for _ in range(5)) < 0.02


@pytest.mark.parametrize(
    ("s", "p", "message"),
    [
        (np.ones((4, 10)), np.ones((3, 5)), "3 bands"),
        (np.ones((4, 10)), np.ones((4, 11)), "11 frames"),
        (np.ones(10), np.ones((4, 5)), "s is"),
        (np.ones((4, 10)), np.ones((4, 0)), "p is"),
        (np.full((4, 10), np.nan), np.ones((4, 5)), "s is not finite|finite"),
    ],
)
def test_spectrograms_that_do_not_fit(s, p, message):
    with pytest.raises(InputError, match=message):
        similarity(s, p)


def test_prototypes_that_cannot_serve():
    with pytest.raises(InputError, match="prototypes"):
        reward(np.ones((4, 10)), [])
    with pytest.raises(InputError, match=r"prototypes\[1\]"):
        reward(np.ones((4, 10)), [np.ones((4, 5)), np.zeros((4, 5))])


@pytest.mark.parametrize("rate", [8000.0, 16000.0, 44100.0])
@pytest.mark.parametrize("frequency", [100.0, 146.0, 300.0, 700.0])
def test_a_tone_stands_in_its_band_at_its_level(rate, frequency):
    t = np.arange(round(rate)) / rate
    rms = 0.2
    tone = np.sqrt(2.0) * rms * np.sin(2.0 * np.pi * frequency * t)
    levels = spectrogram(tone, rate, PLAIN)
    edges = np.geomspace(PLAIN.low, PLAIN.high, PLAIN.bands + 2)
    middle = levels[:, levels.shape[1] // 2]
    loudest = int(np.argmax(middle))
    assert edges[loudest] < frequency < edges[loudest + 2]
    # All bands together hold the tone's power.
    power = np.sum(10.0**middle - 1.0) * PLAIN.floor**2
    assert power == pytest.approx(rms**2, rel=0.03)


def test_frames_and_bands():
    config = RewardConfig()
    sound = np.zeros(16000 * 3)
    heard = spectrogram(sound, 16000.0)
    frames = 1 + (len(sound) - 1024) // 256
    assert heard.shape == (config.bands, frames)
    assert not heard.any()


def test_a_later_sound_is_the_same_sound_later():
    rng = np.random.default_rng(0)
    sound = np.zeros(16000)
    sound[4096:8192] = rng.normal(size=4096)
    hop = round(RewardConfig().hop * 16000)
    first = spectrogram(sound, 16000.0)
    second = spectrogram(np.roll(sound, 5 * hop), 16000.0)
    np.testing.assert_allclose(second[:, 5:], first[:, :-5], atol=1e-6)


def test_what_is_broad_does_not_stand_out():
    rng = np.random.default_rng(0)
    t = np.arange(16000) / 16000.0
    noise = 0.05 * rng.normal(size=16000)
    tone = 0.05 * np.sin(2.0 * np.pi * 146.0 * t)
    share = [
        np.sum(spectrogram(sound, 16000.0) ** 2)
        / np.sum(spectrogram(sound, 16000.0, PLAIN) ** 2)
        for sound in (noise, tone)
    ]
    assert share[0] < 0.05
    assert share[1] > 0.3


@pytest.mark.parametrize(
    ("sound", "rate", "message"),
    [
        (np.zeros(100), 16000.0, "pressure"),
        (np.zeros((16000, 2)), 16000.0, "pressure"),
        (np.full(16000, np.nan), 16000.0, "pressure"),
        (np.zeros(16000), 1000.0, "reward.high"),
    ],
)
def test_recordings_that_do_not_fit(sound, rate, message):
    with pytest.raises(InputError, match=message):
        spectrogram(sound, rate)


def test_a_prototype_is_cut_around_the_loudest_moment():
    voice = DrumVoice()
    config = RewardConfig()
    trial = made_up_trial("head", voice, np.random.default_rng(3))
    heard = spectrogram(trial.pressure, voice.rate)
    prototype = cut_prototype(heard)
    assert prototype.shape == (config.bands, 25)
    assert reward(heard, [prototype]) == 1.0
    loudness = np.linalg.norm(prototype, axis=0)
    assert loudness.max() == np.linalg.norm(heard, axis=0).max()
    # It starts before the sound, and the sound has faded where it ends.
    assert np.argmax(loudness) == 4
    # Near the ends of a recording it is as long.
    for shift in (-np.argmax(heard.sum(axis=0)), -30):
        rolled = np.roll(heard, shift, axis=1)
        assert cut_prototype(rolled).shape == prototype.shape
    assert cut_prototype(heard[:, :10] + 1.0).shape == (config.bands, 10)


def test_silence_is_no_prototype():
    with pytest.raises(InputError, match="silence"):
        cut_prototype(np.zeros((20, 100)))


def test_taps_are_alike_and_repeatable():
    voice = DrumVoice()
    taps = tap_prototypes(voice)
    again = tap_prototypes(voice)
    assert all(np.array_equal(a, b) for a, b in zip(taps, again, strict=True))
    recordings = tap_recordings(voice, np.random.default_rng(1))
    assert len(recordings) == len(taps)
    for recording in recordings:
        assert reward(spectrogram(recording, voice.rate), taps) > 0.5


def test_reward_over_time_peaks_at_the_reward():
    rng = np.random.default_rng(5)
    trial = rng.random((6, 40))
    prototypes = [rng.random((6, 9)) for _ in range(3)]
    prototypes.append(trial[:, 13:22] + 1e-3 * rng.random((6, 9)))
    course = reward_over_time(trial, prototypes)
    assert course.shape == (40 - 9 + 1,)
    assert np.argmax(course) == 13
    assert course.max() == pytest.approx(reward(trial, prototypes), abs=1e-6)
    # Each place alone, by the definition.
    for o in (0, 7, 31):
        by_hand = max(
            1.0 - np.linalg.norm(trial[:, o : o + 9] - p) / np.linalg.norm(p)
            for p in prototypes
        )
        assert course[o] == pytest.approx(by_hand, abs=1e-9)
    with pytest.raises(InputError, match="one shape"):
        reward_over_time(trial, [prototypes[0], prototypes[1][:, :5]])


def test_reward_separates_hits_from_everything_else():
    voice = DrumVoice()
    rng = np.random.default_rng(0)
    config = RewardConfig()
    assert config.threshold == 0.15
    prototypes = [
        cut_prototype(
            spectrogram(made_up_trial("head", voice, rng).pressure, voice.rate)
        )
        for _ in range(10)
    ]
    taps = tap_prototypes(voice)
    trials = list(made_up_trials(voice, rng, 12))
    heard = [spectrogram(trial.pressure, voice.rate) for trial in trials]
    hits = [trial.kind in HITS for trial in trials]
    firm = np.array([trial.kind == "head" for trial in trials])
    pressed = np.array([trial.kind == "slow press" for trial in trials])
    for judges in (prototypes, taps, prototypes[:1]):
        rewards = np.array([reward(sound, judges) for sound in heard])
        assert separation(rewards, hits).auc > 0.99
        assert rewards[firm].min() > 0.2
        # Without a press that is not quite gentle, nothing comes near.
        assert rewards[~np.array(hits) & ~pressed].max() < 0.15
        assert np.mean(rewards[pressed] > 0.15) < 0.25
