"""What holds a joint at rest."""

from hypothesis import given, settings
from hypothesis import strategies as st
import numpy as np
import pytest

from drake_affetto.pneumatics.chamber import Row
from drake_affetto.pneumatics.equilibrium import (
    chamber_torque,
    opening_for_torque,
    pressures_for_torque,
)
from drake_affetto.pneumatics.parameters import resting_pressure
from support.actuator_bench import SUPPLY, Actuators, make_parameters


def test_pressures_for_torque_give_that_torque_within_their_limits():
    array = make_parameters(3, area_ratio=0.85)
    wanted = np.array([0.3, 0.0, -0.4])
    pressure = np.concatenate(pressures_for_torque(array, wanted))
    np.testing.assert_allclose(
        chamber_torque(array, pressure), wanted, atol=1e-12
    )
    p_a, p_b = pressures_for_torque(array, [9.0, -9.0, 0.0])
    assert np.all((p_a <= SUPPLY) & (p_b >= 101.3e3))


@settings(max_examples=25, deadline=None)
@given(
    torque=st.floats(-2.0, 2.0),
    area_ratio=st.floats(0.8, 1.0),
    leak=st.floats(0.0, 1e-11),
)
def test_held_openings_give_the_torque_at_rest(torque, area_ratio, leak):
    array = make_parameters(area_ratio=area_ratio, leak_conductance=leak)
    opening = opening_for_torque(array, [torque])
    pressure = np.concatenate(
        [resting_pressure(array, opening), resting_pressure(array, -opening)]
    )
    assert chamber_torque(array, pressure)[0] == pytest.approx(torque, abs=1e-6)


def test_the_kernel_stays_at_the_operating_point():
    """Nothing of the search is shared with the kernel but the flow."""
    array = make_parameters(leak_conductance=5e-12)
    opening = opening_for_torque(array, [0.5])
    start = np.concatenate(
        [resting_pressure(array, opening), resting_pressure(array, -opening)]
    )
    assert 0.0 < opening[0] < array[Row.UNDERLAP, 0]
    dut = Actuators(array, start, h=0.002, max_dead_time=0.0)
    for _ in range(2000):
        end = dut.step(opening, 0.2)
    # The spool starts in its middle, so that the start is not quite it.
    np.testing.assert_allclose(end, start, rtol=2e-3)
    assert dut.torque[0] == pytest.approx(0.5, abs=5e-3)


def test_a_torque_beyond_the_actuator_saturates_the_valves():
    array = make_parameters()
    strongest = 5e-6 * 558e3
    low, high = opening_for_torque(
        make_parameters(2), [-2 * strongest, 2 * strongest]
    )
    assert (low, high) == pytest.approx((-1.0, 1.0))
    assert resting_pressure(array, 1.0)[0] == pytest.approx(SUPPLY)
