"""The drumming scene, built once for all tests of the scene."""

import dataclasses

from pydrake.geometry import SceneGraph
from pydrake.multibody.plant import (
    AddMultibodyPlant,
    MultibodyPlant,
    MultibodyPlantConfig,
)
from pydrake.systems.framework import Context, Diagram, DiagramBuilder
import pytest

from drake_affetto.scene import world


@dataclasses.dataclass
class Scene:
    diagram: Diagram
    plant: MultibodyPlant
    scene_graph: SceneGraph
    root: Context
    context: Context

    def reset(self) -> None:
        self.diagram.SetDefaultContext(self.root)


def build_scene(
    time_step: float, config: world.WorldConfig | None = None
) -> Scene:
    """A plant whose contact results are asked for without stepping."""
    builder = DiagramBuilder()
    plant, scene_graph = AddMultibodyPlant(
        MultibodyPlantConfig(
            time_step=time_step,
            contact_model="point",
            discrete_contact_approximation="lagged",
            use_sampled_output_ports=False,
        ),
        builder,
    )
    world.add_world(plant, config or world.WorldConfig())
    plant.Finalize()
    diagram = builder.Build()
    root = diagram.CreateDefaultContext()
    context = plant.GetMyMutableContextFromRoot(root)
    return Scene(diagram, plant, scene_graph, root, context)


@pytest.fixture(scope="session")
def built_scene() -> Scene:
    return build_scene(0.001)


@pytest.fixture
def scene(built_scene):
    """The scene in its default context."""
    built_scene.diagram.SetDefaultContext(built_scene.root)
    return built_scene
