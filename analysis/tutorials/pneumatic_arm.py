"""A planar arm of two links on pneumatic actuators, under PIDF control."""

import numpy as np
from pydrake.multibody.parsing import Parser
from pydrake.multibody.plant import AddMultibodyPlantSceneGraph
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder

from drake_affetto.common.resources import models_dir
from drake_affetto.control import ControlParameters, JointGains, PidfConfig
from drake_affetto.pneumatics import (
    ApplyPneumaticDriver,
    JointActuator,
    PneumaticDriver,
)

GAINS = JointGains(kP=1e6, kI=1.5e6, kD=4e4, kF=4e-6)

builder = DiagramBuilder()
plant, _ = AddMultibodyPlantSceneGraph(builder, time_step=0.001)
(arm,) = Parser(plant).AddModels(str(models_dir() / "sdf/two_link_arm.sdf"))
plant.Finalize()
driver = PneumaticDriver(
    joints={
        "shoulder": JointActuator("shoulder"),  # of Affetto's classes
        "elbow": JointActuator("elbow", {"dead_time": 0.005}),
    },
    control=PidfConfig(
        ControlParameters(gains={"shoulder": GAINS, "elbow": GAINS})
    ),
)
pneumatics = ApplyPneumaticDriver(driver, plant, arm, builder)
diagram = builder.Build()
context = diagram.CreateDefaultContext()
pneumatics.hold_posture(diagram, context)
desired = np.array([0.6, 1.0, 0.0, 0.0])  # rad, rad/s
diagram.GetInputPort("two_link_arm.desired_state").FixValue(context, desired)
Simulator(diagram, context).AdvanceTo(4.0)
state = diagram.GetOutputPort("two_link_arm.estimated_state").Eval(context)
print(f"errors of shoulder and elbow: {(state - desired)[:2].round(3)} rad")
