"""Speed and memory of a study: workers side by side, and one over time."""

from pathlib import Path
import resource
import sys
import tempfile
import time

import numpy as np

from drake_affetto.experiments.episode import TrialRunner
from drake_affetto.experiments.trials import (
    demonstration,
    draw_positions,
    run_task,
    strike,
)
from drake_affetto.runner.executor import TrialExecutor
from drake_affetto.runner.store import TrialStore
from drake_affetto.station.scenario import load_scenario

_TRIALS = 40
_MEMORY_TRIALS = 1000
# Caches of the first trials are no growth.
_WARM = 100


def _strikes(theta, prototypes, first: int, count: int):
    scenario = load_scenario("drumming")
    places = draw_positions(scenario, count, np.random.default_rng(first))
    return {
        i: strike("drumming", xy, first + i, theta, prototypes)
        for i, xy in enumerate(places)
    }


def measure(workers: int, folder: Path) -> float:
    """Trials a second with so many workers, once they have started."""
    with (
        TrialStore(folder / f"{workers}.sqlite") as store,
        TrialExecutor(run_task, store, workers=workers, quiet=True) as executor,
    ):
        ((_, arrays),) = executor.run(
            "demonstration", {0: demonstration("drumming", [0.26, -0.1], 0)}
        ).values()
        theta, prototypes = arrays["theta"], arrays["prototype"][None]
        # Every worker has built its station after these.
        executor.run("warm", _strikes(theta, prototypes, 1000, 4 * workers))
        begin = time.perf_counter()
        executor.run("strikes", _strikes(theta, prototypes, 0, _TRIALS))
        return _TRIALS / (time.perf_counter() - begin)


def run() -> None:
    """Prints trials a second with one and two workers, and their memory."""
    with tempfile.TemporaryDirectory() as folder:
        one, two = (measure(workers, Path(folder)) for workers in (1, 2))
    scenario = load_scenario("drumming")
    seconds = scenario.policy.delay + scenario.dmp.duration + 0.3
    print(
        f"one worker          {one:6.2f} trials/s"
        f"  ({one * seconds:.1f} × real time)"
    )
    print(
        f"two workers         {two:6.2f} trials/s"
        f"  ({two / one:.2f} × one; at least 1.8 × is wanted)"
    )
    peak = resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss / 1024**2
    print(f"a worker's memory   {peak:6.2f} GiB at most")


def _resident() -> float:
    """MiB of this process that are in memory now (Linux)."""
    for line in Path("/proc/self/status").read_text().splitlines():
        if line.startswith("VmRSS:"):
            return float(line.split()[1]) / 1024
    raise RuntimeError("no VmRSS in /proc/self/status")


def memory() -> None:
    """Prints how the memory of a process grows over 1000 whole trials."""
    if sys.version_info < (3, 12):
        print("below Python 3.12 Drake frees no Python system: not measured")
        return
    runner = TrialRunner(load_scenario("drumming"))
    places = draw_positions(
        runner.scenario, _MEMORY_TRIALS, np.random.default_rng(0)
    )
    theta = runner.teach(places[0], 0).theta
    prototypes = runner.tap_prototypes()
    measured = []
    for k, xy in enumerate(places):
        runner.gaze(xy, k)
        runner.reward(runner.strike(xy, theta, k), prototypes)
        if (k + 1) % _WARM == 0:
            measured.append(_resident())
    rows = np.arange(1, len(measured) + 1) * _WARM
    slope = np.polyfit(rows, measured, 1)[0]
    print(
        f"memory after {_WARM} and {_MEMORY_TRIALS} trials "
        f"{measured[0]:.1f} and {measured[-1]:.1f} MiB  "
        f"({1024 * slope:+.2f} KiB a trial)"
    )


if __name__ == "__main__":
    run()
    memory()
