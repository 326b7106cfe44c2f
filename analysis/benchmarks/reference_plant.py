"""What the benchmarks compare with: the robot alone, as version 0.1.0 had it.

All 22 joints, those that do not drum locked, at a step of 1 ms and with sampled
output ports. It stays as it is, so that ratios of different versions can be
compared.
"""

from collections.abc import Sequence

from pydrake.multibody.plant import (
    AddMultibodyPlant,
    MultibodyPlant,
    MultibodyPlantConfig,
)
from pydrake.systems.framework import Context, DiagramBuilder

from drake_affetto.scene import world

STEP = 0.001
"""The reference's step, s."""


def add_reference_plant(
    builder: DiagramBuilder, config: world.WorldConfig
) -> MultibodyPlant:
    """Adds the reference to `builder`, with its SceneGraph."""
    plant, _ = AddMultibodyPlant(
        MultibodyPlantConfig(
            time_step=STEP,
            contact_model="point",
            discrete_contact_approximation="lagged",
        ),
        builder,
    )
    world.add_world(plant, config)
    plant.Finalize()
    return plant


def lock_all_but(
    plant: MultibodyPlant, root: Context, active: Sequence[str]
) -> None:
    """Locks the other joints of the robot where they stand."""
    context = plant.GetMyMutableContextFromRoot(root)
    for name in world.joint_names(plant):
        if name not in active:
            world.get_joint(plant, name).Lock(context)
