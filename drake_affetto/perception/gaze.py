"""Turning the upper body until the marker is centered, as a state machine.

The servo looks at a new image at the camera's rate. From the joint's angle q
at the time of exposure and the marker's distance from the image's middle it
takes the yaw at which the marker would be centered,

    q* = q - atan(e / f) / k,

e being the distance [pixels], f the focal length and k how much the image
turns per turn of the joint. It commands that yaw, plus an integral of what
the joint stays behind (a pneumatic joint with friction stops a degree short).
Because q* belongs to one image, neither the actuator's lag nor the camera's
latency makes it wind up.

All state is one array of floats, so that it fits a discrete state vector;
`Gaze` holds settings only.
"""

import dataclasses
import enum
import math
from typing import NamedTuple

import numpy as np

from drake_affetto.common.errors import require
from drake_affetto.common.fields import check_ranges, number
from drake_affetto.common.typing import Array


class GazeMode(enum.IntEnum):
    """What the servo is to do."""

    CENTER = 0
    FIXED_YAW = 1


class GazePhase(enum.IntEnum):
    """Where the servo stands."""

    START = 0
    TRACK = 1
    SEARCH = 2
    SETTLED = 3
    FAILED = 4


@dataclasses.dataclass
class GazeConfig:
    """Settings of the gaze servo.

    Lengths in the image are fractions of its width; speeds per second.

    Attributes:
        gain: part of the way to q* that is commanded per image.
        integral_gain: growth [rad/s per rad] of the command while the joint
            stays behind q*.
        integral_limit: greatest offset [rad] of the integral.
        image_gain: k, image angle per joint angle. More than 1 if the camera
            stands before the axis of the joint, and less if it looks down.
        max_speed: slew limit [rad/s] of the yaw command.
        search_speed: speed [rad/s] of the search sweep.
        yaw_min: lower end [rad] of the search and of any command.
        yaw_max: upper end [rad] of the search and of any command.
        tolerance: greatest distance of the marker from the middle.
        still: greatest speed of the marker in a still image [1/s].
        settled_frames: images in a row that must be still and centered; τ is
            their mean.
        near_yaw: at a fixed yaw, how near [rad] the joint must be to it when
            τ is taken.
        lost_frames: images in a row without marker that start the search (or
            the failure, at a fixed yaw).
        timeout: time [s] after which the trial fails.
        keep_yaw: whether the yaw stays where it is once settled, instead of
            going back to the start posture.
    """

    gain: float = number(1.0, 0.05, 2.0)
    integral_gain: float = number(1.2, 0.0, 20.0)
    integral_limit: float = number(0.15, 0.0, 1.0)
    image_gain: float = number(1.0, 0.1, 5.0)
    max_speed: float = number(0.8, 0.01, 20.0)
    search_speed: float = number(0.5, 0.01, 20.0)
    yaw_min: float = number(-0.5, -math.pi, math.pi)
    yaw_max: float = number(0.5, -math.pi, math.pi)
    tolerance: float = number(0.01, 1e-4, 0.5)
    still: float = number(0.06, 1e-4, 10.0)
    settled_frames: int = number(4, 1, 50)
    near_yaw: float = number(0.012, 1e-3, 1.0)
    lost_frames: int = number(3, 1, 100)
    timeout: float = number(8.0, 0.5, 600.0)
    keep_yaw: bool = False

    def check(self, where: str) -> None:
        """Raises InputError if a value is out of range."""
        check_ranges(self, where)
        require(
            self.yaw_min < self.yaw_max,
            f"{where}.yaw_max",
            self.yaw_max,
            f"more than yaw_min ({self.yaw_min:g})",
        )


@dataclasses.dataclass
class GazeView:
    """How x_img, y_img lie in the image, for the servo.

    Attributes:
        center_x: x_img of the middle of the image.
        width: the image's width in units of x_img.
        height_per_width: unit of y_img over unit of x_img, in pixels.
        focal: focal length in units of x_img.
    """

    center_x: float = number(0.5, -100, 100)
    width: float = number(1.0, 1e-3, 1e3)
    height_per_width: float = number(0.75, 1e-3, 1e3)
    focal: float = number(0.8, 1e-3, 1e4)

    def check(self, where: str) -> None:
        """Raises InputError if a value is out of range."""
        check_ranges(self, where)


@dataclasses.dataclass
class GazeTask:
    """What one trial asks of the servo; parameters in a context.

    Attributes:
        enabled: whether to look at all.
        mode: centre the marker, or look from a fixed yaw.
        fixed_yaw: that yaw [rad].
        start_yaw: yaw [rad] of the start posture.
    """

    enabled: bool = True
    mode: GazeMode = GazeMode.CENTER
    fixed_yaw: float = 0.0
    start_yaw: float = 0.0

    def to_vector(self) -> Array:
        """The task as an array (4,)."""
        return np.array(
            [
                float(self.enabled),
                float(self.mode),
                self.fixed_yaw,
                self.start_yaw,
            ]
        )

    @classmethod
    def from_vector(cls, vector: Array) -> "GazeTask":
        """The inverse of `to_vector`.

        Args:
            vector: As `to_vector` gives it.
        """
        return cls(
            bool(vector[0] > 0.5),
            GazeMode(round(float(vector[1]))),
            float(vector[2]),
            float(vector[3]),
        )


# Layout of the state.
PHASE = 0
T_BEGIN = 1  # time of the first image
T_RAMP = 2  # the command ramps from YAW_RAMP at T_RAMP …
YAW_RAMP = 3
YAW_GOAL = 4  # … to YAW_GOAL …
SPEED = 5  # … at this speed
OFFSET = 6  # the integral
T_LAST = 7  # time of the latest image with a marker
X_LAST = 8  # and where the marker was
Y_LAST = 9
Q_SEEN = 10  # and the joint's angle then
IMAGE_GAIN = 11  # k, as corrected on the way
MISSED = 12  # images in a row without marker
SWEEP = 13  # leg of the search
COUNT = 14  # still and centered images in a row …
SUM_1 = 15  # … and the sums of their τ
SUM_2 = 16
TAU_1 = 17
TAU_2 = 18
STANDING = 19  # whether the joint stood at the latest image
T_YAW = 20  # time of the latest image, marker or not
Q_LAST = 21  # and the joint's angle then
SLOPE_X = 22  # change of the blob per turn of the joint, as seen on the way
SLOPE_Y = 23
SIZE = 24

# An integral begins only near the goal [rad]; farther off the way is free.
_NEAR = 0.15
_KEPT_ONCE_LOOSE = 0.2


class _Look(NamedTuple):
    """One image and when it is taken in.

    Attributes:
        t: Time, s.
        blob: x_img, y_img, found (3,).
        q: The joint's angle when the image was exposed, rad.
        t_image: Time of the exposure, s.
        task: What the trial asks.
    """

    t: float
    blob: Array
    q: float
    t_image: float
    task: GazeTask


class Gaze:
    """The gaze servo without ports.

    Args:
        config: settings.
        view: how the blob's coordinates lie in the image.
    """

    def __init__(self, config: GazeConfig, view: GazeView) -> None:
        config.check("gaze")
        view.check("gaze view")
        self.config = config
        self.view = view

    def initial_state(self) -> Array:
        """The state (SIZE,) before the first image."""
        x = np.zeros(SIZE)
        x[IMAGE_GAIN] = self.config.image_gain
        x[SLOPE_X] = self.config.image_gain * self.view.focal
        return x

    def wants_image(self, x: Array, task: GazeTask) -> bool:
        """Whether a further image is of any use.

        Args:
            x: State of the search.
            task: What the trial asks.
        """
        return task.enabled and x[PHASE] not in (
            GazePhase.SETTLED,
            GazePhase.FAILED,
        )

    def yaw_command(self, x: Array, t: float, task: GazeTask) -> float:
        """The commanded yaw [rad] at time t: a ramp without jumps.

        Args:
            x: State of the search.
            t: Time, s.
            task: What the trial asks.
        """
        if not task.enabled or x[PHASE] == GazePhase.START:
            return task.start_yaw
        reach = x[SPEED] * max(t - x[T_RAMP], 0.0)
        way = x[YAW_GOAL] - x[YAW_RAMP]
        return float(x[YAW_RAMP] + min(max(way, -reach), reach))

    def is_settled(self, x: Array, task: GazeTask) -> bool:
        """Whether τ is known.

        Args:
            x: State of the search.
            task: What the trial asks.
        """
        return task.enabled and x[PHASE] == GazePhase.SETTLED

    def is_failed(self, x: Array, task: GazeTask) -> bool:
        """Whether the trial is given up.

        Args:
            x: State of the search.
            task: What the trial asks.
        """
        return task.enabled and x[PHASE] == GazePhase.FAILED

    def is_ready(self, x: Array, t: float, task: GazeTask) -> bool:
        """Whether τ is known and the yaw command has come to rest.

        Args:
            x: State of the search.
            t: Time, s.
            task: What the trial asks.
        """
        return self.is_settled(x, task) and (
            abs(self.yaw_command(x, t, task) - x[YAW_GOAL]) < 1e-6
        )

    def update(
        self,
        x: Array,
        t: float,
        blob: Array,
        q: float,
        t_image: float,
        task: GazeTask,
    ) -> None:
        """Takes in one image; changes the state `x` in place.

        Args:
            x: state (SIZE,).
            t: time [s].
            blob: x_img, y_img, found (3,) of the image.
            q: the joint's angle [rad] when the image was exposed.
            t_image: time [s] of the exposure.
            task: what the trial asks.
        """
        if not self.wants_image(x, task):
            return
        if x[PHASE] == GazePhase.START:
            x[PHASE] = GazePhase.TRACK
            x[T_BEGIN] = t_image
            x[T_RAMP], x[YAW_RAMP] = t, task.start_yaw
            x[YAW_GOAL], x[SPEED] = task.start_yaw, self.config.max_speed
            x[T_LAST], x[T_YAW] = -np.inf, t_image
            x[Q_LAST] = q
        look = _Look(t, blob, q, t_image, task)
        if task.mode == GazeMode.FIXED_YAW:
            self._look_from_fixed_yaw(x, look)
        else:
            self._center(x, look)
        x[T_YAW], x[Q_LAST] = t_image, q
        if (
            x[PHASE] in (GazePhase.TRACK, GazePhase.SEARCH)
            and t_image - x[T_BEGIN] > self.config.timeout
        ):
            self._give_up(x, t, task)

    # Modes

    def _look_from_fixed_yaw(self, x: Array, look: _Look) -> None:
        config = self.config
        t, blob, q, t_image, task = look
        behind = task.fixed_yaw - q
        elapsed = t_image - x[T_YAW]
        if elapsed > 0:
            speed = abs(q - x[Q_LAST]) / elapsed
            self._overcome_friction(x, behind, elapsed, speed <= config.still)
        self._go_to(x, t, task, task.fixed_yaw + x[OFFSET], config.max_speed)
        near = abs(behind) <= config.near_yaw
        if not blob[2] > 0.5:
            x[COUNT] = 0
            arrived = abs(behind) <= 5.0 * config.near_yaw
            x[MISSED] = x[MISSED] + 1 if arrived else 0
            if x[MISSED] >= config.lost_frames + config.settled_frames:
                self._give_up(x, t, task)
            return
        x[MISSED] = 0
        still = self._is_still(x, look)
        self._learn_image_gain(x, look)
        self._remember(x, look)
        # Where the marker would be, were the joint exactly at the yaw.
        self._count(
            x,
            t,
            task,
            near and still,
            blob[0] + x[SLOPE_X] * behind,
            blob[1] + x[SLOPE_Y] * behind,
        )

    def _center(self, x: Array, look: _Look) -> None:
        config = self.config
        t, blob, q, t_image, task = look
        if not blob[2] > 0.5:
            x[COUNT] = 0
            x[MISSED] += 1
            if x[PHASE] == GazePhase.TRACK:
                if x[MISSED] >= config.lost_frames:
                    self._begin_search(x, t, task)
            elif x[PHASE] == GazePhase.SEARCH:
                self._search(x, t, task, q)
            return
        if x[PHASE] == GazePhase.SEARCH:
            x[PHASE] = GazePhase.TRACK
            x[T_LAST] = -np.inf
        x[MISSED] = 0
        still = self._is_still(x, look)
        error = blob[0] - self.view.center_x
        self._learn_image_gain(x, look)
        # Turning left (+) moves the marker right: too far right, turn right.
        way = -math.atan(error / self.view.focal) / x[IMAGE_GAIN]
        centered = abs(error) <= config.tolerance * self.view.width
        centered_yaw = q + way
        if math.isfinite(x[T_LAST]):
            elapsed = t_image - x[T_LAST]
            self._overcome_friction(x, way, elapsed, still)
        self._remember(x, look)
        step = config.gain * way if not centered else way
        self._go_to(x, t, task, q + step + x[OFFSET], config.max_speed)
        # Both as they would be, were the marker exactly in the middle.
        y_centered = blob[1] + x[SLOPE_Y] * way
        self._count(x, t, task, centered and still, y_centered, centered_yaw)

    # Steps

    def _remember(self, x: Array, look: _Look) -> None:
        x[T_LAST], x[Q_SEEN] = look.t_image, look.q
        x[X_LAST], x[Y_LAST] = look.blob[0], look.blob[1]

    def _is_still(self, x: Array, look: _Look) -> bool:
        """Whether the marker moved little since the image before."""
        blob = look.blob
        elapsed = look.t_image - x[T_LAST]
        if not 0 < elapsed < 1.0:
            return False
        dx = blob[0] - x[X_LAST]
        dy = (blob[1] - x[Y_LAST]) * self.view.height_per_width
        speed = math.hypot(dx, dy) / elapsed / self.view.width
        return speed <= self.config.still

    def _learn_image_gain(self, x: Array, look: _Look) -> None:
        """Learns what a turn does to the image from a turn that was clear."""
        blob = look.blob
        turn = look.q - x[Q_SEEN]
        if not math.isfinite(x[T_LAST]) or abs(turn) < 0.02:
            return
        focal, center = self.view.focal, self.view.center_x
        angle = math.atan((blob[0] - center) / focal)
        before = math.atan((x[X_LAST] - center) / focal)
        nominal = self.config.image_gain
        seen = (angle - before) / turn
        seen = min(max(seen, 0.4 * nominal), 2.5 * nominal)
        x[IMAGE_GAIN] += 0.5 * (seen - x[IMAGE_GAIN])
        limit = 3.0 * self.view.focal * nominal
        for index, now, last in (
            (SLOPE_X, blob[0], x[X_LAST]),
            (SLOPE_Y, blob[1], x[Y_LAST]),
        ):
            slope = min(max((now - last) / turn, -limit), limit)
            x[index] += 0.5 * (slope - x[index])

    def _overcome_friction(
        self, x: Array, behind: float, elapsed: float, standing: bool
    ) -> None:
        """Integrates what the joint stays behind while it stands.

        Once it moves, most of what it took to break loose is taken back: less
        friction holds it now, and it would run past its goal.
        """
        if not standing:
            if x[STANDING]:
                x[OFFSET] *= _KEPT_ONCE_LOOSE
        elif abs(behind) <= _NEAR:
            config = self.config
            offset = x[OFFSET] + config.integral_gain * elapsed * behind
            limit = config.integral_limit
            x[OFFSET] = min(max(offset, -limit), limit)
        x[STANDING] = float(standing)

    def _go_to(
        self, x: Array, t: float, task: GazeTask, yaw: float, speed: float
    ) -> None:
        x[YAW_RAMP] = self.yaw_command(x, t, task)
        x[T_RAMP] = t
        x[YAW_GOAL] = min(max(yaw, self.config.yaw_min), self.config.yaw_max)
        x[SPEED] = speed

    def _count(
        self,
        x: Array,
        t: float,
        task: GazeTask,
        good: bool,
        tau_1: float,
        tau_2: float,
    ) -> None:
        """Counts a good image; settles once there are enough in a row."""
        if not good:
            x[COUNT] = x[SUM_1] = x[SUM_2] = 0.0
            return
        x[COUNT] += 1
        x[SUM_1] += tau_1
        x[SUM_2] += tau_2
        if x[COUNT] >= self.config.settled_frames:
            x[TAU_1] = x[SUM_1] / x[COUNT]
            x[TAU_2] = x[SUM_2] / x[COUNT]
            x[PHASE] = GazePhase.SETTLED
            self._return(x, t, task)

    def _return(self, x: Array, t: float, task: GazeTask) -> None:
        if not self.config.keep_yaw:
            self._go_to(x, t, task, task.start_yaw, self.config.max_speed)

    def _give_up(self, x: Array, t: float, task: GazeTask) -> None:
        x[PHASE] = GazePhase.FAILED
        x[TAU_1] = x[TAU_2] = 0.0
        self._return(x, t, task)

    def _sweep(self, task: GazeTask) -> list[float]:
        """The search: to the nearer end first, then to the other."""
        config = self.config
        ends = [config.yaw_min, config.yaw_max]
        return sorted(ends, key=lambda end: abs(end - task.start_yaw))

    def _begin_search(self, x: Array, t: float, task: GazeTask) -> None:
        x[PHASE] = GazePhase.SEARCH
        x[SWEEP] = 0
        x[OFFSET] = 0.0
        self._go_to(x, t, task, self._sweep(task)[0], self.config.search_speed)

    def _search(self, x: Array, t: float, task: GazeTask, q: float) -> None:
        if abs(self.yaw_command(x, t, task) - x[YAW_GOAL]) > 1e-9:
            return
        # The command has arrived; the joint and the image come later.
        if abs(q - x[YAW_GOAL]) > self.config.near_yaw and (
            t - x[T_RAMP]
            < 0.8 + abs(x[YAW_GOAL] - x[YAW_RAMP]) / self.config.search_speed
        ):
            return
        x[SWEEP] += 1
        legs = self._sweep(task)
        if x[SWEEP] >= len(legs):
            self._give_up(x, t, task)
            return
        self._go_to(x, t, task, legs[int(x[SWEEP])], self.config.search_speed)
