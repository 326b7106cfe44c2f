"""Lessons are taught once, or come from a file."""

import numpy as np
import pytest

from drake_affetto.common.errors import InputError
from drake_affetto.common.output import STORE
from drake_affetto.envs import lessons as module
from drake_affetto.envs.lessons import load_lessons
from drake_affetto.runner.store import TrialStore
from drake_affetto.station.scenario import load_scenario
from drake_affetto.teaching.demonstrations import (
    Demonstration,
    write_demonstrations,
)
from support import fake_world


def test_lessons_are_taught_once(tmp_path, monkeypatch):
    monkeypatch.setenv("AFFETTO_CACHE", str(tmp_path / "new"))
    monkeypatch.setattr(module, "run_task", fake_world.run)
    first = load_lessons("drumming", 5)
    assert first.theta.shape == (5, fake_world.FEATURES)
    with TrialStore(tmp_path / "new" / STORE) as store:
        count = len(store)

    def never(spec):
        raise AssertionError("taught again")

    monkeypatch.setattr(module, "run_task", never)
    again = load_lessons("drumming", 5)
    np.testing.assert_array_equal(again.theta, first.theta)
    np.testing.assert_array_equal(again.prototypes, first.prototypes)
    # Another scenario has lessons of its own.
    with pytest.raises(AssertionError, match="taught again"):
        load_lessons("mirror", 5)
    with TrialStore(tmp_path / "new" / STORE) as store:
        assert len(store) == count


def make(**missing):
    t = np.linspace(0.0, 3.0, 4)
    values = {
        "theta": np.arange(120.0),
        "task_parameter": np.array([0.2, 0.1]),
        "prototype": np.ones((4, 5)),
    }
    names = missing.pop("names", load_scenario("drumming").active_joints)
    q = np.zeros((missing.pop("samples", 4), len(names)))
    return Demonstration(t[: len(q)], q, tuple(names), **values | missing)


def test_a_file_of_lessons_serves(tmp_path):
    path = tmp_path / "lessons.h5"
    other = make(theta=np.ones(120), seed=3)
    write_demonstrations(path, [make(), other, other])
    known = load_lessons("drumming", path)
    np.testing.assert_array_equal(known.theta, [np.arange(120), np.ones(120)])
    np.testing.assert_array_equal(known.tau, [[0.2, 0.1]] * 2)
    assert known.q.shape == (2, 4, 8)
    assert known.prototypes.shape == (2, 4, 5)


@pytest.mark.parametrize(
    ("some", "said"),
    [
        ([make(), make(theta=None)], "demonstration 1 has no theta"),
        ([make()], "expected 2 lessons"),
        ([make(), make(theta=np.ones(80))], "theta is an array of shape"),
        ([make(), make(names="abcdefgh")], "joint_names is .*'a', 'b'"),
        ([make(), make(samples=3)], "different sizes"),
        ([make(seed=1), make(seed=1)], "expected 2 lessons"),
    ],
)
def test_a_file_that_does_not_serve_is_told(tmp_path, some, said):
    path = tmp_path / "lessons.h5"
    write_demonstrations(path, some)
    with pytest.raises(InputError, match=rf"lessons\.h5.*{said}"):
        load_lessons("drumming", path)


def test_what_is_no_number_of_lessons_is_told(tmp_path):
    with pytest.raises(InputError, match="lessons is 1"):
        load_lessons("drumming", 1)
    with pytest.raises(InputError, match=r"none\.h5"):
        load_lessons("drumming", tmp_path / "none.h5")
