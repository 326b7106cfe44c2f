"""Faults in the trials of a runner: begun, heard, and seen again afterwards."""

from collections.abc import Sequence
import math
from typing import TYPE_CHECKING

import numpy as np

from drake_affetto.common.typing import Array
from drake_affetto.faults.config import Fault
from drake_affetto.faults.hearing import sound_scores
from drake_affetto.faults.sounds import with_faults
from drake_affetto.faults.supervision import REASONS, Check
from drake_affetto.faults.supervisor import Verdict
from drake_affetto.perception.camera_model import CameraModel
from drake_affetto.perception.plant_camera_model import make_camera_model
from drake_affetto.scene import world

if TYPE_CHECKING:
    from drake_affetto.experiments.episode import (
        GazeOutcome,
        Recording,
        TrialRunner,
    )


class FaultInjection:
    """What a runner does where its scenario has faults or a supervisor.

    The supervisor system watches signals and images while they come. What it
    can say only afterwards is asked here: the sound is synthesized after the
    movement, and the drum is looked for once more.

    Attributes:
        faults: Faults of the trials to come.
    """

    def __init__(self, runner: "TrialRunner"):
        """Takes the runner; the faults are those of its scenario."""
        wiring = runner.station.faults
        assert wiring is not None
        self._runner = runner
        self._wiring = wiring
        self.faults: Sequence[Fault] = tuple(runner.scenario.faults)
        # What was found afterwards: the greatest score of each check.
        self._late: dict[Check, float] = {}
        self._late_time = math.inf
        self._sight: CameraModel | None = None

    @property
    def key(self) -> str:
        """What tells these faults from others."""
        return repr(self.faults)

    def begin(self, xy: Array, seed: int) -> None:
        """Begins a trial: nothing of an earlier one is left."""
        self._late, self._late_time = {}, math.inf
        self._wiring.begin(self._runner.context, self.faults, seed, xy)

    def watch(self, on: bool) -> None:
        """Has the supervisor watch or not."""
        self._wiring.watch(self._runner.context, on)

    def advance(self, time: float) -> None:
        """Simulates until `time`, s; pauses where a fault changes the scene."""
        runner = self._runner
        self._wiring.apply(runner.context)
        while runner.context.get_time() < time:
            pause = self._wiring.next_change(runner.context, time)
            runner.simulator.AdvanceTo(pause)
            self._wiring.apply(runner.context)

    def hear(self, sound: Array, start: float, first: float) -> Array:
        """The recording as the microphone gives it.

        Args:
            sound: What there is to hear (samples,), Pa.
            start: Time of the movement's start, s.
            first: Time of the first sample, s.
        """
        schedule = self._wiring.schedule(self._runner.context)
        if not schedule.acts_on("microphone"):
            return sound
        return with_faults(sound, self._runner.voice, schedule, first, start)

    @property
    def verdict(self) -> Verdict:
        """What is said of the trial so far."""
        said = self._wiring.verdict(self._runner.context)
        if not said.valid:
            return said
        for check, score in sorted(self._late.items()):
            if score >= 1.0:
                return Verdict(REASONS[check], self._late_time)
        return Verdict()

    @property
    def scores(self) -> Array:
        """Greatest score of each check so far, see `faults.supervision`."""
        scores = self._wiring.scores(self._runner.context)
        for check, score in self._late.items():
            scores[check] = max(scores[check], score)
        return scores

    def _say(self, found: dict[Check, float]) -> None:
        """Adds scores of the supervisor that come late."""
        if self._wiring.supervisor is None:
            return
        if not any(score >= 1.0 for score in self._late.values()):
            self._late_time = self._runner.context.get_time()
        for check, score in found.items():
            self._late[check] = max(self._late.get(check, 0.0), score)

    def listen(self, recording: "Recording", tau: Array, heard: bool) -> None:
        """Compares what was heard with where the hand was.

        Args:
            recording: Recording of the movement.
            tau: Task parameter (2,) with which it was made.
            heard: Whether the reward calls it a success.
        """
        if self._wiring.supervisor is None:
            return
        runner, parameters = self._runner, self._wiring.supervisor.parameters
        head, radius = self._known_drum()
        palm = runner.palm_path(recording.joint_state)
        height = palm[:, 2] - radius - head
        low = height < parameters.low
        place = self._seen_place(tau)
        distances: tuple[float, float] | None = None
        if place is not None:
            away = np.linalg.norm(palm[:, :2] - place, axis=1)
            deep = height < -parameters.deep
            distances = (
                float(away[low].min(initial=math.inf)),
                float(away[deep].min(initial=math.inf)),
            )
        self._say(
            sound_scores(
                parameters,
                recording.sound,
                recording.sound_rate,
                low,
                float(recording.joint_t[1] - recording.joint_t[0]),
                distances,
                heard,
            )
        )

    def look_again(self, before: "GazeOutcome", after: "GazeOutcome") -> None:
        """Compares where the drum was seen before and after the movement."""
        supervisor = self._wiring.supervisor
        if supervisor is None or not before.found:
            return
        score = math.inf
        if after.found:
            apart = np.linalg.norm(after.task_parameter - before.task_parameter)
            score = float(apart) / supervisor.parameters.moved
        self._say({Check.DRUM_MOVED: min(score, 100.0)})

    def lost(self) -> None:
        """The gaze has given up: there is nothing to judge."""
        self._say({Check.MARKER_LOST: 1.0})

    def _known_drum(self) -> tuple[float, float]:
        """Height of the drum's head and radius of the hand, m, as known."""
        runner = self._runner
        plant = runner.station.plant
        context = plant.GetMyContextFromRoot(runner.context)
        off = runner.scenario.body.drum_height
        head = float(world.head_center_position(plant, context)[2]) - off
        return head, world.hand_radius(plant, context)

    def _seen_place(self, tau: Array) -> Array | None:
        """Where the drum was seen (2,), m, by the camera as it is known.

        None where it was seen from a fixed yaw: in a mirror whose plane may
        not be known.
        """
        scenario = self._runner.scenario
        if scenario.look.mode != "centre":
            return None
        if self._sight is None:
            plant = self._runner.station.plant
            root = self._runner.diagram.CreateDefaultContext()
            self._sight = make_camera_model(
                plant,
                plant.GetMyContextFromRoot(root),
                scenario.camera,
                scenario.yaw_joint,
            )
        v = scenario.blob.calibration.pixels(np.array([0.0, tau[0]]))[1]
        u = self._sight.camera.image_center[0]
        seen = self._sight.locate(np.array([u, v]), float(tau[1]))
        return np.asarray(seen)[:2]
