"""The costs of following a reference."""

from hypothesis import given
from hypothesis import strategies as st
import numpy as np
import pytest

from drake_affetto.tuning.config import (
    TRAINING,
    CostWeights,
    TuningConfig,
)
from drake_affetto.tuning.costs import joint_costs, rest_deviation, rest_std
from drake_affetto.tuning.references import (
    JointRange,
    Reference,
    make_reference,
)


def still(duration=4.0, n=2, rate=100.0):
    """A reference that stays where it is; all of it is rest."""
    t = np.arange(round(duration * rate) + 1) / rate
    everything = np.ones(len(t), dtype=bool)
    return Reference("still", t, np.zeros((len(t), n)), everything, everything)


def test_following_exactly_with_closed_valves_costs_nothing():
    start, low, high = np.array([[0.0], [-1.0], [1.0]]) * np.ones(3)
    reference = make_reference(
        TRAINING, TuningConfig(), JointRange(start, low, high)
    )
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
