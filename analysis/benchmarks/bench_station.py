"""Speed of the closed loop beside the reference plant, and of one trial."""

from collections.abc import Callable
import cProfile
import pstats
import time

import numpy as np
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder
from reference_plant import add_reference_plant, lock_all_but

from drake_affetto.experiments.episode import TrialRunner
from drake_affetto.station.scenario import load_scenario
from drake_affetto.station.station import AffettoStation

# Where the Python calls that Drake makes in a trial belong; all that is not
# named is Drake's own step.
_PARTS = {
    "actuators": ("pneumatics/actuation.py",),
    "control and motion": (
        "control/pidf_controller.py",
        "motion/dmp_source.py",
        "perception/gaze_servo.py",
        "skill/policy.py",
        "teaching/kinesthetic_teacher.py",
        "teaching/hand_force.py",
    ),
    # A contact's forces are asked for before the step that applies them: the
    # plant solves for them here, and not again.
    "plant, contact": ("sound/microphone.py",),
}

_NO_PHYSICS = ("control and motion", "judgment", "all else")


def _reference(scenario) -> Simulator:
    """The reference plant with the same joints locked, and no torque."""
    builder = DiagramBuilder()
    plant = add_reference_plant(builder, scenario.world)
    simulator = Simulator(builder.Build())
    root = simulator.get_mutable_context()
    lock_all_but(plant, root, scenario.active_joints)
    plant.get_actuation_input_port().FixValue(
        plant.GetMyMutableContextFromRoot(root), np.zeros(plant.num_actuators())
    )
    return simulator


def measure(duration: float = 1.0, repeats: int = 9) -> tuple[float, float]:
    """CPU seconds per simulated second: reference plant, closed loop.

    The two take turns, and the least of each counts, so that whatever else
    the machine does weighs on neither alone.
    """
    scenario = load_scenario("drumming")
    station = AffettoStation(scenario)
    closed = Simulator(station, station.CreateDefaultContext())
    bare = _reference(scenario)
    for simulator in (bare, closed):
        simulator.AdvanceTo(0.2)  # compiles, fills caches
    cost: dict[str, list[float]] = {"bare": [], "closed": []}
    for k in range(repeats):
        for name, simulator in (("bare", bare), ("closed", closed)):
            begin = time.process_time()
            simulator.AdvanceTo(0.2 + (k + 1) * duration)
            cost[name].append((time.process_time() - begin) / duration)
    return min(cost["bare"]), min(cost["closed"])


def _trial(runner: TrialRunner, theta, seed: int) -> dict[str, float]:
    """CPU time, s, of the parts of a trial: look, stroke, judgment."""
    spent: dict[str, float] = {}
    xy = np.array(runner.scenario.world.drum_position)

    def timed(name: str, work: Callable):
        begin = time.process_time()
        result = work()
        spent[name] = time.process_time() - begin
        return result

    timed("look", lambda: runner.gaze(xy, seed))
    recording = timed(
        "stroke and its sound", lambda: runner.strike(xy, theta, seed)
    )
    prototypes = runner.tap_prototypes()
    timed("judgment", lambda: runner.reward(recording, prototypes))
    return spent


def _by_part(stats: pstats.Stats) -> dict[str, float]:
    """Times, s, of a profiled trial by what they are spent on."""
    parts = dict.fromkeys(
        ("plant, contact", "actuators", "images", "control and motion"), 0.0
    )
    parts |= {"sound": 0.0, "judgment": 0.0}
    stepping = inside = 0.0
    images = ("perception/blob_sensor.py", "perception/mirror_camera.py")
    for (file, _, name), (_, _, _, total, callers) in stats.stats.items():
        if file.endswith("experiments/episode.py") and name == "_advance":
            stepping = total
        elif name == "synthesize":
            parts["sound"] += total
        elif file.endswith("sound/reward.py") and name in (
            "spectrogram",
            "reward",
        ):
            parts["judgment"] += total
        callers_files = {caller[0] for caller in callers}
        if file.endswith(images) and not any(
            caller.endswith(images) for caller in callers_files
        ):
            # The gaze asks for them.
            parts["images"] += total
            parts["control and motion"] -= total
        for part, files in _PARTS.items():
            if file.endswith(files) and any(
                caller.endswith("experiments/episode.py")
                for caller in callers_files
            ):
                parts[part] += total
                inside += total
    parts["plant, contact"] += stepping - inside
    parts["all else"] = stats.total_tt - sum(parts.values())
    return parts


def trial(repeats: int = 5) -> None:
    """Prints what a trial costs, and on what the time is spent."""
    runner = TrialRunner(load_scenario("drumming"))
    xy = np.array(runner.scenario.world.drum_position)
    theta = runner.teach(xy, 0).theta
    _trial(runner, theta, 0)
    runs = [_trial(runner, theta, k) for k in range(repeats)]
    least = {name: min(run[name] for run in runs) for name in runs[0]}
    print(
        f"a trial             {1e3 * sum(least.values()):6.0f} ms  ("
        + ", ".join(f"{n} {1e3 * s:.0f}" for n, s in least.items())
        + ")"
    )
    # The cheapest clock, and no entry for calls into C: what a profiler adds
    # is added to the Python parts alone.
    profile = cProfile.Profile(builtins=False)
    profile.runcall(_trial, runner, theta, 0)
    parts = _by_part(pstats.Stats(profile))
    whole = sum(parts.values())
    for name, seconds in parts.items():
        print(f"  {name:<20}{seconds / whole:6.1%}")
    rest = sum(parts[name] for name in _NO_PHYSICS) / whole
    print(f"  no physics: {rest:.1%} of the time; at most 15 % is wanted")


def run() -> None:
    """Prints the speed of the closed loop (8 joints, 200 Hz) and a trial."""
    bare, closed = measure()
    print(f"reference plant     {1 / bare:6.1f} × real time")
    print(
        f"closed loop         {1 / closed:6.1f} × real time"
        f"  ({closed / bare:.3f} × the reference's time; at most 0.33 is "
        "wanted, version 0.1.0 took 1.3)"
    )
    trial()


if __name__ == "__main__":
    run()
