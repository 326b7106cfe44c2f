"""Made-up impacts against the mechanics that they stand for."""

import numpy as np
import pytest

from drake_affetto.common.errors import InputError
from drake_affetto.sound.impact import Hand, contact_force, stroke


def test_a_stroke_goes_down_and_up_again():
    t = np.linspace(0.0, 3.0, 3001)
    path = stroke(t, 0.5, 0.08, 0.02, 0.4, 0.3, 0.6)
    assert path[0] == path[499] == 0.08
    assert path.min() == pytest.approx(-0.02)
    bottom = t[np.isclose(path, -0.02)]
    assert bottom[0] == pytest.approx(0.9, abs=2e-3)
    assert bottom[-1] == pytest.approx(1.2, abs=2e-3)
    np.testing.assert_allclose(path[t >= 1.8], 0.08)


def test_a_hand_at_rest_presses_as_two_springs_do():
    t = np.arange(0.0, 6.0, 1e-3)
    hand = Hand(arm_stiffness=300.0, stiffness=600.0)
    force = contact_force(t, stroke(t, 0.2, 0.05, 0.03, 1.0, 9.0, 1.0), hand)
    assert force[-1] == pytest.approx(0.03 / (1 / 300.0 + 1 / 600.0), rel=1e-3)
    assert force.min() >= 0.0


def test_a_slow_enough_press_follows_the_target():
    t = np.arange(0.0, 20.0, 1e-3)
    path = np.interp(t, [0.0, 20.0], [0.01, -0.01])
    force = contact_force(t, path, Hand(arm_stiffness=200.0, stiffness=600.0))
    expected = np.maximum(-path, 0.0) * 150.0
    np.testing.assert_allclose(force, expected, atol=0.05)


def test_columns_are_hands_of_their_own():
    t = np.arange(0.0, 2.0, 1e-3)
    paths = np.stack(
        [stroke(t, 0.2, 0.05, d, 0.4, 0.1, 0.4) for d in (0.01, -0.01, 0.02)],
        axis=1,
    )
    hands = [Hand(mass=m) for m in (0.2, 0.3, 0.5)]
    together = contact_force(t, paths, hands)
    for i, hand in enumerate(hands):
        alone = contact_force(t, paths[:, i], hand)
        assert np.array_equal(together[:, i], alone)
    assert not together[:, 1].any()
    assert together[:, 2].max() > together[:, 0].max() > 0.0


def test_dissipation_takes_energy():
    t = np.arange(0.0, 2.0, 1e-4)
    path = stroke(t, 0.2, 0.05, 0.02, 0.3, 0.0, 0.3)
    work = []
    for dissipation in (0.0, 1.0, 3.0):
        force = contact_force(t, path, Hand(dissipation=dissipation))
        touch = np.flatnonzero(force > 0.0)[0]
        work.append(np.diff(force[touch - 1 : touch + 20]).max())
    # It adds to the force while the hand comes in.
    assert work[0] < work[1] < work[2]


@pytest.mark.parametrize(
    ("target", "hand"),
    [
        (np.zeros(9), None),
        (np.zeros((10, 2, 2)), None),
        (np.zeros((10, 3)), [Hand(), Hand()]),
    ],
)
def test_shapes_that_do_not_fit(target, hand):
    with pytest.raises(InputError):
        contact_force(np.arange(10) * 1e-3, target, hand)
