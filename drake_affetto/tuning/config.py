"""Configuration of a tuning study: its references, its cost, its search."""

import dataclasses
from pathlib import Path

from drake_affetto.common.errors import require, require_range
from drake_affetto.common.resources import resolve

DEFAULT_FILE = "package://drake_affetto/tuning.yaml"

TRAINING = "sines_and_steps"

HELD_OUT = ("chirp", "strokes", "trapezoids")

REST = "postures"


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
