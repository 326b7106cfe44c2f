"""How well the robot repeats a command, and a replay the taught path."""

from collections.abc import Sequence
import dataclasses

import numpy as np

from drake_affetto.common.typing import Array
from drake_affetto.experiments.episode import TrialRunner
from drake_affetto.scene import world


@dataclasses.dataclass
class Repeatability:
    """Scatter and tracking of one movement over R trials.

    Attributes:
        joints: Names of the n joints.
        scatter: Rms deviation (n,) of a joint from its mean course, fraction
            of its range.
        tracking: Rms error (n,) from the desired course, fraction of range.
        lag: Delay (n,) by which the desired course fits the joint best, s.
        lowest: Height (R,) of the palm at its lowest, m in the world.
    """

    joints: list[str]
    scatter: Array
    tracking: Array
    lag: Array
    lowest: Array


def measure_repeatability(
    trials: TrialRunner, xy: Array, theta: Array, seeds: Sequence[int]
) -> Repeatability:
    """Executes a movement once for each seed, the drum at xy.

    Args:
        trials: Runner of the scenario's trials.
        xy: Position of the drum (2,), m.
        theta: Parameters of the movement (n·K,).
        seeds: Seeds of the R trials.
    """
    station = trials.station
    n = station.num_joints
    span = station.joints.upper - station.joints.lower
    recordings = [trials.strike(xy, theta, seed) for seed in seeds]
    q = np.stack([each.true_state[:, :n] for each in recordings])
    desired = recordings[0].desired_state[:, :n]
    deviation = q - q.mean(axis=0)
    # Of R trials about their own mean.
    free = len(seeds) / max(len(seeds) - 1, 1)
    t = recordings[0].joint_t
    return Repeatability(
        joints=list(station.joints.names),
        scatter=np.sqrt(free * np.mean(deviation**2, axis=(0, 1))) / span,
        tracking=np.sqrt(np.mean((q - desired) ** 2, axis=(0, 1))) / span,
        lag=np.array(
            [best_lag(t, desired[:, j], q[:, :, j]) for j in range(n)]
        ),
        lowest=np.array(
            [
                trials.palm_path(each.true_state)[:, 2].min()
                for each in recordings
            ]
        ),
    )


def best_lag(t: Array, desired: Array, q: Array, longest: float = 0.6) -> float:
    """The delay that fits `desired` best to all courses `q`, s.

    Args:
        t: Evenly spaced times (T,), s.
        desired: Desired course (T,), rad.
        q: Courses (R, T), rad.
        longest: Longest delay that is tried, s.
    """
    step = t[1] - t[0]
    mean = q.mean(axis=0)
    errors = [
        np.mean((mean[k:] - desired[: len(desired) - k]) ** 2)
        for k in range(round(longest / step))
    ]
    return float(np.argmin(errors) * step)


def replay_depth(trials: TrialRunner, xy: Array, seed: int) -> float:
    """How much higher a free replay's lowest point is than the taught one, m.

    The stroke is taught on the drum at xy; for the replay the drum stands at
    the corner of the table that is farthest away.

    Args:
        trials: Runner of the scenario's trials.
        xy: Position of the drum (2,), m.
        seed: Seed of teaching and replay.
    """
    xy = np.asarray(xy, float)
    guided = trials.teach(xy, seed)
    taught = trials.palm_path(guided.q)
    low, high = world.drum_limits(
        trials.station.plant,
        trials.station.plant.GetMyContextFromRoot(trials.context),
    )
    corners = [
        np.array([x, y]) for x in (low[0], high[0]) for y in (low[1], high[1])
    ]
    away = max(corners, key=lambda each: float(np.linalg.norm(each - xy)))
    replay = trials.strike(away, guided.theta, seed + 1)
    path = trials.palm_path(replay.true_state)
    return float(path[:, 2].min() - taught[:, 2].min())
