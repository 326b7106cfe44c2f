"""Strokes by ear, one after another."""

from experiments.test_self_calibration import study
import numpy as np
import pytest

from drake_affetto.experiments.stroke_courses import (
    LATE,
    listen,
    sounded,
    strokes_result,
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


def test_what_was_not_struck_did_not_sound():
    assert not sounded(None)
