"""`affetto demo`: the paper's whole story once, at small scale.

Teach by hand, learn the skill, drum at unseen positions; then look through
the mirror and compare the paper's four schemes. Every trial is a full
simulation, judged by its sound.
"""

from collections.abc import Sequence
import dataclasses
from pathlib import Path
from typing import Any

import numpy as np

from drake_affetto import __version__
from drake_affetto.common.output import write_json

# The paper's four, in its order, and what this library would do by default.
SCHEMES = ("unchanged", "relearn", "continue", "transfer", "transfer_default")


@dataclasses.dataclass
class DemoSize:
    """How much the demo does.

    Attributes:
        demonstrations: positions taught, drum seen directly.
        evaluations: unseen positions drummed at, drum seen directly.
        samples: positions taught in the mirror.
        mirror_evaluations: unseen positions for each scheme in the mirror.
    """

    demonstrations: int = 12
    evaluations: int = 8
    samples: int = 5
    mirror_evaluations: int = 5


def run_demo(
    out: Path,
    *,
    seed: int = 0,
    workers: int = 2,
    watch: bool = False,
    restart: bool = False,
    size: DemoSize | None = None,
    console: Any = None,
    exhibits: bool = True,
) -> dict[str, Any]:
    """Runs the demo into the folder `out` and returns its results.

    Args:
        seed: of positions, teaching and noise.
        workers: worker processes; 0 for this one.
        watch: shows the trials in Meshcat, in this process.
        restart: whether to run finished trials again.
        size: how much to do.
        console: a rich console for messages; None for silence.
        exhibits: whether to write pictures, sounds and the replay too.
    """
    from drake_affetto.experiments.episode import TrialRunner
    from drake_affetto.experiments.skills import (
        learn_skill,
        stack_prototypes,
        successful,
    )
    from drake_affetto.experiments.trials import (
        demonstration,
        draw_positions,
        drumming,
        run_task,
        set_runner,
    )
    from drake_affetto.runner.executor import TrialExecutor
    from drake_affetto.runner.store import TrialStore
    from drake_affetto.station.scenario import load_scenario

    size = size or DemoSize()
    direct, mirror = load_scenario("drumming"), load_scenario("mirror")
    path = out / "trials.sqlite"
    if restart:
        for old in (path, *(Path(f"{path}{s}") for s in ("-wal", "-shm"))):
            old.unlink(missing_ok=True)
    if watch:
        from pydrake.geometry import StartMeshcat

        from drake_affetto.scene.view import stand_before

        meshcat = StartMeshcat()
        stand_before(meshcat)
        if console is not None:
            console.print(f"Watch at {meshcat.web_url()}")
        workers = 0
        for name, scenario in (("drumming", direct), ("mirror", mirror)):
            scenario.simulator_config.target_realtime_rate = 1.0
            set_runner(name, TrialRunner(scenario, meshcat))

    rng = np.random.default_rng([seed, 0xD2])
    taught = draw_positions(direct, size.demonstrations, rng)
    unseen = draw_positions(direct, size.evaluations, rng)
    taught_mirror = draw_positions(mirror, size.samples, rng)
    unseen_mirror = draw_positions(mirror, size.mirror_evaluations, rng)
    seeds = iter(range(seed * 100_000, (seed + 1) * 100_000))

    with (
        TrialStore(path) as store,
        TrialExecutor(
            run_task, store, workers=workers, quiet=console is None
        ) as executor,
    ):

        def in_order(label: str, specs: list[Any]) -> list[Any]:
            return list(executor.run(label, dict(enumerate(specs))).values())

        lessons = in_order(
            "Teaching by hand",
            [demonstration("drumming", xy, next(seeds)) for xy in taught],
        )
        good = successful(lessons)
        source = learn_skill(direct.skill, good, seed)
        prototypes = list(stack_prototypes(good))
        trials = in_order(
            "Drumming at unseen positions",
            [
                drumming("drumming", xy, next(seeds), source, prototypes)
                for xy in unseen
            ],
        )
        mirror_lessons = in_order(
            "Teaching before the mirror",
            [demonstration("mirror", xy, next(seeds)) for xy in taught_mirror],
        )
        samples = successful(mirror_lessons)
        skills = _fit_schemes(source, samples)
        # Every scheme meets the same positions and the same noise.
        mirror_seeds = [next(seeds) for _ in unseen_mirror]
        plan = [
            drumming("mirror", xy, number, skill, prototypes)
            for skill in skills.values()
            for xy, number in zip(unseen_mirror, mirror_seeds, strict=True)
        ]
        outcomes = iter(in_order("Drumming through the mirror", plan))
        by_scheme = {
            name: [next(outcomes)[0] for _ in unseen_mirror] for name in skills
        }
        if console is not None and executor.reused:
            console.print(f"{executor.reused} trials were there already")

    results = {
        "study": "demo",
        "version": __version__,
        "seed": seed,
        "drumming": {
            "demonstrations": len(good),
            "taught": _taught(taught, lessons),
            "positions": [
                {
                    "xy": xy.tolist(),
                    "tau": result["tau"],
                    "reward": result["reward"],
                    "success": result["success"],
                }
                for xy, (result, _) in zip(unseen, trials, strict=True)
            ],
            "success_rate": _rate([r for r, _ in trials]),
        },
        "mirror": {
            "samples": len(samples),
            "taught": _taught(taught_mirror, mirror_lessons),
            "positions": [{"xy": xy.tolist()} for xy in unseen_mirror],
            "schemes": {
                name: {
                    "success_rate": _rate(rows),
                    "rewards": [row["reward"] for row in rows],
                }
                for name, rows in by_scheme.items()
            },
        },
    }
    if exhibits:
        from drake_affetto.experiments.media import Exhibit, write_exhibits

        if console is not None:
            console.print("Recording a direct and a mirrored trial ...")
        write_exhibits(
            out,
            Exhibit("direct", direct, source, unseen[0]),
            Exhibit(
                "mirror", mirror, skills["transfer_default"], unseen_mirror[0]
            ),
            prototypes,
            seed,
        )
    # Last: where results.json is, all the rest is.
    write_json(out / "results.json", results)
    return results


def _fit_schemes(source, samples) -> dict[str, Any]:
    from drake_affetto.experiments.skills import fit_scheme

    tau = np.array([result["tau"] for result, _ in samples])
    theta = np.array([arrays["theta"] for _, arrays in samples])
    return {
        name: fit_scheme(name, source, tau, theta, "mirror") for name in SCHEMES
    }


def _rate(rows: Sequence[dict[str, Any]]) -> float:
    return float(np.mean([row["success"] for row in rows]))


def _taught(positions: np.ndarray, lessons) -> list[dict[str, Any]]:
    return [
        {
            "xy": xy.tolist(),
            "tau": result["tau"],
            "attempts": result["attempts"],
            "reward": result["reward"],
            "success": result["success"],
        }
        for xy, (result, _) in zip(positions, lessons, strict=True)
    ]
