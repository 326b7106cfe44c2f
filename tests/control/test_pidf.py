"""The PIDF law, its limits and its parameters."""

from hypothesis import given
from hypothesis import strategies as st
import numpy as np
import pytest

from drake_affetto.common.errors import InputError
from drake_affetto.control.pidf import PidfGains, load_control, pidf_update

GAINS = PidfGains(kP=[5e5], kI=[3e5], kD=[2e4], kF=[5e-6])


class Loop:
    """One joint's controller with its state."""

    def __init__(
        self, gains=GAINS, *, integral_limit=300e3, limit=550e3, deadband=0.0
    ):
        self.gains = gains.to_array()
        self.limits = (integral_limit, limit, deadband)
        n = gains.kP.size
        self.integral = np.zeros(n)
        self.demand = np.zeros(n)
        self.opening = np.zeros(n)

    def step(self, q_des, q, v_des=0.0, v=0.0, difference=0.0, offset=0.0):
        pidf_update(
            0.005,
            self.gains,
            *self.limits,
            np.array([q_des, v_des], dtype=float),
            np.array([q, v], dtype=float),
            np.array([4e5 + difference, 4e5]),
            np.array([offset], dtype=float),
            self.integral,
            self.demand,
            self.opening,
        )
        return float(self.opening[0])


def test_law_is_equation_seven():
    loop = Loop()
    opening = loop.step(0.3, 0.2, 0.1, -0.1, difference=2e4, offset=1e4)
    u = 5e5 * 0.1 + 3e5 * (0.005 * 0.1) + 2e4 * 0.2 + 1e4
    assert loop.demand[0] == pytest.approx(u)
    assert opening == pytest.approx(5e-6 * (u - 2e4))


def test_positive_errors_fill_chamber_a():
    assert Loop().step(0.3, 0.2) > 0.0
    assert Loop().step(0.2, 0.3) < 0.0
    # Once the pressure difference is the one asked for, the valves close.
    loop = Loop(PidfGains(kP=[5e5], kI=[0.0], kD=[0.0], kF=[5e-6]))
    assert loop.step(0.3, 0.2, difference=5e4) == pytest.approx(0.0)


def test_integral_sums_the_error_over_time():
    loop = Loop()
    for _ in range(200):
        loop.step(0.1, 0.05, difference=5e4)
    assert loop.integral[0] == pytest.approx(0.05 * 1.0)


def test_integral_stays_within_its_limit():
    loop = Loop(integral_limit=1e4)
    for _ in range(2000):
        loop.step(0.1, 0.05, difference=5e4)
    assert GAINS.kI[0] * loop.integral[0] == pytest.approx(1e4)


def test_integral_waits_while_the_valve_is_fully_open():
    loop = Loop()
    for _ in range(400):
        assert loop.step(1.0, 0.0) == 1.0
    assert loop.integral[0] == 0.0
    # And it unwinds, even at the limit, when the error turns round.
    loop.integral[0] = 0.5
    loop.step(-0.5, 0.0, difference=-8e5)
    assert loop.integral[0] < 0.5


def test_without_integral_gain_nothing_is_kept():
    loop = Loop(GAINS.scaled(0.2))
    for _ in range(100):
        loop.step(0.1, 0.0)
    assert loop.integral[0] == 0.0
    assert loop.demand[0] == pytest.approx(0.2 * 5e5 * 0.1)


def test_small_errors_are_not_integrated_within_the_dead_band():
    loop = Loop(deadband=0.01)
    loop.step(0.009, 0.0)
    assert loop.integral[0] == 0.0
    loop.step(-0.03, 0.0)
    assert loop.integral[0] == pytest.approx(-0.005 * 0.02)


angles = st.floats(-3.0, 3.0)


@given(
    q_des=angles,
    q=angles,
    v=st.floats(-20, 20),
    difference=st.floats(-6e5, 6e5),
    offset=st.floats(-6e5, 6e5),
)
def test_valve_and_demand_stay_within_their_limits(
    q_des, q, v, difference, offset
):
    loop = Loop()
    for _ in range(5):
        opening = loop.step(q_des, q, 0.0, v, difference, offset)
        assert -1.0 <= opening <= 1.0
        assert abs(loop.demand[0]) <= 550e3


@given(
    q=angles,
    v=st.floats(-20, 20),
    difference=st.floats(-6e5, 6e5),
    offset=st.floats(-6e5, 6e5),
)
def test_law_is_odd(q, v, difference, offset):
    there = Loop().step(0.0, q, 0.0, v, difference, offset)
    back = Loop().step(0.0, -q, 0.0, -v, -difference, -offset)
    assert there == pytest.approx(-back, abs=1e-12)


def test_scaled_gains_are_for_leading_by_hand():
    soft = GAINS.scaled(0.2)
    np.testing.assert_allclose(soft.kP, 0.2 * GAINS.kP)
    np.testing.assert_allclose(soft.kD, 0.2 * GAINS.kD)
    np.testing.assert_allclose(soft.kI, 0.0)
    np.testing.assert_allclose(soft.kF, GAINS.kF)
    with pytest.raises(InputError, match="factor"):
        GAINS.scaled(-1.0)


def test_gains_that_do_not_fit_are_named():
    with pytest.raises(InputError, match="kD"):
        PidfGains(kP=[1.0, 2.0], kI=[0.0, 0.0], kD=[0.0], kF=[0.0, 0.0])
    with pytest.raises(InputError, match="kI"):
        PidfGains(kP=[1.0], kI=[-1.0], kD=[0.0], kF=[0.0])
    again = PidfGains.from_array(GAINS.to_array())
    np.testing.assert_array_equal(again.kF, GAINS.kF)


def test_robots_gains_are_read_by_name(tmp_path):
    parameters = load_control()
    assert len(parameters.gains) == 22
    names = ["right_elbow_flexion", "waist_roll"]
    gains = parameters.for_joints(names)
    assert gains.kP[1] == parameters.gains["waist_roll"].kP
    with pytest.raises(InputError, match="knee"):
        parameters.for_joints(["knee"])
    overlay = tmp_path / "tuned.yaml"
    overlay.write_text("gains:\n  waist_roll: {kP: 1.0e+5}\n")
    changed = load_control(overlays=(overlay,))
    assert changed.gains["waist_roll"].kP == 1e5
    assert changed.gains["waist_roll"].kD == parameters.gains["waist_roll"].kD
    overlay.write_text("gains:\n  waist_roll: {kP: -1.0}\n")
    with pytest.raises(InputError, match=r"waist_roll\.kP"):
        load_control(overlays=(overlay,))
