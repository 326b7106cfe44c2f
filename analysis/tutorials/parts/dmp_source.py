"""DmpSource alone: encodes a movement of two joints and plays it again."""

import numpy as np
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.primitives import LogVectorOutput

from drake_affetto.motion import Dmp, DmpConfig, DmpSource

t = np.linspace(0.0, 2.0, 201)
q = np.stack([0.4 * np.sin(np.pi * t / 2.0) ** 2, 0.2 * np.sin(np.pi * t) ** 2])
dmp = Dmp(DmpConfig(n_basis=15, duration=2.0))
theta = dmp.encode(t, q.T)

builder = DiagramBuilder()
source = DmpSource.AddToBuilder(builder=builder, dmp=dmp, num_joints=2)
log = LogVectorOutput(source.get_desired_state_output_port(), builder, 0.01)
simulator = Simulator(builder.Build())
context = source.GetMyMutableContextFromRoot(simulator.get_mutable_context())
source.get_policy_parameters_input_port().FixValue(context, theta)
source.get_start_time_input_port().FixValue(context, [0.0])
simulator.AdvanceTo(2.0)
error = log.FindLog(simulator.get_context()).data()[:2] - q
print(f"the source departs by at most {np.abs(error).max():.1e} rad")
