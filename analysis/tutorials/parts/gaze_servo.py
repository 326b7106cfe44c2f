"""GazeServo alone: turns a yaw joint until a marker at 0.3 rad is centered."""

from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.primitives import AffineSystem, LinearSystem

from drake_affetto import perception as p

view = p.gaze_view(p.CameraConfig().model(), p.BlobCalibration())
builder = DiagramBuilder()
# The joint follows its command in 0.1 s; its output is [q; 0].
joint = builder.AddSystem(LinearSystem([[-10]], [[10]], [[1], [0]], [[0], [0]]))
D = [[view.focal, 0], [0, 0], [0, 0]]  # Near the middle x_img is linear in q.
y0 = [view.center_x - 0.3 * view.focal, 0.4, 1]  # x_img, y_img, found at q = 0
eye = builder.AddSystem(AffineSystem(D=D, y0=y0))
image, state = eye.get_output_port(), joint.get_output_port()
servo = p.GazeServo.AddToBuilder(
    builder=builder, blob=image, estimated_state=state, yaw_index=0, view=view
)
builder.Connect(state, eye.get_input_port())
builder.Connect(servo.get_yaw_command_output_port(), joint.get_input_port())
simulator = Simulator(builder.Build())
simulator.AdvanceTo(4.0)
context = servo.GetMyContextFromRoot(simulator.get_context())
print("τ =", servo.get_task_parameter_output_port().Eval(context).round(3))
