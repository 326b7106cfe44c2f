"""The batched chain against Drake's own kinematics."""

import numpy as np
import pytest

from drake_affetto.common.errors import InputError
from drake_affetto.geometry.kinematics import solve_position
from drake_affetto.scene import world


@pytest.fixture(params=["right_palm", "eye_camera"])
def chain_and_frame(request, scene):
    chain = world.serial_chain(scene.plant, request.param)
    return chain, scene.plant.GetFrameByName(request.param)


def test_poses_agree_with_the_plant(scene, chain_and_frame):
    chain, frame = chain_and_frame
    rng = np.random.default_rng(0)
    q = rng.uniform(chain.lower, chain.upper, (5, len(chain.names)))
    poses = chain.pose(q)
    for one, X_WT in zip(q, poses, strict=True):
        world.set_posture(
            scene.plant,
            scene.context,
            dict(zip(chain.names, one, strict=True)),
        )
        expected = frame.CalcPoseInWorld(scene.context).GetAsMatrix4()
        np.testing.assert_allclose(X_WT, expected, atol=1e-12)


def test_jacobian_agrees_with_differences(chain_and_frame):
    chain, _ = chain_and_frame
    q = np.random.default_rng(1).uniform(
        chain.lower, chain.upper, (3, len(chain.names))
    )
    X, J = chain.position_jacobian(q)
    np.testing.assert_allclose(X, chain.pose(q))
    step = 1e-6
    for i in range(len(chain.names)):
        move = step * np.eye(len(chain.names))[i]
        slope = (chain.pose(q + move) - chain.pose(q - move)) / (2 * step)
        assert J[..., i] == pytest.approx(slope[:, :3, 3], abs=1e-8)


def test_a_frame_in_the_world_has_no_chain(scene):
    with pytest.raises(InputError, match="mirror"):
        world.serial_chain(scene.plant, "mirror")


def test_reachable_targets_are_reached_within_the_limits(scene):
    chain = world.serial_chain(scene.plant, "right_palm")
    rest = chain.posture(world.get_posture(scene.plant, scene.context))
    weights = np.array([float(n.startswith("right_")) for n in chain.names])
    weights[chain.indices(["right_wrist_supination"])] = 0.0
    margin = 0.05
    gap = margin * (chain.upper - chain.lower)
    rng = np.random.default_rng(2)
    spread = np.where(weights > 0, 0.15, 0.0)
    there = np.clip(
        rest + spread * rng.uniform(-1, 1, (20, len(rest))),
        np.where(weights > 0, chain.lower + gap, rest),
        np.where(weights > 0, chain.upper - gap, rest),
    )
    targets = chain.pose(there)[:, :3, 3]
    q, left = solve_position(chain, targets, rest, weights, margin=margin)
    assert np.all(left < 1e-3)
    reached = chain.pose(q)[:, :3, 3]
    assert np.linalg.norm(reached - targets, axis=1) == pytest.approx(left)
    held = weights == 0
    assert np.all(q[:, held] == rest[held])
    assert np.all(q[:, ~held] >= (chain.lower + gap)[~held] - 1e-12)
    assert np.all(q[:, ~held] <= (chain.upper - gap)[~held] + 1e-12)


def test_what_is_out_of_reach_is_told_by_its_distance(scene):
    chain = world.serial_chain(scene.plant, "right_palm")
    rest = chain.posture(world.get_posture(scene.plant, scene.context))
    weights = np.array([float(n.startswith("right_")) for n in chain.names])
    _, left = solve_position(chain, [[2.0, 0.0, 0.0]], rest, weights)
    assert 1.4 < left[0] < 1.9


def test_the_rest_posture_is_kept_where_the_task_leaves_it_free(scene):
    chain = world.serial_chain(scene.plant, "right_palm")
    rest = chain.posture(world.get_posture(scene.plant, scene.context))
    weights = np.ones(len(rest))
    here = chain.pose(rest)[:3, 3]
    start = np.clip(rest + 0.1, chain.lower, chain.upper)
    q, left = solve_position(
        chain, [here], rest, weights, start=start, iterations=500
    )
    assert left[0] < 1e-3
    assert np.linalg.norm(q[0] - rest) < 0.2 * np.linalg.norm(start - rest)
