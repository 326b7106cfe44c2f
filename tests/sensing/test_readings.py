"""Readings: noise, resolution, and the filter against scipy's own."""

import numpy as np
import pytest
from scipy.signal import butter, lfilter, lfilter_zi

from drake_affetto.common.errors import InputError
from drake_affetto.sensing.readings import (
    NOISE_ROWS,
    SensorParameters,
    memory_size,
    noise_block,
    read_sensors,
)

T = 0.005
NAMES = ("elbow", "wrist")
LOWER, UPPER = np.array([0.0, -1.0]), np.array([2.0, 1.5])


def course(parameters, angles, pressures=4e5, seed=0, n=2):
    """Estimates (K, 2n) and pressures (K, 2n) of a course of angles (K, n)."""
    scales = parameters.scales(NAMES, LOWER, UPPER)
    rows = parameters.filter_rows(T)
    memory = np.zeros(memory_size(n, rows.shape[1] - 1))
    estimate, pressure = np.zeros(2 * n), np.zeros(2 * n)
    noise = noise_block(seed, 0, 3 * n)
    estimates, readings = [], []
    for k, q in enumerate(angles):
        state = np.append(q, np.full(n, np.nan))
        true = np.broadcast_to(pressures, 2 * n).astype(float)
        read_sensors(
            T, scales, rows, noise, k, state, true, estimate, pressure, memory
        )
        estimates.append(estimate.copy())
        readings.append(pressure.copy())
    return np.array(estimates), np.array(readings)


def ramp(count=NOISE_ROWS):
    t = T * np.arange(count)
    return np.stack([1.0 + 0.5 * np.sin(3.0 * t), 0.4 * t - 0.5], axis=1)


def test_perfect_sensors_read_the_angle_and_its_difference():
    q = ramp()
    estimate, pressure = course(SensorParameters(), q)
    np.testing.assert_array_equal(estimate[:, :2], q)
    np.testing.assert_allclose(estimate[1:, 2:], np.diff(q, axis=0) / T)
    assert not estimate[0, 2:].any()
    assert (pressure == 4e5).all()


@pytest.mark.parametrize("order", [1, 2, 5])
def test_filter_is_scipys_started_at_rest(order):
    q = ramp()
    parameters = SensorParameters(filter_order=order, filter_cutoff=10.0)
    estimate, _ = course(parameters, q)
    b, a = butter(order, 10.0, fs=1.0 / T)
    for i in range(2):
        expected, _ = lfilter(b, a, q[:, i], zi=lfilter_zi(b, a) * q[0, i])
        np.testing.assert_allclose(estimate[:, i], expected, rtol=1e-9)
        np.testing.assert_allclose(
            estimate[1:, 2 + i], np.diff(expected) / T, atol=1e-7
        )


def test_readings_are_in_steps_of_the_resolution():
    parameters = SensorParameters(
        angle_resolution=0.001, pressure_resolution=300.0
    )
    q = ramp()
    estimate, pressure = course(parameters, q, pressures=401_234.0)
    for i, span in enumerate(UPPER - LOWER):
        steps = estimate[:, i] / (0.001 * span)
        np.testing.assert_allclose(steps, np.rint(steps), atol=1e-6)
        error = estimate[:, i] - q[:, i]
        assert 0.4 < np.abs(error).max() / (0.001 * span) <= 0.5 + 1e-9
    np.testing.assert_allclose(pressure, 401_100.0)


def test_noise_has_each_joints_size_and_is_white():
    parameters = SensorParameters(
        angle_noise=0.001, joint_noise={"wrist": 0.003}, pressure_noise=500.0
    )
    q = np.tile([1.0, 0.2], (NOISE_ROWS, 1))
    estimate, pressure = course(parameters, q)
    error = (estimate[:, :2] - q) / (UPPER - LOWER)
    # Four standard errors of a standard deviation of 512 samples.
    tolerance = 4.0 / np.sqrt(2 * NOISE_ROWS)
    np.testing.assert_allclose(
        error.std(axis=0), [0.001, 0.003], rtol=tolerance
    )
    np.testing.assert_allclose(pressure.std(axis=0), 500.0, rtol=tolerance)
    assert np.abs(np.corrcoef(error.T)[0, 1]) < 4 / np.sqrt(NOISE_ROWS)
    for column in (error - error.mean(axis=0)).T:
        neighbor = np.mean(column[1:] * column[:-1]) / np.var(column)
        assert abs(neighbor) < 4 / np.sqrt(NOISE_ROWS)


def test_noise_is_that_of_seed_and_block():
    same = noise_block(3, 7, 6)
    np.testing.assert_array_equal(same, noise_block(3, 7, 6))
    for other in (noise_block(4, 7, 6), noise_block(3, 8, 6)):
        assert abs(np.corrcoef(same.ravel(), other.ravel())[0, 1]) < 0.1


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"angle_noise": -0.1}, "s.angle_noise is -0.1"),
        ({"joint_noise": {"wrist": 1.0}}, "s.joint_noise.wrist is 1"),
        ({"filter_order": 0}, "s.filter_order is 0"),
    ],
)
def test_misfits_are_named(changes, message):
    with pytest.raises(InputError, match=message):
        SensorParameters(**changes).check("s")


def test_cutoff_must_be_below_half_the_rate():
    with pytest.raises(InputError, match="100 Hz"):
        SensorParameters(filter_cutoff=100.0).filter_rows(T)


def test_limits_must_fit_the_joints():
    with pytest.raises(InputError, match="2 joints"):
        SensorParameters().scales(NAMES, [0.0, 1.0], [1.0, 1.0])
