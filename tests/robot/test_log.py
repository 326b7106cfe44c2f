"""Reading the robot's logs, and the errors of a bad one."""

from pathlib import Path

import numpy as np
import pytest

from drake_affetto.common.errors import InputError
from drake_affetto.common.log_limits import LogLimits
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


def times(change):
    def replace(columns):
        columns["t"] = change(columns["t"])

    return replace


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
        (spoil("rq5", 7, -32768), r"column rq5 is -32768 in row 8 .*-20 to"),
        (spoil("rpa5", 3, 4e5), r"column rpa5 is 400000 in row 4 .*kPa gauge"),
        (spoil("cb5", 3, 256.0), r"column cb5 is 256 in row 4 .*from 0 to"),
        (spoil("qdes5", 3, 1e6), r"column qdes5 is 1e\+06 in row 4"),
        (spoil("t", 5, np.nan), r"column t is nan in row 6"),
        (times(lambda t: 1e3 * t), "0.03 rows a second.*is the time in ms"),
        (times(lambda t: 1e6 * t), "3e-05 rows a second.*is the time in µs"),
        (times(lambda t: t / 1e3), "3e.04 rows a second, expected 5 to 1000"),
        (
            times(lambda t: t + 5.0 * (t > 1.0)),
            r"5.03 s are missing in column t between row 31 .* and row 32",
        ),
        (times(lambda t: t - 0.5 * (t > 1.0)), "not increase from row 31"),
        (times(lambda t: np.minimum(t, 2.5)), "time does not increase from"),
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


def test_a_byte_order_mark_is_no_part_of_the_first_name(tmp_path, invented):
    path = write_csv(tmp_path / "run.csv", invented)
    plain = read_log(path, JOINT, CONTROLLER)
    path.write_bytes(b"\xef\xbb\xbf" + path.read_bytes())
    marked = read_log(path, JOINT, CONTROLLER)
    np.testing.assert_array_equal(marked.q, plain.q)


def test_rows_may_be_late_as_far_as_the_limits_say(tmp_path, invented):
    path = write_csv(
        tmp_path / "run.csv", invented, change=times(lambda t: t + (t > 1.0))
    )
    limits = LogLimits(longest_gap=1.1)
    assert read_log(path, JOINT, CONTROLLER, limits=limits).t.size
    with pytest.raises(InputError, match="are missing"):
        read_log(path, JOINT, CONTROLLER)
