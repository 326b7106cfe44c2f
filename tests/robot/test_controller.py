"""The robot's own controller."""

import pytest

from drake_affetto.common.errors import InputError
from drake_affetto.robot.controller import require_joint
from support.robot_bench import (
    CONTROLLER,
)


def test_joints_that_are_not_there_are_named():
    assert require_joint(CONTROLLER, 5).name == "left_elbow_flexion"
    for joint in (-1, 13):
        with pytest.raises(InputError, match="joint is"):
            require_joint(CONTROLLER, joint)
