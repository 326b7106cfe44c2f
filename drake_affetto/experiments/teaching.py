"""Demonstrations by a simulated teacher, into a file.

The teacher guides the robot's hand to the drum at many positions. A
demonstration counts if the robot's own replay makes the drum sound.
"""

from collections.abc import Callable
from contextlib import AbstractContextManager
from pathlib import Path

from drake_affetto.common.errors import InputError
from drake_affetto.experiments.results import DemonstrationResult
from drake_affetto.experiments.teaching_session import TeachingSession
from drake_affetto.experiments.trials import demonstration, run_trials
from drake_affetto.runner.executor import TrialExecutor
from drake_affetto.runner.store import remove_store

MakeExecutor = Callable[[Path], AbstractContextManager[TrialExecutor]]


def teach(
    session: TeachingSession, make_executor: MakeExecutor
) -> list[DemonstrationResult]:
    """Teaches at all positions that the session's file does not have.

    Demonstrations are added to the file in the order of the positions, each
    as soon as those before it are finished. Demonstrations that cannot be in
    the file yet (because an earlier one is missing, or because the drum never
    sounded) are kept in a store beside it. The store is deleted when the file
    is complete.

    Args:
        session: Positions and file.
        make_executor: Opens an executor whose store is the given file.

    Returns:
        The demonstration at each position.
    """
    results = _teach_missing(session, make_executor) if session.missing else {}
    return [
        results[i] if i in results else session.result(i)
        for i in range(len(session.positions))
    ]


def _teach_missing(
    session: TeachingSession, make_executor: MakeExecutor
) -> dict[int, DemonstrationResult]:
    specs = {
        i: demonstration(
            session.scenario_name,
            session.positions[i].tolist(),
            session.seed(i),
        )
        for i in session.missing
    }
    if any(
        session.content.changed(spec["scenario"]) for spec in specs.values()
    ):
        raise InputError(
            f"the scenario {session.scenario_name!r} changed at this moment; "
            "start again"
        )
    finished: dict[int, DemonstrationResult] = {}
    waiting = list(specs)

    def keep(number: int, result: DemonstrationResult) -> None:
        """Adds to the file what no earlier position holds back."""
        finished[number] = result
        while waiting and waiting[0] in finished:
            i = waiting.pop(0)
            if finished[i].success:
                session.keep(i, finished[i], "simulated")

    path = session.path.with_name(f"{session.path.name}.trials.sqlite")
    with make_executor(path) as executor:
        run_trials(executor, "Kinesthetic teaching (simulated)", specs, keep)
    if not session.missing:
        remove_store(path)
    return finished
