"""The control law, on the robot's own logs."""

from pathlib import Path

import pytest

from drake_affetto.robot.control_law import control_law_error
from drake_affetto.robot.log import read_log
from support.robot_bench import (
    CONTROLLER,
)

LOGS = Path(__file__).parents[2].parent / "shared/data/affetto-logs"


@pytest.mark.skipif(not LOGS.is_dir(), reason="the robot's logs are not here")
def test_the_robots_commands_are_those_of_its_law():
    for path in sorted(LOGS.glob("motion_*.csv")):
        log = read_log(path, 5, CONTROLLER)
        assert control_law_error(log, CONTROLLER.joints[5], CONTROLLER) < 1e-6
    # Other gains than the robot's are noticed.
    assert control_law_error(log, CONTROLLER.joints[2], CONTROLLER) > 5.0
