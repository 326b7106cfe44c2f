"""The reference trajectories that gains are tuned and evaluated on.

A reference is a movement of n joints about the start posture. Gains are tuned
on the training trajectory (sines, then steps). Three trajectories of other
kinds (chirps, strokes, trapezoids) are held out: they show whether the gains
suit other movements too.
"""

from collections.abc import Sequence
import dataclasses

import numpy as np
from numpy.typing import ArrayLike, NDArray

from drake_affetto.common.errors import require
from drake_affetto.common.typing import Array
from drake_affetto.motion.minimum_jerk import minimum_jerk
from drake_affetto.tuning.config import REST, TRAINING, TuningConfig


@dataclasses.dataclass(frozen=True)
class Reference:
    """A movement of n joints to be followed.

    Attributes:
        name: Name of the reference.
        t: Times, evenly from 0, (T,), s.
        q: Joint angles, (T, n), rad.
        rest: Whether all joints should be at rest, after the time that they
            have to come to rest, (T,).
        counted: Whether errors count, (T,).
    """

    name: str
    t: Array
    q: Array
    rest: NDArray[np.bool_]
    counted: NDArray[np.bool_]

    @property
    def duration(self) -> float:
        """Duration of the reference, s."""
        return float(self.t[-1])

    def rate(self) -> Array:
        """Joint velocities, (T, n), rad/s."""
        return np.gradient(self.q, self.t, axis=0)


@dataclasses.dataclass(frozen=True)
class JointRange:
    """The range of angles in which references move n joints.

    Attributes:
        start: Start posture, (n,), rad.
        low: Lowest angles, (n,), rad.
        high: Highest angles, (n,), rad.
    """

    start: Array
    low: Array
    high: Array

    def angle(self, level: Array) -> Array:
        """The angle at a level from -1 (low) to 1 (high)."""
        return self.low + 0.5 * (level + 1.0) * (self.high - self.low)

    def level(self, angle: Array) -> Array:
        """The inverse of `angle`."""
        return 2.0 * (angle - self.low) / (self.high - self.low) - 1.0


def joint_range(
    config: TuningConfig,
    names: Sequence[str],
    start: ArrayLike,
    lower: ArrayLike,
    upper: ArrayLike,
) -> JointRange:
    """The range in which references move the joints `names`.

    Args:
        config: Configuration of the tuning.
        names: Names of the n joints.
        start: Start posture, (n,), rad.
        lower: Lower joint limits, (n,), rad.
        upper: Upper joint limits, (n,), rad.

    Raises:
        InputError: If an excursion leaves the joint's limits, or the joint's
            start posture is not within it.
    """
    q, a, b = (np.array(x, dtype=float) for x in (start, lower, upper))
    room = config.margin * (b - a)
    low = np.maximum(q - config.reach * (b - a), np.minimum(q, a + room))
    high = np.minimum(q + config.reach * (b - a), np.maximum(q, b - room))
    for i, name in enumerate(names):
        if name not in config.excursions:
            continue
        pair = config.excursions[name]
        require(
            a[i] <= pair[0] <= q[i] <= pair[1] <= b[i],
            f"excursions.{name}",
            pair,
            f"angles within the limits {a[i]:.3f} to {b[i]:.3f} rad on both "
            f"sides of the start posture {q[i]:.3f}",
        )
        low[i], high[i] = pair
    return JointRange(q, low, high)


def make_reference(
    name: str, config: TuningConfig, space: JointRange
) -> Reference:
    """The reference called `name`: `TRAINING`, `REST` or one of `HELD_OUT`.

    All begin at rest in the start posture and end at rest.

    Args:
        space: Start posture and limits of the joints.

    Raises:
        InputError: If there is no reference of that name.
    """
    kinds = {
        TRAINING: _sines_and_steps,
        "chirp": _chirp,
        "strokes": _strokes,
        "trapezoids": _trapezoids,
        REST: _postures,
    }
    require(name in kinds, "reference", name, f"one of {', '.join(kinds)}")
    return kinds[name](config, space)


def _finish(name: str, config: TuningConfig, q: Array) -> Reference:
    """Adds the times and the phases in which all joints should be at rest."""
    dt = 1.0 / config.sample_rate
    t = np.arange(len(q), dtype=np.float64) * dt
    counted = t >= config.settling - 1e-9
    moving = np.zeros(len(q), dtype=bool)
    moving[1:] = np.any(np.abs(np.diff(q, axis=0)) > 1e-9, axis=1)
    delay = round(config.rest_delay / dt)
    last = np.where(moving, np.arange(len(q)), -1)
    rest = np.arange(len(q)) - np.maximum.accumulate(last) > delay
    rest &= counted
    return Reference(name, t, q, rest, counted)


def _samples(config: TuningConfig, duration: float) -> Array:
    """Sample times of a part, without its first instant, s."""
    count = round(duration * config.sample_rate)
    return np.arange(1, count + 1) / config.sample_rate


class _Path:
    """A reference that is put together part by part, from the start posture.

    Attributes:
        at: Where it has come to, (n,), rad.
    """

    def __init__(self, config: TuningConfig, space: JointRange):
        self._config = config
        self._parts = [space.start[None]]
        self.at = space.start
        self.hold(config.settling)

    def hold(self, duration: float) -> None:
        """Rests for a time, s."""
        count = len(_samples(self._config, duration))
        self._parts.append(np.repeat(self.at[None], count, axis=0))

    def move(self, to: Array, duration: float, rest: float = 0.0) -> None:
        """Moves to the posture `to`, (n,), rad, in a time, s, and rests."""
        blend = minimum_jerk(_samples(self._config, duration) / duration)
        self._parts.append(self.at + blend[:, None] * (to - self.at))
        self.at = to
        self.hold(rest)

    def wave(self, angles: Array) -> None:
        """Follows angles, (T, n), rad, that end where they have begun."""
        self._parts.append(angles)

    def finish(self, name: str) -> Reference:
        """The whole as a reference."""
        return _finish(name, self._config, np.concatenate(self._parts))


def _directions(n: int) -> Array:
    """Signs that differ from joint to joint, (n,)."""
    return np.where(np.arange(n) % 3 == 1, -1.0, 1.0)


def _fade(t: Array, duration: float, ramp: float) -> Array:
    """A window that rises smoothly from 0 to 1 and falls again, (T, 1)."""
    rising = minimum_jerk(t / ramp)
    return (rising * minimum_jerk((duration - t) / ramp))[:, None]


def _sines_and_steps(config: TuningConfig, space: JointRange) -> Reference:
    n = space.start.size
    sines, steps = config.sines, config.steps
    path = _Path(config, space)
    # About the middle of the range, where there is room to both sides.
    path.move(space.angle(np.zeros(n)), config.approach)
    t = _samples(config, sines.duration)
    slow = np.linspace(sines.low, sines.high, n)
    # Neighboring joints should not have neighboring frequencies.
    slow = slow[np.argsort(np.arange(n) * 0.618 % 1.0)]
    phase = 2.0 * np.pi * t[:, None] * slow
    wave = (1.0 - sines.share) * np.sin(phase)
    wave = wave + sines.share * np.sin(sines.ratio * phase)
    ramp = min(0.5, 0.25 * sines.duration)
    wave = wave * _directions(n) * _fade(t, sines.duration, ramp)
    path.wave(space.angle(wave))
    for level in steps.levels:
        to = space.angle(level * _directions(n))
        path.move(to, steps.rise, steps.hold)
    path.move(space.start, 2.0 * steps.rise, config.tail)
    return path.finish(TRAINING)


def _chirp(config: TuningConfig, space: JointRange) -> Reference:
    n = space.start.size
    chirp = config.chirp
    t = _samples(config, chirp.duration)
    slope = (chirp.high - chirp.low) / chirp.duration
    # Phases of the joints are spread over the circle; the sine is faded in
    # and out.
    shift = 2.0 * np.pi * (np.arange(n) * 0.618 % 1.0)
    phase = 2.0 * np.pi * (chirp.low * t + 0.5 * slope * t**2)
    wave = 0.9 * np.sin(phase[:, None] + shift)
    wave = wave * _fade(t, chirp.duration, min(1.0, 0.25 * chirp.duration))
    path = _Path(config, space)
    path.move(space.angle(np.zeros(n)), config.approach)
    path.wave(space.angle(wave))
    path.move(space.start, config.approach, config.tail)
    return path.finish("chirp")


def _strokes(config: TuningConfig, space: JointRange) -> Reference:
    n = space.start.size
    strokes = config.strokes
    rng = np.random.default_rng(strokes.seed)
    start = space.start
    path = _Path(config, space)
    for _ in range(strokes.count):
        # A stroke moves each joint by a part of its range.
        to = start + rng.uniform(0.2, 0.8, n) * (
            np.where(rng.random(n) < 0.5, space.low, space.high) - start
        )
        path.move(to, strokes.stroke, strokes.dwell)
        path.move(start, strokes.back, strokes.pause)
    path.hold(config.tail)
    return path.finish("strokes")


def _trapezoids(config: TuningConfig, space: JointRange) -> Reference:
    n = space.start.size
    shape = config.trapezoids
    rng = np.random.default_rng(shape.seed)
    knots, levels = [], []
    for i in range(n):
        ramps = rng.uniform(shape.ramp[0], shape.ramp[1], shape.count + 1)
        holds = rng.uniform(shape.hold[0], shape.hold[1], shape.count + 1)
        times = config.settling + np.concatenate(
            [[0.0], np.cumsum(np.stack([ramps, holds], axis=1).ravel())]
        )
        way = rng.uniform(-0.8, 0.8, shape.count)
        begin = space.level(space.start)[i]
        level = np.concatenate([[begin], np.repeat(way, 2), [begin, begin]])
        knots.append(times)
        levels.append(level)
    end = max(times[-1] for times in knots) + config.tail
    count = round(end * config.sample_rate)
    t = np.arange(count + 1) / config.sample_rate
    level = np.stack(
        [np.interp(t, k, v) for k, v in zip(knots, levels, strict=True)],
        axis=1,
    )
    return _finish("trapezoids", config, space.angle(level))


def _postures(config: TuningConfig, space: JointRange) -> Reference:
    shape = config.postures
    rng = np.random.default_rng(shape.seed)
    path = _Path(config, space)
    for _ in range(shape.count):
        to = space.angle(rng.uniform(-0.9, 0.9, space.start.size))
        path.move(to, shape.move, shape.hold)
    return path.finish(REST)
