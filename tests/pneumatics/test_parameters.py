"""Actuator parameters: files, overrides, arrays."""

import dataclasses

import numpy as np
import pytest

from drake_affetto.common.errors import InputError
from drake_affetto.pneumatics.chamber import Row
from drake_affetto.pneumatics.parameters import (
    ActuatorClass,
    JointActuator,
    PneumaticParameters,
    chamber_volumes,
    load_parameters,
    parameter_array,
    resting_pressure,
)


def simple():
    return PneumaticParameters(
        classes={
            "a": ActuatorClass(),
            "b": ActuatorClass(torque_constant=2e-6),
        },
        joints={
            "one": JointActuator(actuator="a"),
            "two": JointActuator(
                actuator="b", override={"coulomb_torque": 0.01}
            ),
        },
    )


def test_columns_stand_in_the_order_of_the_names():
    array = simple().for_joints(["two", "one"], [0.0, -1.0], [1.0, 1.0])
    np.testing.assert_allclose(array[Row.K_A], [2e-6, 5e-6])
    np.testing.assert_allclose(array[Row.K_B], 0.95 * array[Row.K_A])
    np.testing.assert_allclose(array[Row.COULOMB], [0.01, 0.075])
    np.testing.assert_allclose(array[Row.Q_LOWER], [0.0, -1.0])
    assert np.all(np.isfinite(array))


def test_volumes_and_torques_share_their_constant():
    array = simple().for_joints(["one"], [0.0], [2.0])
    low = np.array(chamber_volumes(array, [0.0]))
    high = np.array(chamber_volumes(array, [2.0]))
    np.testing.assert_allclose(low[:, 0], [12e-6, 12e-6 + 2 * 4.75e-6])
    np.testing.assert_allclose(
        (high - low)[:, 0] / 2.0, [array[Row.K_A, 0], -array[Row.K_B, 0]]
    )


def test_the_robots_file_serves_every_joint():
    parameters = load_parameters()
    assert len(parameters.joints) == 22
    n = 22
    array = parameters.for_joints(
        list(parameters.joints), np.full(n, -0.5), np.full(n, 1.0)
    )
    assert array.shape == (len(Row), n)
    assert np.all(array[Row.BREAKAWAY] >= array[Row.COULOMB])
    assert np.all(array[Row.C_FILL] > array[Row.C_EXHAUST])


def test_overlays_change_what_they_name_and_nothing_else(tmp_path):
    overlay = tmp_path / "fit.yaml"
    overlay.write_text("classes:\n  elbow:\n    coulomb_torque: 0.05\n")
    plain, changed = load_parameters(), load_parameters(overlays=[overlay])
    assert changed.classes["elbow"].coulomb_torque == 0.05
    expected = dataclasses.replace(plain.classes["elbow"], coulomb_torque=0.05)
    assert changed.classes["elbow"] == expected
    assert changed.classes["waist"] == plain.classes["waist"]
    assert changed.joints == plain.joints


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("classes:\n  elbow: {torque_constnat: 1}\n", "torque_constnat"),
        ("classes:\n  elbow: {underlap: 2}\n", "elbow.underlap"),
        ("classes:\n  elbow: {dead_volume: 0}\n", "elbow.dead_volume"),
        ("classes:\n  elbow: {breakaway_torque: 0.001}\n", "breakaway"),
        ("polytropic_exponent: 1.7\n", "polytropic_exponent"),
        ("supply_pressure: 1.0\n", "supply_pressure"),
        ("joints:\n  waist_yaw: {actuator: hip}\n", "hip"),
        ("joints:\n  waist_yaw: {override: {size: 1}}\n", "size"),
        ("- 1\n", "mapping"),
    ],
)
def test_what_does_not_fit_is_named(tmp_path, text, message):
    overlay = tmp_path / "wrong.yaml"
    overlay.write_text(text)
    with pytest.raises(InputError, match=message):
        load_parameters(overlays=[overlay])


def test_unknown_joints_and_limits_are_named():
    with pytest.raises(InputError, match="three"):
        simple().for_joints(["three"], [0.0], [1.0])
    with pytest.raises(InputError, match="q_lower"):
        simple().for_joints(["one"], [0.0, 1.0], [1.0])
    for limits in ([1.0, 0.0], [-np.inf, np.inf], [0.0, np.nan]):
        with pytest.raises(
            InputError, match=r"range of joint one is .*, expected a finite"
        ):
            simple().for_joints(["one"], *np.transpose([limits]))


def test_parameters_need_joints_to_be_an_array():
    with pytest.raises(InputError, match="joints is None"):
        parameter_array(simple())


def test_resting_pressure_of_tight_valves_is_in_the_middle():
    array = simple().for_joints(["one"], [0.0], [1.0])
    array[Row.UNDERLAP] = 0.0
    assert resting_pressure(array)[0] == pytest.approx(
        0.5 * (101.3e3 + 701.3e3)
    )
    array[Row.C_LEAK] = 1e-12
    assert resting_pressure(array)[0] == pytest.approx(101.3e3)
