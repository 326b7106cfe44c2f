"""A box of movements holds what was taught."""

import numpy as np
import pytest

from drake_affetto.common.errors import InputError
from drake_affetto.envs.movements import MovementSpace


@pytest.fixture
def theta():
    """Lessons that differ in two directions alone."""
    rng = np.random.default_rng(0)
    return 3.0 + rng.normal(size=(9, 2)) @ rng.normal(size=(2, 30))


@pytest.mark.parametrize("directions", [2, None])
def test_the_box_holds_all_lessons(theta, directions):
    space = MovementSpace(theta, directions)
    assert space.share == pytest.approx(1.0)
    for each in theta:
        action, *_ = np.linalg.lstsq(
            space.directions.T, each - space.mean, rcond=None
        )
        assert np.abs(action).max() <= 0.8 + 1e-9
        np.testing.assert_allclose(space.theta(action), each)


def test_directions_are_orthogonal_and_the_first_explains_most(theta):
    space = MovementSpace(theta, 2)
    assert space.directions[0] @ space.directions[1] == pytest.approx(0.0)
    one = MovementSpace(theta, 1)
    assert 0.5 < one.share < 1.0
    np.testing.assert_allclose(one.directions, space.directions[:1])


@pytest.mark.parametrize(
    ("action", "said"),
    [
        ([0.0], r"action is an array of shape \(1,\).*\(2,\)"),
        ([0.0, np.nan], r"action\[1\] is nan"),
        ([0.0, 1.5], r"action\[1\] is 1.5, expected a number from -1 to 1"),
        ("left", "action is no array"),
    ],
)
def test_other_actions_are_refused(theta, action, said):
    with pytest.raises(InputError, match=said):
        MovementSpace(theta, 2).theta(action)


def test_more_directions_than_lessons_are_refused(theta):
    with pytest.raises(InputError, match="directions is 9"):
        MovementSpace(theta, 9)
