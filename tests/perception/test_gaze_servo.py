"""The gaze servo's ports, events and parameters."""

import numpy as np
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder, LeafSystem
import pytest

from drake_affetto.common.errors import InputError
from drake_affetto.geometry.optics import PinholeCamera
from drake_affetto.perception.blob import BlobCalibration
from drake_affetto.perception.gaze import (
    PHASE,
    GazeConfig,
    GazeMode,
    GazePhase,
    GazeTask,
)
from drake_affetto.perception.gaze_servo import GazeServo, gaze_view
from support.gaze_view import VIEW, x_img_at

MARKER = 0.25


class Eye(LeafSystem):
    """A marker centered at the yaw `MARKER`; counts who looks."""

    def __init__(self):
        super().__init__()
        self.looks = []
        self._yaw = self.DeclareVectorInputPort("state", 6)
        self.DeclareVectorOutputPort(
            "blob",
            3,
            self._calc,
            {self.input_port_ticket(self._yaw.get_index()), self.time_ticket()},
        )

    def _calc(self, context, output):
        self.looks.append(context.get_time())
        q = self._yaw.Eval(context)[1]
        x = x_img_at(q - MARKER)
        output.SetFromVector([x, 0.4, 1.0])


class Body(LeafSystem):
    """Three joints; the second follows the command with a lag of 0.1 s."""

    def __init__(self):
        super().__init__()
        self._command = self.DeclareVectorInputPort("yaw_command", 1)
        index = self.DeclareDiscreteState(6)
        self.DeclarePeriodicDiscreteUpdateEvent(0.005, 0.0, self._update)
        self.DeclareStateOutputPort("state", index)

    def _update(self, context, values):
        state = values.get_mutable_vector().get_mutable_value()
        state[4] = (self._command.Eval(context)[0] - state[1]) / 0.1
        state[1] += 0.005 * state[4]


def make(rate=10.0, latency=0.03, config=None):
    """(diagram, servo, eye, body) in a closed loop."""
    builder = DiagramBuilder()
    eye = builder.AddSystem(Eye())
    body = builder.AddSystem(Body())
    servo = GazeServo.AddToBuilder(
        builder=builder,
        blob=eye.get_output_port(),
        estimated_state=body.get_output_port(),
        yaw_index=1,
        view=VIEW,
        config=config,
        rate=rate,
        latency=latency,
    )
    builder.Connect(body.get_output_port(), eye.get_input_port())
    builder.Connect(servo.get_yaw_command_output_port(), body.get_input_port())
    return builder.Build(), servo, eye, body


def run(diagram, servo, task, duration=4.0, context=None):
    context = context or diagram.CreateDefaultContext()
    sub = servo.GetMyMutableContextFromRoot(context)
    servo.set_task(sub, task)
    simulator = Simulator(diagram, context)
    simulator.Initialize()
    simulator.AdvanceTo(duration)
    return sub


@pytest.mark.parametrize("latency", [0.0, 0.03, 0.1, 0.17])
def test_it_settles_in_a_closed_loop(latency):
    diagram, servo, eye, _ = make(latency=latency)
    sub = run(diagram, servo, GazeTask())
    assert servo.get_settled_output_port().Eval(sub)[0] == 1
    assert servo.get_failed_output_port().Eval(sub)[0] == 0
    assert servo.get_ready_output_port().Eval(sub)[0] == 1
    tau = servo.get_task_parameter_output_port().Eval(sub)
    np.testing.assert_allclose(tau, [0.4, MARKER], atol=2e-3)
    assert servo.get_yaw_command_output_port().Eval(sub)[0] == 0.0
    # An image was looked at at the camera's rate, and none once settled.
    np.testing.assert_allclose(np.diff(eye.looks), 0.1, atol=1e-9)
    assert eye.looks[-1] < 2.0


def test_an_image_is_used_after_the_latency():
    """Until then the command stays; the image is that of its exposure."""
    for latency, used in ((0.03, 0.03), (0.1, 0.1), (0.25, 0.25)):
        diagram, servo, _, _ = make(latency=latency)
        context = diagram.CreateDefaultContext()
        sub = servo.GetMyMutableContextFromRoot(context)
        simulator = Simulator(diagram, context)
        simulator.Initialize()
        simulator.AdvanceTo(used - 0.002)
        assert sub.get_discrete_state(0)[PHASE] == GazePhase.START
        simulator.AdvanceTo(used + 0.002)
        assert sub.get_discrete_state(0)[PHASE] == GazePhase.TRACK
        goal = servo._gaze.yaw_command(
            sub.get_discrete_state(0).CopyToVector(), 100.0, GazeTask()
        )
        assert goal == pytest.approx(MARKER, abs=1e-6)


def test_disabled_it_looks_at_no_image():
    diagram, servo, eye, _ = make()
    sub = run(diagram, servo, GazeTask(enabled=False, start_yaw=0.05), 1.0)
    assert eye.looks == []
    assert servo.get_settled_output_port().Eval(sub)[0] == 0
    assert servo.get_yaw_command_output_port().Eval(sub)[0] == 0.05
    np.testing.assert_array_equal(
        servo.get_task_parameter_output_port().Eval(sub), 0.0
    )


def test_fixed_yaw_gives_the_image_coordinates():
    diagram, servo, _, _ = make()
    task = GazeTask(mode=GazeMode.FIXED_YAW, fixed_yaw=0.4)
    sub = run(diagram, servo, task)
    tau = servo.get_task_parameter_output_port().Eval(sub)
    np.testing.assert_allclose(tau, [x_img_at(0.15), 0.4], atol=0.01)


def test_setters_change_one_thing_each():
    _, servo, _, _ = make()
    context = servo.CreateDefaultContext()
    servo.set_enabled(context, False)
    servo.set_mode(context, GazeMode.FIXED_YAW)
    servo.set_fixed_yaw(context, 0.3)
    servo.set_start_yaw(context, -0.1)
    assert servo.task(context) == GazeTask(False, GazeMode.FIXED_YAW, 0.3, -0.1)


def test_a_context_can_be_used_again():
    diagram, servo, _, _ = make()
    context = diagram.CreateDefaultContext()
    first = run(diagram, servo, GazeTask(), context=context)
    tau = servo.get_task_parameter_output_port().Eval(first).copy()
    # By the default state of the whole, and by the servo's own reset.
    context.SetTime(0.0)
    diagram.SetDefaultContext(context)
    again = run(diagram, servo, GazeTask(), context=context)
    np.testing.assert_array_equal(
        servo.get_task_parameter_output_port().Eval(again), tau
    )
    servo.reset(again)
    assert servo.get_settled_output_port().Eval(again)[0] == 0
    simulator = Simulator(diagram, context)
    simulator.Initialize()
    simulator.AdvanceTo(8.0)
    assert servo.get_settled_output_port().Eval(again)[0] == 1


def test_yaw_command_is_no_feedthrough_of_the_image():
    """So that a loop over body and camera is no algebraic loop."""
    servo = GazeServo(3, 1, VIEW)
    assert not servo.HasAnyDirectFeedthrough()


def test_view_of_a_calibrated_camera():
    camera = PinholeCamera.from_fov(320, 240, 0.9)
    view = gaze_view(camera, BlobCalibration(-0.5, 319.5, 39.5, 199.5))
    assert view.center_x == pytest.approx(0.5)
    assert view.width == pytest.approx(1.0)
    assert view.height_per_width == pytest.approx(0.5)
    assert view.focal == pytest.approx(camera.focal_x / 320)
    narrow = gaze_view(camera, BlobCalibration(79.5, 239.5, -0.5, 239.5))
    assert narrow.center_x == pytest.approx(0.5)
    assert narrow.width == pytest.approx(2.0)


def test_arguments_that_do_not_fit_are_named():
    with pytest.raises(InputError, match="yaw_index is 3"):
        GazeServo(3, 3, VIEW)
    with pytest.raises(InputError, match="latency is -1"):
        GazeServo(3, 1, VIEW, latency=-1)
    with pytest.raises(InputError, match=r"gaze\.tolerance"):
        GazeServo(3, 1, VIEW, GazeConfig(tolerance=0.0))
