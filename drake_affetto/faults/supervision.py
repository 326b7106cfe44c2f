"""What a real robot can watch in itself, and when it says: not valid.

Each check gives a score, which is 1 where its threshold is. Nothing here knows
a contact, a true angle or where the drum stands: angles and pressures as they
are read, the commands, their time stamps, and what the image is like.

- A reading that does not change over many samples is stuck: real ones are
  noisy.
- A reading jumps, or is noisy, if the second difference of its angle is beyond
  what its known noise explains. No motion of the arm is as sudden.
- Pressures are predicted by the actuators' own equations (`pneumatics.chamber`)
  from the commands and the angles; the prediction is drawn to the reading with
  a gain. What it is off by, passed through a low-pass, tells of sensors,
  valves, leaks and supply.
- A joint follows what is desired of it, or something is wrong with it.
"""

import dataclasses
import enum
import math

import numba
import numpy as np
from numpy.typing import NDArray
from scipy.signal import lfilter

from drake_affetto.common.fields import check_ranges, number
from drake_affetto.common.typing import Array
from drake_affetto.pneumatics.chamber import FLOW_MODE, MASS_OFFSET, step_joints
from drake_affetto.sensing.readings import SensorParameters


class Check(enum.IntEnum):
    """What is checked; the order in which a reason is told."""

    ANGLE_STUCK = 0
    ANGLE_JUMP = 1
    ANGLE_NOISE = 2
    PRESSURE_STUCK = 3
    PRESSURE_RANGE = 4
    PRESSURE_JUMP = 5
    PRESSURE_MODEL = 6
    TRACKING = 7
    TICK_LATE = 8
    TICK_MISSED = 9
    IMAGE_DARK = 10
    IMAGE_BRIGHT = 11
    IMAGE_FLAT = 12
    IMAGE_BLURRED = 13
    IMAGE_FROZEN = 14
    MARKER_DOUBTFUL = 15
    MARKER_SECOND = 16
    MARKER_LOST = 17
    DRUM_MOVED = 18
    SOUND_DEAD = 19
    SOUND_CLIPPED = 20
    SOUND_NOISY = 21
    SOUND_ELSEWHERE = 22
    SOUND_UNREACHED = 23
    SOUND_MISSING = 24


CHECKS = len(Check)

REASONS: dict[Check, str] = {
    Check.ANGLE_STUCK: "angle reading does not change",
    Check.ANGLE_JUMP: "angle reading jumps",
    Check.ANGLE_NOISE: "angle reading is noisy",
    Check.PRESSURE_STUCK: "pressure reading does not change",
    Check.PRESSURE_RANGE: "pressure reading is out of range",
    Check.PRESSURE_JUMP: "pressure reading jumps",
    Check.PRESSURE_MODEL: "pressure is not what the valves give",
    Check.TRACKING: "joint does not follow",
    Check.TICK_LATE: "commands come late",
    Check.TICK_MISSED: "commands are missing",
    Check.IMAGE_DARK: "image is dark",
    Check.IMAGE_BRIGHT: "image is over-exposed",
    Check.IMAGE_FLAT: "image has no contrast",
    Check.IMAGE_BLURRED: "image is blurred",
    Check.IMAGE_FROZEN: "image does not change",
    Check.MARKER_DOUBTFUL: "marker is seen in part",
    Check.MARKER_SECOND: "more than one marker is seen",
    Check.MARKER_LOST: "marker is not found",
    Check.DRUM_MOVED: "drum is seen elsewhere afterwards",
    Check.SOUND_DEAD: "microphone is silent",
    Check.SOUND_CLIPPED: "microphone is clipped",
    Check.SOUND_NOISY: "it is loud before the stroke",
    Check.SOUND_ELSEWHERE: "a drum is heard while the hand is away from it",
    Check.SOUND_UNREACHED: "a drum is heard that the hand did not reach",
    Check.SOUND_MISSING: "the hand was on the drum and nothing is heard",
}

_OF_JOINTS = (Check.ANGLE_STUCK, Check.ANGLE_JUMP, Check.ANGLE_NOISE)
_OF_CHAMBERS = (
    Check.PRESSURE_STUCK,
    Check.PRESSURE_RANGE,
    Check.PRESSURE_JUMP,
    Check.PRESSURE_MODEL,
)


@dataclasses.dataclass
class SupervisorParameters:
    """Thresholds of the supervisor.

    Attributes:
        stuck_angle_ticks: Samples for which an angle may read the same.
        stuck_pressure_ticks: The same of a pressure.
        jump: Second difference of an angle, in its standard deviations.
        noise: Its mean square over `noise_time`, in variances.
        noise_time: Time constant of that, s.
        pressure_low: Least pressure that is read, Pa absolute.
        pressure_high: Greatest, Pa absolute.
        pressure_jump: Greatest error of a prediction in one sample, Pa.
        pressure_model: Greatest error of the predictions, Pa ...
        pressure_time: ... with this time constant, s.
        pressure_lag: Uncertainty of valves' lag and dead time, s: both may be
            off by what a chamber's pressure changed in that time, lately.
        observer_time: Time constant with which predictions follow readings, s.
        tracking: Greatest error of an angle, rad ...
        tracking_time: ... with this time constant, s.
        tick_age: Greatest age of a command, s.
        tick_missed: Greatest share of ticks without one ...
        tick_time: ... with this time constant, s.
        image_dark: Least mean of an image, levels.
        image_bright: Greatest share of pixels at their upper end.
        image_flat: Least standard deviation of an image, levels.
        image_blurred: Least strength of its strongest edges, levels.
        image_frozen: Images in a row that may be equal.
        confidence: Least confidence of the marker.
        whole: Least area of the marker's hue, as a share of the marker's, which
            is completed where it is hidden ...
        second: ... and the greatest: beyond it there is another one.
        margin: Distance from the image's edge from which on a marker is looked
            at for that, px.
        middle: Distance from the image's middle up to which one is that the
            gaze centers, px: farther off, the robot's own arm may hide it.
        moved: Greatest distance between the drum's task parameters before and
            after the movement.
        sound_dead: Least sound pressure (rms) before the stroke, Pa.
        sound_clipped: Greatest number of samples at the recording's extremes.
        sound_loud: Greatest sound pressure below 1 kHz before the stroke
            (rms), Pa.
        sound_elsewhere: Greatest sound pressure below 1 kHz (rms over 30 ms)
            while the hand is away from the drum, as a share of the loudest.
        near: Distance between hand and seen drum within which a hand as deep as
            `deep` below the head is heard, m.
        deep: That depth of the hand's lowest point, m.
        far: Distance beyond which no stroke is heard, m.
        low: Height of that point above the head from which on it may touch, m.
        ringing: How long a drum rings on, s.
    """

    stuck_angle_ticks: int = number(50, 2, 10_000)
    stuck_pressure_ticks: int = number(20, 2, 10_000)
    jump: float = number(8.0, 1.0, 100.0)
    noise: float = number(4.0, 1.0, 1000.0)
    noise_time: float = number(0.1, 0.01, 10.0)
    pressure_low: float = number(90e3, 0.0, 1e6)
    pressure_high: float = number(800e3, 1e5, 2e6)
    pressure_jump: float = number(40e3, 1.0, 1e6)
    pressure_model: float = number(40e3, 1.0, 1e6)
    pressure_time: float = number(0.05, 0.001, 10.0)
    pressure_lag: float = number(0.01, 0.0, 1.0)
    observer_time: float = number(0.2, 0.01, 10.0)
    tracking: float = number(0.3, 0.001, 3.0)
    tracking_time: float = number(0.2, 0.01, 10.0)
    tick_age: float = number(0.03, 0.001, 1.0)
    tick_missed: float = number(0.15, 0.0, 1.0)
    tick_time: float = number(0.2, 0.01, 10.0)
    image_dark: float = number(40.0, 0.0, 255.0)
    image_bright: float = number(0.3, 0.0, 1.0)
    image_flat: float = number(10.0, 0.0, 128.0)
    image_blurred: float = number(10.0, 0.0, 1000.0)
    image_frozen: int = number(2, 1, 100)
    confidence: float = number(0.6, 0.0, 1.0)
    whole: float = number(0.85, 0.0, 1.0)
    second: float = number(1.3, 1.0, 100.0)
    margin: float = number(25.0, 0.0, 1000.0)
    middle: float = number(53.0, 0.0, 1e4)
    moved: float = number(0.05, 0.0, 10.0)
    sound_dead: float = number(3e-4, 0.0, 1.0)
    sound_clipped: int = number(8, 1, 1_000_000)
    sound_loud: float = number(0.01, 0.0, 10.0)
    sound_elsewhere: float = number(0.2, 0.0, 1.0)
    near: float = number(0.025, 0.0, 1.0)
    deep: float = number(0.003, -1.0, 1.0)
    far: float = number(0.06, 0.0, 1.0)
    low: float = number(0.0, -1.0, 1.0)
    ringing: float = number(0.5, 0.0, 10.0)

    def check(self, where: str) -> None:
        """Raises InputError naming the first field that does not fit."""
        check_ranges(self, where)

    def signals(self) -> Array:
        """What `watch_signals` needs of them, in its order."""
        return np.array(
            [
                self.stuck_angle_ticks,
                self.stuck_pressure_ticks,
                self.jump,
                self.noise,
                self.noise_time,
                self.pressure_low,
                self.pressure_high,
                self.pressure_jump,
                self.pressure_model,
                self.pressure_time,
                self.observer_time,
                self.tracking,
                self.tracking_time,
                self.tick_age,
                self.tick_missed,
                self.tick_time,
                self.pressure_lag,
            ],
            dtype=float,
        )


def second_difference_deviation(
    sensors: SensorParameters, scales: Array, period: float
) -> Array:
    """Standard deviation of q_k - 2 q_{k-1} + q_{k-2} at rest (n,), rad.

    Args:
        sensors: Sensors of the joints, with their filter.
        scales: Noise and resolution (2, 3n), see `SensorParameters.scales`.
        period: Time between two samples, s.
    """
    n = scales.shape[1] // 3
    b, a = sensors.filter_rows(period)
    impulse = np.zeros(400)
    impulse[0] = 1.0
    gain = np.sqrt(
        np.sum(lfilter(np.convolve(b, [1.0, -2.0, 1.0]), a, impulse) ** 2)
    )
    # Rounding adds noise of a step's width over √12.
    own = np.hypot(scales[0, :n], scales[1, :n] / np.sqrt(12.0))
    return np.asarray(gain * own)


def watch_size(n: int) -> int:
    """Size of the memory of `watch_signals`: [filled, missed, stamp, angles
    (2n), pressures (2n), samples alike (3n), variance (n), error (n),
    prediction's error (2n), its change lately (2n)]."""
    return 3 + 13 * n


@numba.njit(cache=True)
def watch_signals(
    period: float,
    limits: NDArray[np.float64],
    deviation: NDArray[np.float64],
    parameters: NDArray[np.float64],
    now: float,
    desired: NDArray[np.float64],
    estimate: NDArray[np.float64],
    pressure: NDArray[np.float64],
    opening: NDArray[np.float64],
    tick_time: float,
    memory: NDArray[np.float64],
    predicted: NDArray[np.float64],
    torque: NDArray[np.float64],
    flow: NDArray[np.float64],
    actuators: NDArray[np.float64],
    scores: NDArray[np.float64],
    channels: NDArray[np.float64],
) -> None:
    """Watches one tick of the controller.

    Args:
        period: Time between two ticks, s.
        limits: Thresholds, see `SupervisorParameters.signals`.
        deviation: (n), see `second_difference_deviation`, rad.
        parameters: (ROWS, n) of the actuators as the robot knows them.
        now: Time, s.
        desired: (2n) angles and speeds, rad, rad/s.
        estimate: (2n) the same as read.
        pressure: (2n) as read, Pa.
        opening: (n) commands since the last tick.
        tick_time: Time stamp of the command that the valves have, s.
        memory: See `watch_size`; advanced. Where its first entry is 0 it is
            filled.
        predicted: (2n) pressures; advanced, as are the actuators' `torque`,
            `flow` and memory `actuators`.
        scores: (CHECKS); those of the signals are set.
        channels: (CHECKS) joint or chamber that each score is of; set.
    """
    n = opening.size
    q1 = memory[3 : 3 + n]
    q2 = memory[3 + n : 3 + 2 * n]
    p1 = memory[3 + 2 * n : 3 + 4 * n]
    alike = memory[3 + 4 * n : 3 + 7 * n]
    variance = memory[3 + 7 * n : 3 + 8 * n]
    error = memory[3 + 8 * n : 3 + 9 * n]
    surprise = memory[3 + 9 * n : 3 + 11 * n]
    swing = memory[3 + 11 * n : 3 + 13 * n]
    first = memory[0] == 0.0
    if first:
        memory[0] = 1.0
        memory[1] = 0.0
        memory[2] = tick_time
        for i in range(n):
            q1[i] = estimate[i]
            q2[i] = estimate[i]
            variance[i] = 1.0
            error[i] = 0.0
        for c in range(2 * n):
            p1[c] = pressure[c]
            predicted[c] = pressure[c]
            surprise[c] = 0.0
            swing[c] = 0.0
        alike[:] = 0.0
        actuators[:] = 0.0
    for k in range(10):
        scores[k] = 0.0
        channels[k] = 0.0
    for i in range(n):
        second = (estimate[i] - 2.0 * q1[i] + q2[i]) / deviation[i]
        alike[i] = alike[i] + 1.0 if abs(estimate[i] - q1[i]) < 1e-9 else 0.0
        q2[i] = q1[i]
        q1[i] = estimate[i]
        share = period / limits[4]
        variance[i] += share * (second * second - variance[i])
        late = period / limits[12]
        error[i] += late * (desired[i] - estimate[i] - error[i])
        found = (
            alike[i] / limits[0],
            abs(second) / limits[2],
            variance[i] / limits[3],
        )
        for k in range(3):
            if found[k] > scores[k]:
                scores[k] = found[k]
                channels[k] = i
        if abs(error[i]) / limits[11] > scores[7]:
            scores[7] = abs(error[i]) / limits[11]
            channels[7] = i

    before = predicted.copy()
    step_joints(
        period,
        FLOW_MODE,
        0.0,
        parameters,
        opening,
        estimate,
        predicted,
        torque,
        flow,
        actuators,
    )
    middle = 0.5 * (limits[5] + limits[6])
    half = 0.5 * (limits[6] - limits[5])
    for c in range(2 * n):
        alike[n + c] = alike[n + c] + 1.0 if pressure[c] == p1[c] else 0.0
        p1[c] = pressure[c]
        off = pressure[c] - predicted[c]
        surprise[c] += period / limits[9] * (off - surprise[c])
        swing[c] *= math.exp(-period / limits[10])
        change = abs(predicted[c] - before[c]) * limits[16] / period
        swing[c] = max(swing[c], change)
        of_chamber = (
            alike[n + c] / limits[1],
            abs(pressure[c] - middle) / half,
            abs(off) / (limits[7] + swing[c]),
            abs(surprise[c]) / (limits[8] + swing[c]),
        )
        for k in range(4):
            if of_chamber[k] > scores[3 + k]:
                scores[3 + k] = of_chamber[k]
                channels[3 + k] = c
        # The air that is taken to be there changes with its pressure.
        nearer = predicted[c] + period / limits[10] * off
        actuators[MASS_OFFSET + c] *= nearer / predicted[c]
        predicted[c] = nearer

    scores[8] = (now - tick_time) / limits[13]
    missed = 1.0 if tick_time <= memory[2] and not first else 0.0
    memory[1] += period / limits[15] * (missed - memory[1])
    memory[2] = tick_time
    scores[9] = memory[1] / limits[14]


def reason(check: int, channel: int, joints: tuple[str, ...]) -> str:
    """A check that was not passed, in words.

    Args:
        check: Number of the check.
        channel: Joint, or chamber in [p_a; p_b], that it is of.
        joints: Names of the n joints.
    """
    which = Check(check)
    text = REASONS[which]
    if which in _OF_CHAMBERS:
        side = "ab"[channel // len(joints)]
        return f"{text} ({joints[channel % len(joints)]}, chamber {side})"
    if which in _OF_JOINTS or which == Check.TRACKING:
        return f"{text} ({joints[channel]})"
    return text


def image_scores(
    parameters: SupervisorParameters,
    statistics: Array,
    alike: int,
) -> dict[Check, float]:
    """Scores of an image, whatever it shows.

    Args:
        parameters: Thresholds.
        statistics: See `images.image_statistics`.
        alike: Images in a row, before this one, that were the same.
    """
    mean, contrast, saturated, sharpness, *_ = statistics
    return {
        Check.IMAGE_DARK: parameters.image_dark / max(mean, 1e-3),
        Check.IMAGE_BRIGHT: saturated / max(parameters.image_bright, 1e-6),
        Check.IMAGE_FLAT: parameters.image_flat / max(contrast, 1e-3),
        Check.IMAGE_BLURRED: parameters.image_blurred / max(sharpness, 1e-3),
        Check.IMAGE_FROZEN: alike / parameters.image_frozen,
    }


def marker_scores(
    parameters: SupervisorParameters,
    pixels: Array,
    hue_area: float,
    size: tuple[int, int],
    centered: bool,
) -> dict[Check, float]:
    """Scores of how the marker is seen; none where it is not well in view.

    Args:
        parameters: Thresholds.
        pixels: u, v, area and confidence, see `BlobSensor`.
        hue_area: Area of the marker's hue in the image, px².
        size: Width and height of the image, px.
        centered: Whether the gaze centers the marker before τ is taken.
    """
    u, v, area, confidence = pixels
    margin = parameters.margin
    width, height = size
    if centered and abs(u - 0.5 * width) > parameters.middle:
        return {}
    if area <= 0.0 or not (
        margin < u < width - margin and margin < v < height - margin
    ):
        return {}
    share = hue_area / area
    return {
        Check.MARKER_DOUBTFUL: max(
            parameters.confidence / max(confidence, 1e-3),
            parameters.whole / max(share, 1e-3),
        ),
        Check.MARKER_SECOND: share / parameters.second,
    }
