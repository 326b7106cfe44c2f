"""How well the reward tells hits from other sounds."""

import numpy as np
import pytest

from drake_affetto.common.errors import InputError
from drake_affetto.sound.separation import (
    HITS,
    KINDS,
    made_up_trial,
    separation,
)
from drake_affetto.sound.voice import DrumVoice


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
