"""A world in which a trial takes no time, for the planning of studies.

The drum is seen by an affine map of its place, another one in each scenario;
the movement is the place itself, a little shaky; who lands near enough hits.
"""

import os
from pathlib import Path
import time

import numpy as np

from drake_affetto.faults.supervision import CHECKS

VIEWS = {
    "drumming": (np.array([[6.0, 0.5], [-0.5, 4.0]]), np.array([-1.1, 0.4])),
    "mirror": (np.array([[-0.5, 4.0], [5.0, 1.0]]), np.array([0.7, -0.8])),
}
FEATURES = 6
REACH = 0.03


def tau(name: str, xy) -> np.ndarray:
    A, b = VIEWS.get(name, VIEWS["mirror"])
    return A @ np.asarray(xy) + b


def run(spec):
    """Runs a spec of `tasks`; leaves a mark, and takes some time if asked."""
    note(spec)
    name = spec["scenario"]["@name"]
    xy = np.array(spec["xy"])
    rng = np.random.default_rng(spec["seed"])
    seen = tau(name, xy) + 1e-3 * rng.normal(size=2)
    if spec["kind"] == "look":
        return {"found": True, "tau": seen.tolist(), "duration": 1.0}, {}
    if spec["kind"] == "demonstration":
        shaky = xy + 0.003 * spec["variability"] * rng.normal(size=2)
        result = {
            "xy": xy.tolist(),
            "found": True,
            "tau": seen.tolist(),
            "attempts": 1,
            # One teacher of a few has a bad day.
            "success": spec["seed"] % 9 != 0,
            "reward": 0.5,
            "max_pull": 12.0,
        }
        arrays = {
            "theta": np.resize(shaky, FEATURES),
            "q": np.zeros((3, 2)),
            "prototype": np.full((4, 5), 0.5),
        }
        return result, arrays
    if spec["kind"] == "watched":
        return _watched(spec, seen, rng)
    assert spec["kind"] == "strike"
    miss = np.linalg.norm(spec["theta"][:2] - xy)
    reward = float(max(0.0, 1.0 - 0.85 * miss / REACH))
    result = {
        "reward": reward,
        "success": reward > 0.15,
        "max_force": 4.0,
        "impulse": 1.0 if miss < REACH else 0.0,
        "landing": float(miss),
        "graze": bool(0.8 * REACH < miss < REACH),
    }
    course = np.linspace(0.0, reward, 7, dtype=np.float32)
    return result, {"reward_over_time": course}


def _watched(spec, seen, rng):
    """A trial with faults: the larger, the more surely it is noticed."""
    size = max((fault["size"] for fault in spec["faults"]), default=0.0)
    noticed = bool(rng.uniform() < size)
    result = {
        "found": True,
        "tau": seen.tolist(),
        "reward": 0.0 if size == 0.3 else 0.6,
        "heard": size != 0.3,
        "invalid": "angle reading jumps (elbow)" if noticed else "",
        "detected_at": 2.5 if noticed else None,
        "onset": 2.0 if spec["faults"] else None,
        "movement_at": 3.0,
        # Someone else's drum.
        "impulse": 0.0 if size == 0.2 else 1.0,
        "max_force": 50.0 if size == 1.0 else 5.0,
        "max_speed": 2.0,
    }
    return result, {"scores": np.full(CHECKS, 0.5, dtype=np.float32)}


def note(spec) -> None:
    """Appends to the file of marks, and sleeps, as the environment asks."""
    if marks := os.environ.get("FAKE_WORLD_MARKS"):
        line = f"{spec['kind']} {spec['xy']} {spec['seed']} "
        line += f"{np.round(spec.get('theta', 0.0), 12).tolist()}\n"
        with Path(marks).open("a") as file:
            file.write(line)
    time.sleep(float(os.environ.get("FAKE_WORLD_SECONDS", "0")))
