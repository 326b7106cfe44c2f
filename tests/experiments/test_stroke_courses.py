"""Strokes one after another: by ear, and watched."""

import dataclasses

from experiments.test_self_calibration import PLAN, study
import numpy as np
import pytest

from drake_affetto.experiments.self_calibration import Calibrated
from drake_affetto.experiments.stroke_courses import (
    LATE,
    listen,
    sounded,
    strokes_result,
    watch,
)
from support.fake_mirrors import FakeMirrors


@pytest.fixture(scope="module")
def world():
    return FakeMirrors()


@pytest.fixture(scope="module")
def made(world):
    return study(world)


@pytest.fixture(scope="module")
def ellipse(made):
    return made.by_ellipse()


def test_by_ear_it_comes_to_hit(made, ellipse):
    courses = {each.start: each for each in listen(made, ellipse)}
    assert set(courses) == set(LATE)
    for start, each in courses.items():
        low, high = LATE[start]
        result = strokes_result(each)
        assert len(result.by_stroke) == high
        assert (result.late_from, result.late_to) == (low, high)
        # Never worse than what it began with.
        assert result.late.mean >= result.chance.mean
    assert strokes_result(courses["ellipse"]).late.mean >= 0.9
    assert strokes_result(courses["prior"]).late.mean >= 0.75
    steps = [step for step, _ in courses["prior"].steps]
    assert steps == sorted(steps)
    # The belief shrinks.
    first, last = (courses["prior"].steps[i][1] for i in (0, -1))
    assert np.std(last[:, 0]) < 0.5 * np.std(first[:, 0])


def test_a_turned_mirror_is_noticed_and_found_again(made):
    mirrors = {each.number: each.mirror for each in made.repeats}
    result = watch(made, made.by_hand(mirrors))
    assert result.noticed.mean == 1.0
    assert all(3 <= delay <= 6 for delay in result.delays)
    assert result.false_alarms == 0
    assert result.quiet_strokes == 2 * PLAN.turned_after
    assert result.recovered.mean >= 0.9


def test_a_mirror_that_stays_raises_no_alarm():
    made = study(
        FakeMirrors(), dataclasses.replace(PLAN, turned_by=0.0, repeats=1)
    )
    mirrors = {each.number: each.mirror for each in made.repeats}
    result = watch(made, made.by_hand(mirrors))
    assert result.delays == [None]
    assert result.noticed.mean == 0.0
    assert result.recovered is None


def test_a_repeat_without_a_mirror_is_not_watched(made):
    lost = Calibrated(None, made.truth, None, failure="nothing is seen")
    found = made.by_hand({0: made.repeats[0].mirror}) | {1: lost}
    assert len(watch(made, found).delays) == 1


def test_what_was_not_struck_did_not_sound():
    assert not sounded(None)
