"""How a person's hand leads the robot's hand to the drum and back.

A person does not impose a trajectory: an intended motion (smooth, no faster
than a human arm) pulls through the impedance of the teacher's own arm, with a
bounded force and some tremor. A slow integral stands for the teacher watching
the hand and correcting what is left of the error.
"""

import dataclasses
import math
from typing import Any

import numpy as np

from drake_affetto.common.errors import require_range


@dataclasses.dataclass
class Variation:
    """A number that differs from demonstration to demonstration."""

    mean: float = 0.0
    sd: float = 0.0

    def draw(self, rng: np.random.Generator, low: float) -> float:
        """Draws a value within two standard deviations, at least `low`."""
        deviation = float(np.clip(rng.standard_normal(), -2.0, 2.0))
        return max(low, self.mean + self.sd * deviation)


def _vary(mean: float, sd: float):
    return dataclasses.field(default_factory=lambda: Variation(mean, sd))


@dataclasses.dataclass
class TeacherConfig:
    """The teacher's arm and habits.

    Attributes:
        duration: length of a demonstration, s (paper: 3 s).
        recording_rate: rate at which joint angles are recorded, Hz.
        update_rate: rate of the teacher's force, Hz.
        stiffness: of the teacher's arm, N/m.
        damping: of the teacher's arm, N s/m.
        watching: integral of the hand's position error, N/(m s).
        max_force: the most a teacher pulls with, N.
        bandwidth: of the intended motion, Hz.
        tremor: standard deviation of the tremor's force, N (6 to 12 Hz).
        gain_scale: share of the playback gains kP, kD that is left on while
            teaching; with all of them a person cannot move the arm.
        settling_time: how long the equilibrium outputs u_eq are averaged, s.
        lift: height above the head from which the stroke begins, m.
        reach_time: from the grasp to that height, s.
        stroke_time: from there to the head, s.
        press_depth: how far the soft hand is pressed into the head, m.
        dwell_time: how long it is pressed, s.
        return_time: back to that height, s.
        aim_sd: standard deviation of the point aimed at on the head, m.
        firmer_depth: what each repeated attempt adds to the depth, m.
        firmer_dwell: what each repeated attempt adds to the dwell, s.
        max_attempts: how often one position is tried.
    """

    duration: float = 3.0
    recording_rate: float = 100.0
    update_rate: float = 200.0
    stiffness: float = 400.0
    damping: float = 25.0
    watching: float = 800.0
    max_force: float = 30.0
    bandwidth: float = 3.0
    tremor: float = 0.15
    gain_scale: float = 0.2
    settling_time: float = 0.2
    lift: Variation = _vary(0.07, 0.01)
    reach_time: Variation = _vary(0.9, 0.05)
    stroke_time: Variation = _vary(0.5, 0.05)
    press_depth: Variation = _vary(0.014, 0.002)
    dwell_time: Variation = _vary(0.25, 0.02)
    return_time: Variation = _vary(0.4, 0.03)
    aim_sd: float = 0.005
    firmer_depth: float = 0.005
    firmer_dwell: float = 0.06
    max_attempts: int = 4

    def varied(self, factor: float) -> "TeacherConfig":
        """A teacher whose demonstrations differ `factor` times as much."""
        changed: dict[str, Any] = {"aim_sd": factor * self.aim_sd}
        for field in dataclasses.fields(self):
            value = getattr(self, field.name)
            if isinstance(value, Variation):
                changed[field.name] = Variation(value.mean, factor * value.sd)
        return dataclasses.replace(self, **changed)

    def check(self, where: str) -> None:
        """Raises InputError for the first field that does not fit."""
        for name, low, high in (
            ("duration", 0.5, 30.0),
            ("recording_rate", 10.0, 1000.0),
            ("update_rate", 50.0, 1000.0),
            ("stiffness", 1.0, 5000.0),
            ("damping", 0.0, 500.0),
            ("watching", 0.0, 10000.0),
            ("max_force", 1.0, 200.0),
            ("bandwidth", 0.2, 20.0),
            ("tremor", 0.0, 5.0),
            ("gain_scale", 0.01, 1.0),
            ("settling_time", 0.01, 5.0),
            ("aim_sd", 0.0, 0.05),
            ("firmer_depth", 0.0, 0.02),
            ("firmer_dwell", 0.0, 0.5),
            ("max_attempts", 1, 20),
        ):
            require_range(f"{where}.{name}", getattr(self, name), low, high)
        for name in (
            "lift",
            "reach_time",
            "stroke_time",
            "press_depth",
            "dwell_time",
            "return_time",
        ):
            variation = getattr(self, name)
            require_range(f"{where}.{name}.mean", variation.mean, 0.001, 5.0)
            require_range(f"{where}.{name}.sd", variation.sd, 0.0, 1.0)


@dataclasses.dataclass(frozen=True)
class Stroke:
    """One intended motion of the hand, in the world frame.

    Attributes:
        target: (3,) where the palm's centre shall come to rest on the drum, m
            (already lower than the touching height, by the depth pressed).
        lift: height above `target` from which the stroke begins, m.
        times: (6,) end of each phase after the grasp, s: reach, stroke,
            dwell, lift off, back at the start, end.
        tremor: (3, 3, K) amplitude, angular frequency and phase of the K
            sines of the tremor's force, for each axis.
    """

    target: np.ndarray
    lift: float
    times: np.ndarray
    tremor: np.ndarray


def draw_stroke(
    config: TeacherConfig,
    touching: np.ndarray,
    rng: np.random.Generator,
    attempt: int = 0,
) -> Stroke:
    """Draws one demonstration's stroke.

    Args:
        touching: (3,) the palm's centre when the hand just touches the middle
            of the drum's head, in the world, m.
        rng: where the differences between demonstrations come from.
        attempt: 0 for the first; each further one is a little more firm
            (deeper and longer, not faster).
    """
    aim = np.append(config.aim_sd * np.clip(rng.standard_normal(2), -2, 2), 0)
    depth = config.press_depth.draw(rng, 0.002) + attempt * config.firmer_depth
    reach = config.reach_time.draw(rng, 0.3)
    stroke = config.stroke_time.draw(rng, 0.25)
    dwell = config.dwell_time.draw(rng, 0.0) + attempt * config.firmer_dwell
    lift_off = config.return_time.draw(rng, 0.2)
    ends = np.cumsum([reach, stroke, dwell, lift_off])
    # What is left of the duration goes into the way back, most of it moving.
    rest = max(0.3, config.duration - ends[-1])
    times = np.append(ends, [ends[-1] + 0.85 * rest, ends[-1] + rest])
    sines = 5
    amplitude = np.full((3, sines), config.tremor * math.sqrt(2.0 / sines))
    frequency = 2.0 * np.pi * rng.uniform(6.0, 12.0, (3, sines))
    phase = rng.uniform(0.0, 2.0 * np.pi, (3, sines))
    return Stroke(
        target=np.asarray(touching, float) + aim - [0.0, 0.0, depth],
        lift=config.lift.draw(rng, 0.02) + depth,
        times=times,
        tremor=np.stack([amplitude, frequency, phase]),
    )


def intended_position(
    stroke: Stroke, grasp: np.ndarray, t: float
) -> np.ndarray:
    """Where the teacher means the palm to be.

    Args:
        grasp: (3,) the palm's position when the teacher took hold of it, m.
        t: time since then, s.

    Returns:
        (3,) m, from minimum-jerk segments through the phases of `stroke`.
    """
    above = stroke.target + np.array([0.0, 0.0, stroke.lift])
    points = (grasp, above, stroke.target, stroke.target, above, grasp, grasp)
    i = int(np.searchsorted(stroke.times, t, side="right"))
    if i >= len(stroke.times):
        return np.array(grasp, float)
    begin = 0.0 if i == 0 else stroke.times[i - 1]
    s = np.clip((t - begin) / (stroke.times[i] - begin), 0.0, 1.0)
    blend = s**3 * (10.0 - 15.0 * s + 6.0 * s**2)
    return points[i] + blend * (points[i + 1] - points[i])


def tremor_force(stroke: Stroke, t: float) -> np.ndarray:
    """The tremor's force at time t, (3,) N."""
    amplitude, frequency, phase = stroke.tremor
    return np.sum(amplitude * np.sin(frequency * t + phase), axis=1)


@dataclasses.dataclass
class TeacherState:
    """What a teacher carries from one update to the next.

    Attributes:
        intention, intention_rate: (3,) the intended motion after the
            teacher's bandwidth, m and m/s.
        correction: (3,) force from watching the error, N.
        force: (3,) on the palm, N.
    """

    intention: np.ndarray
    intention_rate: np.ndarray
    correction: np.ndarray
    force: np.ndarray

    @staticmethod
    def at(grasp: np.ndarray) -> "TeacherState":
        """The state at the moment the palm is grasped."""
        zero = np.zeros(3)
        return TeacherState(np.array(grasp, float), zero, zero, zero)


def advance_teacher(
    config: TeacherConfig,
    state: TeacherState,
    goal: np.ndarray,
    palm: np.ndarray,
    palm_velocity: np.ndarray,
    tremor: np.ndarray,
    dt: float,
) -> TeacherState:
    """One update of the teacher's force.

    The intended motion passes a critically damped filter of the teacher's
    bandwidth (integrated exactly); the arm is a spring and damper about it;
    the sum, tremor included, never exceeds the teacher's strength.

    Args:
        goal: (3,) intended position at this time, m.
        palm, palm_velocity: (3,) of the robot's palm, m and m/s.
        tremor: (3,) N.
        dt: time since the last update, s.
    """
    w = 2.0 * np.pi * config.bandwidth
    offset = state.intention - goal
    slope = state.intention_rate + w * offset
    decay = math.exp(-w * dt)
    intention = goal + (offset + slope * dt) * decay
    rate = (state.intention_rate - w * slope * dt) * decay
    error = intention - palm
    correction = state.correction + config.watching * dt * error
    force = (
        config.stiffness * error
        + config.damping * (rate - palm_velocity)
        + correction
        + tremor
    )
    size = float(np.linalg.norm(force))
    if size > config.max_force:
        force = force * (config.max_force / size)
        # A teacher at the limit does not wind up a larger wish.
        correction = state.correction
    return TeacherState(intention, rate, correction, force)
