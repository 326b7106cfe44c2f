"""One trial at a time: gaze, guided movement, strike, the whole chain.

Each trial runs the whole station. A `TrialRunner` builds its Diagram once;
trials change the context only, and what a trial gives depends on its
arguments alone, not on the trials before it.

Long: all that one runner does with its one Diagram.
"""

from collections import deque
from collections.abc import Callable, Sequence
import dataclasses
import math

import numpy as np
from pydrake.geometry import Meshcat, MeshcatVisualizerParams, SceneGraph
from pydrake.systems.analysis import ApplySimulatorConfig, Simulator
from pydrake.systems.framework import (
    Context,
    DiagramBuilder,
    TriggerType,
)
from pydrake.systems.primitives import LogVectorOutput, VectorLogSink

from drake_affetto.common.typing import Array
from drake_affetto.experiments.fault_injection import FaultInjection
from drake_affetto.experiments.recordings import GazeOutcome, Recording
from drake_affetto.faults.supervisor import Verdict
from drake_affetto.motion.dmp import Dmp
from drake_affetto.perception import gaze as gaze_state
from drake_affetto.perception.gaze import GazePhase
from drake_affetto.scene import world
from drake_affetto.skill.policy import Regressor
from drake_affetto.sound.config import load_sound_config
from drake_affetto.sound.reward import (
    cut_prototype,
    reward,
    spectrogram,
    tap_prototypes,
)
from drake_affetto.sound.voice import DrumVoice, microphone_noise
from drake_affetto.station.scenario import Scenario
from drake_affetto.station.station import AffettoStation
from drake_affetto.teaching.stroke import draw_stroke

RINGING = 0.3
"""Time after a movement that is recorded too, s: a struck drum rings on."""

# Steps in which a search with the gaze is simulated, s.
FRAME_PERIOD = 0.05
# Of so many of these at its end a search that failed mostly saw the marker, or
# did not.
_LAST_FRAMES = 20
# The gaze gives a turn back within so long, s.
_PATIENCE = 5.0


@dataclasses.dataclass
class GuidedMovement:
    """One movement of the arm that a teacher guided (paper Eq. 8).

    Attributes:
        t: Times since the palm was grasped (T,), s.
        q: Recorded joint angles (T, n), rad.
        theta: Movement primitive that was encoded from them (n·K,).
        max_pull: Greatest force of the teacher, N.
    """

    t: Array
    q: Array
    theta: Array
    max_pull: float


@dataclasses.dataclass(frozen=True)
class Landing:
    """Where the palm comes down.

    Attributes:
        distance: How far from the head's center, level with the table, the
            palm is when its lowest point first is at the head's height, or
            where it is lowest if it never gets so low, m.
        graze: Whether it touches the head all the same although it comes down
            beside it.
    """

    distance: float
    graze: bool


@dataclasses.dataclass(frozen=True)
class _Look:
    """The last search of a runner, and the station at its end.

    Attributes:
        key: Position of the drum, seed of the trial, pose of the mirror and
            faults.
        outcome: Outcome of the search.
        end: Context at its end.
    """

    key: tuple[float, float, int, world.FramePose | None, str]
    outcome: GazeOutcome
    end: Context


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
            scenario: Scenario of the trials.
            meshcat: Browser window that shows them; None for none.
            meshcat_params: How they are shown.
            start_time: Whole number of seconds at which the robot comes to
                rest, for replays of several trials one after another.
            by_mouse: Whether a person who drags the hand in `meshcat` is the
                teacher.
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
            "affetto.joint_state": 1.0 / scenario.teaching.recording_rate,
            "affetto.estimated_state": 1.0 / scenario.teaching.recording_rate,
            "affetto.desired_state": 1.0 / scenario.teaching.recording_rate,
            "affetto.chamber_pressure": 1.0 / scenario.teaching.recording_rate,
            "affetto.valve_opening": 1.0 / scenario.teaching.recording_rate,
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
        self._palm_chain = world.serial_chain(
            self.station.plant, "affetto::right_palm"
        )
        self._settled: Context | None = None
        self._mirror: world.FramePose | None = None
        self._looked: _Look | None = None
        self._taps: list[Array] | None = None
        self.injection: FaultInjection | None = None
        if self.station.faults is not None:
            self.injection = FaultInjection(self)

    def place_mirror(self, pose: world.FramePose | None) -> None:
        """Puts the mirror there in the trials to come; None: as the scenario.

        Args:
            pose: Pose of the frame `mirror_pose`.
        """
        self._mirror = pose

    def tap_prototypes(self) -> list[Array]:
        """Prototypes of the drum's sound when a person taps it."""
        if self._taps is None:
            self._taps = tap_prototypes(self.voice, self.reward_config)
        return self._taps

    def spectrogram(self, recording: Recording) -> Array:
        """(bands, frames) of a recording's sound.

        Args:
            recording: A trial's recording.
        """
        return spectrogram(
            recording.sound, recording.sound_rate, self.reward_config
        )

    def reward(
        self, recording: Recording, prototypes: Sequence[Array]
    ) -> float:
        """R of paper Eq. 10, from the sound alone.

        Args:
            recording: A trial's recording.
            prototypes: Spectrograms (bands, frames) of sounds of the drum.
        """
        return reward(self.spectrogram(recording), prototypes)

    def prototype(self, recording: Recording) -> Array:
        """The recording's loudest moment, as a prototype for rewards.

        Args:
            recording: A trial's recording.
        """
        return cut_prototype(self.spectrogram(recording), self.reward_config)

    def gaze(
        self,
        xy: Array,
        seed: int,
        on_frame: Callable[[float], None] | None = None,
        linger: float = 0.0,
    ) -> GazeOutcome:
        """Searches for the drum at xy with the gaze.

        Args:
            xy: Position of the drum (2,), m.
            seed: Seed of the trial: of the camera's noise and the robot's
                variation.
            on_frame: Called every 0.05 s with the time since the beginning,
                e.g. to film the search.
            linger: Time for which the simulation goes on after the end of the
                search, s.
        """
        begin = self.settle(xy, seed)
        # The gaze alone: no movement starts within any trial's time.
        self.play(
            np.zeros(self.station.num_joints * self.dmp.n_basis), begin + 1e6
        )
        self._enable_gaze()
        outcome = self._wait_for_gaze(begin, on_frame)
        self._tell(outcome)
        end = self.context.get_time() + linger
        while self.context.get_time() < end - 1e-9:
            self._advance_frame(begin, on_frame)
        return outcome

    @property
    def gaze_phase(self) -> GazePhase:
        """The present state of the gaze servo."""
        state = self._sub(self.station.gaze).get_discrete_state(0)
        return GazePhase(int(state.CopyToVector()[gaze_state.PHASE]))

    def teach(
        self,
        xy: Array,
        seed: int,
        attempt: int = 0,
        variability: float = 1.0,
        aim: Array | None = None,
    ) -> GuidedMovement:
        """Guides the arm to the drum at xy and back, as a simulated teacher.

        Args:
            xy: Position of the drum (2,), m.
            seed: Seed of the teacher's and the robot's variation.
            attempt: Number of earlier attempts at this position.
            variability: Factor of the teacher's variation.
            aim: Where the palm is to touch (3,), m in the world; None for the
                middle of the drum's head.
        """
        teaching = self.scenario.teaching.varied(variability)
        station = self.station
        grasped = self._soften(xy, seed)
        touched = station.touching_position(self.context)
        stroke = draw_stroke(
            teaching,
            touched if aim is None else np.asarray(aim, float),
            np.random.default_rng([seed, 0x7EAC4]),
            attempt,
        )
        station.teacher.set_stroke(self._sub(station.teacher), stroke, grasped)
        return self._record_guidance(grasped)

    def _soften(self, xy: Array, seed: int) -> float:
        """Makes the arm compliant (paper Eq. 8); returns the time, s."""
        teaching, station = self.scenario.teaching, self.station
        begin = self.settle(xy, seed)
        # What holds the arm at rest will hold it while it is guided.
        self.advance(begin + teaching.settling_time)
        u_eq = self.log("affetto.pid_output")[1].mean(axis=0)
        controller = self._sub(station.controller)
        gains = station.controller.get_gains(controller)
        station.controller.set_gains(
            controller, gains.scaled(teaching.gain_scale)
        )
        station.set_equilibrium_offset(self.context, u_eq)
        return begin + teaching.settling_time

    def _record_guidance(self, grasped: float) -> GuidedMovement:
        """Records the guided movement from the time `grasped` on, s."""
        self._clear_logs()
        self.advance(grasped + self.scenario.teaching.duration)
        t, state = self.log("affetto.estimated_state")
        _, pull = self.log("teacher.pulling_force")
        t = t - grasped
        q = state[:, : self.station.num_joints]
        return GuidedMovement(
            t=t,
            q=q,
            theta=self.dmp.encode(t, q),
            max_pull=float(np.linalg.norm(pull, axis=1).max()),
        )

    def strike(self, xy: Array, theta: Array, seed: int) -> Recording:
        """Executes a movement, without the gaze.

        Args:
            xy: Position of the drum (2,), m.
            theta: Parameters θ of the movement (n·K,).
            seed: Seed of the microphone's noise and the robot's variation.
        """
        start = self.settle(xy, seed) + self.scenario.policy.delay
        self._watch()
        self.play(theta, start)
        return self.record(start, seed)

    def play(self, theta: Array, start: float) -> None:
        """Has the movement θ (n·K,) begin at the time `start`, s.

        Args:
            theta: Policy parameters (n·K,).
        """
        self.station.policy.set_policy_parameters(
            self._sub(self.station.policy), theta, start
        )

    def drum(
        self, xy: Array, regressor: Regressor, seed: int
    ) -> tuple[GazeOutcome, Recording | None]:
        """The whole chain: the gaze finds the drum, the skill strikes it.

        Args:
            xy: Position of the drum (2,), m.
            regressor: Skill, from task parameters to θ.
            seed: Seed of the camera's and the microphone's noise, and of the
                robot's variation.

        Returns:
            The outcome of the gaze, and the recording (None if the drum was
            not found, or a supervisor has ended the trial).
        """
        outcome = self.look(xy, seed)
        if not outcome.found:
            return outcome, None
        start = self.await_movement(regressor)
        if not self.verdict.valid:
            return outcome, None
        if math.isinf(start):
            raise RuntimeError("the gaze has settled but is never ready")
        return outcome, self.record(start, seed)

    def await_movement(self, regressor: Regressor) -> float:
        """Waits until the gaze has settled and the skill has been asked.

        Args:
            regressor: Skill, from task parameters to θ.

        Returns:
            The movement's start, s; inf if the gaze does not settle within
            5 s, or the supervisor ends the trial before.
        """
        policy = self._sub(self.station.policy)
        self.station.policy.set_regressor(policy, regressor)
        limit = self.context.get_time() + _PATIENCE
        while not self.station.policy.is_latched(policy):
            if self.context.get_time() > limit or not self.verdict.valid:
                return math.inf
            self.advance(self.context.get_time() + FRAME_PERIOD)
        return float(self.port("affetto.start_time")[0])

    def look(self, xy: Array, seed: int) -> GazeOutcome:
        """The search for the drum, at whose end the station then is.

        It knows nothing of the movement that follows. So the station's state
        at the end of the last search is kept: further movements of the same
        trial go on from there, exactly as if the search came before each.

        Args:
            xy: Position of the drum (2,), m.
            seed: Seed of the trial.
        """
        faults = "" if self.injection is None else self.injection.key
        key = (float(xy[0]), float(xy[1]), seed, self._mirror, faults)
        if self._looked is None or self._looked.key != key:
            outcome = self.gaze(xy, seed)
            if self._looked is None:
                end = self.context.Clone()
            else:
                end = self._looked.end
                self._copy(self.context, end)
            self._looked = _Look(key, outcome, end)
        self._copy(self._looked.end, self.context)
        if self.injection is not None:
            self.injection.resume()
            self._tell(self._looked.outcome)
        self._clear_logs()
        self.simulator.Initialize()
        return self._looked.outcome

    def look_again(self) -> GazeOutcome:
        """Searches for the drum once more, where a movement has ended."""
        self.station.gaze.reset(self._sub(self.station.gaze))
        self.simulator.Initialize()
        return self._wait_for_gaze(self.context.get_time())

    def check_stroke(
        self, gaze: GazeOutcome, recording: Recording, heard: bool
    ) -> Verdict:
        """What is said of a stroke that has just ended; see `verdict`.

        Args:
            gaze: Search before the stroke.
            recording: The stroke.
            heard: Whether its sound was a hit's.
        """
        if self.injection is not None:
            self.injection.afterwards(gaze, recording, heard)
        return self.verdict

    def palm_path(self, state: Array) -> Array:
        """Positions (T, 3) of the palm, m in the world.

        Args:
            state: Angles of the n joints, rad, and whatever follows them, such
                as their speeds (T, n or more).
        """
        names = self.station.joints.names
        q = state[:, [names.index(name) for name in self._palm_chain.names]]
        return self._palm_chain.pose(q)[:, :3, 3]

    def landing(self, recording: Recording) -> Landing:
        """Where the palm came down in the trial that has just ended.

        For judging only, by the true posture: neither learner nor reward know
        of it.

        Args:
            recording: The trial's recording.
        """
        plant = self.station.plant
        context = self._sub(plant)
        head = world.head_center_position(plant, context)
        palm = self.palm_path(recording.true_state)
        low = palm[:, 2] - world.hand_radius(plant, context)
        down = low <= head[2]
        at = int(np.argmax(down)) if down.any() else int(np.argmin(low))
        distance = float(np.linalg.norm(palm[at, :2] - head[:2]))
        touched = bool(np.any(recording.contact_force[:, 0] > 0.0))
        beside = distance > world.head_radius(plant, context)
        return Landing(distance, touched and beside)

    def port(self, name: str):
        """The value now of the station's output port `name`."""
        return self.station.GetOutputPort(name).Eval(self._station_context)

    @property
    def _station_context(self) -> Context:
        return self.station.GetMyMutableContextFromRoot(self.context)

    def _sub(self, system) -> Context:
        return system.GetMyMutableContextFromRoot(self.context)

    def settle(self, xy: Array, seed: int) -> float:
        """Starts a trial: robot at rest, drum at xy, m; gives the time, s.

        The seed is that of all that differs from trial to trial.
        """
        if self._settled is None:
            station = self.station
            station.reset(self._station_context)
            self.context.SetTime(self._start_time)
            self.simulator.Initialize()
            self.advance(self._start_time + self.scenario.settling_duration)
            self._settled = self.context.Clone()
        self._copy(self._settled, self.context)
        self.station.set_drum_position(self._station_context, xy)
        if self._mirror is not None:
            self.station.set_mirror_pose(self._station_context, self._mirror)
        self.station.set_seed(self._station_context, seed)
        if self.injection is not None:
            self.injection.begin(xy, seed)
        self._clear_logs()
        self.simulator.Initialize()
        return self.context.get_time()

    def _copy(self, source: Context, target: Context) -> None:
        """Takes time, state and parameters over from one context to another.

        All but the geometries, which no trial changes: to copy them means to
        copy the render engines, forty times the cost of all else.
        """
        target.SetTime(source.get_time())
        for system in self.station.GetSystems():
            if not isinstance(system, SceneGraph):
                system.GetMyMutableContextFromRoot(
                    target
                ).SetStateAndParametersFrom(system.GetMyContextFromRoot(source))

    def _watch(self) -> None:
        """Has the supervisor watch what follows, if there is one."""
        if self.injection is not None:
            self.injection.watch(True)

    def _enable_gaze(self) -> None:
        self._watch()
        self.station.gaze.set_enabled(self._sub(self.station.gaze), True)

    def _wait_for_gaze(
        self, begin: float, on_frame: Callable[[float], None] | None = None
    ) -> GazeOutcome:
        gaze, context = self.station.gaze, self._sub(self.station.gaze)
        settled = gaze.get_settled_output_port()
        failed = gaze.GetOutputPort("failed")
        sightings: deque[bool] = deque(maxlen=_LAST_FRAMES)
        while not settled.Eval(context)[0] and not failed.Eval(context)[0]:
            if not self.verdict.valid:
                break
            self._advance_frame(begin, on_frame)
            sightings.append(bool(self.port("camera.blob")[2]))
        found = bool(settled.Eval(context)[0])
        return GazeOutcome(
            found=found,
            task_parameter=np.array(
                gaze.get_task_parameter_output_port().Eval(context)
            ),
            duration=self.context.get_time() - begin,
            unseen=not found and sum(sightings) < 0.5 * len(sightings),
        )

    def _tell(self, outcome: GazeOutcome) -> None:
        """Has a supervisor know that a search has not seen the marker."""
        if outcome.unseen and self.injection and self.verdict.valid:
            self.injection.lost()

    def _advance_frame(
        self, begin: float, on_frame: Callable[[float], None] | None
    ) -> None:
        self.advance(self.context.get_time() + FRAME_PERIOD)
        if on_frame is not None:
            on_frame(self.context.get_time() - begin)

    def record(self, start: float, seed: int) -> Recording:
        """Simulates the movement that starts at `start`, with its sound."""
        self.advance(start)
        self._clear_logs()
        self.advance(start + self.scenario.dmp.duration)
        return self.finish_recording(start, seed)

    def finish_recording(self, start: float, seed: int) -> Recording:
        """The recording of a movement that has just ended, with its sound.

        The simulation goes on for a moment, in which the drum rings on.

        Args:
            start: Time of the movement's start, s.
            seed: Seed of the microphone's noise.
        """
        self.advance(self.context.get_time() + RINGING)
        t, contact = self.log("drum.contact_force")
        _, knock = self.log("drum.knock_force")
        _, flow = self.log("affetto.mass_flow")
        joint_t, state = self.log("affetto.estimated_state")
        # A contact's force is that over the plant's step from then on.
        t = t - start + 0.5 * self.scenario.plant_config.time_step
        sound = self.voice.synthesize(
            t,
            contact[:, 0],
            contact[:, 1],
            knock[:, 0],
            knock[:, 1],
            np.abs(flow),
            microphone_noise(seed),
        )
        if self.injection is not None:
            sound = self.injection.hear(sound, start, start + float(t[0]))
        return Recording(
            t=t,
            contact_force=contact,
            knock_force=knock,
            hiss_flow=np.linalg.norm(flow, axis=1),
            joint_t=joint_t - start,
            joint_state=state,
            true_state=self.log("affetto.joint_state")[1],
            desired_state=self.log("affetto.desired_state")[1],
            chamber_pressure=self.log("affetto.chamber_pressure")[1],
            valve_opening=self.log("affetto.valve_opening")[1],
            sound=sound,
            sound_rate=self.voice.rate,
        )

    def advance(self, time: float) -> None:
        """Simulates until `time`, s."""
        if time <= self.context.get_time():
            return
        if self.injection is not None:
            self.injection.advance(time)
        else:
            self.simulator.AdvanceTo(time)

    @property
    def verdict(self) -> Verdict:
        """What the supervisor says of the trial so far; valid without one."""
        return Verdict() if self.injection is None else self.injection.verdict

    def log(self, name: str) -> tuple[Array, Array]:
        """Times (T,) and values (T, size) of a log, each time once.

        Args:
            name: Name of the log.
        """
        log = self._logs[name].FindLog(self.context)
        t = log.sample_times()
        keep = np.append(np.diff(t) > 1e-9, True)
        return t[keep].copy(), log.data().T[keep].copy()

    def _clear_logs(self) -> None:
        for log in self._logs.values():
            log.FindMutableLog(self.context).Clear()
