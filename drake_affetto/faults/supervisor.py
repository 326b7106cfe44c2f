"""The supervisor as a system: it watches the robot and says: not valid."""

import dataclasses
import math
from typing import Any

import numpy as np
from pydrake.systems.framework import (
    BasicVector,
    Context,
    DiscreteValues,
    LeafSystem,
)

from drake_affetto.common.systems import input_port, output_port
from drake_affetto.common.typing import Array
from drake_affetto.faults.images import DIGEST, HUE_AREA, STATISTICS
from drake_affetto.faults.supervision import (
    CHECKS,
    Check,
    SupervisorParameters,
    image_scores,
    marker_scores,
    reason,
    watch_signals,
    watch_size,
)
from drake_affetto.pneumatics.chamber import memory_size
from drake_affetto.pneumatics.parameters import largest_dead_time


@dataclasses.dataclass(frozen=True)
class Verdict:
    """What the supervisor says of a trial.

    Attributes:
        reason: Why it is not valid; empty: it is.
        time: When it said so, s; infinite: never.
    """

    reason: str = ""
    time: float = math.inf

    @property
    def valid(self) -> bool:
        """Whether the trial may be judged and learned from."""
        return not self.reason


class Supervisor(LeafSystem):
    """Watches what a real robot could watch, and acts on the valves.

    .. pydrake_system::

        name: Supervisor
        input_ports:
        - desired_state
        - estimated_state
        - chamber_pressure
        - valve_opening
        - tick_time
        - statistics
        - blob_pixels
        - settled
        - failed
        output_ports:
        - verdict
        - valve_action
        - scores

    - desired_state, estimated_state (2n): [q; q̇], rad, rad/s.
    - chamber_pressure (2n): [p_a; p_b] as read, Pa.
    - valve_opening (n): the controller's command.
    - tick_time (1): time stamp of the command that has come, s.
    - statistics (6): of the image, see `images.image_statistics`.
    - blob_pixels (4): see `BlobSensor`.
    - settled, failed (1): of the gaze: no image is looked at any more.
    - verdict (3): number of the check that was not passed, plus 1, or 0; the
      joint or chamber that it is of; when, s.
    - valve_action (1): for `PneumaticActuation`: nothing, until a check is not
      passed.
    - scores (checks): greatest score of each check until one is not
      passed, which is at 1.

    Signals are watched at every tick of the controller, images at the camera's
    rate while the gaze looks. `watch` switches both, and forgets what was
    before. The mathematics are those of `supervision`.
    """

    _DESIRED, _ESTIMATE, _PRESSURE, _OPENING, _TICK, _IMAGE, _BLOB = range(7)

    def __init__(
        self,
        parameters: SupervisorParameters,
        actuators: Array,
        deviation: Array,
        joints: tuple[str, ...],
        image_size: tuple[int, int],
        *,
        action: int,
        centered: bool = True,
        period: float = 0.005,
        rate: float = 10.0,
    ):
        """Declares ports, state and events.

        Args:
            parameters: Thresholds.
            actuators: (ROWS, n) of the actuators as the robot knows them.
            deviation: Of an angle's second difference (n,), rad, see
                `supervision.second_difference_deviation`.
            joints: Names of the n joints.
            image_size: Width and height of the image, px.
            action: What the valves are told where a check is not passed.
            centered: Whether the gaze centers the marker.
            period: Time between two ticks, s.
            rate: Images per second.

        Raises:
            InputError: If a threshold is out of range.
        """
        super().__init__()
        parameters.check("supervisor")
        self.parameters = parameters
        self._limits = parameters.signals()
        self._actuators = np.array(actuators, dtype=float)
        self._deviation = np.array(deviation, dtype=float)
        self.joints = joints
        self._size = image_size
        self._action = float(action)
        self._centered = centered
        self._period = float(period)
        n = len(joints)
        for name, size in (
            ("desired_state", 2 * n),
            ("estimated_state", 2 * n),
            ("chamber_pressure", 2 * n),
            ("valve_opening", n),
            ("tick_time", 1),
            ("statistics", STATISTICS),
            ("blob_pixels", 4),
            ("settled", 1),
            ("failed", 1),
        ):
            self.DeclareVectorInputPort(name, size)
        self._on_index = int(
            self.DeclareNumericParameter(BasicVector(np.zeros(1)))
        )
        self._signals_index = self.DeclareDiscreteState(watch_size(n))
        # Pressures, torques, flows as they are predicted.
        self._model_index = self.DeclareDiscreteState(5 * n)
        self._line_index = self.DeclareDiscreteState(
            memory_size(n, self._period, largest_dead_time(self._actuators))
        )
        # Digest of the last image, and how many were the same in a row.
        self._image_index = self.DeclareDiscreteState(2)
        self._scores_index = self.DeclareDiscreteState(CHECKS)
        self._verdict_index = self.DeclareDiscreteState(3)
        self._action_index = self.DeclareDiscreteState(1)
        self.DeclareStateOutputPort("verdict", self._verdict_index)
        self.DeclareStateOutputPort("valve_action", self._action_index)
        self.DeclareStateOutputPort("scores", self._scores_index)
        self.DeclarePeriodicDiscreteUpdateEvent(
            self._period, 0.0, self._watch_signals
        )
        self.DeclarePeriodicDiscreteUpdateEvent(
            1.0 / rate, 0.0, self._watch_image
        )

    get_desired_state_input_port = input_port("[q; q̇] desired (2n).")
    get_estimated_state_input_port = input_port("[q; q̇] as read (2n).")
    get_chamber_pressure_input_port = input_port("[p_a; p_b] as read (2n).")
    get_valve_opening_input_port = input_port("The command (n).")
    get_tick_time_input_port = input_port("Its time stamp (1), s.")
    get_statistics_input_port = input_port("What the image is like (6).")
    get_blob_pixels_input_port = input_port("The marker in it (4).")
    get_settled_input_port = input_port("Whether the gaze is done (1).")
    get_failed_input_port = input_port("Whether it has given up (1).")
    get_verdict_output_port = output_port("Check + 1, channel, time (3).")
    get_valve_action_output_port = output_port("What the valves are told (1).")
    get_scores_output_port = output_port("Greatest score of each check.")

    def watch(self, context: Context, on: bool) -> None:
        """Begins to watch, or ends it; forgets what was before.

        Args:
            on: Whether it watches.
        """
        context.get_mutable_numeric_parameter(self._on_index).SetFromVector(
            np.array([float(on)])
        )
        for index in range(context.num_discrete_state_groups()):
            size = context.get_discrete_state(index).size()
            context.SetDiscreteState(index, np.zeros(size))

    def verdict(self, context: Context) -> Verdict:
        """What it says of the trial so far."""
        check, channel, time = context.get_discrete_state(
            self._verdict_index
        ).CopyToVector()
        if check == 0.0:
            return Verdict()
        text = reason(int(check) - 1, int(channel), self.joints)
        return Verdict(text, float(time))

    def _on(self, context: Context) -> bool:
        on = context.get_numeric_parameter(self._on_index).value()
        return bool(on[0] > 0.0)

    def _watch_signals(self, context: Context, values: DiscreteValues) -> None:
        if not self._on(context):
            return
        read = self.EvalVectorInput
        mutable = values.get_mutable_value
        n = len(self.joints)
        model = mutable(self._model_index)
        scores, channels = np.zeros(CHECKS), np.zeros(CHECKS)
        watch_signals(
            self._period,
            self._limits,
            self._deviation,
            self._actuators,
            context.get_time(),
            read(context, self._DESIRED).value(),
            read(context, self._ESTIMATE).value(),
            read(context, self._PRESSURE).value(),
            read(context, self._OPENING).value(),
            float(read(context, self._TICK).value()[0]),
            mutable(self._signals_index),
            model[: 2 * n],
            model[2 * n : 3 * n],
            model[3 * n :],
            mutable(self._line_index),
            scores,
            channels,
        )
        self._judge(context, values, scores, channels)

    def _watch_image(self, context: Context, values: DiscreteValues) -> None:
        if not self._on(context):
            return
        for name in ("settled", "failed"):
            done: Any = self.GetInputPort(name).Eval(context)
            if done[0]:
                return
        statistics: Any = self.GetInputPort("statistics").Eval(context)
        pixels: Any = self.GetInputPort("blob_pixels").Eval(context)
        image = values.get_mutable_value(self._image_index)
        image[1] = image[1] + 1.0 if statistics[DIGEST] == image[0] else 0.0
        image[0] = statistics[DIGEST]
        found = image_scores(self.parameters, statistics, int(image[1]))
        found |= marker_scores(
            self.parameters,
            pixels,
            statistics[HUE_AREA],
            self._size,
            self._centered,
        )
        scores = np.zeros(CHECKS)
        for check, score in found.items():
            scores[check] = score
        self._judge(context, values, scores, np.zeros(CHECKS))

    def _judge(
        self,
        context: Context,
        values: DiscreteValues,
        scores: Array,
        channels: Array,
    ) -> None:
        """Keeps the greatest scores; the first that is not passed decides."""
        verdict = values.get_mutable_value(self._verdict_index)
        if verdict[0] != 0.0:
            return
        greatest = values.get_mutable_value(self._scores_index)
        np.maximum(greatest, scores, out=greatest)
        (beyond,) = np.nonzero(scores >= 1.0)
        if beyond.size:
            check = Check(int(beyond[0]))
            verdict[:] = check + 1, channels[check], context.get_time()
            values.get_mutable_value(self._action_index)[:] = self._action
