"""Which posture comes next."""

import dataclasses

import numpy as np
import pytest

from drake_affetto.calibration.hand import HandLook, estimate_from_hand
from drake_affetto.calibration.knowledge import in_image
from drake_affetto.calibration.plane import CalibrationFailure
from drake_affetto.calibration.postures import HandCalibration, PostureChooser
from support import mirror_robot
from support.mirror_robot import MIRROR, angle_between, sees_hand

TRUE = mirror_robot.robot()
SETTINGS = mirror_robot.settings()
EXACT = mirror_robot.exact()


def session(seed=0, **changes):
    config = dataclasses.replace(SETTINGS.hand, **changes)
    rng = np.random.default_rng(seed)
    return HandCalibration(TRUE, EXACT, SETTINGS.prior, config, rng)


def look_until_done(calibration, look):
    while not calibration.done:
        calibration.add(look(calibration.next_posture()))
    return calibration


def test_candidates_keep_to_the_box_and_out_of_the_direct_view():
    chooser = PostureChooser(
        TRUE, EXACT, SETTINGS.prior, SETTINGS.hand, np.random.default_rng(0)
    )
    hand = TRUE.hand(chooser.candidates)
    assert np.all(hand >= SETTINGS.hand.space_low)
    assert np.all(hand <= SETTINGS.hand.space_high)
    assert not in_image(TRUE, chooser.candidates, 20.0).any()
    # The trunk stands still, so that the view does.
    assert np.ptp(chooser.candidates[:, :2]) == 0.0


def test_a_box_out_of_reach_is_told():
    with pytest.raises(CalibrationFailure, match="no posture brings"):
        session(space_low=[0.9, 0.9, 0.9], space_high=[1.0, 1.0, 1.0])


def test_few_looks_are_enough_for_a_goal():
    done = look_until_done(
        session(angle_goal=0.01, distance_goal=0.005),
        lambda q: sees_hand(TRUE, MIRROR, q),
    )
    assert 6 <= len(done.looks) <= 9
    plane = done.estimate().plane
    assert angle_between(plane.parameters, MIRROR) < 0.2
    assert plane.angle_sd <= 0.01


def test_an_estimate_takes_in_each_look_and_is_made_once():
    calibration = session(looks=12, angle_goal=0.01, distance_goal=0.005)
    done = look_until_done(calibration, lambda q: sees_hand(TRUE, MIRROR, q))
    before = done.estimate()
    assert done.estimate() is before
    # The same posture once more, with the noise of another image.
    seen = next(look for look in done.looks if look.pixel is not None)
    done.add(HandLook(seen.readings, seen.pixel + 1.0))
    assert len(done.estimate().used) == len(before.used) + 1


def test_no_posture_is_tried_twice():
    done = look_until_done(
        session(angle_goal=0.0, looks=12), lambda q: sees_hand(TRUE, MIRROR, q)
    )
    tried = np.array([look.readings for look in done.looks])
    assert len(np.unique(tried, axis=0)) == 12


def test_the_chosen_posture_tells_more_than_most():
    rng = np.random.default_rng(0)
    chooser = PostureChooser(TRUE, EXACT, SETTINGS.prior, SETTINGS.hand, rng)
    looks = []
    for q in chooser.candidates:
        look = sees_hand(TRUE, MIRROR, q)
        if look.pixel is not None and len(looks) < 4:
            looks.append(look)

    def volume(more):
        config = dataclasses.replace(SETTINGS.hand, spread=0.0, angle_limit=1.0)
        found = estimate_from_hand(
            TRUE, EXACT, [*looks, more], SETTINGS.prior, config
        )
        return np.linalg.det(found.plane.covariance)

    chosen = volume(sees_hand(TRUE, MIRROR, chooser.next(looks)))
    others = [
        volume(look)
        for look in (
            sees_hand(TRUE, MIRROR, q) for q in chooser.candidates[::8]
        )
        if look.pixel is not None
    ]
    assert chosen <= np.quantile(others, 0.2)


def test_it_learns_where_the_glass_ends():
    """Little of the image is glass; most later looks are within it."""

    def glass(q):
        look = sees_hand(TRUE, MIRROR, q)
        if look.pixel is not None and look.pixel[0] < 112.0:
            return HandLook(q, None)
        return look

    seen, share = [], []
    for seed in range(4):
        calibration = session(seed, looks=14, angle_goal=0.0)
        done = look_until_done(calibration, glass)
        seen += [look.pixel is not None for look in done.looks[7:]]
        share += [glass(q).pixel is not None for q in done._chooser.candidates]
        plane = done.estimate().plane
        assert angle_between(plane.parameters, MIRROR) < 0.5
    assert np.mean(seen) >= np.mean(share) + 0.1


def test_looks_run_out_where_nothing_is_seen():
    done = look_until_done(session(looks=5), lambda q: HandLook(q, None))
    assert len(done.looks) == 5
    with pytest.raises(CalibrationFailure, match="at any of 5 postures"):
        done.estimate()
