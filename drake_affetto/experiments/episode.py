"""One trial at a time: look for the drum, be taught, play, drum.

Each trial runs the whole station. A `TrialRunner` builds its Diagram once;
trials change the context only, and what a trial gives depends on its
arguments alone, not on the trials before it.
"""

from collections.abc import Sequence
import dataclasses

import numpy as np
from pydrake.geometry import Meshcat, MeshcatVisualizerParams
from pydrake.systems.analysis import ApplySimulatorConfig, Simulator
from pydrake.systems.framework import (
    Context,
    DiagramBuilder,
    TriggerType,
)
from pydrake.systems.primitives import LogVectorOutput, VectorLogSink

from drake_affetto.motion.dmp import Dmp
from drake_affetto.skill.policy import Regressor
from drake_affetto.sound.config import load_sound_config
from drake_affetto.sound.reward import (
    cut_prototype,
    reward,
    spectrogram,
    tap_prototypes,
)
from drake_affetto.sound.voice import DrumVoice
from drake_affetto.station.scenario import Scenario
from drake_affetto.station.station import AffettoStation
from drake_affetto.teaching.stroke import draw_stroke

# How long after a movement is listened: a struck drum rings on.
_RINGING = 0.3


@dataclasses.dataclass
class Look:
    """What came of looking for the drum.

    Attributes:
        found: whether the gaze settled on the marker.
        task_parameter: (2,) τ or τ̂; zeros where it did not.
        duration: how long it took, s.
    """

    found: bool
    task_parameter: np.ndarray
    duration: float


@dataclasses.dataclass
class Recording:
    """What was recorded while the robot moved.

    Attributes:
        t: (T,) times of the contacts since the movement's start, s.
        contact_force: (T, 2) N on the head and m from its centre.
        knock_force: (T, 2) N on the shell and on the table.
        joint_t: (S,) times of the joints, s.
        joint_state: (S, 2n) rad, rad/s.
        desired_state: (S, 2n) rad, rad/s.
        chamber_pressure: (S, 2n) Pa absolute.
        sound: (samples,) Pa at the microphone.
        sound_rate: samples per second.
    """

    t: np.ndarray
    contact_force: np.ndarray
    knock_force: np.ndarray
    joint_t: np.ndarray
    joint_state: np.ndarray
    desired_state: np.ndarray
    chamber_pressure: np.ndarray
    sound: np.ndarray
    sound_rate: float


@dataclasses.dataclass
class Lesson:
    """One demonstration by hand (paper Eq. 8).

    Attributes:
        t: (T,) s since the palm was grasped.
        q: (T, n) recorded joint angles, rad.
        theta: (n·K,) the movement primitive that was encoded from them.
        max_pull: greatest force of the teacher, N.
    """

    t: np.ndarray
    q: np.ndarray
    theta: np.ndarray
    max_pull: float


class TrialRunner:
    """Runs trials of one scenario on one station."""

    def __init__(
        self,
        scenario: Scenario,
        meshcat: Meshcat | None = None,
        meshcat_params: MeshcatVisualizerParams | None = None,
        *,
        start_time: float = 0.0,
        by_mouse: bool = False,
    ):
        """Builds the station; see `AffettoStation` for what is raised.

        Args:
            by_mouse: whoever drags the hand in `meshcat` teaches.
            start_time: a whole number of seconds; from when the robot comes
                to rest, for replays of several trials one after another.
        """
        self.scenario = scenario
        self._start_time = start_time
        builder = DiagramBuilder()
        self.station = builder.AddNamedSystem(
            "station",
            AffettoStation(
                scenario, meshcat, meshcat_params, by_mouse=by_mouse
            ),
        )
        step = scenario.plant_config.time_step
        rates = {
            "drum.contact_force": step,
            "drum.knock_force": step,
            "affetto.mass_flow": step,
            "affetto.estimated_state": 1.0 / scenario.teaching.recording_rate,
            "affetto.desired_state": 1.0 / scenario.teaching.recording_rate,
            "affetto.chamber_pressure": 1.0 / scenario.teaching.recording_rate,
            "affetto.pid_output": scenario.control.period,
            "teacher.pulling_force": 1.0 / scenario.teaching.update_rate,
        }
        self._logs: dict[str, VectorLogSink] = {
            name: LogVectorOutput(
                self.station.GetOutputPort(name),
                builder,
                publish_triggers={TriggerType.kPeriodic},
                publish_period=period,
            )
            for name, period in rates.items()
        }
        self.diagram = builder.Build()
        self.simulator = Simulator(self.diagram)
        ApplySimulatorConfig(scenario.simulator_config, self.simulator)
        self.context = self.simulator.get_mutable_context()
        self.dmp = Dmp(scenario.dmp)
        sound = load_sound_config(scenario.sound)
        self.voice = DrumVoice(sound.voice)
        self.reward_config = sound.reward
        self.meshcat = meshcat
        self._settled: Context | None = None

    def taps(self) -> list[np.ndarray]:
        """Prototypes of what the drum sounds like when a person taps it."""
        return tap_prototypes(self.voice, self.reward_config)

    def spectrogram(self, recording: Recording) -> np.ndarray:
        """(bands, frames) of a recording's sound."""
        return spectrogram(
            recording.sound, recording.sound_rate, self.reward_config
        )

    def reward(
        self, recording: Recording, prototypes: Sequence[np.ndarray]
    ) -> float:
        """R of paper Eq. 10, from the sound alone."""
        return reward(self.spectrogram(recording), prototypes)

    def prototype(self, recording: Recording) -> np.ndarray:
        """The recording's loudest moment, as a prototype for rewards."""
        return cut_prototype(self.spectrogram(recording), self.reward_config)

    def look(self, xy: np.ndarray, seed: int) -> Look:
        """Looks for the drum at xy (2,), m.

        Args:
            seed: of the camera's noise.
        """
        begin = self._start(xy)
        # Looking only: nothing is played within any trial's time.
        self.station.policy.set_policy_parameters(
            self._sub(self.station.policy),
            np.zeros(self.station.num_joints * self.dmp.n_basis),
            begin + 1e6,
        )
        self._watch(seed)
        return self._wait_for_gaze(begin)

    def teach(
        self,
        xy: np.ndarray,
        seed: int,
        attempt: int = 0,
        variability: float = 1.0,
    ) -> Lesson:
        """Guides the arm to the drum at xy (2,), m, and back.

        Args:
            seed: of what differs between demonstrations.
            attempt: how often this position was tried before.
            variability: by how much more than the scenario says
                demonstrations differ.
        """
        teaching = self.scenario.teaching.varied(variability)
        station = self.station
        grasped = self._soften(xy)
        stroke = draw_stroke(
            teaching,
            station.touching_position(self.context),
            np.random.default_rng([seed, 0x7EAC4]),
            attempt,
        )
        station.teacher.set_stroke(self._sub(station.teacher), stroke, grasped)
        return self._write_lesson(grasped)

    def _soften(self, xy: np.ndarray) -> float:
        """Lets the arm be led, drum at xy (paper Eq. 8); returns the time."""
        teaching, station = self.scenario.teaching, self.station
        begin = self._start(xy)
        # What holds the arm at rest will hold it while it is led.
        self._advance(begin + teaching.settling_time)
        u_eq = self._log("affetto.pid_output")[1].mean(axis=0)
        controller = self._sub(station.controller)
        gains = station.controller.get_gains(controller)
        station.controller.set_gains(
            controller, gains.scaled(teaching.gain_scale)
        )
        station.set_equilibrium_offset(self.context, u_eq)
        return begin + teaching.settling_time

    def _write_lesson(self, grasped: float) -> Lesson:
        """Records what the hand is led through from `grasped` on, s."""
        self._clear_logs()
        self._advance(grasped + self.scenario.teaching.duration)
        t, state = self._log("affetto.estimated_state")
        _, pull = self._log("teacher.pulling_force")
        t = t - grasped
        q = state[:, : self.station.num_joints]
        return Lesson(
            t=t,
            q=q,
            theta=self.dmp.encode(t, q),
            max_pull=float(np.linalg.norm(pull, axis=1).max()),
        )

    def play(self, xy: np.ndarray, theta: np.ndarray, seed: int) -> Recording:
        """Plays θ (n·K,) with the drum at xy (2,), m.

        Args:
            seed: of the microphone's noise.
        """
        begin = self._start(xy)
        start = begin + self.scenario.policy.delay
        self.station.policy.set_policy_parameters(
            self._sub(self.station.policy), theta, start
        )
        return self._record(start, seed)

    def drum(
        self, xy: np.ndarray, regressor: Regressor, seed: int
    ) -> tuple[Look, Recording | None]:
        """The whole chain: finds the drum at xy (2,), m, and plays.

        Args:
            regressor: the skill, from task parameters to θ.
            seed: of the camera's and the microphone's noise.

        Returns:
            What was seen, and what was recorded (None where the drum was not
            found).
        """
        begin = self._start(xy)
        policy = self._sub(self.station.policy)
        self.station.policy.set_regressor(policy, regressor)
        self._watch(seed)
        look = self._wait_for_gaze(begin)
        if not look.found:
            return look, None
        limit = begin + self.scenario.gaze.timeout + 5.0
        while not self.station.policy.is_latched(policy):
            if self.context.get_time() > limit:
                raise RuntimeError("the gaze has settled but is never ready")
            self._advance(self.context.get_time() + 0.05)
        start = float(self.port("affetto.start_time")[0])
        return look, self._record(start, seed)

    def port(self, name: str):
        """The value now of the station's output port `name`."""
        return self.station.GetOutputPort(name).Eval(self._station_context)

    @property
    def _station_context(self) -> Context:
        return self.station.GetMyMutableContextFromRoot(self.context)

    def _sub(self, system) -> Context:
        return system.GetMyMutableContextFromRoot(self.context)

    def _start(self, xy: np.ndarray) -> float:
        """Robot settled at its start posture, drum at xy; returns the time."""
        if self._settled is None:
            station = self.station
            station.reset(self._station_context)
            self.context.SetTime(self._start_time)
            self.simulator.Initialize()
            self._advance(self._start_time + self.scenario.settling_duration)
            self._settled = self.context.Clone()
        self.context.SetTimeStateAndParametersFrom(self._settled)
        self.station.set_drum_position(self._station_context, xy)
        self._clear_logs()
        self.simulator.Initialize()
        return self.context.get_time()

    def _watch(self, seed: int) -> None:
        gaze, camera = self.station.gaze, self.station.camera
        gaze.set_enabled(self._sub(gaze), True)
        camera.set_seed(self._sub(camera), seed)

    def _wait_for_gaze(self, begin: float) -> Look:
        gaze, context = self.station.gaze, self._sub(self.station.gaze)
        settled = gaze.get_settled_output_port()
        failed = gaze.GetOutputPort("failed")
        while not settled.Eval(context)[0] and not failed.Eval(context)[0]:
            self._advance(self.context.get_time() + 0.05)
        return Look(
            found=bool(settled.Eval(context)[0]),
            task_parameter=np.array(
                gaze.get_task_parameter_output_port().Eval(context)
            ),
            duration=self.context.get_time() - begin,
        )

    def _record(self, start: float, seed: int) -> Recording:
        """Simulates the movement that starts at `start`; listens to it."""
        self._advance(start)
        self._clear_logs()
        self._advance(start + self.scenario.dmp.duration + _RINGING)
        t, contact = self._log("drum.contact_force")
        _, knock = self._log("drum.knock_force")
        _, flow = self._log("affetto.mass_flow")
        joint_t, state = self._log("affetto.estimated_state")
        t = t - start
        sound = self.voice.synthesise(
            t,
            contact[:, 0],
            contact[:, 1],
            knock[:, 0],
            knock[:, 1],
            np.abs(flow),
            np.random.default_rng([seed, 0x50BD]),
        )
        return Recording(
            t=t,
            contact_force=contact,
            knock_force=knock,
            joint_t=joint_t - start,
            joint_state=state,
            desired_state=self._log("affetto.desired_state")[1],
            chamber_pressure=self._log("affetto.chamber_pressure")[1],
            sound=sound,
            sound_rate=self.voice.rate,
        )

    def _advance(self, time: float) -> None:
        if time > self.context.get_time():
            self.simulator.AdvanceTo(time)

    def _log(self, name: str) -> tuple[np.ndarray, np.ndarray]:
        """Times (T,) and values (T, size) of a log, each time once."""
        log = self._logs[name].FindLog(self.context)
        t = log.sample_times()
        keep = np.append(np.diff(t) > 1e-9, True)
        return t[keep].copy(), log.data().T[keep].copy()

    def _clear_logs(self) -> None:
        for log in self._logs.values():
            log.FindMutableLog(self.context).Clear()
