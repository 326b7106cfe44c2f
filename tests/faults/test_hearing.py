"""Whether what was heard of a stroke can be believed."""

import numpy as np
import pytest

from drake_affetto.faults.hearing import sound_scores
from drake_affetto.faults.supervision import Check, SupervisorParameters

RATE, STEP = 16000.0, 0.01
PARAMETERS = SupervisorParameters()
# Low from 1.2 to 1.7 s of 3 s.
LOW = (np.arange(300) * STEP > 1.2) & (np.arange(300) * STEP < 1.7)


def beat(at, loud=0.3, seconds=3.0):
    """Noise of the microphone, and a drum at those times."""
    t = np.arange(int(seconds * RATE)) / RATE
    sound = 1e-3 * np.random.default_rng(2).standard_normal(len(t))
    for when in at:
        ring = np.exp(-(t - when) / 0.05) * np.sin(2500.0 * (t - when))
        sound += loud * np.where(t >= when, ring, 0.0)
    return sound


def judge(sound, distances=(0.01, 0.01), heard=True, low=LOW):
    scores = sound_scores(PARAMETERS, sound, RATE, low, STEP, distances, heard)
    return {check for check, score in scores.items() if score >= 1.0}


def test_a_stroke_that_is_heard_in_its_time_is_believed():
    assert judge(beat([1.4])) == set()


def test_so_is_a_miss_of_a_hand_that_was_elsewhere():
    nowhere = (np.inf, np.inf)
    assert judge(beat([]), (0.09, 0.09), heard=False) == set()
    assert judge(beat([]), nowhere, heard=False, low=LOW & False) == set()
    assert judge(beat([]), None, heard=False) == set()


@pytest.mark.parametrize(
    ("sound", "more", "check"),
    [
        (0.0 * beat([]), {"heard": False}, Check.SOUND_DEAD),
        (np.clip(beat([1.4]), -0.05, 0.05), {}, Check.SOUND_CLIPPED),
        (beat([0.1, 1.4]), {}, Check.SOUND_NOISY),
        (beat([0.7, 1.4]), {}, Check.SOUND_ELSEWHERE),
        (beat([1.4, 2.6]), {}, Check.SOUND_ELSEWHERE),
        (
            beat([1.4]),
            {"distances": (0.12, np.inf)},
            Check.SOUND_UNREACHED,
        ),
        (
            beat([1.4]),
            {"distances": (np.inf, np.inf), "low": LOW & False},
            Check.SOUND_UNREACHED,
        ),
        (beat([]), {"heard": False}, Check.SOUND_MISSING),
    ],
)
def test_what_cannot_be_is_not_believed(sound, more, check):
    assert check in judge(sound, **more)
