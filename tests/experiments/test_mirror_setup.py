"""Mirrors that are set up, and what the robot knows of itself there."""

import dataclasses

import numpy as np
import pytest

from drake_affetto.calibration.plane import PlaneEstimate
from drake_affetto.common.errors import InputError
from drake_affetto.experiments.mirror_setup import (
    MirrorSetup,
    judge_plane,
    pose_matrix,
)
from drake_affetto.experiments.plans import SelfCalibrationPlan
from drake_affetto.experiments.view_maps import ViewDomain
from drake_affetto.scene import world
from support.fake_mirrors import plane_of, setup, truth

PLAN = SelfCalibrationPlan()


@pytest.fixture(scope="module")
def view():
    return ViewDomain.of("mirror")


def test_the_model_of_itself_is_the_plant(view):
    known = truth()
    station, context = view.station, view.context
    q = np.array([0.05, 0.1, 0.2, 0.1, 0.5, 0.4, -0.3, 1.2])
    station.set_posture(context, q)
    plant = station.plant
    frame = plant.GetFrameByName("hand_marker")
    p = frame.CalcPoseInWorld(plant.GetMyContextFromRoot(context))
    np.testing.assert_allclose(known.hand(q), p.translation(), atol=1e-12)
    np.testing.assert_allclose(
        known.eye(q),
        station.camera_pose(context).GetAsMatrix4(),
        atol=1e-12,
    )
    station.set_posture(context, station.start_posture)


def test_a_view_without_a_mirror_is_told():
    with pytest.raises(InputError, match="drumming has no mirror"):
        MirrorSetup.of("drumming", "drumming")
    with pytest.raises(InputError, match="does not look at the drum directly"):
        MirrorSetup.of("mirror", "mirror")


def test_the_mirror_can_be_put_elsewhere(view):
    pose = setup().nominal_pose()
    known = view.sight.mirrors[0].X_WM
    np.testing.assert_allclose(pose_matrix(pose), known, atol=1e-9)
    other = world.FramePose([0.33, 0.31, 0.18], [99.0, 0.0, -14.0])
    context = view.station.CreateDefaultContext()
    view.station.set_mirror_pose(context, other)
    camera = view.station.camera
    sub = view.station.GetSubsystemContext(camera, context)
    X_WM, width, _ = camera.mirrors(sub)[0]
    np.testing.assert_allclose(
        X_WM.GetAsMatrix4(), pose_matrix(other), atol=1e-9
    )
    assert width == pytest.approx(view.sight.mirrors[0].width)
    with pytest.raises(InputError, match=r"mirror\.translation\[0\] is 99"):
        view.station.set_mirror_pose(
            context, world.FramePose([99.0, 0.0, 0.0], [0.0, 0.0, 0.0])
        )


def test_mirrors_show_the_region_and_differ():
    drawn = [
        setup().draw_mirror(PLAN, np.random.default_rng(i)) for i in range(5)
    ]
    nominal = setup().nominal_pose()
    for pose in drawn:
        assert setup().seen_share(pose) >= PLAN.least_seen
        off = np.subtract(pose.translation, nominal.translation)
        assert np.abs(off).max() <= PLAN.translation
        turn = np.subtract(pose.rotation, nominal.rotation)
        assert np.abs(turn).max() <= PLAN.rotation
    assert len({tuple(pose.translation) for pose in drawn}) == 5


def test_a_mirror_out_of_view_is_told():
    plan = dataclasses.replace(PLAN, least_seen=1.0, rotation=0.0)
    far = dataclasses.replace(plan, translation=0.0)
    if setup().seen_share(setup().nominal_pose()) < 1.0:
        with pytest.raises(InputError, match="none shows 100% of the drum's"):
            setup().draw_mirror(far, np.random.default_rng(0))
    else:
        assert setup().draw_mirror(far, np.random.default_rng(0))


def test_a_mirror_is_turned_about_the_vertical():
    pose = setup().nominal_pose()
    after = setup().turned(PLAN, pose, np.random.default_rng(0))
    n, m = pose_matrix(pose)[:3, 2], pose_matrix(after)[:3, 2]
    assert m[2] == pytest.approx(n[2])
    azimuth = np.degrees(np.arctan2(m[1], m[0]) - np.arctan2(n[1], n[0]))
    assert abs(azimuth) == pytest.approx(PLAN.turned_by)


def test_a_plane_is_judged():
    pose = setup().nominal_pose()
    eye = truth().eye_position
    true = plane_of(dataclasses.asdict(pose))
    covariance = np.diag([0.01, 0.01, 0.003]) ** 2
    right = judge_plane(PlaneEstimate(true, covariance, eye), pose)
    assert right.angle == pytest.approx(0.0, abs=1e-6)
    assert right.offset == pytest.approx(0.0, abs=1e-9)
    assert right.covered
    wrong = judge_plane(
        PlaneEstimate(true + [0.0, 0.05, 0.0], covariance, eye), pose
    )
    assert wrong.angle == pytest.approx(0.05, abs=1e-6)
    assert not wrong.covered
    near = judge_plane(
        PlaneEstimate(true + [0.0, 0.0, 0.004], covariance, eye), pose
    )
    assert near.offset == pytest.approx(0.004)
