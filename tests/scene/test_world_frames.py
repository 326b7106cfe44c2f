"""Frames of the scene that a scenario puts elsewhere."""

import numpy as np
from pydrake.math import RigidTransform, RollPitchYaw
from pydrake.multibody.plant import MultibodyPlant
import pytest

from drake_affetto.common.errors import InputError
from drake_affetto.scene.world import FramePose, WorldConfig, add_world


def pose_of(config, frame):
    plant = MultibodyPlant(0.001)
    add_world(plant, config)
    plant.Finalize()
    context = plant.CreateDefaultContext()
    return plant.GetFrameByName(frame).CalcPoseInWorld(context)


@pytest.mark.parametrize(
    ("frame", "carried"),
    [("mirror_pose", "mirror"), ("affetto_base", "pelvis")],
)
def test_a_frame_is_moved_with_what_stands_on_it(frame, carried):
    usual = WorldConfig()
    moved = WorldConfig(
        frames={frame: FramePose([0.4, 0.3, 0.1], [90.0, 10.0, -20.0])}
    )
    X_WF = RigidTransform(
        RollPitchYaw(np.deg2rad([90.0, 10.0, -20.0])), [0.4, 0.3, 0.1]
    )
    assert pose_of(moved, frame).IsNearlyEqualTo(X_WF, 1e-12)
    before = pose_of(usual, frame).inverse() @ pose_of(usual, carried)
    after = X_WF.inverse() @ pose_of(moved, carried)
    assert after.IsNearlyEqualTo(before, 1e-9)
    assert pose_of(moved, "table_pose").IsExactlyEqualTo(
        pose_of(usual, "table_pose")
    )


def test_a_frame_that_is_not_there_is_named():
    with pytest.raises(InputError, match="no frame 'mirror', expected one of"):
        pose_of(WorldConfig(frames={"mirror": FramePose()}), "mirror")
    config = WorldConfig(frames={"mirror_pose": FramePose([0.0, 0.0])})
    with pytest.raises(InputError, match=r"frames\.mirror_pose\.translation"):
        pose_of(config, "mirror")
