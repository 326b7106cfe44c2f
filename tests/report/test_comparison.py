"""Schemes of transfer and their tests."""

import numpy as np
import pytest

from drake_affetto.experiments.results import DemoMirror, DemoScheme
from drake_affetto.report import wording
from drake_affetto.report.charts.transfer import significance
from drake_affetto.report.comparison import SchemeComparison
from support.report_page import compare


def test_comparisons_are_read_in_both_directions():
    found = compare("transfer")
    there = found.compare("transfer", "unchanged", 3)
    back = found.compare("unchanged", "transfer", 3)
    assert there.difference == -back.difference > 0.0
    assert there.effect_size == -back.effect_size
    assert there.p == back.p
    chart = significance(found, 3)
    z = np.array(chart.figure.data[0].z, dtype=float)
    np.testing.assert_allclose(z + z.T, np.where(np.eye(8), np.nan, 0.0))
    row = wording.ordered(found.rates).index("transfer")
    assert z[row, 0] == pytest.approx(100 * there.difference, abs=0.06)


def demo_rate(hits, n):
    rewards = [0.5] * hits + [0.0] * (n - hits)
    mirror = DemoMirror(5, [], [], {"relearn": DemoScheme(hits / n, rewards)})
    return SchemeComparison.of_demo(mirror).rates["relearn"][5]


def test_intervals_of_the_demo_are_wilsons():
    # From the textbook's quadratic: |p - rate| = z sqrt(p (1 - p) / n).
    z = 1.959964
    for hits, n in ((0, 5), (1, 5), (4, 5), (5, 5), (7, 8)):
        found = demo_rate(hits, n)
        share = hits / n
        roots = np.roots([1 + z**2 / n, -(2 * share + z**2 / n), share**2])
        low, high = np.sort(roots.real)
        assert found.low == pytest.approx(low, abs=1e-7)
        assert found.high == pytest.approx(high, abs=1e-7)
        assert found.low <= found.mean <= found.high
