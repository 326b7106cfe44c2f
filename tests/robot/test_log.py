"""Reading the robot's logs, and the errors of a bad one."""

from pathlib import Path

import numpy as np
import pytest

from drake_affetto.common.errors import InputError
from drake_affetto.robot.log import read_log
from support.robot_bench import (
    CONTROLLER,
    JOINT,
    make_log,
    make_problem,
    true_values,
    write_csv,
)

LOGS = Path(__file__).parents[2].parent / "shared/data/affetto-logs"


@pytest.fixture(scope="module")
def invented():
    problem = make_problem()
    return make_log(problem, true_values(problem), seconds=3.0)


def spoil(name, row, value):
    def change(columns):
        columns[name][row] = value

    return change


def drop(columns):
    del columns["rpb5"]


def still(columns):
    columns["rq5"][:] = 12.0


def led(columns):
    columns["ca5"][:] = 0.0
    columns["cb5"][:] = 0.0


def cut(columns):
    for name in columns:
        columns[name] = columns[name][:20]


def test_a_log_comes_back_as_it_was_written(tmp_path, invented):
    log = read_log(write_csv(tmp_path / "run.csv", invented), JOINT, CONTROLLER)
    assert log.name == "run"
    for name in ("t", "q", "p_a", "p_b", "c_a", "c_b", "q_des", "dq_des"):
        np.testing.assert_allclose(getattr(log, name), getattr(invented, name))


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (drop, "no column rpb5"),
        (spoil("rq5", 7, np.nan), r"column rq5 is nan in row 8"),
        (spoil("ca5", 0, np.inf), r"column ca5 is inf in row 1"),
        (spoil("t", 10, 0.1), "time does not increase from row 10"),
        (still, "does not move"),
        (led, "led by hand"),
        (cut, "at least 2 s"),
    ],
)
def test_what_is_wrong_with_a_log_is_named(tmp_path, invented, change, message):
    path = write_csv(tmp_path / "bad.csv", invented, change=change)
    with pytest.raises(InputError, match=message) as caught:
        read_log(path, JOINT, CONTROLLER)
    assert "bad.csv" in str(caught.value)


def test_files_that_are_no_logs_are_named(tmp_path):
    with pytest.raises(InputError, match=r"nowhere\.csv"):
        read_log(tmp_path / "nowhere.csv", JOINT, CONTROLLER)
    empty = tmp_path / "empty.csv"
    empty.write_text("")
    with pytest.raises(InputError, match="no column t"):
        read_log(empty, JOINT, CONTROLLER)
    header = "t,rq5,rpa5,rpb5,ca5,cb5,qdes5\n"
    empty.write_text(header)
    with pytest.raises(InputError, match="fewer than two rows"):
        read_log(empty, JOINT, CONTROLLER)
    empty.write_text(header + "0,1,2,3,4,5,6\n0.03,1,x,3,4,5,6\n")
    with pytest.raises(InputError, match="line 3"):
        read_log(empty, JOINT, CONTROLLER)
    empty.write_bytes(b"\xff\xfe\x00t")
    with pytest.raises(InputError, match="UTF-8"):
        read_log(empty, JOINT, CONTROLLER)


@pytest.mark.skipif(not LOGS.is_dir(), reason="the robot's logs are not here")
def test_a_recording_led_by_hand_is_not_taken_for_a_run():
    with pytest.raises(InputError, match="led by hand"):
        read_log(LOGS / "kinesthetic_000.csv", 5, CONTROLLER)
    with pytest.raises(InputError, match="does not move"):
        read_log(LOGS / "motion_000.csv", 3, CONTROLLER)
