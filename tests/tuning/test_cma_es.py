"""The search, on costs that are known functions."""

import numpy as np
import pytest

from drake_affetto.tuning.cma_es import EvaluatedCandidate, JointwiseCmaEs


def search(joints=3, parameters=4, *, population=9, seed=5):
    return JointwiseCmaEs(
        joints,
        parameters,
        sigma=0.4,
        bound=2.0,
        population=population,
        seed=seed,
    )


def bowl(x, goal, scale):
    """Each joint's own quadratic, with a little of its neighbors'."""
    own = np.sum(scale * (x - goal) ** 2, axis=1)
    return own + 0.05 * np.mean(own)


def run_search(dut, goal, count, scale=1.0, history=None):
    history = {} if history is None else dict(history)
    for k in range(count):
        if k not in history:
            x = dut.ask(k, history)
            history[k] = EvaluatedCandidate(x, bowl(x, goal, scale))
    return history


def test_candidate_0_is_the_start():
    np.testing.assert_array_equal(search().ask(0, {}), np.zeros((3, 4)))


def test_all_joints_find_their_own_optimum():
    rng = np.random.default_rng(3)
    goal = rng.uniform(-1.2, 1.2, (8, 4))
    scale = np.array([1.0, 10.0, 0.3, 3.0])
    dut = search(joints=8)
    history = run_search(dut, goal, 30 * dut.generation_size + 1, scale)
    np.testing.assert_allclose(
        history[30 * dut.generation_size].x, goal, atol=0.05
    )


def test_one_search_of_everything_needs_many_more_trials():
    import cmaes

    rng = np.random.default_rng(4)
    goal = rng.uniform(-1.2, 1.2, (8, 4))
    dut = search(joints=8)
    count = 15 * dut.generation_size + 1
    ours = run_search(dut, goal, count)
    wide = cmaes.CMA(mean=np.zeros(32), sigma=0.4, seed=5)
    best, asked = np.inf, 0
    while asked < count:
        told = []
        for _ in range(wide.population_size):
            x = wide.ask()
            told.append((x, bowl(x.reshape(8, 4), goal, 1.0).mean()))
        asked += len(told)
        best = min(best, *(value for _, value in told))
        wide.tell(told)
    assert min(e.cost.mean() for e in ours.values()) < 0.2 * best


def test_candidates_stay_within_the_bounds():
    dut = search()
    history = run_search(dut, np.full((3, 4), 5.0), 60)
    x = np.array([e.x for e in history.values()])
    assert np.all(np.abs(x) <= 2.0)
    assert np.abs(x).max() > 1.5


def test_what_a_candidate_is_depends_on_earlier_generations_alone():
    goal = np.full((3, 4), 0.7)
    history = run_search(search(), goal, 50)
    again = search()
    # In any order, and after having been further already.
    for k in (41, 12, 33, 10, 5, 0, 49):
        np.testing.assert_array_equal(again.ask(k, history), history[k].x)
    earlier = {k: e for k, e in history.items() if k < 40}
    np.testing.assert_array_equal(search().ask(43, earlier), history[43].x)


def test_a_missing_evaluation_is_an_error():
    history = run_search(search(), np.zeros((3, 4)), 10)
    del history[4]
    with pytest.raises(KeyError):
        search().ask(10, history)


def test_seeds_differ():
    a, b = search(seed=1).ask(3, {}), search(seed=2).ask(3, {})
    assert np.abs(a - b).max() > 1e-3
    # And so do the joints of one candidate.
    assert np.abs(a[0] - a[1]).max() > 1e-3
