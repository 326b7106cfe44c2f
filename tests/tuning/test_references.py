"""References, cost and search of tuning, without a robot."""

import dataclasses

from hypothesis import given, settings
from hypothesis import strategies as st
import numpy as np
import pytest

from drake_affetto.common.errors import InputError
from drake_affetto.tuning.cma_es import EvaluatedCandidate, JointwiseCmaEs
from drake_affetto.tuning.config import (
    HELD_OUT,
    REST,
    TRAINING,
    CostWeights,
    TuningConfig,
    load_tuning,
)
from drake_affetto.tuning.costs import joint_costs, rest_deviation, rest_std
from drake_affetto.tuning.references import (
    JointRange,
    Reference,
    joint_range,
    make_reference,
    minimum_jerk,
)

NAMES = (TRAINING, *HELD_OUT, REST)


def space_of(n, seed=0):
    rng = np.random.default_rng(seed)
    low = rng.uniform(-1.0, 0.0, n)
    high = low + rng.uniform(0.3, 2.0, n)
    start = low + rng.uniform(0.0, 1.0, n) * (high - low)
    return JointRange(start, low, high)


# --- references


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


def test_minimum_jerk_rests_at_both_ends():
    s = np.linspace(-0.5, 1.5, 2001)
    x = minimum_jerk(s)
    assert np.all(x[s <= 0] == 0.0)
    np.testing.assert_allclose(x[s >= 1], 1.0)
    assert np.all(np.diff(x) >= -1e-15)
    for edge in (0.0, 1.0):
        h = 1e-4
        y = minimum_jerk(np.array([edge - h, edge, edge + h]))
        assert abs(y[2] - y[0]) / (2 * h) < 1e-6


# --- excursions


def test_excursions_keep_a_margin_and_hold_the_start():
    config = TuningConfig(margin=0.1, reach=0.3)
    lower, upper = np.array([0.0, 0.0, 0.0]), np.array([1.0, 1.0, 1.0])
    space = joint_range(config, ["a", "b", "c"], [0.5, 0.05, 0.95], lower, upper)
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


# --- the cost


def still(duration=4.0, n=2, rate=100.0):
    """A reference that stays where it is; all of it is rest."""
    t = np.arange(round(duration * rate) + 1) / rate
    everything = np.ones(len(t), dtype=bool)
    return Reference("still", t, np.zeros((len(t), n)), everything, everything)


def test_following_exactly_with_closed_valves_costs_nothing():
    reference = make_reference(TRAINING, TuningConfig(), space_of(3))
    costs = joint_costs(
        reference,
        reference.q,
        np.zeros_like(reference.q),
        np.ones(3),
        CostWeights(),
    )
    np.testing.assert_allclose(costs.tracking, 0.0)
    np.testing.assert_allclose(costs.effort, 0.0)
    np.testing.assert_allclose(costs.oscillation, 0.0, atol=1e-9)
    assert costs.mean() == pytest.approx(0.0, abs=1e-9)


def test_tracking_is_in_percent_of_the_range():
    reference = still()
    q = np.tile([0.02, -0.02], (len(reference.t), 1))
    costs = joint_costs(
        reference, q, np.zeros_like(q), [1.0, 2.0], CostWeights()
    )
    np.testing.assert_allclose(costs.tracking, [2.0, 1.0])
    # An offset is no oscillation.
    np.testing.assert_allclose(costs.oscillation, 0.0, atol=1e-12)


def test_open_valves_and_moving_valves_are_effort():
    reference = still(n=3)
    v = np.zeros((len(reference.t), 3))
    v[:, 0] = 0.2
    v[:, 1] = 0.2 * (-1.0) ** np.arange(len(v))
    costs = joint_costs(
        reference, np.zeros_like(v), v, np.ones(3), CostWeights()
    )
    # The chattering valve moves 0.4 in each 0.01 s: 4 a tenth of a second.
    np.testing.assert_allclose(costs.effort, [10.0, 10.0 + 200.0, 0.0])


@given(
    amplitude=st.floats(1e-3, 0.5),
    frequency=st.floats(2.0, 20.0),
    drift=st.floats(-0.01, 0.01),
)
def test_oscillation_is_the_swing_and_not_the_drift(
    amplitude, frequency, drift
):
    rate = 200.0
    t = np.arange(801) / rate
    q = amplitude * np.sin(2 * np.pi * frequency * t) + drift * t
    rest = np.ones(len(t), dtype=bool)
    found = rest_deviation(q[:, None], rest, rate)[0]
    assert found == pytest.approx(amplitude / np.sqrt(2.0), rel=0.1, abs=2e-3)


def test_where_there_is_no_rest_there_is_no_oscillation():
    q = np.random.default_rng(0).normal(size=(100, 2))
    nowhere = np.zeros(100, dtype=bool)
    np.testing.assert_array_equal(rest_deviation(q, nowhere, 100.0), 0.0)
    np.testing.assert_array_equal(rest_std(q, nowhere, 100.0), 0.0)


def test_the_end_of_the_worst_rest_is_reported():
    rate = 100.0
    t = np.arange(1200) / rate
    rest = (t < 4.0) | (t >= 6.0)
    q = np.zeros((len(t), 1))
    q[t < 1.0] = 5.0  # a creep that has ended two seconds before the end
    swinging = t >= 9.0
    q[swinging, 0] = 0.1 * np.sin(2 * np.pi * 5 * t[swinging])
    found = rest_std(q, rest, rate)[0]
    assert found == pytest.approx(0.1 / np.sqrt(2.0), rel=0.01)


def test_weights_add_the_parts():
    reference = still()
    rng = np.random.default_rng(1)
    q = rng.normal(size=(len(reference.t), 2))
    v = rng.uniform(-1, 1, q.shape)
    costs = joint_costs(reference, q, v, [1.0, 2.0], CostWeights(2.0, 0.5, 3.0))
    np.testing.assert_allclose(
        costs.total,
        2.0 * costs.tracking + 0.5 * costs.effort + 3.0 * costs.oscillation,
    )
    assert costs.mean() == pytest.approx(costs.total.mean())


def test_a_run_that_was_stopped_is_judged_by_what_there_is():
    reference = still()
    half = len(reference.t) // 2
    q = np.full((half, 2), 0.01)
    costs = joint_costs(
        reference, q, np.zeros_like(q), np.ones(2), CostWeights()
    )
    np.testing.assert_allclose(costs.tracking, 1.0)


# --- the search


def search(joints=3, parameters=4, *, population=9, seed=5):
    return JointwiseCmaEs(
        joints,
        parameters,
        sigma=0.4,
        bound=2.0,
        population=population,
        seed=seed,
    )


def bowl(x, goal, scale):
    """Each joint's own quadratic, with a little of its neighbours'."""
    own = np.sum(scale * (x - goal) ** 2, axis=1)
    return own + 0.05 * np.mean(own)


def run_search(dut, goal, count, scale=1.0, history=None):
    history = {} if history is None else dict(history)
    for k in range(count):
        if k not in history:
            x = dut.ask(k, history)
            history[k] = EvaluatedCandidate(x, bowl(x, goal, scale))
    return history


def test_candidate_0_is_the_start():
    np.testing.assert_array_equal(search().ask(0, {}), np.zeros((3, 4)))


def test_all_joints_find_their_own_optimum():
    rng = np.random.default_rng(3)
    goal = rng.uniform(-1.2, 1.2, (8, 4))
    scale = np.array([1.0, 10.0, 0.3, 3.0])
    dut = search(joints=8)
    history = run_search(dut, goal, 30 * dut.generation_size + 1, scale)
    np.testing.assert_allclose(
        history[30 * dut.generation_size].x, goal, atol=0.05
    )


def test_one_search_of_everything_needs_many_more_trials():
    import cmaes

    rng = np.random.default_rng(4)
    goal = rng.uniform(-1.2, 1.2, (8, 4))
    dut = search(joints=8)
    count = 15 * dut.generation_size + 1
    ours = run_search(dut, goal, count)
    wide = cmaes.CMA(mean=np.zeros(32), sigma=0.4, seed=5)
    best, asked = np.inf, 0
    while asked < count:
        told = []
        for _ in range(wide.population_size):
            x = wide.ask()
            told.append((x, bowl(x.reshape(8, 4), goal, 1.0).mean()))
        asked += len(told)
        best = min(best, *(value for _, value in told))
        wide.tell(told)
    assert min(e.cost.mean() for e in ours.values()) < 0.2 * best


def test_candidates_stay_within_the_bounds():
    dut = search()
    history = run_search(dut, np.full((3, 4), 5.0), 60)
    x = np.array([e.x for e in history.values()])
    assert np.all(np.abs(x) <= 2.0)
    assert np.abs(x).max() > 1.5


def test_what_a_candidate_is_depends_on_earlier_generations_alone():
    goal = np.full((3, 4), 0.7)
    history = run_search(search(), goal, 50)
    again = search()
    # In any order, and after having been further already.
    for k in (41, 12, 33, 10, 5, 0, 49):
        np.testing.assert_array_equal(again.ask(k, history), history[k].x)
    earlier = {k: e for k, e in history.items() if k < 40}
    np.testing.assert_array_equal(search().ask(43, earlier), history[43].x)


def test_a_missing_evaluation_is_an_error():
    history = run_search(search(), np.zeros((3, 4)), 10)
    del history[4]
    with pytest.raises(KeyError):
        search().ask(10, history)


def test_seeds_differ():
    a, b = search(seed=1).ask(3, {}), search(seed=2).ask(3, {})
    assert np.abs(a - b).max() > 1e-3
    # And so do the joints of one candidate.
    assert np.abs(a[0] - a[1]).max() > 1e-3


# --- the file


def test_the_default_file_is_read():
    config = load_tuning()
    assert config.cost.tracking > 0.0
    assert "right_elbow_flexion" in config.excursions


@pytest.mark.parametrize(
    ("text", "field"),
    [
        ("sample_rate: 3.0", "sample_rate"),
        ("sines: {low: 0.5, high: 0.2}", r"sines\.high"),
        ("steps: {levels: [2.0]}", r"steps\.levels"),
        ("trapezoids: {ramp: [1.0]}", r"trapezoids\.ramp"),
        ("excursions: {waist_yaw: [0.3, -0.3]}", r"excursions\.waist_yaw"),
        ("search: {population: 2}", r"search\.population"),
        ("cost: {tracking: -1.0}", r"cost\.tracking"),
        ("cots: {}", "cots"),
    ],
)
def test_a_value_that_does_not_fit_is_named(tmp_path, text, field):
    path = tmp_path / "mine.yaml"
    path.write_text(text)
    with pytest.raises(InputError, match=field):
        load_tuning(path)


def test_defaults_fit_themselves():
    TuningConfig().check("tuning")
    assert dataclasses.asdict(TuningConfig())["sample_rate"] > 0
