"""Gains of a trial, from the factors that the search gives."""

import numpy as np

from drake_affetto.control.pidf import load_control
from drake_affetto.tuning.plan import START_FILE
from drake_affetto.tuning.search import scaled_gains


def test_factors_multiply_the_start():
    names = ["waist_yaw", "right_elbow_flexion"]
    start = load_control(START_FILE).for_joints(names)
    gains = scaled_gains(start, names, {"right_elbow_flexion.kD": 2.0})
    expected = start.to_array()
    expected[2, 1] *= 2.0
    np.testing.assert_array_equal(gains.to_array(), expected)
