"""Model of a person who moves the robot's hand to the drum and back.

The teacher's force is that of an impedance about an intended motion, which is
smooth and no faster than a human arm. Tremor is added, and the force is
bounded. An integral of the hand's position error models that the teacher
watches the hand and corrects the error that remains.
"""

import dataclasses
import math
from typing import Any

import numpy as np

from drake_affetto.common.errors import require_range
from drake_affetto.common.fields import check_ranges, number
from drake_affetto.common.typing import Array
from drake_affetto.motion.minimum_jerk import minimum_jerk


@dataclasses.dataclass
class ClippedNormal:
    """A normal distribution, clipped at two standard deviations.

    Attributes:
        mean: Mean, before a lower bound is applied.
        sd: Standard deviation.
    """

    mean: float = 0.0
    sd: float = 0.0

    def draw(self, rng: np.random.Generator, low: float) -> float:
        """Draws a value that is at least `low`."""
        deviation = float(np.clip(rng.standard_normal(), -2.0, 2.0))
        return max(low, self.mean + self.sd * deviation)


def _normal(mean: float, sd: float) -> Any:
    return dataclasses.field(default_factory=lambda: ClippedNormal(mean, sd))


@dataclasses.dataclass
class TeacherConfig:
    """Parameters of the teacher's arm and strokes.

    Attributes:
        duration: Duration of a demonstration, s (paper: 3 s).
        recording_rate: Rate at which joint angles are recorded, Hz.
        update_rate: Update rate of the teacher's force, Hz.
        stiffness: Stiffness of the teacher's arm, N/m.
        damping: Damping of the teacher's arm, N s/m.
        watching: Integral gain on the hand's position error, N/(m s).
        max_force: Greatest force of the teacher, N.
        bandwidth: Bandwidth of the intended motion, Hz.
        tremor: Standard deviation of the tremor's force, N (6 to 12 Hz).
        gain_scale: Factor of the controller's gains kP and kD during a
            demonstration. With the full gains a person cannot move the arm.
        settling_time: Time over which the controller's output at equilibrium,
            u_eq, is averaged, s.
        lift: Height above the drum's head at which the stroke begins, m.
        reach_time: Time from the grasp to that height, s.
        stroke_time: Time from that height to the head, s.
        press_depth: Depth to which the soft hand is pressed into the head, m.
        dwell_time: Time for which it is pressed, s.
        return_time: Time from the head back to that height, s.
        aim_sd: Standard deviation of the target point on the head, m.
        firmer_depth: Increment of the depth for each further attempt, m.
        firmer_dwell: Increment of the dwell for each further attempt, s.
        max_attempts: Maximum number of attempts at one position.
    """

    duration: float = number(3.0, 0.5, 30.0)
    recording_rate: float = number(100.0, 10.0, 1000.0)
    update_rate: float = number(200.0, 50.0, 1000.0)
    stiffness: float = number(400.0, 1.0, 5000.0)
    damping: float = number(25.0, 0.0, 500.0)
    watching: float = number(800.0, 0.0, 10000.0)
    max_force: float = number(30.0, 1.0, 200.0)
    bandwidth: float = number(3.0, 0.2, 20.0)
    tremor: float = number(0.15, 0.0, 5.0)
    gain_scale: float = number(0.2, 0.01, 1.0)
    settling_time: float = number(0.2, 0.01, 5.0)
    lift: ClippedNormal = _normal(0.07, 0.01)
    reach_time: ClippedNormal = _normal(0.9, 0.05)
    stroke_time: ClippedNormal = _normal(0.5, 0.05)
    press_depth: ClippedNormal = _normal(0.014, 0.002)
    dwell_time: ClippedNormal = _normal(0.25, 0.02)
    return_time: ClippedNormal = _normal(0.4, 0.03)
    aim_sd: float = number(0.005, 0.0, 0.05)
    firmer_depth: float = number(0.005, 0.0, 0.02)
    firmer_dwell: float = number(0.06, 0.0, 0.5)
    max_attempts: int = number(4, 1, 20)

    def varied(self, factor: float) -> "TeacherConfig":
        """A copy with all standard deviations scaled by `factor`."""
        changed: dict[str, Any] = {"aim_sd": factor * self.aim_sd}
        for field in dataclasses.fields(self):
            value = getattr(self, field.name)
            if isinstance(value, ClippedNormal):
                changed[field.name] = ClippedNormal(
                    value.mean, factor * value.sd
                )
        return dataclasses.replace(self, **changed)

    def check(self, where: str) -> None:
        """Raises InputError for the first field that does not fit."""
        check_ranges(self, where)
        for name in (
            "lift",
            "reach_time",
            "stroke_time",
            "press_depth",
            "dwell_time",
            "return_time",
        ):
            distribution = getattr(self, name)
            require_range(f"{where}.{name}.mean", distribution.mean, 0.001, 5.0)
            require_range(f"{where}.{name}.sd", distribution.sd, 0.0, 1.0)


@dataclasses.dataclass(frozen=True)
class Stroke:
    """One intended motion of the hand, in the world frame.

    Attributes:
        target: Lowest position of the palm's center (3,), m. It is below the
            position at which the hand touches, by the depth of pressing.
        lift: Height above `target` at which the stroke begins, m.
        times: End of each phase after the grasp (6,), s: reach, stroke,
            dwell, lift off, back at the start, end.
        tremor: Amplitude, angular frequency and phase of the K sines of the
            tremor's force (3, 3, K); the last but one index is the axis.
    """

    target: Array
    lift: float
    times: Array
    tremor: Array


def draw_stroke(
    config: TeacherConfig,
    touching: Array,
    rng: np.random.Generator,
    attempt: int = 0,
) -> Stroke:
    """Draws one demonstration's stroke.

    Args:
        config: Parameters of the teacher.
        touching: Position of the palm's center (3,), world frame, m, at which
            the hand touches the center of the drum's head.
        rng: Source of the differences between demonstrations.
        attempt: Number of earlier attempts. Each further one is a little more
            firm: deeper and longer, not faster.
    """
    aim = np.append(config.aim_sd * np.clip(rng.standard_normal(2), -2, 2), 0)
    depth = config.press_depth.draw(rng, 0.002) + attempt * config.firmer_depth
    reach = config.reach_time.draw(rng, 0.3)
    stroke = config.stroke_time.draw(rng, 0.25)
    dwell = config.dwell_time.draw(rng, 0.0) + attempt * config.firmer_dwell
    lift_off = config.return_time.draw(rng, 0.2)
    ends = np.cumsum([reach, stroke, dwell, lift_off])
    # The remaining time is for the way back; the hand rests in its last part.
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


def intended_position(stroke: Stroke, grasp: Array, t: float) -> Array:
    """The intended position of the palm.

    Args:
        stroke: The intended motion.
        grasp: Position of the palm at the grasp (3,), m.
        t: Time since the grasp, s.

    Returns:
        Position (3,), m, on minimum-jerk segments through the phases of
        `stroke`.
    """
    above = stroke.target + np.array([0.0, 0.0, stroke.lift])
    points = (grasp, above, stroke.target, stroke.target, above, grasp, grasp)
    i = int(np.searchsorted(stroke.times, t, side="right"))
    if i >= len(stroke.times):
        return np.array(grasp, float)
    begin = 0.0 if i == 0 else stroke.times[i - 1]
    blend = minimum_jerk((t - begin) / (stroke.times[i] - begin))
    return points[i] + blend * (points[i + 1] - points[i])


def tremor_force(stroke: Stroke, t: float) -> Array:
    """The tremor's force at time t, (3,) N."""
    amplitude, frequency, phase = stroke.tremor
    return np.sum(amplitude * np.sin(frequency * t + phase), axis=1)


@dataclasses.dataclass
class TeacherState:
    """State of the teacher between updates.

    Attributes:
        intention: Intended position, filtered with the bandwidth (3,), m.
        intention_rate: Rate of `intention` (3,), m/s.
        correction: Integral part of the force (3,), N.
        force: Force on the palm (3,), N.
    """

    intention: Array
    intention_rate: Array
    correction: Array
    force: Array

    @staticmethod
    def at(grasp: Array) -> "TeacherState":
        """The state at the moment the palm is grasped."""
        zero = np.zeros(3)
        return TeacherState(np.array(grasp, float), zero, zero, zero)


def advance_teacher(
    config: TeacherConfig,
    state: TeacherState,
    goal: Array,
    palm: Array,
    palm_velocity: Array,
    tremor: Array,
    dt: float,
) -> TeacherState:
    """One update of the teacher's force.

    The intended motion passes a critically damped filter with the teacher's
    bandwidth, which is integrated exactly. The force is

        f = K (p_i - p) + D (ṗ_i - ṗ) + ∫ K_I (p_i - p) dt + tremor

    with the filtered intention p_i and the palm p, scaled down to `max_force`.

    Args:
        config: Parameters of the teacher.
        state: State after the last update.
        goal: Intended position at this time (3,), m.
        palm: Position of the palm (3,), m.
        palm_velocity: Velocity of the palm (3,), m/s.
        tremor: Force of the tremor (3,), N.
        dt: Time since the last update, s.
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
        # Anti-windup: at the limit the integral is kept.
        correction = state.correction
    return TeacherState(intention, rate, correction, force)
