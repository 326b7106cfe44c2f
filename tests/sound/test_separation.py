"""How well the reward tells hits from other sounds."""

import numpy as np
import pytest

from drake_affetto.common.errors import InputError
from drake_affetto.sound.reward import (
    RewardConfig,
    cut_prototype,
    reward,
    spectrogram,
    tap_prototypes,
)
from drake_affetto.sound.separation import (
    HITS,
    KINDS,
    made_up_trial,
    made_up_trials,
    separation,
)
from drake_affetto.sound.voice import DrumVoice


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


@pytest.mark.parametrize("kind", KINDS)
def test_made_up_trials_are_what_they_say(kind):
    voice = DrumVoice()
    trial = made_up_trial(kind, voice, np.random.default_rng(1), duration=2.5)
    again = made_up_trial(kind, voice, np.random.default_rng(1), duration=2.5)
    assert np.array_equal(trial.pressure, again.pressure)
    assert (trial.impulse > 0.0) == (kind in (*HITS, "slow press"))
    if kind in HITS:
        assert trial.rate_of_force > 10.0
    with pytest.raises(InputError, match="kind"):
        made_up_trial(kind + "?", voice, np.random.default_rng(1))


def test_separation_counts():
    result = separation([0.9, 0.16, 0.1, 0.15, 0.2, -1.0], [1, 1, 1, 0, 0, 0])
    assert (result.false_hits, result.missed_hits) == (1, 1)
    assert (result.hits, result.others) == (3, 3)
    # Pairs in the right order, by hand: 3 + 2 + 1 of 9.
    assert result.auc == pytest.approx(6.0 / 9.0)
    assert separation([0.3, 0.3], [True, False]).auc == 0.5
    assert np.isnan(separation([0.3], [True]).auc)
    with pytest.raises(InputError, match="hits"):
        separation([0.3], [True, False])
