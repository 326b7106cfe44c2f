"""The system that turns the upper body to the marker and takes τ."""

import dataclasses
import math
from typing import Any

import numpy as np
from pydrake.systems.framework import (
    BasicVector,
    Context,
    DiagramBuilder,
    DiscreteValues,
    LeafSystem,
    OutputPort,
)

from drake_affetto.common.errors import require, require_range
from drake_affetto.common.systems import input_port, output_port
from drake_affetto.geometry.optics import Camera
from drake_affetto.perception.blob import BlobCalibration
from drake_affetto.perception.gaze import (
    PHASE,
    TAU_1,
    TAU_2,
    Gaze,
    GazeConfig,
    GazeMode,
    GazePhase,
    GazeTask,
    GazeView,
)

_NO = np.zeros(1)


def gaze_view(camera: Camera, calibration: BlobCalibration) -> GazeView:
    """How the calibrated blob coordinates lie in a camera's image.

    Args:
        camera: Camera and lens.
        calibration: The box that the coordinates are scaled by.
    """
    unit_x = calibration.u_max - calibration.u_min
    unit_y = calibration.v_max - calibration.v_min
    center = calibration.normalize(camera.image_center)
    return GazeView(
        center_x=float(center[0]),
        width=camera.width / unit_x,
        height_per_width=unit_y / unit_x,
        focal=camera.focal_x / unit_x,
    )


class GazeServo(LeafSystem):
    """Turns the upper body's yaw until the marker is centered; gives τ.

    .. pydrake_system::

        name: GazeServo
        input_ports:
        - blob
        - estimated_state
        output_ports:
        - yaw_command
        - task_parameter
        - settled
        - failed
        - ready

    - blob (3): x_img, y_img, found.
    - estimated_state (2n): [q; q̇] of the active joints [rad, rad/s].
    - yaw_command (1): where the yaw joint should be [rad], without jumps.
    - task_parameter (2): [y_img, q₃*] if the marker was centered, [x_img,
      y_img] at a fixed yaw; zeros until settled is 1.
    - settled (1): 1 once τ is known, else 0.
    - failed (1): 1 once the marker is given up, else 0.
    - ready (1): 1 once τ is known and the yaw command is back at the start
      posture, else 0.

    An image is taken in at the camera's rate, with the camera's latency:
    `blob` and the yaw are read at the time of exposure and used later by the
    latency. Once settled, failed or not enabled, `blob` is not evaluated, so
    that no image is rendered. What a trial asks (`GazeTask`) is a numeric
    parameter with its setters; the rest of the state is discrete.
    """

    def __init__(
        self,
        n: int,
        yaw_index: int,
        view: GazeView,
        config: GazeConfig | None = None,
        rate: float = 10.0,
        latency: float = 0.0,
    ) -> None:
        """Fixes what does not change from trial to trial.

        Args:
            n: number of active joints.
            yaw_index: which of them is the yaw of the upper body.
            view: how the blob's coordinates lie in the image.
            config: settings of the servo.
            rate: images per second.
            latency: time [s] from exposure until an image can be used.

        Raises:
            InputError: if a value is out of range.
        """
        super().__init__()
        require(n >= 1, "n", n, "at least 1")
        require(
            0 <= yaw_index < n, "yaw_index", yaw_index, f"from 0 to {n - 1}"
        )
        require_range("rate", rate, 0.1, 1e4)
        require_range("latency", latency, 0.0, 10.0)
        self._gaze = Gaze(config or GazeConfig(), view)
        self._yaw_index = yaw_index
        self._period = 1.0 / rate
        # Images on their way: exposed, not yet usable. The newest is last.
        self._queue = max(1, math.ceil(latency * rate - 1e-9))
        self._latency = latency

        task = self.DeclareNumericParameter(BasicVector(GazeTask().to_vector()))
        self._task_index = int(task)
        self._tasks: dict[bytes, GazeTask] = {}
        self._blob_port = self.DeclareVectorInputPort("blob", 3)
        self._state_port = self.DeclareVectorInputPort("estimated_state", 2 * n)
        self._gaze_state = int(
            self.DeclareDiscreteState(self._gaze.initial_state())
        )
        # Each image: time of exposure (-∞: none), x_img, y_img, found, yaw.
        empty = np.zeros((self._queue, 5))
        empty[:, 0] = -np.inf
        self._images = int(self.DeclareDiscreteState(empty.ravel()))

        delay = latency % self._period
        if min(delay, self._period - delay) < 1e-6:
            # Used at a later exposure (or at once): one event does both.
            self.DeclarePeriodicDiscreteUpdateEvent(
                self._period, 0.0, self._expose_and_use
            )
        else:
            self.DeclarePeriodicDiscreteUpdateEvent(
                self._period, 0.0, self._expose
            )
            self.DeclarePeriodicDiscreteUpdateEvent(
                self._period, delay, self._use
            )

        state = {self.xd_ticket(), self.all_parameters_ticket()}
        timed = state | {self.time_ticket()}
        self.DeclareVectorOutputPort(
            "yaw_command", 1, self._calc_yaw_command, timed
        )
        self.DeclareVectorOutputPort(
            "task_parameter", 2, self._calc_task_parameter, state
        )
        self.DeclareVectorOutputPort("settled", 1, self._calc_settled, state)
        self.DeclareVectorOutputPort("failed", 1, self._calc_failed, state)
        self.DeclareVectorOutputPort("ready", 1, self._calc_ready, timed)

    @staticmethod
    def AddToBuilder(
        *,
        builder: DiagramBuilder,
        blob: OutputPort,
        estimated_state: OutputPort,
        yaw_index: int,
        view: GazeView,
        config: GazeConfig | None = None,
        rate: float = 10.0,
        latency: float = 0.0,
        name: str = "gaze_servo",
    ) -> "GazeServo":
        """Adds a servo wired to a blob sensor and to the joints' state.

        Args:
            blob: The blob sensor's output.
            estimated_state: [q; q̇] (2n) of the active joints, rad and rad/s.
            yaw_index: Place of the yaw joint among them.
            view: How the blob's coordinates lie in the image.
            rate: Rate of the images, Hz.
            latency: Delay from exposure to use, s.
        """
        servo = GazeServo(
            estimated_state.size() // 2, yaw_index, view, config, rate, latency
        )
        builder.AddNamedSystem(name, servo)
        builder.Connect(blob, servo.get_blob_input_port())
        builder.Connect(estimated_state, servo.get_estimated_state_input_port())
        return servo

    get_blob_input_port = input_port("x_img, y_img, found (3).")
    get_estimated_state_input_port = input_port("[q; q̇] (2n), rad and rad/s.")
    get_yaw_command_output_port = output_port(
        "Where the yaw joint should be (1), rad."
    )
    get_task_parameter_output_port = output_port(
        "τ or τ̂ (2), zeros until it is settled."
    )
    get_settled_output_port = output_port("1 once τ is known (1), else 0.")
    get_failed_output_port = output_port(
        "1 once the marker is given up (1), else 0."
    )
    get_ready_output_port = output_port(
        "1 once τ is known and the yaw is back (1), else 0."
    )

    # Parameters of a trial

    def task(self, context: Context) -> GazeTask:
        """What the servo is asked in this context."""
        return GazeTask.from_vector(
            context.get_numeric_parameter(self._task_index).CopyToVector()
        )

    def set_task(self, context: Context, task: GazeTask) -> None:
        """Sets all that a trial asks of the servo.

        Args:
            task: What the trial asks.
        """
        context.get_mutable_numeric_parameter(self._task_index).SetFromVector(
            task.to_vector()
        )

    def set_enabled(self, context: Context, enabled: bool) -> None:
        """Whether to look at all (not, while teaching or replaying).

        Args:
            enabled: Whether it looks and turns.
        """
        self._change_task(context, enabled=bool(enabled))

    def set_mode(self, context: Context, mode: GazeMode) -> None:
        """Center the marker, or look from a fixed yaw.

        Args:
            mode: Center the marker, or look from a fixed yaw.
        """
        self._change_task(context, mode=GazeMode(mode))

    def set_fixed_yaw(self, context: Context, yaw: float) -> None:
        """The yaw [rad] to look from in the mode FIXED_YAW."""
        self._change_task(context, fixed_yaw=float(yaw))

    def set_start_yaw(self, context: Context, yaw: float) -> None:
        """The yaw [rad] of the start posture."""
        self._change_task(context, start_yaw=float(yaw))

    def _change_task(self, context: Context, **changes: Any) -> None:
        task = dataclasses.replace(self.task(context), **changes)
        self.set_task(context, task)

    def reset(self, context: Context) -> None:
        """Forgets all images, as at the start of a trial."""
        context.SetDiscreteState(self._gaze_state, self._gaze.initial_state())
        empty = np.zeros((self._queue, 5))
        empty[:, 0] = -np.inf
        context.SetDiscreteState(self._images, empty.ravel())

    # Events

    def _known_task(self, context: Context) -> GazeTask:
        """`task`, not to be changed: made once for each that is asked for."""
        values = context.get_numeric_parameter(self._task_index).value()
        key = values.tobytes()
        if key not in self._tasks:
            self._tasks = {key: GazeTask.from_vector(values)}
        return self._tasks[key]

    def _gaze_values(self, context: Context) -> np.ndarray:
        """The state (SIZE,), not to be changed."""
        return context.get_discrete_state(self._gaze_state).value()

    def _measure(self, context: Context) -> np.ndarray:
        """One image as a row: time, x_img, y_img, found, yaw."""
        blob: Any = self._blob_port.Eval(context)
        state: Any = self._state_port.Eval(context)
        yaw = state[self._yaw_index]
        return np.array([context.get_time(), *blob, yaw])

    def _take_in(
        self, context: Context, images: np.ndarray, values: DiscreteValues
    ) -> None:
        """Hands the newest image that is old enough to the state machine."""
        t = context.get_time()
        usable = images[images[:, 0] <= t - self._latency + 1e-6]
        if len(usable) == 0 or not np.isfinite(usable[-1, 0]):
            return
        image = usable[-1]
        x = values.get_mutable_vector(self._gaze_state).get_mutable_value()
        self._gaze.update(
            x, t, image[1:4], image[4], image[0], self.task(context)
        )

    def _expose(self, context: Context, values: DiscreteValues) -> None:
        if not self._gaze.wants_image(
            self._gaze_values(context), self.task(context)
        ):
            return
        queue = values.get_mutable_vector(self._images).get_mutable_value()
        rows = queue.reshape(self._queue, 5)
        rows[:-1] = rows[1:].copy()
        rows[-1] = self._measure(context)

    def _use(self, context: Context, values: DiscreteValues) -> None:
        queue = context.get_discrete_state(self._images).CopyToVector()
        self._take_in(context, queue.reshape(self._queue, 5), values)

    def _expose_and_use(self, context: Context, values: DiscreteValues) -> None:
        if not self._gaze.wants_image(
            self._gaze_values(context), self.task(context)
        ):
            return
        queue = context.get_discrete_state(self._images).CopyToVector()
        rows = np.vstack(
            [queue.reshape(self._queue, 5), self._measure(context)]
        )
        values.get_mutable_vector(self._images).SetFromVector(rows[1:].ravel())
        self._take_in(context, rows, values)

    # Outputs

    # These are asked for at every tick of the controller, mostly while nothing
    # is looked for: the phase alone then tells.

    def _calc_yaw_command(self, context: Context, output: BasicVector) -> None:
        x = self._gaze_values(context)
        yaw = self._gaze.yaw_command(
            x, context.get_time(), self._known_task(context)
        )
        output.SetFromVector(np.array([yaw]))

    def _calc_task_parameter(
        self, context: Context, output: BasicVector
    ) -> None:
        x = self._gaze_values(context)
        if self._gaze.is_settled(x, self.task(context)):
            output.SetFromVector(np.array([x[TAU_1], x[TAU_2]]))
        else:
            output.SetFromVector(np.array([0.0, 0.0]))

    def _calc_settled(self, context: Context, output: BasicVector) -> None:
        x = self._gaze_values(context)
        if x[PHASE] != GazePhase.SETTLED:
            output.SetFromVector(_NO)
            return
        settled = self._gaze.is_settled(x, self.task(context))
        output.SetFromVector(np.array([float(settled)]))

    def _calc_failed(self, context: Context, output: BasicVector) -> None:
        x = self._gaze_values(context)
        failed = self._gaze.is_failed(x, self.task(context))
        output.SetFromVector(np.array([float(failed)]))

    def _calc_ready(self, context: Context, output: BasicVector) -> None:
        x = self._gaze_values(context)
        if x[PHASE] != GazePhase.SETTLED:
            output.SetFromVector(_NO)
            return
        ready = self._gaze.is_ready(x, context.get_time(), self.task(context))
        output.SetFromVector(np.array([float(ready)]))
