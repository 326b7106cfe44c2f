"""Looks into the mirror, through real images."""

import numpy as np
import pytest

from drake_affetto.calibration.config import load_self_calibration
from drake_affetto.calibration.ellipse import (
    expected_ellipse,
    shape_features,
)
from drake_affetto.calibration.hand import HandLook
from drake_affetto.experiments import trials
from drake_affetto.experiments.mirror_looks import way_to
from drake_affetto.experiments.mirror_setup import MirrorSetup
from drake_affetto.geometry.planes import reflect
from drake_affetto.scene.world import FramePose
from support.fake_mirrors import plane_of

SETTINGS = load_self_calibration()
MIRROR = {"translation": [0.345, 0.31, 0.172], "rotation": [102.0, 0.0, -16.0]}
# A posture with the hand before the mirror.
POSTURE = [0.0, 0.07, 0.12, 0.1, 0.3, 0.45, -0.2, 1.0]


@pytest.fixture(scope="module")
def robot():
    return MirrorSetup.of("mirror", "drumming").true_knowledge()


def hand_look(posture, seed=1):
    spec = trials.hand_look(
        "mirror", SETTINGS.hand.aside, seed, posture, SETTINGS.hand.blob
    )
    return trials.run_trial(trials.at_mirror(spec, FramePose(**MIRROR)))


def test_the_way_rests_at_the_posture():
    start, there = np.zeros(2), np.array([1.0, -0.5])
    t, q = way_to(start, there, 3.0)
    assert t[-1] == 3.0
    np.testing.assert_allclose(q[[0, -1]], [start, start], atol=1e-12)
    rest = (t >= 0.43 * 3.0) & (t <= 0.71 * 3.0)
    np.testing.assert_allclose(q[rest], np.tile(there, (rest.sum(), 1)))
    assert np.abs(np.diff(q, axis=0)).max() < 0.06


def test_the_hand_is_seen_where_geometry_says(robot):
    found = hand_look(POSTURE)
    look = HandLook(np.array(found.readings), np.array(found.pixel))
    np.testing.assert_allclose(look.readings, POSTURE, atol=0.06)
    image = reflect(
        plane_of(MIRROR), robot.eye_position, robot.hand(look.readings)
    )
    uv = robot.pixels(robot.eye(look.readings), image)
    assert np.linalg.norm(look.pixel - uv) < 1.5
    assert found.area > 50.0


def test_a_hand_out_of_the_mirror_is_not_seen():
    hanging = [*POSTURE[:3], 0.1, 1.6, 0.0, 0.0, 0.2]
    assert hand_look(hanging).pixel is None


def test_the_ellipse_is_that_of_geometry(robot):
    xy = np.array([0.25, -0.1])
    spec = trials.at_mirror(
        trials.ellipse_look("mirror", xy, 3), FramePose(**MIRROR)
    )
    found = trials.run_trial(spec)
    assert found.found
    center, moments = expected_ellipse(
        robot,
        plane_of(MIRROR),
        robot.eye_position,
        xy,
        SETTINGS.ellipse.blur,
    )
    seen = robot.calibration.pixels(np.array(found.tau))
    assert np.linalg.norm(seen - center) < 1.5
    np.testing.assert_allclose(
        shape_features(np.array(found.moments)),
        shape_features(moments),
        atol=0.2,
    )
    # Without a mirror's pose it is the scenario's again.
    plain = trials.run_trial(trials.look("mirror", xy, 3))
    assert np.linalg.norm(np.subtract(plain.tau, found.tau)) > 0.02


def test_the_marker_on_the_hand_touches_nothing():
    """A visual alone: no other contact geometry than before."""
    station = trials.runner("mirror").station
    inspector = station.scene_graph.model_inspector()
    plant = station.plant
    frame = plant.GetBodyFrameIdOrThrow(
        plant.GetBodyByName("right_hand").index()
    )
    from pydrake.geometry import Role

    touching = [
        inspector.GetName(each)
        for each in inspector.GetGeometries(frame, Role.kProximity)
    ]
    assert sorted(name.rpartition("::")[2] for name in touching) == [
        "core",
        "rubber",
    ]
    seen = [
        inspector.GetName(each).rpartition("::")[2]
        for each in inspector.GetGeometries(frame, Role.kPerception)
    ]
    assert "hand_marker" in seen
