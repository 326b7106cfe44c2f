"""The gaze servo's state machine on a joint with lag and friction."""

import dataclasses
import math

import numpy as np
import pytest

from drake_affetto.common.errors import InputError
from drake_affetto.perception import gaze
from drake_affetto.perception.gaze import (
    Gaze,
    GazeConfig,
    GazeMode,
    GazePhase,
    GazeTask,
)
from support.gaze_view import VIEW, x_img_at


class Joint:
    """A joint that follows like a pneumatic one: dead time, lag, stiction."""

    def __init__(self, q=0.0, breakaway=0.25):
        self.q, self.v, self.torque, self.sum = q, 0.0, 0.0, 0.0
        self.breakaway = breakaway
        self.commands = [q] * 50

    def step(self, command, dt=0.001):
        self.commands.append(command)
        error = self.commands.pop(0) - self.q
        self.sum = min(max(self.sum + error * dt, -0.1), 0.1)
        wanted = 12.0 * error + 2.0 * self.sum - 0.6 * self.v
        self.torque += dt * (wanted - self.torque) / 0.12
        net = self.torque - 0.8 * self.v
        if abs(self.v) < 1e-3 and abs(net) < self.breakaway:
            self.v = 0.0
            return
        coulomb = 0.65 * self.breakaway * math.tanh(self.v / 0.02)
        self.v += dt * (net - coulomb) / 0.06
        self.q += dt * self.v


@dataclasses.dataclass
class Outcome:
    """What one run of the servo gave."""

    phase: GazePhase
    tau: np.ndarray
    time: float
    error: float
    images: int
    commands: np.ndarray
    q: float


def simulate(
    marker,
    *,
    config=None,
    task=None,
    rate=10.0,
    latency=0.05,
    seed=0,
    duration=10.0,
    turns=1.25,
    noise=0.001,
    visible=lambda t, x: abs(x - 0.5) < 0.5,
    breakaway=0.25,
):
    """A marker that is centered at the yaw `marker`; 1 ms steps."""
    rng = np.random.default_rng(seed)
    servo = Gaze(config or GazeConfig(), VIEW)
    task = task or GazeTask()
    x, joint = servo.initial_state(), Joint(task.start_yaw, breakaway)
    waiting, commands, images = [], [], 0
    error, end = math.nan, math.nan
    for k in range(round(duration * 1000)):
        t = 0.001 * k
        if k % round(1000 / rate) == 0 and servo.wants_image(x, task):
            images += 1
            x_img = x_img_at(turns * (joint.q - marker))
            found = visible(t, x_img)
            blob = (
                np.array([x_img, 0.3, 1.0])
                if found
                else np.array([0.5, 0.5, 0.0])
            )
            blob[:2] += noise * rng.normal(size=2) * found
            measured = joint.q + 0.001 * rng.normal()
            waiting.append((t + latency, t, blob, measured))
        while waiting and waiting[0][0] <= t + 1e-9:
            _, t_image, blob, q = waiting.pop(0)
            servo.update(x, t, blob, q, t_image, task)
            if x[gaze.PHASE] >= GazePhase.SETTLED and math.isnan(end):
                end, error = t, blob[0] - 0.5
        commands.append(servo.yaw_command(x, t, task))
        joint.step(commands[-1])
    return Outcome(
        GazePhase(int(x[gaze.PHASE])),
        x[[gaze.TAU_1, gaze.TAU_2]],
        end,
        error,
        images,
        np.array(commands),
        joint.q,
    )


@pytest.mark.parametrize("marker", [-0.35, -0.12, 0.02, 0.2, 0.38])
def test_the_marker_is_centered_and_its_yaw_told(marker):
    runs = [simulate(marker, seed=s, duration=4.0) for s in range(3)]
    for run in runs:
        assert run.phase == GazePhase.SETTLED
        assert run.time < 2.7
        assert abs(run.error) <= 0.012
        assert run.tau[0] == pytest.approx(0.3, abs=0.003)
        assert run.tau[1] == pytest.approx(marker, abs=math.radians(0.3))
    yaws = [run.tau[1] for run in runs]
    assert np.ptp(yaws) < math.radians(0.3)


@pytest.mark.parametrize("latency", [0.0, 0.05, 0.15])
@pytest.mark.parametrize("turns", [0.7, 1.0, 1.6])
def test_latency_and_an_unknown_image_gain_do_not_upset_it(latency, turns):
    run = simulate(0.2, latency=latency, turns=turns, duration=4.0)
    assert run.phase == GazePhase.SETTLED
    assert run.tau[1] == pytest.approx(0.2, abs=math.radians(0.3))


def test_command_has_no_jumps_and_keeps_its_limits():
    config = GazeConfig(max_speed=0.6, yaw_min=-0.3, yaw_max=0.3)
    run = simulate(0.28, config=config, duration=5.0)
    assert np.abs(np.diff(run.commands)).max() <= 0.6 * 0.001 + 1e-12
    assert run.commands.max() <= 0.3


def test_once_settled_it_returns_and_wants_no_more_images():
    short = simulate(0.25, duration=3.0)
    long = simulate(0.25, duration=6.0)
    assert short.images == long.images
    assert long.commands[-1] == 0.0
    assert long.q == pytest.approx(0.0, abs=0.03)
    stays = simulate(0.25, config=GazeConfig(keep_yaw=True), duration=4.0)
    assert stays.commands[-1] == pytest.approx(0.25, abs=0.05)


def test_a_marker_out_of_view_is_searched_and_found():
    # In view only within 0.25 rad of it; it begins 0.45 rad away.
    run = simulate(
        -0.45,
        visible=lambda t, x: abs(x - 0.5) < 0.25,
        config=GazeConfig(yaw_min=-0.55, yaw_max=0.55),
    )
    assert run.phase == GazePhase.SETTLED
    assert run.tau[1] == pytest.approx(-0.45, abs=math.radians(0.3))


def test_no_marker_at_all_is_a_failure_and_no_task_parameter():
    run = simulate(0.0, visible=lambda t, x: False, duration=9.0)
    assert run.phase == GazePhase.FAILED
    np.testing.assert_array_equal(run.tau, 0.0)
    # Both ends were looked at before giving up, and it went home.
    assert run.commands.min() == pytest.approx(-0.5)
    assert run.commands.max() == pytest.approx(0.5)
    assert run.commands[-1] == 0.0


def test_a_marker_that_never_rests_is_a_failure_in_time():
    rng = np.random.default_rng(0)
    config = GazeConfig(timeout=3.0)
    servo, task = Gaze(config, VIEW), GazeTask()
    x = servo.initial_state()
    for k in range(60):
        t = 0.1 * k
        blob = np.array([rng.uniform(0.2, 0.8), 0.5, 1.0])
        servo.update(x, t, blob, 0.0, t, task)
    assert servo.is_failed(x, task)
    assert not servo.is_settled(x, task)


def test_a_few_missed_images_are_borne():
    run = simulate(
        0.2,
        visible=lambda t, x: not 0.35 < t < 0.55,
        duration=4.0,
    )
    assert run.phase == GazePhase.SETTLED
    assert run.tau[1] == pytest.approx(0.2, abs=math.radians(0.3))


def fixed(yaw, **options):
    task = GazeTask(mode=GazeMode.FIXED_YAW, fixed_yaw=yaw)
    return simulate(0.2, task=task, **options)


def test_from_a_fixed_yaw_the_image_is_the_task_parameter():
    run = fixed(0.35)
    assert run.phase == GazePhase.SETTLED
    # The joint comes to the yaw within the tolerance, so that x_img does.
    expected = x_img_at(1.25 * 0.15)
    assert run.tau[0] == pytest.approx(expected, abs=0.02)
    assert run.tau[1] == pytest.approx(0.3, abs=0.003)
    # It did not take the still image before the joint began to move.
    assert run.time > 0.5


def test_from_a_fixed_yaw_a_missing_marker_is_a_failure_not_a_search():
    run = fixed(0.35, visible=lambda t, x: False)
    assert run.phase == GazePhase.FAILED
    assert run.time < 4.0
    assert run.commands.max() < 0.55
    assert run.commands.min() >= 0.0


def test_disabled_it_does_nothing():
    task = GazeTask(enabled=False, start_yaw=0.1)
    run = simulate(0.2, task=task, duration=2.0)
    assert run.images == 0
    assert run.phase == GazePhase.START
    np.testing.assert_array_equal(run.commands, 0.1)


def test_ready_waits_for_the_command_to_be_back():
    servo, task = Gaze(GazeConfig(settled_frames=2), VIEW), GazeTask()
    x = servo.initial_state()
    # The marker is centered at 0.4 and the joint is there at once.
    for k in range(20):
        t = 0.1 * k
        q = servo.yaw_command(x, t, task)
        blob = np.array([x_img_at(q - 0.4), 0.3, 1.0])
        servo.update(x, t, blob, q, t, task)
        if servo.is_settled(x, task):
            break
    assert servo.is_settled(x, task)
    assert not servo.is_ready(x, t, task)
    away = abs(servo.yaw_command(x, t, task))
    home = t + away / GazeConfig().max_speed
    assert not servo.is_ready(x, home - 0.01, task)
    assert servo.is_ready(x, home + 0.01, task)


def test_task_survives_the_way_through_a_vector():
    task = GazeTask(True, GazeMode.FIXED_YAW, 0.3, -0.1)
    assert GazeTask.from_vector(task.to_vector()) == task


def test_bad_settings_are_named():
    with pytest.raises(InputError, match=r"gaze\.gain"):
        Gaze(GazeConfig(gain=0.0), VIEW)
    with pytest.raises(InputError, match=r"gaze\.yaw_max"):
        Gaze(GazeConfig(yaw_min=0.2, yaw_max=0.1), VIEW)
    with pytest.raises(InputError, match=r"gaze view\.focal"):
        Gaze(GazeConfig(), dataclasses.replace(VIEW, focal=0.0))
