"""A synthetic robot and its log."""

import pytest

from support.robot_bench import make_log, make_problem, true_values


@pytest.fixture(scope="module")
def problem():
    return make_problem()


@pytest.fixture(scope="module")
def truth(problem):
    return true_values(problem)


@pytest.fixture(scope="module")
def log(problem, truth):
    return make_log(problem, truth, seed=1)
