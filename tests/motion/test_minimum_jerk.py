"""The blend from rest to rest."""

import numpy as np

from drake_affetto.motion.minimum_jerk import minimum_jerk


def test_minimum_jerk_rests_at_both_ends():
    s = np.linspace(-0.5, 1.5, 2001)
    x = minimum_jerk(s)
    assert np.all(x[s <= 0] == 0.0)
    np.testing.assert_allclose(x[s >= 1], 1.0)
    assert np.all(np.diff(x) >= -1e-15)
    for edge in (0.0, 1.0):
        h = 1e-4
        y = minimum_jerk(np.array([edge - h, edge, edge + h]))
        assert abs(y[2] - y[0]) / (2 * h) < 1e-6
