"""What a log may hold; the logs' own tests show it on whole files."""

from pathlib import Path

import numpy as np
import pytest

from drake_affetto.common.errors import InputError
from drake_affetto.common.log_limits import (
    LogLimits,
    load_limits,
    require_between,
    require_times,
)

FILE = Path("run.csv")


def test_the_limits_that_come_with_the_package_are_the_defaults():
    assert load_limits() == LogLimits()


def test_the_robot_s_rates_and_a_few_late_rows_are_taken():
    for rate in (30.0, 100.0):
        t = np.arange(300) / rate
        require_times(FILE, t, LogLimits())
        require_times(FILE, t + 0.2 * (t > 1.0), LogLimits())


def test_the_first_value_that_cannot_be_is_named():
    data = {"t": np.arange(4.0), "q": np.array([1.0, 2.0, 9.0, np.nan])}
    with pytest.raises(InputError) as caught:
        require_between(FILE, "q", data, 0.0, 5.0, "%")
    assert str(caught.value) == (
        "run.csv: column q is 9 in row 3 (t = 2 s), expected a number from 0 "
        "to 5 (%)"
    )
    with pytest.raises(InputError, match=r"column q is nan in row 4"):
        require_between(FILE, "q", data, 0.0, 10.0, "%")


def test_limits_that_are_none_are_named(tmp_path):
    path = tmp_path / "limits.yaml"
    for text, told in (
        ("rate: [5.0, 1.0]", r"limits\.yaml\.rate is"),
        ("angle: [1.0]", r"limits\.yaml\.angle is"),
        ("longest_gap: 0.0", r"limits\.yaml\.longest_gap is"),
    ):
        path.write_text(text)
        with pytest.raises(InputError, match=told):
            load_limits(path)
