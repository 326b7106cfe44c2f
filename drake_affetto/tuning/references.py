"""What gains are tuned on: references, what following them costs, a search.

A reference is a movement of n joints about the start posture. The test
trajectory (sines, then steps) is what gains are tuned on; three of other kinds
(chirps, strokes, trapezoids) are held out, to see whether the gains hold.

The cost of a joint is nearly its own affair: its four gains act on the other
joints only through the body. `JointwiseCmaEs` makes use of that. It runs one
small CMA-ES for each joint, and every simulation serves all of them at once.
"""

from collections.abc import Mapping, Sequence
import dataclasses
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike, NDArray

from drake_affetto.common.errors import require, require_range
from drake_affetto.common.resources import resolve

DEFAULT_FILE = "package://drake_affetto/tuning.yaml"

TEST = "sines_and_steps"
HELD_OUT = ("chirp", "strokes", "trapezoids")
REST = "postures"

Array = NDArray[np.float64]


@dataclasses.dataclass
class SinesConfig:
    """Two sines for each joint, of frequencies that no two joints share.

    Attributes:
        duration: s.
        low: lowest frequency of a joint's slow sine, Hz.
        high: highest frequency of a joint's slow sine, Hz.
        ratio: frequency of the fast sine over that of the slow one.
        share: amplitude of the fast sine, of both together.
    """

    duration: float = 5.0
    low: float = 0.2
    high: float = 0.4
    ratio: float = 2.3
    share: float = 0.3


@dataclasses.dataclass
class StepsConfig:
    """Steps of all joints at once, in directions that differ.

    Attributes:
        levels: where the steps lead, in -1 to 1 of the excursion.
        rise: duration of a step, s; no valve follows a sudden one.
        hold: rest after each step, s.
    """

    levels: list[float] = dataclasses.field(
        default_factory=lambda: [0.7, -0.5, 0.3]
    )
    rise: float = 0.4
    hold: float = 1.1


@dataclasses.dataclass
class ChirpConfig:
    """A sine of rising frequency.

    Attributes:
        duration: s.
        low: first frequency, Hz.
        high: last frequency, Hz.
    """

    duration: float = 8.0
    low: float = 0.1
    high: float = 0.6


@dataclasses.dataclass
class StrokesConfig:
    """Minimum-jerk strokes to random postures, dwell, and back: as drumming.

    Attributes:
        count: how many strokes.
        stroke: time there, s.
        dwell: rest there, s.
        back: time back, s.
        pause: rest at the start posture, s.
        seed: of the postures.
    """

    count: int = 4
    stroke: float = 0.5
    dwell: float = 0.4
    back: float = 0.6
    pause: float = 0.5
    seed: int = 1


@dataclasses.dataclass
class TrapezoidsConfig:
    """Ramps of constant rate between random levels, each joint in its time.

    Attributes:
        count: how many ramps.
        ramp: shortest and longest duration of a ramp, s.
        hold: shortest and longest rest after it, s.
        seed: of levels and times.
    """

    count: int = 5
    ramp: list[float] = dataclasses.field(default_factory=lambda: [0.5, 1.0])
    hold: list[float] = dataclasses.field(default_factory=lambda: [0.3, 0.8])
    seed: int = 2


@dataclasses.dataclass
class PosturesConfig:
    """Slow ways to random postures, where rest is looked at.

    Attributes:
        count: how many postures.
        move: time to each, s.
        hold: rest there, s.
        seed: of the postures.
    """

    count: int = 4
    move: float = 1.0
    hold: float = 3.5
    seed: int = 3


@dataclasses.dataclass
class CostWeights:
    """The cost of a joint: its three parts, weighed and added.

    Attributes:
        tracking: of the rms tracking error in % of the joint's range.
        effort: of the effort in %: half the mean opening of the valves (air)
            and half of how far they move in the time of a valve's stroke.
        oscillation: of the rms about a slow drift at rest in % of the range.
    """

    tracking: float = 1.0
    effort: float = 0.05
    oscillation: float = 3.0


@dataclasses.dataclass
class SearchConfig:
    """How gains are searched: as factors of a start, in logarithmic scale.

    Attributes:
        largest_factor: gains lie within start / this and start · this.
        sigma: first standard deviation of log factors.
        population: trials of a generation, besides that of the mean.
        report_every: how often a trial says what it has cost so far, s.
        prune_factor: a trial is stopped where that exceeds what the best one
            of earlier generations had cost until then by this factor.
    """

    largest_factor: float = 6.0
    sigma: float = 0.35
    population: int = 11
    report_every: float = 2.5
    prune_factor: float = 2.0


@dataclasses.dataclass
class TuningConfig:
    """The references and the cost of tuning.

    Attributes:
        sample_rate: of references and records, Hz.
        margin: what a reference keeps from a joint's limits, of its range.
        reach: of joints without an excursion: how far from its start posture
            a joint is taken at most, of its range.
        excursions: lowest and highest angle of joints by name, rad.
        settling: first of a trial, until errors count, s.
        approach: from the start posture to where sines begin, s.
        tail: rest at the end of each reference, s.
        rest_delay: after the reference stops a joint is given this long to
            come to rest, s.
        sines, steps: the test trajectory's parts.
        chirp, strokes, trapezoids: the held-out trajectories.
        postures: where rest is looked at.
        cost: see `CostWeights`.
        search: see `SearchConfig`.
    """

    sample_rate: float = 200.0
    margin: float = 0.05
    reach: float = 0.2
    excursions: dict[str, list[float]] = dataclasses.field(default_factory=dict)
    settling: float = 0.5
    approach: float = 1.0
    tail: float = 1.0
    rest_delay: float = 0.5
    sines: SinesConfig = dataclasses.field(default_factory=SinesConfig)
    steps: StepsConfig = dataclasses.field(default_factory=StepsConfig)
    chirp: ChirpConfig = dataclasses.field(default_factory=ChirpConfig)
    strokes: StrokesConfig = dataclasses.field(default_factory=StrokesConfig)
    trapezoids: TrapezoidsConfig = dataclasses.field(
        default_factory=TrapezoidsConfig
    )
    postures: PosturesConfig = dataclasses.field(default_factory=PosturesConfig)
    cost: CostWeights = dataclasses.field(default_factory=CostWeights)
    search: SearchConfig = dataclasses.field(default_factory=SearchConfig)

    def check(self, where: str) -> None:
        """Raises InputError naming the first field that does not fit."""
        for name, low, high in (
            ("sample_rate", 50.0, 1000.0),
            ("margin", 0.0, 0.4),
            ("reach", 0.01, 1.0),
            ("settling", 0.1, 10.0),
            ("approach", 0.1, 10.0),
            ("tail", 0.0, 10.0),
            ("rest_delay", 0.0, 10.0),
            ("sines.duration", 0.5, 60.0),
            ("sines.low", 0.01, 5.0),
            ("sines.high", self.sines.low, 5.0),
            ("sines.ratio", 1.0, 10.0),
            ("sines.share", 0.0, 1.0),
            ("steps.rise", 0.05, 5.0),
            ("steps.hold", 0.05, 10.0),
            ("chirp.duration", 0.5, 60.0),
            ("chirp.low", 0.01, 5.0),
            ("chirp.high", self.chirp.low, 5.0),
            ("strokes.count", 1, 100),
            ("strokes.stroke", 0.05, 5.0),
            ("strokes.dwell", 0.0, 5.0),
            ("strokes.back", 0.05, 5.0),
            ("strokes.pause", 0.0, 5.0),
            ("strokes.seed", 0, 2**31 - 1),
            ("trapezoids.count", 1, 100),
            ("trapezoids.seed", 0, 2**31 - 1),
            ("postures.count", 1, 100),
            ("postures.move", 0.1, 10.0),
            ("postures.hold", 0.1, 10.0),
            ("postures.seed", 0, 2**31 - 1),
            ("cost.tracking", 0.0, 1e3),
            ("cost.effort", 0.0, 1e3),
            ("cost.oscillation", 0.0, 1e3),
            ("search.largest_factor", 1.01, 1e3),
            ("search.sigma", 0.01, 3.0),
            ("search.population", 4, 1000),
            ("search.report_every", 0.1, 60.0),
            ("search.prune_factor", 1.0, 1e3),
        ):
            value: object = self
            for part in name.split("."):
                value = getattr(value, part)
            require_range(f"{where}.{name}", value, low, high)  # type: ignore[arg-type]
        for level in self.steps.levels:
            require_range(f"{where}.steps.levels", level, -1.0, 1.0)
        pairs = {f"excursions.{k}": v for k, v in self.excursions.items()}
        pairs["trapezoids.ramp"] = self.trapezoids.ramp
        pairs["trapezoids.hold"] = self.trapezoids.hold
        for name, pair in pairs.items():
            require(
                len(pair) == 2 and pair[0] < pair[1],
                f"{where}.{name}",
                pair,
                "a lower and a greater upper value",
            )


def load_tuning(file: str | Path = DEFAULT_FILE) -> TuningConfig:
    """Reads a YAML file of `TuningConfig`.

    Raises:
        InputError: for a file or a value that does not fit, by name.
    """
    # Drake's YAML reader is behind this; the mathematics need none of it.
    from drake_affetto.common.yaml_config import read_yaml, typed

    path = resolve(file)
    config = typed(
        TuningConfig,
        read_yaml(path),
        where=path.name,
        defaults=TuningConfig(),
    )
    config.check(path.stem)
    return config


@dataclasses.dataclass(frozen=True)
class Reference:
    """A movement to be followed.

    Attributes:
        name: which.
        t: (T,) s, evenly from 0.
        q: (T, n) rad.
        rest: (T,) whether all joints should be at rest, the time that they
            are given to come to rest being over.
        counted: (T,) whether errors count.
    """

    name: str
    t: Array
    q: Array
    rest: NDArray[np.bool_]
    counted: NDArray[np.bool_]

    @property
    def duration(self) -> float:
        """s."""
        return float(self.t[-1])

    def rate(self) -> Array:
        """(T, n) rad/s."""
        return np.gradient(self.q, self.t, axis=0)


@dataclasses.dataclass(frozen=True)
class Excursion:
    """Where references may take n joints, all (n,), rad."""

    start: Array
    low: Array
    high: Array

    def angle(self, level: Array) -> Array:
        """The angle at a level in -1 (low) to 1 (high)."""
        return self.low + 0.5 * (level + 1.0) * (self.high - self.low)

    def level(self, angle: Array) -> Array:
        """The inverse of `angle`."""
        return 2.0 * (angle - self.low) / (self.high - self.low) - 1.0


def excursion(
    config: TuningConfig,
    names: Sequence[str],
    start: ArrayLike,
    lower: ArrayLike,
    upper: ArrayLike,
) -> Excursion:
    """Where references take the joints `names`.

    Args:
        start: (n,) start posture, rad.
        lower: (n,) limits, rad.
        upper: (n,) limits, rad.

    Raises:
        InputError: where an excursion leaves the limits less their margin, or
            the joint's start posture is not within it.
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
    return Excursion(q, low, high)


def minimum_jerk(s: Array) -> Array:
    """The minimum-jerk way from 0 to 1 as s goes from 0 to 1, else held."""
    s = np.clip(s, 0.0, 1.0)
    return s**3 * (10.0 - 15.0 * s + 6.0 * s**2)


def make_reference(
    name: str, config: TuningConfig, space: Excursion
) -> Reference:
    """The reference called `name`: `TEST`, `REST` or one of `HELD_OUT`.

    All begin at rest at the start posture and end at rest.

    Raises:
        InputError: for another name.
    """
    kinds = {
        TEST: _sines_and_steps,
        "chirp": _chirp,
        "strokes": _strokes,
        "trapezoids": _trapezoids,
        REST: _postures,
    }
    require(name in kinds, "reference", name, f"one of {', '.join(kinds)}")
    return kinds[name](config, space)


def _finish(name: str, config: TuningConfig, q: Array) -> Reference:
    """Adds times, and finds where all joints should be at rest."""
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
    """Times of the samples of a part, without its beginning, s."""
    count = round(duration * config.sample_rate)
    return np.arange(1, count + 1) / config.sample_rate


def _move(
    config: TuningConfig, begin: Array, end: Array, duration: float
) -> Array:
    blend = minimum_jerk(_samples(config, duration) / duration)[:, None]
    return begin + blend * (end - begin)


def _hold(config: TuningConfig, at: Array, duration: float) -> Array:
    return np.repeat(at[None], len(_samples(config, duration)), axis=0)


def _directions(n: int) -> Array:
    """Signs that differ from joint to joint, (n,)."""
    return np.where(np.arange(n) % 3 == 1, -1.0, 1.0)


def _fade(t: Array, duration: float, ramp: float) -> Array:
    """Rises from 0 to 1 and falls again, smoothly, (T, 1)."""
    rising = minimum_jerk(t / ramp)
    return (rising * minimum_jerk((duration - t) / ramp))[:, None]


def _sines_and_steps(config: TuningConfig, space: Excursion) -> Reference:
    n = space.start.size
    sines, steps = config.sines, config.steps
    middle = space.angle(np.zeros(n))
    # About the middle of the excursion, where there is room for both sides.
    parts = [
        space.start[None],
        _hold(config, space.start, config.settling),
        _move(config, space.start, middle, config.approach),
    ]
    t = _samples(config, sines.duration)
    slow = np.linspace(sines.low, sines.high, n)
    # Neighbours in the body should not be neighbours in frequency.
    slow = slow[np.argsort(np.arange(n) * 0.618 % 1.0)]
    phase = 2.0 * np.pi * t[:, None] * slow
    wave = (1.0 - sines.share) * np.sin(phase)
    wave = wave + sines.share * np.sin(sines.ratio * phase)
    ramp = min(0.5, 0.25 * sines.duration)
    wave = wave * _directions(n) * _fade(t, sines.duration, ramp)
    parts.append(space.angle(wave))
    at = middle
    for level in steps.levels:
        to = space.angle(level * _directions(n))
        parts.append(_move(config, at, to, steps.rise))
        parts.append(_hold(config, to, steps.hold))
        at = to
    parts.append(_move(config, at, space.start, 2.0 * steps.rise))
    parts.append(_hold(config, space.start, config.tail))
    return _finish(TEST, config, np.concatenate(parts))


def _chirp(config: TuningConfig, space: Excursion) -> Reference:
    n = space.start.size
    chirp = config.chirp
    middle = space.angle(np.zeros(n))
    t = _samples(config, chirp.duration)
    slope = (chirp.high - chirp.low) / chirp.duration
    # The joints start one after another round the circle, faded in and out.
    shift = 2.0 * np.pi * (np.arange(n) * 0.618 % 1.0)
    phase = 2.0 * np.pi * (chirp.low * t + 0.5 * slope * t**2)
    wave = 0.9 * np.sin(phase[:, None] + shift)
    wave = wave * _fade(t, chirp.duration, min(1.0, 0.25 * chirp.duration))
    parts = [
        space.start[None],
        _hold(config, space.start, config.settling),
        _move(config, space.start, middle, config.approach),
        space.angle(wave),
        _move(config, middle, space.start, config.approach),
        _hold(config, space.start, config.tail),
    ]
    return _finish("chirp", config, np.concatenate(parts))


def _strokes(config: TuningConfig, space: Excursion) -> Reference:
    n = space.start.size
    strokes = config.strokes
    rng = np.random.default_rng(strokes.seed)
    start = space.start
    parts = [start[None], _hold(config, start, config.settling)]
    for _ in range(strokes.count):
        # A stroke takes every joint some way along its excursion.
        to = start + rng.uniform(0.2, 0.8, n) * (
            np.where(rng.random(n) < 0.5, space.low, space.high) - start
        )
        parts += [
            _move(config, start, to, strokes.stroke),
            _hold(config, to, strokes.dwell),
            _move(config, to, start, strokes.back),
            _hold(config, start, strokes.pause),
        ]
    parts.append(_hold(config, start, config.tail))
    return _finish("strokes", config, np.concatenate(parts))


def _trapezoids(config: TuningConfig, space: Excursion) -> Reference:
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


def _postures(config: TuningConfig, space: Excursion) -> Reference:
    n = space.start.size
    shape = config.postures
    rng = np.random.default_rng(shape.seed)
    at = space.start
    parts = [at[None], _hold(config, at, config.settling)]
    for _ in range(shape.count):
        to = space.angle(rng.uniform(-0.9, 0.9, n))
        parts.append(_move(config, at, to, shape.move))
        parts.append(_hold(config, to, shape.hold))
        at = to
    return _finish(REST, config, np.concatenate(parts))


@dataclasses.dataclass(frozen=True)
class JointCosts:
    """What following a reference has cost, each (n,).

    Attributes:
        tracking: rms error, % of the joint's range.
        effort: %; see `CostWeights`.
        oscillation: rms about a slow drift at rest, % of the joint's range.
        total: the weighted sum.
    """

    tracking: Array
    effort: Array
    oscillation: Array
    total: Array

    def mean(self) -> float:
        """The cost of all joints together."""
        return float(np.mean(self.total))


# Time constant of a proportional valve's stroke, in which its movement is
# counted, s; drift slower than this is not oscillation, s.
_STROKE_TIME = 0.1
_DRIFT_TIME = 0.5


def rest_deviation(q: ArrayLike, rest: ArrayLike, sample_rate: float) -> Array:
    """How far joints at rest move about their mean, (n,), in units of q.

    Standard deviation within pieces of at most half a second, so that a slow
    creep towards the goal does not count; rms over the phases.

    Args:
        q: (T, n).
        rest: (T,) whether the joints should be at rest.
        sample_rate: Hz.

    Returns:
        Zeros where there is no phase of rest.
    """
    q, rest = np.asarray(q, dtype=float), np.asarray(rest, dtype=bool)
    edges = np.flatnonzero(np.diff(np.concatenate([[0], rest, [0]])))
    length = max(2, round(_DRIFT_TIME * sample_rate))
    total, count = np.zeros(q.shape[1]), 0
    for begin, end in edges.reshape(-1, 2):
        for first in range(begin, end, length):
            phase = q[first : min(first + length, end)]
            if len(phase) >= length // 2:
                total += len(phase) * phase.var(axis=0)
                count += len(phase)
    return np.sqrt(total / max(count, 1))


# What is left of a joint's rest once integrators have done their work, s.
_LAST_OF_REST = 2.0


def rest_std(q: ArrayLike, rest: ArrayLike, sample_rate: float) -> Array:
    """Greatest standard deviation of joints at rest, (n,), in units of q.

    Of the last two seconds of each phase of rest: a limit cycle shows, a
    creep that ends does not.

    Args:
        q: (T, n).
        rest: (T,) whether the joints should be at rest.
        sample_rate: Hz.
    """
    q, rest = np.asarray(q, dtype=float), np.asarray(rest, dtype=bool)
    edges = np.flatnonzero(np.diff(np.concatenate([[0], rest, [0]])))
    length = round(_LAST_OF_REST * sample_rate)
    stds = [
        q[max(begin, end - length) : end].std(axis=0)
        for begin, end in edges.reshape(-1, 2)
    ]
    return np.max(stds, axis=0) if stds else np.zeros(q.shape[1])


def joint_costs(
    reference: Reference,
    q: ArrayLike,
    opening: ArrayLike,
    span: ArrayLike,
    weights: CostWeights,
) -> JointCosts:
    """The cost of a run along `reference`.

    Args:
        q: (T', n) angles at the reference's times, from the first, rad; T' may
            be less than T.
        opening: (T', n) of the valves, in -1 to 1.
        span: (n,) range of each joint, rad.
        weights: of the cost's parts.
    """
    q, v = np.asarray(q, dtype=float), np.asarray(opening, dtype=float)
    span = np.asarray(span, dtype=float)
    length = len(q)
    counted = reference.counted[:length]
    rest = reference.rest[:length]
    dt = reference.t[1] - reference.t[0]
    error = (q - reference.q[:length])[counted]
    tracking = 100.0 * np.sqrt(np.mean(error**2, axis=0)) / span
    v = v[counted]
    travel = np.mean(np.abs(np.diff(v, axis=0)), axis=0) / dt * _STROKE_TIME
    effort = 100.0 * 0.5 * (np.mean(np.abs(v), axis=0) + travel)
    oscillation = 100.0 * rest_deviation(q, rest, 1.0 / dt) / span
    total = (
        weights.tracking * tracking
        + weights.effort * effort
        + weights.oscillation * oscillation
    )
    return JointCosts(tracking, effort, oscillation, total)


class JointwiseCmaEs:
    """CMA-ES of each joint's own parameters, all on the same evaluations.

    Joints are searched side by side: a candidate is one sample of every
    joint's distribution, its evaluation gives a cost for every joint, and each
    distribution learns from its joint's. What the joints do to each other is
    noise to it, of which CMA-ES bears a good deal, as it goes by ranks. For 8
    joints with 4 gains it learns 8 covariances of 4 × 4 instead of one of
    32 × 32, which needs many times the evaluations.

    There is no state but the evaluations themselves: `ask` works out the
    distributions from them. What candidate k is depends on the seed and the
    generations before its own, not on who evaluates what when; a search that
    was stopped goes on as if nothing had happened.

    Candidate 0 is the start. The first candidate of each later generation is
    the mean of all joints' distributions: what the search would answer then,
    and usually the best so far. Distributions do not learn from these.
    """

    def __init__(
        self,
        joints: int,
        parameters: int,
        *,
        sigma: float,
        bound: float,
        population: int,
        seed: int,
    ):
        """Takes the search's shape.

        Args:
            joints: how many are searched.
            parameters: of each joint.
            sigma: first standard deviation about the start, which is 0.
            bound: parameters lie within -bound and bound.
            population: evaluations of a generation that are learned from.
            seed: of the samples.
        """
        self._shape = (joints, parameters)
        self._sigma, self.bound = sigma, bound
        self._population, self._seed = population, seed
        self._learned = 0
        self._cmas = self._start()

    def _start(self) -> list:
        import cmaes

        joints, parameters = self._shape
        return [
            cmaes.CMA(
                mean=np.zeros(parameters),
                sigma=self._sigma,
                bounds=np.tile([-self.bound, self.bound], (parameters, 1)),
                population_size=self._population,
                seed=self._seed,
            )
            for _ in range(joints)
        ]

    @property
    def generation_size(self) -> int:
        """Candidates of a generation, the first one included."""
        return self._population + 1

    def generation(self, candidate: int) -> int:
        """The generation that candidate number `candidate` belongs to."""
        return candidate // self.generation_size

    def ask(self, candidate: int, history: Mapping[int, "Evaluation"]) -> Array:
        """Candidate number `candidate`, (joints, parameters).

        Args:
            candidate: counts from 0.
            history: evaluations by their candidates' numbers; those of all
                generations before this candidate's are needed.

        Raises:
            KeyError: where one of them is missing.
        """
        generation = self.generation(candidate)
        self._learn(generation, history)
        x = np.empty(self._shape)
        for j, cma in enumerate(self._cmas):
            if candidate % self.generation_size == 0:
                x[j] = cma.mean
                continue
            seeds = np.random.SeedSequence([self._seed, candidate, j])
            cma.reseed_rng(int(seeds.generate_state(1)[0]))
            x[j] = cma.ask()
        return np.clip(x, -self.bound, self.bound)

    def _learn(
        self, generation: int, history: Mapping[int, "Evaluation"]
    ) -> None:
        """Brings the distributions to the beginning of `generation`."""
        if generation < self._learned:
            self._cmas, self._learned = self._start(), 0
        while self._learned < generation:
            first = self._learned * self.generation_size
            told = [history[first + 1 + k] for k in range(self._population)]
            for j, cma in enumerate(self._cmas):
                cma.tell([(item.x[j], item.cost[j]) for item in told])
            self._learned += 1


@dataclasses.dataclass(frozen=True)
class Evaluation:
    """A candidate of `JointwiseCmaEs` and what it has cost.

    Attributes:
        x: (joints, parameters).
        cost: (joints,).
    """

    x: Array
    cost: Array
