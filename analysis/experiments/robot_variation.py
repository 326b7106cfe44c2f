"""How a varying robot repeats a stroke, and how deep its free replays go.

python analysis/experiments/robot_variation.py [--scenario drumming] [--off]

Repeats one taught stroke 20 times and prints each joint's scatter, tracking
error and lag. Then teaches strokes over the drum's region, replays each with
the drum out of the way, and prints by how much the hand's lowest point differs
from the taught path's.
"""

import argparse

import numpy as np

from drake_affetto.experiments.episode import TrialRunner
from drake_affetto.experiments.repeatability import (
    measure_repeatability,
    replay_depth,
)
from drake_affetto.geometry.region import grid_inside
from drake_affetto.station.scenario import load_scenario


def print_repeatability(trials: TrialRunner, count: int) -> None:
    xy = np.array(trials.scenario.world.drum_position)
    theta = trials.teach(xy, 3).theta
    result = measure_repeatability(trials, xy, theta, range(count))
    print(f"{count} repeats      scatter   error     lag   (% of range, ms)")
    for row in zip(
        result.joints,
        100.0 * result.scatter,
        100.0 * result.tracking,
        1e3 * result.lag,
        strict=True,
    ):
        print("{:<26}{:6.2f}  {:6.2f}  {:6.0f}".format(*row))
    print(f"lowest point of the palm: sd {1e3 * result.lowest.std():.1f} mm")


def print_depths(trials: TrialRunner, places: np.ndarray, seed: int) -> None:
    print("     x       y    replay - taught [mm]")
    depths = []
    for k, xy in enumerate(places):
        depths.append(1e3 * replay_depth(trials, xy, seed + k))
        print(f"{xy[0]:7.3f} {xy[1]:7.3f} {depths[-1]:8.1f}", flush=True)
    size = np.abs(depths)
    print(f"median of sizes {np.median(size):.1f} mm, most {size.max():.1f} mm")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--scenario", default="drumming")
    parser.add_argument("--off", action="store_true", help="no variation")
    parser.add_argument("--repeats", type=int, default=20)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument(
        "--places",
        nargs="+",
        type=float,
        metavar="X Y",
        help="drum's places [m] (default: a grid over its region)",
    )
    args = parser.parse_args()
    scenario = load_scenario(args.scenario)
    scenario.variation.enabled &= not args.off
    trials = TrialRunner(scenario)
    print_repeatability(trials, args.repeats)
    places = np.reshape(
        args.places or grid_inside(scenario.drum_region.corners, 6), (-1, 2)
    )
    print_depths(trials, places, args.seed)


if __name__ == "__main__":
    main()
