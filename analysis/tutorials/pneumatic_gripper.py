"""Another's robot, from a scenario as Drake's hardware_sim reads them."""

import dataclasses

from pydrake.common.yaml import yaml_load_typed
from pydrake.manipulation import ApplyDriverConfigs, ZeroForceDriver
from pydrake.multibody import parsing
from pydrake.multibody.plant import AddMultibodyPlantSceneGraph
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder

from drake_affetto.pneumatics import PneumaticDriver


@dataclasses.dataclass
class Scene:
    directives: list[parsing.ModelDirective]
    model_drivers: dict[str, PneumaticDriver | ZeroForceDriver]


scene = yaml_load_typed(filename=__file__[:-2] + "yaml", defaults=Scene([], {}))
builder = DiagramBuilder()
plant, _ = AddMultibodyPlantSceneGraph(builder, time_step=0.001)
directives = parsing.ModelDirectives(directives=scene.directives)
parsing.ProcessModelDirectives(directives, parsing.Parser(plant))
plant.Finalize()
ApplyDriverConfigs(
    driver_configs=scene.model_drivers,
    sim_plant=plant,
    models_from_directives=[],
    lcm_buses=None,
    builder=builder,
)
diagram = builder.Build()
context = diagram.CreateDefaultContext()
desired = [0.5, -0.8] * 3 + [0.0] * 6  # rad, rad/s
diagram.GetInputPort("gripper.desired_state").FixValue(context, desired)
Simulator(diagram, context).AdvanceTo(4.0)
state = diagram.GetOutputPort("gripper.estimated_state").Eval(context)
print(f"errors of the six joints: {(state - desired)[:6].round(3)} rad")
