"""Draws of actuators, and the supply that breathes."""

import numpy as np
import pytest

from drake_affetto.common.errors import InputError
from drake_affetto.pneumatics.chamber import Row
from drake_affetto.pneumatics.parameters import load_parameters
from drake_affetto.pneumatics.variation import ActuatorVariation, supply_change

NAMES = ["waist_yaw", "right_elbow_flexion"]
NOMINAL = load_parameters().for_joints(NAMES, [-1.0, 0.0], [1.0, 2.0])
SIZES = ActuatorVariation(
    friction=0.2, valve_lag=0.1, dead_time=0.003, supply_swing=2e4
)


def draws(variation, count=2000):
    rng = np.random.default_rng(0)
    return np.stack([variation.draw(NOMINAL, rng)[0] for _ in range(count)])


def test_nothing_differs_by_default():
    drawn, breath = ActuatorVariation().draw(NOMINAL, np.random.default_rng(1))
    np.testing.assert_array_equal(drawn, NOMINAL)
    assert supply_change(breath, 12.3) == 0.0


def test_draws_have_their_sizes_and_are_clipped():
    drawn = draws(SIZES)
    # sd of a normal distribution clipped at 2 sd
    shrunk = 0.962
    friction = drawn[:, Row.COULOMB] / NOMINAL[Row.COULOMB] - 1.0
    lag = drawn[:, Row.VALVE_LAG] / NOMINAL[Row.VALVE_LAG] - 1.0
    delay = drawn[:, Row.DEAD_TIME] - NOMINAL[Row.DEAD_TIME]
    for values, sd in ((friction, 0.2), (lag, 0.1), (delay, 0.003)):
        np.testing.assert_allclose(values.std(axis=0), shrunk * sd, rtol=0.08)
        assert np.abs(values).max() <= 2.0 * sd + 1e-12
        assert abs(np.corrcoef(values.T)[0, 1]) < 0.1
    assert abs(np.corrcoef(friction[:, 0], lag[:, 0])[0, 1]) < 0.1


def test_friction_of_a_joint_is_scaled_as_a_whole_and_all_else_kept():
    drawn = draws(SIZES, 1)[0]
    varied = [
        Row.COULOMB,
        Row.BREAKAWAY,
        Row.STIFFNESS,
        Row.DAMPING,
        Row.DWELL_TORQUE,
        Row.VALVE_LAG,
        Row.DEAD_TIME,
    ]
    rest = np.setdiff1d(np.arange(len(Row)), varied)
    np.testing.assert_array_equal(drawn[rest], NOMINAL[rest])
    factor = drawn[Row.COULOMB] / NOMINAL[Row.COULOMB]
    for row in (Row.BREAKAWAY, Row.STIFFNESS, Row.DAMPING):
        np.testing.assert_allclose(drawn[row], factor * NOMINAL[row])


def test_dead_time_is_never_negative():
    assert draws(ActuatorVariation(dead_time=0.1))[:, Row.DEAD_TIME].min() == 0


def test_supply_swings_about_its_mean_and_fills_faster_than_it_falls():
    breath = np.array([2e4, 40.0, 0.25, 0.6])
    t = np.arange(0.0, 80.0, 0.01)
    change = np.array([supply_change(breath, each) for each in t])
    assert change.max() == pytest.approx(2e4, rel=2e-3)
    assert change.min() == pytest.approx(-2e4, rel=2e-3)
    assert change.mean() == pytest.approx(0.0, abs=50.0)
    assert np.mean(np.diff(change) > 0.0) == pytest.approx(0.25, abs=2e-3)
    assert np.abs(np.diff(change)).max() < 50.0
    np.testing.assert_allclose(change[4000:], change[:4000], atol=1e-6)


def test_misfit_is_named():
    with pytest.raises(InputError, match=r"v\.friction is 0\.9"):
        ActuatorVariation(friction=0.9).check("v")
