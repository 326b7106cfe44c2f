"""Intervals and tests, against scipy and against their promises."""

import itertools
import warnings

import numpy as np
import pytest
from scipy import stats

from drake_affetto.common.errors import InputError
from drake_affetto.experiments.results import StrikeResult
from drake_affetto.experiments.statistics import (
    cohens_h,
    compare,
    compare_landing,
    holm,
    paired_p,
    scheme_cell,
    success_rate,
)


@pytest.mark.parametrize("hits", [0, 1, 7, 10])
def test_one_repeat_is_wilsons_interval(hits):
    row = np.arange(10) < hits
    found = success_rate([row])
    wilson = stats.binomtest(hits, 10).proportion_ci(method="wilson")
    assert found.mean == hits / 10
    assert found.low == pytest.approx(wilson.low, abs=1e-12)
    assert found.high == pytest.approx(wilson.high, abs=1e-12)


def test_repeats_that_differ_count_for_less():
    rng = np.random.default_rng(0)
    even = np.tile([1, 1, 0, 0, 1, 0], (10, 1))
    uneven = np.array([[i % 2] * 6 for i in range(10)])
    assert even.mean() == uneven.mean()
    narrow, wide = success_rate(even), success_rate(uneven)
    assert wide.high - wide.low > 1.8 * (narrow.high - narrow.low)
    # All trials of a repeat alike: as many as there are repeats, in the main.
    ten = success_rate(uneven[:, :1])
    assert wide.low == pytest.approx(ten.low, abs=0.02)
    # It covers what it should, also where repeats differ.
    covered = 0
    for _ in range(400):
        rates = rng.beta(3, 1.5, size=(10, 1))
        found = success_rate(rng.random((10, 6)) < rates)
        covered += found.low <= 2 / 3 <= found.high
    assert covered / 400 > 0.9


def test_no_trial_is_an_error():
    with pytest.raises(InputError, match="successes"):
        success_rate(np.zeros((0, 3)))
    with pytest.raises(InputError, match="first"):
        paired_p([], [])


def test_paired_p_is_the_share_of_sign_changes():
    first, second = [6, 5, 6, 4, 6], [3, 5, 2, 1, 6]
    d = np.subtract(first, second)
    means = [
        abs(np.mean(d * signs))
        for signs in itertools.product([-1, 1], repeat=len(d))
    ]
    by_hand = np.mean(np.array(means) >= abs(d.mean()) - 1e-12)
    assert paired_p(first, second) == pytest.approx(by_hand)
    assert paired_p(second, first) == pytest.approx(by_hand)
    assert paired_p(first, first) == 1.0
    assert paired_p([6], [1]) == 1.0
    assert paired_p([6] * 10, [2] * 10) == pytest.approx(2 / 1024)


def test_paired_p_is_rarely_small_by_chance():
    rng = np.random.default_rng(1)
    p = [
        paired_p(*rng.binomial(6, rng.beta(3, 1, size=8), size=(2, 8)))
        for _ in range(300)
    ]
    assert np.mean(np.array(p) <= 0.05) <= 0.08


def test_holm_corrects_step_by_step():
    assert holm([0.01, 0.04, 0.03]) == pytest.approx([0.03, 0.06, 0.06])
    assert holm([0.5, 0.9]) == pytest.approx([1.0, 1.0])
    assert holm([]) == []


def test_effect_size_has_a_sign_and_limits():
    assert cohens_h(1.0, 0.0) == pytest.approx(np.pi)
    assert cohens_h(0.3, 0.3) == 0.0
    assert cohens_h(0.2, 0.5) == -cohens_h(0.5, 0.2)


def test_compare_has_every_pair_once():
    rng = np.random.default_rng(2)
    better = rng.random((10, 6)) < 0.97
    worse = rng.random((10, 6)) < 0.2
    rows = compare({"x": better, "y": worse, "z": worse}, 3)
    assert [(r.a, r.b) for r in rows] == [
        ("x", "y"),
        ("x", "z"),
        ("y", "z"),
    ]
    for row in rows[:2]:
        assert row.difference > 0.5
        assert row.effect_size > 0.8
        assert row.p <= row.p_corrected < 0.05
    assert rows[2].difference == 0.0
    assert rows[2].p_corrected == 1.0
    assert {r.samples for r in rows} == {3}


@pytest.mark.parametrize("outcome", [0.0, 1.0])
def test_trials_of_a_repeat_belong_together_also_where_all_went_alike(outcome):
    together = success_rate(np.full((10, 8), outcome))
    alone = success_rate(np.full((80, 1), outcome))
    width, narrow = (r.high - r.low for r in (together, alone))
    assert together.mean == alone.mean == outcome
    assert 1.3 * narrow < width
    # Not as little as if each repeat were a single trial.
    assert width < success_rate(np.full((10, 1), outcome)).high - (
        success_rate(np.full((10, 1), outcome)).low
    )


def test_a_repeat_without_a_stroke_has_no_landing():
    nothing = np.full((1, 4), np.nan)
    near, far = (np.full((3, 4), d) for d in (0.01, 0.04))
    landings = {
        "near": np.vstack([near, nothing]),
        "far": np.vstack([nothing, far]),
    }
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        row = compare_landing(landings, ("near", "far"), 3)
        # Only two repeats have both.
        assert row.difference == pytest.approx(-0.03)
        none = {"near": nothing, "far": nothing}
        assert compare_landing(none, ("near", "far"), 3).p is None


def strike(reward: float, landing: float, graze: bool) -> StrikeResult:
    return StrikeResult(
        reward, reward > 0.15, 1.0, 0.1, landing, graze, np.zeros(3)
    )


def test_a_cell_counts_what_was_not_struck_as_missed():
    cell = scheme_cell(
        [
            [strike(0.4, 0.01, False), strike(0.2, 0.05, True)],
            [strike(0.1, 0.09, False), None],
        ]
    )
    assert cell.success_rate == success_rate([[1, 1], [0, 0]])
    assert cell.per_repeat == [1.0, 0.0]
    assert cell.rewards == [0.4, 0.2, 0.1, 0.0]
    assert cell.landing == [0.01, 0.05, 0.09, None]
    assert cell.grazes == 0.25


def test_trials_that_are_not_valid_count_neither_way():
    nan = np.nan
    found = success_rate([[1.0, nan, 0.0], [nan, 1.0, 1.0], [nan, nan, nan]])
    without = success_rate([[1.0, 0.0], [1.0, 1.0]])
    assert found == without
    with pytest.raises(InputError, match="none that is valid"):
        success_rate([[nan, nan]])
    # A pair is compared only where both are valid.
    a, b = (
        np.array([[1.0, nan], [1.0, 0.0]]),
        np.array([[0.0, 1.0], [1.0, nan]]),
    )
    (row,) = compare({"a": a, "b": b}, 3)
    assert row.difference == pytest.approx(0.25)
