"""What the signals of a robot tell, without a robot."""

import numpy as np
import pytest

from drake_affetto.common.errors import InputError
from drake_affetto.common.yaml_config import load_config
from drake_affetto.faults.supervision import (
    CHECKS,
    REASONS,
    Check,
    SupervisorParameters,
    image_scores,
    marker_scores,
    reason,
    second_difference_deviation,
    watch_signals,
    watch_size,
)
from drake_affetto.pneumatics.chamber import memory_size
from drake_affetto.sensing.readings import (
    SensorParameters,
    memory_size as filter_size,
    noise_block,
    read_sensors,
)
from support.actuator_bench import Actuators, make_parameters

T = 0.005
SENSORS = SensorParameters(
    angle_resolution=0.001,
    angle_noise=0.001,
    pressure_resolution=300.0,
    pressure_noise=500.0,
    filter_cutoff=40.0,
)
SCALES = SENSORS.scales(["joint"], [-1.0], [1.0])
ARRAY = make_parameters(exhaust_conductance=0.05e-8)
PARAMETERS = load_config(
    SupervisorParameters, "package://drake_affetto/supervisor.yaml"
)


def watch(ticks=400, change=None, conditions=None, stamp=lambda k: k * T):
    """Greatest score of each check, for a joint that goes to and fro.

    Args:
        ticks: How long.
        change: What becomes of tick, angle and pressures as read.
        conditions: Of the valves from tick 200 on.
        stamp: Time stamp of the command at a tick.
    """
    plant = Actuators(ARRAY, 3e5, h=T, max_dead_time=0.05)
    deviation = second_difference_deviation(SENSORS, SCALES, T)
    memory, filters = np.zeros(watch_size(1)), np.zeros(filter_size(1, 1))
    line = np.zeros(memory_size(1, T, 0.05))
    predicted, torque, flow = np.zeros(2), np.zeros(1), np.zeros(2)
    estimate, pressure = np.zeros(2), np.zeros(2)
    worst, noise = np.zeros(CHECKS), noise_block(1, 0, 3)
    for k in range(ticks):
        q = 0.4 * np.sin(2.0 * k * T)
        opening = np.array([0.6 * np.sin(5.0 * k * T)])
        if conditions is not None and k >= 200:
            plant.conditions = conditions
        plant.step(opening, q)
        read_sensors(
            T,
            SCALES,
            SENSORS.filter_rows(T),
            noise,
            k,
            np.array([q, 0.0]),
            plant.pressure,
            estimate,
            pressure,
            filters,
        )
        seen = estimate.copy(), pressure.copy()
        if change is not None:
            change(k, *seen)
        scores, channels = np.zeros(CHECKS), np.zeros(CHECKS)
        watch_signals(
            T,
            PARAMETERS.signals(),
            deviation,
            ARRAY,
            k * T,
            np.array([q, 0.0]),
            *seen,
            opening,
            stamp(k),
            memory,
            predicted,
            torque,
            flow,
            line,
            scores,
            channels,
        )
        np.maximum(worst, scores, out=worst)
    return worst


def beyond(**how):
    return {Check(int(i)) for i in np.flatnonzero(watch(**how) >= 1.0)}


def test_a_sound_robot_stays_well_within():
    assert watch().max() < 0.9


def test_noise_is_known_from_the_sensors():
    rng = np.random.default_rng(4)
    deviation = second_difference_deviation(SENSORS, SCALES, T)
    b, a = SENSORS.filter_rows(T)
    raw = 0.002 * np.rint((0.3123 + 0.002 * rng.standard_normal(4000)) / 0.002)
    y = np.zeros_like(raw)
    for k in range(1, len(raw)):
        y[k] = b[0] * raw[k] + b[1] * raw[k - 1] - a[1] * y[k - 1]
    assert deviation[0] == pytest.approx(np.diff(y[500:], 2).std(), rel=0.1)


def test_faults_of_sensors_are_noticed():
    kept = {}

    def stuck_angle(k, q, p):
        q[0] = kept.setdefault("q", q[0]) if k >= 200 else q[0]

    def stuck_pressure(k, q, p):
        p[1] = kept.setdefault("p", p[1]) if k >= 200 else p[1]

    def jump(k, q, p):
        q[0] += 0.1 * (k >= 200)

    def noisy(k, q, p):
        q[0] += 0.02 * (-1.0) ** k * (k >= 200)

    def offset(k, q, p):
        p[0] += 150e3 * (k >= 200)

    assert Check.ANGLE_STUCK in beyond(change=stuck_angle)
    assert Check.PRESSURE_STUCK in beyond(change=stuck_pressure)
    assert Check.ANGLE_JUMP in beyond(change=jump)
    assert Check.ANGLE_NOISE in beyond(change=noisy)
    assert Check.PRESSURE_JUMP in beyond(change=offset)


def test_faults_of_valves_show_in_the_pressures():
    for conditions in (
        # A valve that stays open, and a chamber that leaks.
        [[1.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 0.0]],
        [[0.0, 0.0], [0.0, 0.0], [1.0, 1.0], [0.0, 2e-9]],
    ):
        assert Check.PRESSURE_MODEL in beyond(
            conditions=np.array(conditions).ravel()
        )


def test_commands_that_do_not_come_are_noticed():
    assert Check.TICK_LATE in beyond(stamp=lambda k: min(k, 200) * T)
    assert Check.TICK_MISSED in beyond(stamp=lambda k: (k - k % 2) * T)


def test_a_joint_that_does_not_follow_is_noticed():
    def away(k, q, p):
        q[0] -= min(max(k - 100, 0) * 0.003, 0.6)

    assert beyond(change=away) == {Check.TRACKING}


def test_images_and_markers():
    usual = np.array([115.0, 20.0, 0.0, 90.0, 1.0, 900.0])
    assert max(image_scores(PARAMETERS, usual, 0).values()) < 1.0
    assert image_scores(PARAMETERS, usual, 2)[Check.IMAGE_FROZEN] >= 1.0

    def marker(area, hue, u=160.0, confidence=0.7):
        pixels = np.array([u, 120.0, area, confidence])
        found = marker_scores(PARAMETERS, pixels, hue, (320, 240), True)
        return {check for check, score in found.items() if score >= 1.0}

    assert marker(900.0, 910.0) == set()
    assert marker(900.0, 500.0) == {Check.MARKER_DOUBTFUL}
    assert marker(900.0, 910.0, confidence=0.4) == {Check.MARKER_DOUBTFUL}
    assert marker(900.0, 1700.0) == {Check.MARKER_SECOND}
    # Off the middle the robot's own arm may hide it.
    assert marker(900.0, 500.0, u=60.0) == set()


def test_every_reason_is_told_with_its_joint():
    assert set(REASONS) == set(Check)
    joints = ("shoulder", "elbow")
    assert reason(Check.ANGLE_JUMP, 1, joints) == "angle reading jumps (elbow)"
    told = reason(Check.PRESSURE_STUCK, 3, joints)
    assert told == "pressure reading does not change (elbow, chamber b)"
    assert reason(Check.TICK_LATE, 0, joints) == "commands come late"


def test_thresholds_out_of_range_are_named():
    with pytest.raises(InputError, match=r"mine\.tracking is -1"):
        SupervisorParameters(tracking=-1.0).check("mine")
