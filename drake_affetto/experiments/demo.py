"""The whole story at small scale: a small drum and a small mirror study.

Both learn the same skill from the same demonstrations, which are therefore
given once. Beside their results the demo leaves pictures, sounds and a replay.
"""

from collections.abc import Sequence
import contextlib
import functools
from pathlib import Path
from typing import Any

from drake_affetto.common.output import write_json
from drake_affetto.experiments.drumming import run_drum
from drake_affetto.experiments.media import ShownTrial, write_media
from drake_affetto.experiments.mirror import MirrorOutcome, run_mirror
from drake_affetto.experiments.plans import DemoPlan
from drake_affetto.experiments.results import DrumResults
from drake_affetto.experiments.results.demo import (
    DemoDrumming,
    DemoMirror,
    DemoPosition,
    DemoResults,
    DemoScheme,
    DemoTaught,
    DemoTrial,
)
from drake_affetto.experiments.trials import run_task
from drake_affetto.runner.executor import TrialExecutor
from drake_affetto.runner.store import TrialStore, remove_store
from drake_affetto.runner.workers import WorkerPool
from drake_affetto.station.scenario import load_scenario


def run_demo(
    out: Path,
    plan: DemoPlan,
    *,
    workers: int = 2,
    pool: WorkerPool | None = None,
    watch: bool = False,
    restart: bool = False,
    reuse: Sequence[str | Path] = (),
    console: Any = None,
    media: bool = True,
) -> DemoResults:
    """Runs the demo into the folder `out` and returns its results.

    Args:
        out: Folder, prepared.
        plan: How much to do.
        workers: Number of worker processes; 0 for this one.
        pool: Workers that run already, instead of `workers` new ones.
        watch: Whether to show the trials in Meshcat, in this process.
        restart: Whether to run finished trials again.
        reuse: Folders of other studies whose finished trials are taken over.
        console: A rich console for messages; None for silence.
        media: Whether to write pictures, sounds and the replay too.
    """
    path = out / "trials.sqlite"
    if restart:
        remove_store(path)
    run = run_task
    if watch:
        workers = 0
        run = functools.partial(run_task, runners=_watched_runners(console))
    with contextlib.ExitStack() as stack:
        store = stack.enter_context(TrialStore(path))
        for folder in reuse:
            store.merge(Path(folder) / path.name)
        executor = stack.enter_context(
            TrialExecutor(
                run, store, workers=workers, pool=pool, quiet=console is None
            )
        )
        drum = run_drum(executor, plan.drum)
        outcome = run_mirror(executor, plan.mirror)
        if console is not None and executor.reused:
            console.print(f"{executor.reused} trials were finished already")
    if media:
        if console is not None:
            console.print("Recording a direct and a mirrored trial ...")
        direct, mirror = (
            load_scenario(name)
            for name in (plan.drum.scenario, plan.mirror.scenario)
        )
        scheme = outcome.schemes["transfer_default"]
        write_media(
            out,
            ShownTrial(
                "direct", direct, outcome.skill, drum.final.positions[0].xy
            ),
            ShownTrial("mirror", mirror, scheme, outcome.positions[0]),
            list(outcome.prototypes),
            plan.seed,
        )
    results = _make_results(plan, drum, outcome)
    # Last: where results.json is, all the rest is.
    write_json(out / "results.json", results)
    return results


def _watched_runners(console: Any) -> dict[str, Any]:
    """Runners at the speed of real time, both shown in one Meshcat."""
    from pydrake.geometry import StartMeshcat

    from drake_affetto.experiments.episode import TrialRunner
    from drake_affetto.scene.view import set_default_camera_pose

    meshcat = StartMeshcat()
    set_default_camera_pose(meshcat)
    if console is not None:
        console.print(f"Watch at {meshcat.web_url()}")
    runners = {}
    for name in ("drumming", "mirror"):
        scenario = load_scenario(name)
        scenario.simulator_config.target_realtime_rate = 1.0
        runners[name] = TrialRunner(scenario, meshcat)
    return runners


def _make_results(
    plan: DemoPlan, drum: DrumResults, outcome: MirrorOutcome
) -> DemoResults:
    count = max(plan.mirror.samples)
    return DemoResults.of(
        plan,
        drumming=DemoDrumming(
            demonstrations=drum.demonstrations,
            taught=[
                DemoTaught(each.xy, each.tau, each.attempts, each.reward)
                for each in drum.taught
            ],
            positions=[
                DemoTrial(each.xy, each.tau, each.reward, each.success)
                for each in drum.final.positions
            ],
            success_rate=drum.final.success_rate,
        ),
        mirror=DemoMirror(
            samples=count,
            taught=[
                DemoTaught(
                    (each.xy[0], each.xy[1]),
                    each.tau,
                    each.attempts,
                    each.reward,
                    each.success,
                )
                for each in outcome.demonstrations
            ],
            positions=[
                DemoPosition((float(x), float(y)), gaze.tau)
                for (x, y), gaze in zip(
                    outcome.positions, outcome.seen, strict=True
                )
            ],
            schemes={
                name: DemoScheme(
                    cells[count].success_rate.mean, cells[count].rewards
                )
                for name, cells in outcome.results.schemes.items()
            },
        ),
    )
