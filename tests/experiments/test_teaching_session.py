"""Which files a teaching session goes on with."""

import numpy as np
import pytest

from drake_affetto.common.errors import InputError
from drake_affetto.experiments.plans import TeachPlan
from drake_affetto.experiments.teaching_session import TeachingSession
from drake_affetto.scene.world import ACTIVE_JOINTS
from drake_affetto.teaching.demonstrations import (
    Demonstration,
    append_demonstration,
)


def session(path, scenario="drumming"):
    return TeachingSession(TeachPlan(6, scenario, 0), path)


def test_files_of_others_are_refused(tmp_path, monkeypatch):
    path = tmp_path / "taught.h5"

    def holds(**changes):
        path.unlink(missing_ok=True)
        values = {
            "t": [0.0, 1.0],
            "q": np.zeros((2, len(ACTIVE_JOINTS))),
            "joint_names": list(ACTIVE_JOINTS),
            "theta": np.zeros(15 * len(ACTIVE_JOINTS)),
            "task_parameter": [0.5, 0.0],
            "prototype": np.zeros((2, 3)),
            "drum_xy": [0.2, -0.1],
            "scenario": "drumming",
            "seed": 0,
        }
        append_demonstration(path, Demonstration(**{**values, **changes}))

    holds(version="0.0.0")
    with pytest.raises(InputError, match=r"version 0\.0\.0, not"):
        session(path)
    holds(seed=None)
    with pytest.raises(InputError, match="seed None, not 0"):
        session(path)
    holds()
    with pytest.raises(InputError, match="other positions"):
        session(path)
    path.write_text("t, q0\n")
    with pytest.raises(InputError, match="no HDF5 file"):
        session(path)
    with pytest.raises(InputError, match="not a folder"):
        session(tmp_path)


def test_a_robot_that_does_not_move_by_itself_cannot_be_taught(tmp_path):
    path = tmp_path / "mine.yaml"
    path.write_text("extends: drumming\nmotion_source: external\n")
    with pytest.raises(InputError, match="motion_source"):
        session(tmp_path / "t.h5", str(path))
