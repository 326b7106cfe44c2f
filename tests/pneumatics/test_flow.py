"""ISO 6358 flow against the standard's formula and its limits."""

from hypothesis import given
from hypothesis import strategies as st
import numpy as np
import pytest

from drake_affetto.common.errors import InputError
from drake_affetto.pneumatics.flow import (
    LAMINAR_RATIO,
    REFERENCE_DENSITY,
    mass_flow_rate,
)

C = 0.1e-8
T0 = 293.15


def test_choked_flow_is_proportional_to_the_upstream_pressure_alone():
    expected = C * REFERENCE_DENSITY * 6e5
    assert mass_flow_rate(6e5, 1e5, C, 0.3, T0) == pytest.approx(expected)
    assert mass_flow_rate(6e5, 1.7e5, C, 0.3, T0) == pytest.approx(expected)
    assert mass_flow_rate(3e5, 0.5e5, C, 0.3, T0) == pytest.approx(expected / 2)


def test_hot_air_flows_less_by_the_root_of_the_temperature():
    hot = mass_flow_rate(6e5, 1e5, C, 0.3, 4 * T0)
    assert hot == pytest.approx(0.5 * mass_flow_rate(6e5, 1e5, C, 0.3, T0))


def test_subsonic_flow_follows_the_ellipse():
    r = np.linspace(0.31, 0.99, 50)
    flow = mass_flow_rate(5e5, r * 5e5, C, 0.3, T0)
    phi = flow / (C * REFERENCE_DENSITY * 5e5)
    np.testing.assert_allclose(phi**2 + ((r - 0.3) / 0.7) ** 2, 1.0, rtol=1e-12)


def test_laminar_flow_is_linear_down_to_none_and_joins_the_ellipse():
    edge = mass_flow_rate(5e5, LAMINAR_RATIO * 5e5, C, 0.3, T0)
    r = np.linspace(LAMINAR_RATIO, 1.0, 11)
    flow = mass_flow_rate(5e5, r * 5e5, C, 0.3, T0)
    line = edge * (1.0 - r) / (1.0 - LAMINAR_RATIO)
    np.testing.assert_allclose(flow, line, atol=1e-12 * edge)


pressures = st.floats(0.0, 1e6)


@given(a=pressures, b=pressures, ratio=st.floats(0.0, 0.9))
def test_exchanging_the_ends_turns_the_flow_round(a, b, ratio):
    there = mass_flow_rate(a, b, C, ratio, T0)
    assert there == -mass_flow_rate(b, a, C, ratio, T0)
    assert there * (a - b) >= 0.0


@given(
    up=st.floats(1e4, 1e6),
    r=st.floats(0.0, 1.0),
    dr=st.floats(0.0, 0.1),
    ratio=st.floats(0.0, 0.9),
)
def test_flow_never_grows_with_the_downstream_pressure(up, r, dr, ratio):
    lower = mass_flow_rate(up, r * up, C, ratio, T0)
    higher = mass_flow_rate(up, min(r + dr, 1.0) * up, C, ratio, T0)
    assert higher <= lower * (1.0 + 1e-12)


def test_arguments_broadcast():
    flow = mass_flow_rate(
        np.array([[6e5], [3e5]]), np.array([1e5, 2e5, 3e5]), C, 0.3, T0
    )
    assert flow.shape == (2, 3)
    assert flow[1, 2] == 0.0


@pytest.mark.parametrize(
    ("arguments", "field"),
    [
        ((-1.0, 1e5, C, 0.3, T0), "p_up"),
        ((1e5, -1.0, C, 0.3, T0), "p_down"),
        ((1e5, 1e5, -C, 0.3, T0), "C"),
        ((1e5, 1e5, C, 1.0, T0), "b"),
        ((1e5, 1e5, C, 0.3, 0.0), "T"),
        ((1e5, np.nan, C, 0.3, T0), "p_down"),
    ],
)
def test_impossible_arguments_are_named(arguments, field):
    with pytest.raises(InputError, match=f"^{field} is "):
        mass_flow_rate(*arguments)
