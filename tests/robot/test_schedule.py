"""Ticks in real time, on a clock that the test turns."""

import pytest

from drake_affetto.robot.schedule import Schedule


class Clock:
    def __init__(self):
        self.now = 100.0

    def __call__(self):
        return self.now


@pytest.fixture
def clock():
    return Clock()


def run(schedule, clock, delays):
    """Ticks that come as late as told."""
    for delay in delays:
        clock.now = max(clock.now, schedule.deadline + delay)
        schedule.tick()


def test_a_late_tick_does_not_shift_those_after_it(clock):
    schedule = Schedule(0.01, clock)
    schedule.start()
    run(schedule, clock, [0.0, 0.03, 0.0, 0.0, 0.0, 0.0] * 20)
    assert schedule.deadline == pytest.approx(100.0 + 121 * 0.01)
    assert schedule.rate() == pytest.approx(100.0)
    # The tick itself, and two that were due meanwhile.
    assert schedule.late == 20 * 3
    assert schedule.stalls == 0


def test_after_a_stall_the_schedule_begins_anew_without_a_burst(clock):
    schedule = Schedule(0.01, clock)
    schedule.start()
    run(schedule, clock, [0.0, 2.0])
    assert schedule.stalls == 1
    assert schedule.remaining() == pytest.approx(0.01)
    before = clock.now
    run(schedule, clock, [0.0] * 5)
    assert clock.now - before == pytest.approx(0.05)


def test_rate_and_deadlines_do_not_drift(clock):
    schedule = Schedule(1.0 / 30.0, clock)
    schedule.start()
    run(schedule, clock, [0.0] * 30_000)
    assert schedule.deadline == pytest.approx(100.0 + 30_001 / 30, abs=1e-9)
