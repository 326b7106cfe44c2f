"""Configuration of a tuning study: references, cost and search.

`repr(TuningConfig)` is a part of the fingerprint of stored studies: names of
these classes and fields stay as they are.
"""

import dataclasses
from pathlib import Path

from drake_affetto.common.errors import require, require_interval
from drake_affetto.common.fields import check_ranges, number

DEFAULT_FILE = "package://drake_affetto/tuning.yaml"
START_FILE = "package://drake_affetto/control_hand_tuned.yaml"

# Names of the references: the one that gains are tuned on, those that show
# whether the gains suit other movements, and the one for oscillation at rest.
TRAINING = "sines_and_steps"
HELD_OUT = ("chirp", "strokes", "trapezoids")
REST = "postures"

_SEED = (0, 2**31 - 1)


@dataclasses.dataclass
class SinesConfig:
    """Two sines for each joint; the frequencies of all joints differ.

    Attributes:
        duration: Duration, s.
        low: Lowest frequency of a joint's slow sine, Hz.
        high: Highest frequency of a joint's slow sine, Hz.
        ratio: Frequency of the fast sine divided by that of the slow one.
        share: Amplitude of the fast sine as a part of the sum of both.
    """

    duration: float = number(5.0, 0.5, 60.0)
    low: float = number(0.2, 0.01, 5.0)
    high: float = number(0.4, 0.01, 5.0)
    ratio: float = number(2.3, 1.0, 10.0)
    share: float = number(0.3, 0.0, 1.0)


@dataclasses.dataclass
class StepsConfig:
    """Steps of all joints at once, in different directions.

    Attributes:
        levels: Levels after each step, from -1 to 1 of the joint's range.
        rise: Duration of a step, s; no valve follows a sudden one.
        hold: Rest after each step, s.
    """

    levels: list[float] = dataclasses.field(
        default_factory=lambda: [0.7, -0.5, 0.3],
        metadata={"range": (-1.0, 1.0), "help": ""},
    )
    rise: float = number(0.4, 0.05, 5.0)
    hold: float = number(1.1, 0.05, 10.0)


@dataclasses.dataclass
class ChirpConfig:
    """A sine of rising frequency.

    Attributes:
        duration: Duration, s.
        low: First frequency, Hz.
        high: Last frequency, Hz.
    """

    duration: float = number(8.0, 0.5, 60.0)
    low: float = number(0.1, 0.01, 5.0)
    high: float = number(0.6, 0.01, 5.0)


@dataclasses.dataclass
class StrokesConfig:
    """Minimum-jerk strokes to random postures and back, as in drumming.

    Attributes:
        count: Number of strokes.
        stroke: Duration of the movement to the posture, s.
        dwell: Rest in the posture, s.
        back: Duration of the movement back, s.
        pause: Rest in the start posture, s.
        seed: Seed of the postures.
    """

    count: int = number(4, 1, 100)
    stroke: float = number(0.5, 0.05, 5.0)
    dwell: float = number(0.4, 0.0, 5.0)
    back: float = number(0.6, 0.05, 5.0)
    pause: float = number(0.5, 0.0, 5.0)
    seed: int = number(1, *_SEED)


@dataclasses.dataclass
class TrapezoidsConfig:
    """Ramps of constant rate between random levels, at each joint's own time.

    Attributes:
        count: Number of ramps.
        ramp: Shortest and longest duration of a ramp, s.
        hold: Shortest and longest rest after a ramp, s.
        seed: Seed of levels and times.
    """

    count: int = number(5, 1, 100)
    ramp: list[float] = dataclasses.field(default_factory=lambda: [0.5, 1.0])
    hold: list[float] = dataclasses.field(default_factory=lambda: [0.3, 0.8])
    seed: int = number(2, *_SEED)


@dataclasses.dataclass
class PosturesConfig:
    """Slow movements to random postures, each followed by a rest.

    Attributes:
        count: Number of postures.
        move: Duration of the movement to each, s.
        hold: Rest in each, s.
        seed: Seed of the postures.
    """

    count: int = number(4, 1, 100)
    move: float = number(1.0, 0.1, 10.0)
    hold: float = number(3.5, 0.1, 10.0)
    seed: int = number(3, *_SEED)


@dataclasses.dataclass
class CostWeights:
    """Weights of the three parts of a joint's cost.

    Attributes:
        tracking: Weight of the rms tracking error in % of the joint's range.
        effort: Weight of the effort in %: half the mean opening of the valves
            (the use of air) plus half of their movement in the duration of a
            valve's stroke.
        oscillation: Weight of the rms about a slow drift at rest in % of the
            joint's range.
    """

    tracking: float = number(1.0, 0.0, 1e3)
    effort: float = number(0.05, 0.0, 1e3)
    oscillation: float = number(3.0, 0.0, 1e3)


@dataclasses.dataclass
class SearchConfig:
    """The search for gains, as factors of the start, in logarithmic scale.

    Attributes:
        largest_factor: Bound of the factors: gains lie between the start
            divided by this and the start times this.
        sigma: First standard deviation of the factors' logarithms.
        population: Trials of a generation, without that of the mean.
        report_every: Time between two intermediate costs of a trial, s.
        prune_factor: Ratio at which a trial is stopped: its intermediate cost
            over the least one of earlier generations at the same time.
    """

    largest_factor: float = number(6.0, 1.01, 1e3)
    sigma: float = number(0.35, 0.01, 3.0)
    population: int = number(11, 4, 1000)
    report_every: float = number(2.5, 0.1, 60.0)
    prune_factor: float = number(2.0, 1.0, 1e3)


@dataclasses.dataclass
class TuningConfig:
    """The references and the cost of tuning.

    Attributes:
        sample_rate: Rate of references and recordings, Hz.
        margin: Distance of a reference from a joint's limits, as a part of the
            joint's range.
        reach: Greatest distance from the start posture for joints without an
            excursion, as a part of the joint's range.
        excursions: Lowest and highest angle by joint, rad.
        settling: Time at the beginning of a trial until errors count, s.
        approach: Duration of the movement from the start posture to the first
            sample of sines, s.
        tail: Rest at the end of each reference, s.
        rest_delay: Time that a joint has to come to rest after the reference
            stops, s.
        sines: First part of the training trajectory.
        steps: Second part of the training trajectory.
        chirp: First held-out trajectory.
        strokes: Second held-out trajectory.
        trapezoids: Third held-out trajectory.
        postures: Postures in which the robot should be at rest.
        cost: Weights of the cost.
        search: Settings of the search.
    """

    sample_rate: float = number(200.0, 50.0, 1000.0)
    margin: float = number(0.05, 0.0, 0.4)
    reach: float = number(0.2, 0.01, 1.0)
    excursions: dict[str, list[float]] = dataclasses.field(default_factory=dict)
    settling: float = number(0.5, 0.1, 10.0)
    approach: float = number(1.0, 0.1, 10.0)
    tail: float = number(1.0, 0.0, 10.0)
    rest_delay: float = number(0.5, 0.0, 10.0)
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
        check_ranges(self, where)
        # Frequencies may be equal; the other pairs must differ.
        for name, sine in (("sines", self.sines), ("chirp", self.chirp)):
            require(
                sine.low <= sine.high,
                f"{where}.{name}.high",
                sine.high,
                f"at least {name}.low, {sine.low:g}",
            )
        pairs = {f"excursions.{k}": v for k, v in self.excursions.items()}
        pairs["trapezoids.ramp"] = self.trapezoids.ramp
        pairs["trapezoids.hold"] = self.trapezoids.hold
        for name, pair in pairs.items():
            require_interval(f"{where}.{name}", pair)


def load_tuning(file: str | Path = DEFAULT_FILE) -> TuningConfig:
    """Reads a YAML file of `TuningConfig`.

    Args:
        file: The file, or its package:// URI.

    Raises:
        InputError: If the file or a value in it does not fit.
    """
    # It imports Drake, which the command's help does not need.
    from drake_affetto.common.yaml_config import load_config

    return load_config(TuningConfig, file)
