"""Noticing that the mirror has been moved."""

import numpy as np

from drake_affetto.calibration.config import WatchConfig
from drake_affetto.calibration.watch import StrokeWatch


def run(chances, heard):
    watch = StrokeWatch(WatchConfig())
    for number, (chance, one) in enumerate(zip(chances, heard, strict=True)):
        if watch.add(chance, one):
            return number + 1
    return None


def test_strokes_that_keep_missing_are_noticed():
    assert run(6 * [0.92], 6 * [False]) in (3, 4)


def test_strokes_of_which_little_was_expected_say_little():
    assert run(12 * [0.3], 12 * [False]) is None


def test_it_begins_anew():
    watch = StrokeWatch(WatchConfig())
    watch.add(0.9, False)
    assert watch.sum > 0.0
    watch.reset()
    assert watch.sum == 0.0


def test_false_alarms_are_rare_and_turns_are_noticed():
    rng = np.random.default_rng(0)
    strokes, alarms = 40_000, 0
    watch = StrokeWatch(WatchConfig())
    for heard in rng.random(strokes) < 0.93:
        if watch.add(0.92, bool(heard)):
            alarms += 1
            watch.reset()
    assert alarms <= strokes / 200
    delays = [run(6 * [0.92], rng.random(6) < 0.15) for _ in range(500)]
    assert np.mean([delay is not None for delay in delays]) >= 0.9


def test_drums_where_none_can_stand_are_noticed():
    watch = StrokeWatch(WatchConfig())
    assert not watch.see(False)
    assert watch.see(False)
    watch.reset()
    for _ in range(50):
        assert not watch.see(True)
    assert watch.sum == 0.0


def test_what_is_seen_and_heard_raises_few_false_alarms():
    rng = np.random.default_rng(1)
    strokes, alarms = 20_000, 0
    watch = StrokeWatch(WatchConfig())
    for seen, heard in rng.random((strokes, 2)) < (0.98, 0.93):
        alarm = watch.see(bool(seen))
        alarm |= watch.add(0.92, bool(heard))
        if alarm:
            alarms += 1
            watch.reset()
    assert alarms <= strokes / 200
