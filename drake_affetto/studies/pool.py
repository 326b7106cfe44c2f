"""Runs planned trials on worker processes, and keeps each as it finishes.

Planning is apart from running: a plan is a list of specs (plain mappings that
determine a trial wholly), and any `concurrent.futures.Executor` may run it.
"""

from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import (
    Executor,
    Future,
    ProcessPoolExecutor,
    as_completed,
)
from concurrent.futures.process import BrokenProcessPool
import contextlib
import multiprocessing
import os
from typing import Any

import numpy as np
from rich.progress import (
    BarColumn,
    MofNCompleteColumn,
    Progress,
    TextColumn,
    TimeElapsedColumn,
    TimeRemainingColumn,
)

from drake_affetto.errors import InputError
from drake_affetto.studies.store import TrialStore

Spec = Mapping[str, Any]
Arrays = dict[str, np.ndarray]
Result = tuple[dict[str, Any], Arrays]

# How often a trial whose worker died is tried again.
_RETRIES = 2


class InProcessExecutor(Executor):
    """Runs each call at once, in this process: for watching, for debugging."""

    def submit(self, fn, /, *args, **kwargs) -> Future:  # type: ignore[override]
        """Calls `fn` and returns its outcome as a finished future."""
        future: Future = Future()
        try:
            future.set_result(fn(*args, **kwargs))
        except Exception as error:
            future.set_exception(error)
        return future


def _single_threaded() -> None:
    """Keeps a worker's linear algebra on its own core."""
    for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"):
        os.environ[name] = "1"


def make_executor(workers: int) -> Executor:
    """Worker processes, or this process where `workers` is 0.

    Processes are spawned, not forked: neither Drake's renderer nor Python's
    threads survive a fork.
    """
    if workers == 0:
        return InProcessExecutor()
    return ProcessPoolExecutor(
        workers,
        mp_context=multiprocessing.get_context("spawn"),
        initializer=_single_threaded,
    )


class Crew:
    """Workers, a store and a progress display, for the stages of one study."""

    def __init__(
        self,
        run: Callable[[Spec], Result],
        store: TrialStore,
        *,
        workers: int = 2,
        quiet: bool = False,
    ):
        """Takes `run`, a module's function, that runs one spec."""
        self._run = run
        self._store = store
        self._workers = workers
        self._executor = make_executor(workers)
        self._progress = Progress(
            TextColumn("{task.description:<32}"),
            BarColumn(),
            MofNCompleteColumn(),
            TimeElapsedColumn(),
            TimeRemainingColumn(),
            disable=quiet,
        )
        self.reused = 0

    def __enter__(self) -> "Crew":
        self._progress.start()
        return self

    def __exit__(self, kind: type | None, *_: object) -> None:
        self._progress.stop()
        self._executor.shutdown(wait=kind is None, cancel_futures=True)
        if kind is not None:
            self._stop_workers()

    def run(self, label: str, specs: Sequence[Spec]) -> list[Result]:
        """Runs those of `specs` that the store does not have.

        Returns:
            A result for each spec, in the order of `specs`, whichever worker
            finished first.
        """
        results: list[Result | None] = [self._store.get(s) for s in specs]
        todo = [i for i, result in enumerate(results) if result is None]
        self.reused += len(specs) - len(todo)
        bar = self._progress.add_task(
            label, total=len(specs), completed=len(specs) - len(todo)
        )
        for attempt in range(_RETRIES + 1):
            try:
                self._run_some(specs, todo, results, bar)
                break
            except BrokenProcessPool as error:
                todo = [i for i in todo if results[i] is None]
                if attempt == _RETRIES:
                    raise InputError(
                        f"{label}: worker processes die again and again "
                        f"({len(todo)} trials left; memory may be short)"
                    ) from error
                self._progress.console.print(
                    f"{label}: a worker process died; trying its trials again"
                )
                self._executor = make_executor(self._workers)
        return [result for result in results if result is not None]

    def _run_some(
        self,
        specs: Sequence[Spec],
        todo: list[int],
        results: list[Result | None],
        bar: Any,
    ) -> None:
        futures = {self._executor.submit(self._run, specs[i]): i for i in todo}
        for future in as_completed(futures):
            i = futures[future]
            result, arrays = future.result()
            self._store.put(specs[i], result, arrays)
            # As the store would give it back: a resumed study and one that
            # was not disturbed see the same numbers.
            results[i] = self._store.get(specs[i])
            self._progress.advance(bar)

    def _stop_workers(self) -> None:
        """Ends workers in the middle of a trial; the trial is not finished."""
        processes = getattr(self._executor, "_processes", None) or {}
        for process in list(processes.values()):
            with contextlib.suppress(OSError, ValueError):
                process.terminate()
