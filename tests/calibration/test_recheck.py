"""Looking at the hand again, to see whether the mirror has moved."""

import numpy as np
import pytest

from drake_affetto.calibration.config import WatchConfig
from drake_affetto.calibration.hand import HandLook
from drake_affetto.calibration.plane import PlaneEstimate
from drake_affetto.calibration.recheck import HandRecheck
from support import mirror_robot
from support.fake_mirrors import plane_of, setup, truth

CONFIG = WatchConfig()


def true_plane(turned_by: float = 0.0):
    pose = setup().nominal_pose()
    pose.rotation[2] += turned_by
    return plane_of(
        {"translation": pose.translation, "rotation": pose.rotation}
    )


@pytest.fixture(scope="module")
def seen():
    """Looks that show the hand, before the mirror is turned."""
    rng = np.random.default_rng(3)
    known, looks = truth(), []
    low, high = known.hand_chain.lower, known.hand_chain.upper
    for _ in range(4000):
        readings = known.posture.copy()
        readings[3:] = rng.uniform(low, high)[-5:]
        look = mirror_robot.sees_hand(known, true_plane(), readings, rng, 0.4)
        if look.pixel is not None:
            looks.append(look)
    assert len(looks) >= 5
    return looks[:8]


def recheck(seen):
    eye = truth().eye_position
    plane = PlaneEstimate(true_plane(), 1e-6 * np.eye(3), eye)
    return HandRecheck(truth(), plane, seen, CONFIG)


def run(one, turned_by, rng):
    while one.moved is None:
        one.add(
            mirror_robot.sees_hand(
                truth(), true_plane(turned_by), one.next_posture(), rng, 0.4
            )
        )
    return one.moved


def test_a_mirror_that_stays_is_left_alone(seen):
    for seed in range(20):
        one = recheck(seen)
        assert run(one, 0.0, np.random.default_rng(seed)) is False
        assert one.looks == 2


@pytest.mark.parametrize("turned_by", [-5.0, 5.0])
def test_a_turned_mirror_is_told(seen, turned_by):
    one = recheck(seen)
    assert run(one, turned_by, np.random.default_rng(0)) is True
    assert one.looks <= CONFIG.recheck_looks


def test_one_gross_outlier_does_not_decide(seen):
    one = recheck(seen)
    posture = one.next_posture()
    one.add(HandLook(posture, np.array([3.0, 3.0])))
    assert one.moved is None
    assert run(one, 0.0, np.random.default_rng(0)) is False
    assert one.looks == 3


def test_a_hand_that_does_not_show_speaks_against_the_mirror(seen):
    one = recheck(seen)
    for _ in range(2):
        one.add(HandLook(one.next_posture(), None))
    assert one.moved is True


def test_postures_are_those_of_looks_that_agreed(seen):
    one = recheck(seen)
    assert any(
        np.array_equal(one.next_posture(), look.readings) for look in seen
    )
    with pytest.raises(ValueError, match="looks at which the hand was seen"):
        recheck([])
