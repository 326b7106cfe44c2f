"""The gradient of a tracking error by PIDF gains, and finite differences."""

import numpy as np
from pydrake.autodiffutils import AutoDiffXd, InitializeAutoDiff
from pydrake.multibody.parsing import Parser
from pydrake.multibody.plant import AddMultibodyPlantSceneGraph
from pydrake.systems.analysis import ResetIntegratorFromFlags, Simulator_
from pydrake.systems.framework import DiagramBuilder

from drake_affetto import control, pneumatics
from drake_affetto.common.resources import models_dir

builder = DiagramBuilder()
plant, _ = AddMultibodyPlantSceneGraph(builder, time_step=0.0)  # continuous
(arm,) = Parser(plant).AddModels(str(models_dir() / "sdf/two_link_arm.sdf"))
plant.Finalize()
joints = {n: pneumatics.JointActuator(n) for n in ("shoulder", "elbow")}
gains = dict.fromkeys(joints, control.JointGains(1e6, 1e6, 4e4, 4e-6))
config = control.PidfConfig(control.ControlParameters(gains=gains))
driver = pneumatics.PneumaticDriver(joints, control=config)
pneumatics.ApplyPneumaticDriver(driver, plant, arm, builder)
diagram = builder.Build()
runs = [(diagram.ToAutoDiffXd(), InitializeAutoDiff(np.ones(8)).ravel())]
runs += [(diagram, 1 + 1e-4 * s) for s in np.r_[np.eye(8), -np.eye(8)]]
cost = np.zeros(17, dtype=object)  # mean square error of a step's first 0.4 s
for i, (diagram, factors) in enumerate(runs):
    context = diagram.CreateDefaultContext()
    diagram.get_input_port(0).FixValue(context, [0.3, 0.5, 0.0, 0.0])
    pidf = diagram.GetSubsystemByName("two_link_arm.controller")
    own = pidf.GetMyMutableContextFromRoot(context)
    pidf.set_gains(own, np.repeat([1e6, 1e6, 4e4, 4e-6], 2) * factors)
    simulator = Simulator_[AutoDiffXd if i == 0 else float](diagram, context)
    ResetIntegratorFromFlags(simulator, "runge_kutta3", 0.002)
    simulator.get_mutable_integrator().set_fixed_step_mode(True)
    for k in range(40):
        simulator.AdvanceTo(0.01 * (k + 1))
        error = diagram.get_output_port(0).Eval(context)[:2] - [0.3, 0.5]
        cost[i] += error @ error / 40
finite = (cost[1:9] - cost[9:]).astype(float) / 2e-4
print(np.c_[cost[0].derivatives(), finite].round(6))  # rad²; kP, kI, kD, kF
