"""References: their ranges, their rests, their frequencies."""

from hypothesis import given, settings
from hypothesis import strategies as st
import numpy as np
import pytest

from drake_affetto.common.errors import InputError
from drake_affetto.tuning.config import (
    HELD_OUT,
    REST,
    TRAINING,
    TuningConfig,
)
from drake_affetto.tuning.references import (
    JointRange,
    joint_range,
    make_reference,
)

NAMES = (TRAINING, *HELD_OUT, REST)


def space_of(n, seed=0):
    rng = np.random.default_rng(seed)
    low = rng.uniform(-1.0, 0.0, n)
    high = low + rng.uniform(0.3, 2.0, n)
    start = low + rng.uniform(0.0, 1.0, n) * (high - low)
    return JointRange(start, low, high)


@pytest.mark.parametrize("name", NAMES)
@given(n=st.integers(1, 22), seed=st.integers(0, 1000))
@settings(max_examples=10)
def test_references_keep_to_their_space(name, n, seed):
    config, space = TuningConfig(), space_of(n, seed)
    reference = make_reference(name, config, space)
    assert reference.q.shape == (len(reference.t), n)
    np.testing.assert_allclose(
        np.diff(reference.t), 1.0 / config.sample_rate, rtol=1e-9
    )
    assert np.all(reference.q >= space.low - 1e-9)
    assert np.all(reference.q <= space.high + 1e-9)
    # At rest at the start posture while nothing counts yet.
    quiet = reference.t < config.settling
    np.testing.assert_allclose(
        reference.q[quiet], np.tile(space.start, (quiet.sum(), 1)), atol=1e-12
    )
    assert not np.any(reference.counted[quiet])
    assert np.all(reference.counted[~quiet])
    # No jumps: nothing crosses its excursion within a twentieth of a second.
    step = np.abs(np.diff(reference.q, axis=0)) / (space.high - space.low)
    assert step.max() < 20.0 / config.sample_rate


@pytest.mark.parametrize("name", NAMES)
def test_references_use_the_room_that_there_is(name):
    low, high = -np.ones(8), np.linspace(0.5, 2.0, 8)
    space = JointRange(0.5 * (low + high), low, high)
    q = make_reference(name, TuningConfig(), space).q
    assert np.all(np.ptp(q, axis=0) > 0.25 * (high - low))


@pytest.mark.parametrize("name", [TRAINING, *HELD_OUT])
def test_references_end_at_rest_where_they_began(name):
    space = space_of(8)
    reference = make_reference(name, TuningConfig(), space)
    np.testing.assert_allclose(reference.q[-1], space.start, atol=1e-9)
    assert reference.rest[-1]


@pytest.mark.parametrize("name", NAMES)
def test_rest_is_where_nothing_has_moved_for_a_while(name):
    config = TuningConfig()
    reference = make_reference(name, config, space_of(5))
    assert np.any(reference.rest)
    delay = round(config.rest_delay * config.sample_rate)
    for k in np.flatnonzero(reference.rest):
        before = reference.q[k - delay : k + 1]
        assert np.ptp(before, axis=0).max() < 1e-6


def test_sines_of_no_two_joints_share_a_frequency():
    config = TuningConfig()
    config.sines.duration = 40.0
    config.sines.share = 0.0
    n = 8
    q = make_reference(TRAINING, config, space_of(n)).q
    # The sines alone, between settling, the way there, and the steps.
    rate = config.sample_rate
    first = round((config.settling + config.approach) * rate)
    wave = q[first : first + round(config.sines.duration * rate)]
    wave = (wave - wave.mean(axis=0)) * np.hanning(len(wave))[:, None]
    spectrum = np.abs(np.fft.rfft(wave, 8 * len(wave), axis=0))
    peak = np.fft.rfftfreq(8 * len(wave), 1.0 / rate)[spectrum.argmax(axis=0)]
    expected = np.linspace(config.sines.low, config.sines.high, n)
    np.testing.assert_allclose(np.sort(peak), expected, atol=0.004)


def test_held_out_references_are_others():
    config, space = TuningConfig(), space_of(4)
    test = make_reference(TRAINING, config, space).q
    for name in HELD_OUT:
        q = make_reference(name, config, space).q
        length = min(len(q), len(test))
        assert np.abs(q[:length] - test[:length]).max() > 0.1


def test_an_unknown_reference_is_told():
    with pytest.raises(InputError, match="chirp"):
        make_reference("zigzag", TuningConfig(), space_of(2))


def test_rates_are_the_derivative():
    reference = make_reference("chirp", TuningConfig(), space_of(3))
    rate = reference.rate()
    dt = reference.t[1]
    way = np.concatenate(
        [[np.zeros(3)], np.cumsum(0.5 * dt * (rate[1:] + rate[:-1]), axis=0)]
    )
    np.testing.assert_allclose(way + reference.q[0], reference.q, atol=2e-3)


def test_excursions_keep_a_margin_and_hold_the_start():
    config = TuningConfig(margin=0.1, reach=0.3)
    lower, upper = np.array([0.0, 0.0, 0.0]), np.array([1.0, 1.0, 1.0])
    space = joint_range(
        config, ["a", "b", "c"], [0.5, 0.05, 0.95], lower, upper
    )
    np.testing.assert_allclose(space.low, [0.2, 0.05, 0.65])
    np.testing.assert_allclose(space.high, [0.8, 0.35, 0.95])


def test_a_named_excursion_is_taken():
    config = TuningConfig(excursions={"b": [0.1, 0.7]})
    space = joint_range(config, ["a", "b"], [0.5, 0.5], [0, 0], [1, 1])
    assert (space.low[1], space.high[1]) == (0.1, 0.7)


@pytest.mark.parametrize("pair", [[-0.1, 0.7], [0.1, 1.2], [0.6, 0.8]])
def test_an_excursion_that_does_not_fit_is_told(pair):
    config = TuningConfig(excursions={"b": pair})
    with pytest.raises(InputError, match=r"excursions\.b"):
        joint_range(config, ["a", "b"], [0.5, 0.5], [0, 0], [1, 1])
