"""What the robot knows of itself, and corrections of it."""

import numpy as np
import pytest

from drake_affetto.calibration.knowledge import KnowledgeErrors, in_image
from drake_affetto.common.errors import InputError
from support import mirror_robot

ERRORS = KnowledgeErrors(0.01, 0.003, 0.004, 0.002, 0.005)


def test_errors_are_drawn_as_large_as_they_are_stated():
    rng = np.random.default_rng(0)
    drawn = np.array([ERRORS.draw(6, rng) for _ in range(4000)])
    # Clipped at two deviations.
    np.testing.assert_allclose(
        drawn.std(axis=0), 0.96 * ERRORS.deviation(6), rtol=0.06
    )
    assert not KnowledgeErrors().draw(6, rng).any()


def test_errors_out_of_range_are_told():
    with pytest.raises(InputError, match=r"knowledge\.focal is -1, expected"):
        KnowledgeErrors(focal=-1).check("knowledge")


def test_no_correction_changes_nothing():
    robot = mirror_robot.robot()
    assert robot.corrected(np.zeros(robot.corrections)) is robot


def test_a_correction_turns_moves_and_scales():
    robot = mirror_robot.robot()
    q = np.array([0.1, 0.05, 0.7, 0.2, -0.1, 0.5])
    correction = np.zeros(robot.corrections)
    correction[3:6] = [0.01, 0.02, 0.03]
    correction[6] = 0.1
    correction[7:10] = [0.004, 0.0, 0.0]
    changed = robot.corrected(correction)
    X = robot.eye(q)
    np.testing.assert_allclose(
        changed.eye(q)[:3, 3], X[:3, 3] + X[:3, :3] @ correction[3:6]
    )
    assert changed.camera.focal_x == pytest.approx(1.1 * robot.camera.focal_x)
    assert np.linalg.norm(changed.hand(q) - robot.hand(q)) == pytest.approx(
        0.004
    )


def test_joint_zeros_act_as_other_readings():
    robot = mirror_robot.robot()
    q = np.array([0.1, 0.05, 0.7, 0.2, -0.1, 0.5])
    zeros = np.array([0.02, -0.01, 0.03, 0.01, -0.02, 0.04])
    correction = np.concatenate([np.zeros(10), zeros])
    changed = robot.corrected(correction)
    np.testing.assert_allclose(changed.hand(q), robot.hand(q + zeros))
    np.testing.assert_allclose(changed.eye(q), robot.eye(q + zeros))


def test_the_optical_map_looks_with_the_same_eye():
    robot = mirror_robot.misjudged(mirror_robot.robot(), ERRORS, 3)
    optical = robot.optical_map()
    np.testing.assert_allclose(
        optical.target.camera_pose(optical.yaw),
        robot.eye(robot.posture),
        atol=1e-12,
    )
    for yaw in (-0.2, 0.4):
        posture = robot.source_posture.copy()
        posture[0] = yaw
        np.testing.assert_allclose(
            optical.source.camera_pose(yaw),
            robot._pose(robot.source_chain, posture),
            atol=1e-12,
        )


def test_the_hand_is_told_to_be_in_the_direct_view():
    robot = mirror_robot.robot()
    q = np.random.default_rng(0).uniform(-0.3, 1.5, (400, 6))
    q[:, :2] = 0.0
    inside = in_image(robot, q, 0.0)
    near = in_image(robot, q, 30.0)
    assert inside.sum() < near.sum()
    assert np.all(near[inside])
