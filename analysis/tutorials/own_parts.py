"""Tutorial: your own policy, your own motion and your own controller.

    python analysis/tutorials/own_parts.py

It runs top to bottom in less than half a minute, needs no display, and each
part ends with what the drum says. Read it as a notebook: each `# %%` is a cell.
"""

# %% What is needed
import argparse
import dataclasses
from functools import partial

import numpy as np
from pydrake.multibody.inverse_kinematics import InverseKinematics
from pydrake.solvers import Solve
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder, LeafSystem
from pydrake.systems.primitives import LogVectorOutput

from drake_affetto.experiments.episode import TrialRunner
from drake_affetto.sound.config import load_sound_config
from drake_affetto.sound.reward import reward, spectrogram, tap_prototypes
from drake_affetto.sound.voice import DrumVoice
from drake_affetto.station.scenario import load_scenario
from drake_affetto.station.station import AffettoStation

argparse.ArgumentParser(description=__doc__).parse_args()
scenario = load_scenario("drumming")
drum_xy = np.array([0.23, -0.09])  # where the drum stands, m


def tell(what, value):
    """Prints what the drum says to a movement."""
    verdict = "the drum sounds" if value > threshold else "no sound"
    print(f"   {what:<44} R = {value:5.2f}: {verdict}")


# %% 1. Your own policy
# The station's SkillPolicy asks a regressor for the movement θ that belongs to
# what the camera saw, τ. Anything with scikit-learn's `predict` will do: here
# an average of what was taught, weighted by how near it was.
print("1. A policy of one's own: any regressor from τ to θ")


class Neighbors:
    """Averages the demonstrations, the nearest counting most."""

    def __init__(self, tau, theta):
        self.tau, self.theta = np.array(tau), np.array(theta)
        self.scale = np.ptp(self.tau, axis=0)

    def predict(self, X):
        """Task parameters (m, 2) to policy parameters (m, F)."""
        far = (np.asarray(X)[:, None] - self.tau) / self.scale
        weight = 1.0 / (1e-6 + np.sum(far**2, axis=-1))
        return weight @ self.theta / weight.sum(axis=1, keepdims=True)


# A TrialRunner is one station and the course of a trial: look at the drum, be
# taught, and later drum, which is look, ask the policy, move and listen.
trials = TrialRunner(scenario)
threshold = trials.reward_config.threshold
taught = drum_xy + [[-0.03, 0.04], [0.03, 0.04], [0.0, -0.05]]
policy = Neighbors(
    tau=[trials.gaze(xy, seed=0).task_parameter for xy in taught],
    theta=[trials.teach(xy, seed=0).theta for xy in taught],
)
print(f"   taught by hand at {len(taught)} places")
look, recording = trials.drum(drum_xy, policy, seed=0)
print(f"   an unseen place is seen as tau = {look.task_parameter.round(3)}")
tell(
    "the average of its neighbors",
    trials.reward(recording, trials.tap_prototypes()),
)


# %% 2. Your own motion
# With `motion_source: external` the gaze, the skill and the movement primitive
# are left out, and `affetto.desired_state` is an input of the station. What
# drives it is a LeafSystem like any other in Drake.
print("2. A motion of one's own: a LeafSystem for affetto.desired_state")


class Strike(LeafSystem):
    """Leads the joints through via postures, at rest in each.

    .. pydrake_system::

        name: Strike
        output_ports:
        - desired_state

    - desired_state: (2n) angles and rates, rad and rad/s.
    """

    def __init__(self, times, postures):
        """Takes times (m,) s and the postures there (m, n) rad."""
        super().__init__()
        self._times, self._postures = np.array(times), np.array(postures)
        # Without a word on what it depends on, a Python output counts as
        # depending on everything.
        self.DeclareVectorOutputPort(
            name="desired_state",
            size=2 * self._postures.shape[1],
            calc=self._calc_desired_state,
            prerequisites_of_calc={self.time_ticket()},
        )

    def _calc_desired_state(self, context, output):
        t = np.clip(context.get_time(), self._times[0], self._times[-1])
        i = np.searchsorted(self._times[1:-1], t, side="right")
        span = self._times[i + 1] - self._times[i]
        s = (t - self._times[i]) / span
        way = self._postures[i + 1] - self._postures[i]
        blend = s**3 * (10 - 15 * s + 6 * s**2)  # minimum jerk
        rate = 30 * s**2 * (1 - s) ** 2 / span
        output.SetFromVector(
            np.concatenate([self._postures[i] + blend * way, rate * way])
        )


def posture_at(station, p_WPalm):
    """The posture next to the start that brings the palm to p_WPalm (3,)."""
    context = station.CreateDefaultContext()  # inactive joints are locked
    ik = InverseKinematics(
        station.plant, station.plant.GetMyMutableContextFromRoot(context)
    )
    palm = station.plant.GetFrameByName("right_palm")
    world = station.plant.world_frame()
    ik.AddPositionConstraint(
        palm, np.zeros(3), world, p_WPalm - 1e-3, p_WPalm + 1e-3
    )
    start = station.plant.GetPositions(
        station.plant.GetMyContextFromRoot(context)
    )
    ik.prog().AddQuadraticErrorCost(np.eye(len(start)), start, ik.q())
    result = Solve(ik.prog(), start)
    assert result.is_success()
    station.plant.SetPositions(
        station.plant.GetMyMutableContextFromRoot(context),
        result.GetSolution(ik.q()),
    )
    state = station.GetOutputPort("affetto.joint_state").Eval(context)
    return state[: station.num_joints]


def strike(station, depth):
    """A stroke that turns where the hand is pressed `depth` m into the drum."""
    context = station.CreateDefaultContext()
    station.set_drum_position(context, drum_xy)
    touching = station.touching_position(context)
    rest = station.start_posture
    above = posture_at(station, touching + [0, 0, 0.06])
    low = posture_at(station, touching - [0, 0, depth])
    return Strike(
        times=[0.2, 0.9, 1.4, 1.7, 2.1, 2.8],
        postures=[rest, above, low, low, above, rest],
    )


# The sound comes from contacts and valves: whoever logs them can listen.
sound = load_sound_config(scenario.sound)
voice = DrumVoice(sound.voice)
SOUNDING = ("drum.contact_force", "drum.knock_force", "affetto.mass_flow")


def play(add_mine, **sources):
    """Runs the station with one's own systems beside it; returns the reward.

    Args:
        add_mine: a function of a builder and the station in it, that adds
            one's own systems and connects them.
        sources: which parts of the station to leave out for that.
    """
    builder = DiagramBuilder()
    station = builder.AddNamedSystem(
        "station", AffettoStation(dataclasses.replace(scenario, **sources))
    )
    add_mine(builder, station)
    step = scenario.plant_config.time_step
    logs = [
        LogVectorOutput(station.GetOutputPort(name), builder, step)
        for name in SOUNDING
    ]
    simulator = Simulator(builder.Build())
    root = simulator.get_mutable_context()
    station.reset(root)  # at rest, gravity balanced, inactive joints locked
    station.set_drum_position(root, drum_xy)
    simulator.AdvanceTo(2.8)
    contact, knock, flow = (log.FindLog(root).data().T for log in logs)
    heard = voice.synthesize(
        logs[0].FindLog(root).sample_times(),
        *contact.T,
        *knock.T,
        np.abs(flow),
        np.random.default_rng(0),
    )
    return reward(
        spectrogram(heard, voice.rate, sound.reward),
        tap_prototypes(voice, sound.reward),
    )


def add_strike(builder, station, depth=0.04):
    """Adds the stroke in place of gaze, skill and movement primitive."""
    motion = builder.AddNamedSystem("strike", strike(station, depth))
    builder.Connect(
        motion.get_output_port(),
        station.GetInputPort("affetto.desired_state"),
    )


tell(
    "a stroke that turns 3 cm above the head",
    play(partial(add_strike, depth=-0.03), motion_source="external"),
)
tell(
    "a stroke that means to go 4 cm deeper",
    play(add_strike, motion_source="external"),
)


# %% 3. Your own controller
# With `valve_source: external` the controller is left out, and the openings of
# the valves, `affetto.valve_opening`, are an input. Proportional valves are
# dear. Would cheap ones do, that are open or closed and nothing between?
print("3. A controller of one's own: a LeafSystem for affetto.valve_opening")


class OnOffValves(LeafSystem):
    """Fills or empties wholly where the pressure is off by more than a margin.

    .. pydrake_system::

        name: OnOffValves
        input_ports:
        - desired_state
        - estimated_state
        - chamber_pressure
        output_ports:
        - valve_opening

    - desired_state, estimated_state (2n): rad, rad/s.
    - chamber_pressure (2n): [p_a; p_b], Pa absolute.
    - valve_opening (n): -1, 0 or 1; held from one update to the next.
    """

    def __init__(self, p_rest, *, kP=5e5, kD=2.5e4, margin=2e4, period=0.005):
        """Takes p_rest (n,): p_a - p_b that holds the robot at rest, Pa."""
        super().__init__()
        self._p_rest = np.array(p_rest)
        self._kP, self._kD, self._margin = kP, kD, margin
        n = len(self._p_rest)
        self._desired = self.DeclareVectorInputPort("desired_state", 2 * n)
        self._estimated = self.DeclareVectorInputPort("estimated_state", 2 * n)
        self._pressure = self.DeclareVectorInputPort("chamber_pressure", 2 * n)
        held = self.DeclareDiscreteState(n)
        self.DeclareStateOutputPort("valve_opening", held)
        self.DeclarePeriodicDiscreteUpdateEvent(period, 0.0, self._update)

    def _update(self, context, values):
        error = self._desired.Eval(context) - self._estimated.Eval(context)
        e, e_dot = np.split(error, 2)
        p_a, p_b = np.split(self._pressure.Eval(context), 2)
        missing = self._p_rest + self._kP * e + self._kD * e_dot - (p_a - p_b)
        values.get_mutable_value()[:] = np.where(
            np.abs(missing) > self._margin, np.sign(missing), 0.0
        )


def add_strike_and_valves(builder, station):
    """Adds the stroke, and the valves in place of the controller."""
    add_strike(builder, station)
    at_rest = station.CreateDefaultContext()
    p_a, p_b = np.split(
        station.GetOutputPort("affetto.chamber_pressure").Eval(at_rest), 2
    )
    valves = builder.AddNamedSystem("valves", OnOffValves(p_a - p_b))
    for name in ("desired_state", "estimated_state", "chamber_pressure"):
        builder.Connect(
            station.GetOutputPort(f"affetto.{name}"), valves.GetInputPort(name)
        )
    builder.Connect(
        valves.get_output_port(), station.GetInputPort("affetto.valve_opening")
    )


tell(
    "the same stroke by on-off valves",
    play(
        add_strike_and_valves,
        motion_source="external",
        valve_source="external",
    ),
)
