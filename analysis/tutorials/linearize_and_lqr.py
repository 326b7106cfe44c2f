"""An LQR for an arm with its valves and chambers, linearized at a posture."""

import numpy as np
from pydrake.multibody.parsing import Parser
from pydrake.multibody.plant import AddMultibodyPlantSceneGraph
from pydrake.systems.analysis import Simulator
from pydrake.systems.controllers import LinearQuadraticRegulator
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.primitives import Linearize

from drake_affetto import pneumatics
from drake_affetto.common.resources import models_dir

builder = DiagramBuilder()
plant, _ = AddMultibodyPlantSceneGraph(builder, time_step=0.0)  # continuous
(arm,) = Parser(plant).AddModels(str(models_dir() / "sdf/two_link_arm.sdf"))
plant.Finalize()
plant.SetDefaultPositions([0.4, 0.9])
joints = {n: pneumatics.JointActuator(n) for n in ("shoulder", "elbow")}
driver = pneumatics.PneumaticDriver(joints)
systems = pneumatics.ApplyPneumaticDriver(driver, plant, arm, builder)
diagram = builder.Build()
context = diagram.CreateDefaultContext()
v = systems.find_equilibrium(diagram, context)
valves = diagram.GetInputPort("two_link_arm.valve_opening")
valves.FixValue(context, v)
x = context.get_continuous_state_vector().CopyToVector()
linear = Linearize(diagram, context, valves.get_index())
unit = np.repeat([1, 1e5, 1e-5, 1e-2], 4)  # q q̇, pressures, masses, spools
A, B = linear.A() * unit / unit[:, None], linear.B() / unit[:, None]
Q = np.diag([100.0] * 2 + [1.0] * 2 + [1e-3] * 12)
K = LinearQuadraticRegulator(A, B, Q, 10.0 * np.eye(2))[0] / unit
for law, gain in (("valves held", 0.0 * K), ("LQR", K)):
    context.SetTimeAndContinuousState(0.0, x + 0.2 * np.eye(16)[0])
    simulator = Simulator(diagram, context)
    for time in np.arange(0.01, 1.02, 0.01):  # 100 Hz
        dx = context.get_continuous_state_vector().CopyToVector() - x
        valves.FixValue(context, v - gain @ dx)
        simulator.AdvanceTo(time)
    print(f"{law}: {dx[:2].round(4)} rad from the posture after 1 s")
