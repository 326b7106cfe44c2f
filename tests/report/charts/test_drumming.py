"""Charts of the drumming study."""

import dataclasses

import numpy as np

from drake_affetto.experiments.results import RewardRow
from drake_affetto.report.charts.drumming import (
    separation,
    task_space,
    workspace,
)
from support import report_data
from support.report_page import typed


def test_separation_counts_every_trial():
    results = typed(report_data.drum())
    rewards = [
        *results.rewards,
        RewardRow("random", 0, 1, (0.2, 0.0), -0.4, None),
        RewardRow("random", 0, 1, (0.2, 0.0), 1.0, 2.0),
    ]
    chart = separation(rewards, 0.15, 0.05)
    counts = np.sum([[row[1], row[2]] for row in chart.rows], axis=0)
    assert counts.sum() == len(rewards)
    hit = sum(r.impulse is not None and r.impulse > 0.05 for r in rewards)
    assert counts[0] == hit
    # The threshold is an edge: no bar lies on both sides of it.
    for bar in chart.figure.data:
        edges = np.array(bar.x) + 0.025
        assert np.min(np.abs(edges - 0.15)) < 1e-9


def test_tests_are_drawn_where_they_were():
    results = typed(report_data.drum(repeats=1))
    taught, tests = results.taught, results.final.positions
    for chart, across, along in (
        (
            workspace(taught, tests, 0.15),
            lambda row: 100 * row.xy[1],
            lambda row: 100 * row.xy[0],
        ),
        (
            task_space(taught, tests, 0.15),
            lambda row: np.degrees(row.tau[1]),
            lambda row: row.tau[0],
        ),
    ):
        np.testing.assert_allclose(
            chart.figure.data[0].x, [across(row) for row in taught]
        )
        hits = [row for row in tests if row.success]
        misses = [row for row in tests if not row.success]
        for name, rows in (("tested: hit", hits), ("tested: miss", misses)):
            (drawn,) = [
                t
                for t in chart.figure.data
                if t.name == name and t.x[0] is not None
            ]
            np.testing.assert_allclose(drawn.x, [across(r) for r in rows])
            np.testing.assert_allclose(drawn.y, [along(r) for r in rows])
            assert list(drawn.marker.color) == [r.reward for r in rows]
        # Left is left: both axes grow towards the robot's left.
        assert chart.figure.layout.xaxis.autorange == "reversed"
        assert len(chart.rows) == len(taught) + len(tests)
    taught[0] = dataclasses.replace(taught[0], tau=[0.1])
    assert task_space(taught, tests, 0.15) is None
