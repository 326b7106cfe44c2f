"""The teacher's intended motion and force, without Drake."""

import dataclasses

from hypothesis import given, settings
from hypothesis import strategies as st
import numpy as np
import pytest

from drake_affetto.common.errors import InputError
from drake_affetto.teaching.stroke import (
    ClippedNormal,
    TeacherConfig,
    TeacherState,
    advance_teacher,
    draw_stroke,
    intended_position,
    tremor_force,
)

GRASP = np.array([0.2, -0.1, 0.15])
TOUCHING = np.array([0.25, -0.05, 0.06])


@given(seed=st.integers(0, 10_000), attempt=st.integers(0, 4))
@settings(max_examples=50, deadline=None)
def test_a_stroke_is_smooth_and_returns(seed, attempt):
    config = TeacherConfig()
    stroke = draw_stroke(config, TOUCHING, np.random.default_rng(seed), attempt)
    assert np.all(np.diff(stroke.times) > 0)
    t = np.linspace(0, config.duration, 3001)
    path = np.array([intended_position(stroke, GRASP, s) for s in t])
    np.testing.assert_allclose(path[0], GRASP)
    np.testing.assert_allclose(path[-1], GRASP, atol=1e-6)
    # Minimum jerk: no jump in position, no jump in velocity.
    velocity = np.gradient(path, t, axis=0)
    assert np.abs(np.diff(path, axis=0)).max() < 2e-3
    assert np.abs(np.diff(velocity, axis=0)).max() < 0.02
    # It presses the head, from above, where it aims.
    lowest = path[np.argmin(path[:, 2])]
    assert lowest[2] < TOUCHING[2]
    assert np.linalg.norm(lowest[:2] - TOUCHING[:2]) < 3 * config.aim_sd


def test_a_repeated_attempt_is_deeper_and_longer_not_faster():
    config = TeacherConfig()
    first, second = (
        draw_stroke(config, TOUCHING, np.random.default_rng(3), attempt)
        for attempt in (0, 1)
    )
    assert second.target[2] < first.target[2]
    assert np.diff(second.times)[1] > np.diff(first.times)[1]
    assert np.diff(second.times)[0] == pytest.approx(np.diff(first.times)[0])


def test_same_seed_same_stroke_other_seed_another():
    config = TeacherConfig()

    def draw(seed):
        return draw_stroke(config, TOUCHING, np.random.default_rng(seed))

    np.testing.assert_array_equal(draw(1).target, draw(1).target)
    np.testing.assert_array_equal(draw(1).tremor, draw(1).tremor)
    assert not np.array_equal(draw(1).target, draw(2).target)


def test_tremor_has_the_configured_size_and_lies_in_its_band():
    config = TeacherConfig(tremor=0.5)
    stroke = draw_stroke(config, TOUCHING, np.random.default_rng(0))
    t = np.arange(0, 40, 0.005)
    force = np.array([tremor_force(stroke, s) for s in t])
    np.testing.assert_allclose(force.std(axis=0), 0.5, rtol=0.05)
    power = np.abs(np.fft.rfft(force[:, 0])) ** 2
    frequency = np.fft.rfftfreq(len(t), 0.005)
    band = (frequency > 5.9) & (frequency < 12.1)
    assert power[band].sum() > 0.95 * power[1:].sum()


@given(
    palm=st.lists(st.floats(-1, 1), min_size=3, max_size=3),
    velocity=st.lists(st.floats(-3, 3), min_size=3, max_size=3),
)
@settings(max_examples=100, deadline=None)
def test_the_force_never_exceeds_the_teachers_strength(palm, velocity):
    config = TeacherConfig()
    state = TeacherState.at(GRASP)
    for _ in range(50):
        state = advance_teacher(
            config,
            state,
            TOUCHING,
            np.array(palm),
            np.array(velocity),
            np.zeros(3),
            0.005,
        )
        assert np.linalg.norm(state.force) <= config.max_force * (1 + 1e-12)


def test_intention_follows_a_critically_damped_filter():
    """Against the closed-form step response of (s/w + 1)^-2."""
    config = TeacherConfig()
    state = TeacherState.at(np.zeros(3))
    w = 2 * np.pi * config.bandwidth
    goal = np.array([0.1, 0.0, -0.2])
    for k in range(1, 60):
        state = advance_teacher(
            config, state, goal, np.zeros(3), np.zeros(3), np.zeros(3), 0.005
        )
        t = 0.005 * k
        expected = goal * (1 - (1 + w * t) * np.exp(-w * t))
        np.testing.assert_allclose(state.intention, expected, atol=1e-12)


def test_a_spring_alone_holds_a_static_error_that_watching_removes():
    """A mass on a spring of its own, pulled by the teacher."""

    def final_error(config):
        state, x, v = TeacherState.at(np.zeros(3)), np.zeros(3), np.zeros(3)
        goal = np.array([0.05, 0.0, 0.0])
        for _ in range(1200):
            state = advance_teacher(
                config, state, goal, x, v, np.zeros(3), 0.005
            )
            v = (v + 0.005 / 0.6 * (state.force - 200.0 * x)) / (1 + 0.02)
            x = x + 0.005 * v
        return abs(x[0] - goal[0])

    config = TeacherConfig()
    assert final_error(config) < 1e-3
    assert final_error(dataclasses.replace(config, watching=0.0)) > 5e-3


@pytest.mark.parametrize(
    ("field", "value"),
    [
        ("max_force", 0.0),
        ("bandwidth", float("nan")),
        ("gain_scale", 1.5),
        ("press_depth", ClippedNormal(-0.1, 0.0)),
    ],
)
def test_a_bad_configuration_is_named(field, value):
    config = dataclasses.replace(TeacherConfig(), **{field: value})
    with pytest.raises(InputError, match=f"teaching.{field}"):
        config.check("teaching")


def test_variability_scales_what_differs_and_nothing_else():
    config = TeacherConfig()
    assert config.varied(1.0) == config
    same, twice = config.varied(0.0), config.varied(2.0)
    touching = np.array([0.2, 0.0, 0.1])

    def strokes(teacher):
        return [
            draw_stroke(teacher, touching, np.random.default_rng(seed))
            for seed in range(20)
        ]

    assert np.ptp([s.target for s in strokes(same)], axis=0).max() == 0.0
    spread, wider = (
        np.std([s.target for s in strokes(teacher)], axis=0)
        for teacher in (config, twice)
    )
    np.testing.assert_allclose(wider, 2.0 * spread, rtol=1e-6)
    assert twice.max_force == config.max_force
    assert twice.lift.mean == config.lift.mean
