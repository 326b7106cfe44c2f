"""Runs planned trials on worker processes, and keeps each as it finishes.

Planning is apart from running: a plan is a list of specs (plain mappings that
determine a trial wholly), and any `concurrent.futures.Executor` may run it.
"""

from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import (
    FIRST_COMPLETED,
    BrokenExecutor,
    Executor,
    Future,
    ProcessPoolExecutor,
    wait,
)
import contextlib
import itertools
import multiprocessing
import os
import signal
import threading
from typing import Any

import numpy as np
from rich.progress import (
    BarColumn,
    MofNCompleteColumn,
    Progress,
    ProgressColumn,
    Task,
    TaskID,
    TextColumn,
    TimeElapsedColumn,
    TimeRemainingColumn,
)
from rich.text import Text

from drake_affetto.errors import InputError
from drake_affetto.studies.store import TrialStore, trial_key

Spec = Mapping[str, Any]
Arrays = dict[str, np.ndarray]
Result = tuple[dict[str, Any], Arrays]

# How often a trial whose worker died is tried again.
_RETRIES = 2

# How many trials are handed to an executor whose size is not known.
_CLUSTER_AHEAD = 1000


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


def _begin_worker() -> None:
    """What a worker process does first."""
    # Its linear algebra keeps to its own core.
    for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"):
        os.environ[name] = "1"
    # Ctrl-C reaches the whole group; only the study's process answers it.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_end_with_parent, daemon=True).start()


def _end_with_parent() -> None:
    """Ends a worker whose study was killed; it would wait for ever."""
    parent = multiprocessing.parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)


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
        initializer=_begin_worker,
    )


class _RateColumn(ProgressColumn):
    """How many trials are finished in a second, or seconds each takes."""

    def render(self, task: Task) -> Text:
        speed = task.finished_speed or task.speed
        if not speed:
            return Text("")
        return Text(f"{speed:.1f}/s" if speed >= 1.0 else f"{1 / speed:.1f} s")


class Crew:
    """Workers, a store and a progress display, for the stages of one study."""

    def __init__(
        self,
        run: Callable[[Spec], Result],
        store: TrialStore,
        *,
        workers: int = 2,
        executor: Executor | None = None,
        quiet: bool = False,
    ):
        """Takes `run`, a module's function, that runs one spec.

        Args:
            workers: how many processes; see `make_executor`.
            executor: any other executor, such as a Dask cluster's, instead of
                worker processes. It is left open.
            quiet: without a progress display.
        """
        self._run = run
        self._store = store
        self._workers = workers
        self._own = executor is None
        # How many trials are handed over at a time.
        self._ahead = max(1, 8 * workers) if self._own else _CLUSTER_AHEAD
        self._executor = executor or make_executor(workers)
        self._progress = Progress(
            TextColumn("{task.description:<32}"),
            BarColumn(),
            MofNCompleteColumn(),
            _RateColumn(),
            TimeElapsedColumn(),
            TimeRemainingColumn(),
            disable=quiet,
        )
        self._crew_of_this_run: list[Any] = []
        self.reused = 0

    def __enter__(self) -> "Crew":
        self._progress.start()
        return self

    def __exit__(self, kind: type | None, *_: object) -> None:
        self._progress.stop()
        if not self._own:
            return
        processes = self._processes()
        self._executor.shutdown(wait=kind is None, cancel_futures=True)
        if kind is not None:
            # In the middle of a trial, which is then not finished.
            for process in processes:
                with contextlib.suppress(OSError, ValueError):
                    process.terminate()

    def run(self, label: str, specs: Sequence[Spec]) -> list[Result]:
        """Runs those of `specs` that the store does not have.

        Equal specs are one trial. A trial whose worker dies is tried again.

        Returns:
            A result for each spec, in the order of `specs`, whichever worker
            finished first.

        Raises:
            InputError: if workers die again and again.
        """
        self._store.plan(label, specs)
        keys = [trial_key(spec) for spec in specs]
        plan = dict(zip(keys, specs, strict=True))
        results = {key: self._store.get(spec) for key, spec in plan.items()}
        known = sum(result is not None for result in results.values())
        self.reused += known
        bar = self._progress.add_task(label, total=len(plan), completed=known)
        for attempt in range(_RETRIES + 1):
            todo = [key for key, result in results.items() if result is None]
            try:
                self._run_some(plan, todo, results, bar)
                break
            except BrokenExecutor as error:
                dead = _obituary(self._crew_of_this_run)
                left = sum(result is None for result in results.values())
                if attempt == _RETRIES or not self._own:
                    raise InputError(
                        f"{label}: worker processes die again and again, the "
                        f"last was {dead}; {left} trials are left (memory may "
                        "be short); those that were finished are kept"
                    ) from error
                self._progress.console.print(
                    f"{label}: {dead} died; its trials are tried again"
                )
                self._executor = make_executor(self._workers)
        return [result for key in keys if (result := results[key]) is not None]

    def _run_some(
        self,
        plan: Mapping[str, Spec],
        todo: Sequence[str],
        results: dict[str, Result | None],
        bar: TaskID,
    ) -> None:
        waiting = iter(todo)
        futures: dict[Future, str] = {}
        try:
            while True:
                # Not all at once: in this process, submitting is running.
                for key in itertools.islice(
                    waiting, self._ahead - len(futures)
                ):
                    futures[self._executor.submit(self._run, plan[key])] = key
                self._crew_of_this_run = self._processes()
                if not futures:
                    return
                for future in wait(futures, return_when=FIRST_COMPLETED).done:
                    key = futures.pop(future)
                    result, arrays = future.result()
                    self._store.put(plan[key], result, arrays)
                    # As the store would give it back: a resumed study and one
                    # that was not disturbed see the same numbers.
                    results[key] = self._store.get(plan[key])
                    self._progress.advance(bar)
        except BaseException:
            for future in futures:
                future.cancel()
            raise

    def _processes(self) -> list[Any]:
        """The worker processes, where the executor has any of its own."""
        return list(
            (getattr(self._executor, "_processes", None) or {}).values()
        )


def _obituary(processes: Sequence[Any]) -> str:
    """Which of the workers died by itself, and how."""
    dead = []
    for process in processes:
        process.join(timeout=1.0)
        # The executor itself ends the others by SIGTERM.
        if process.exitcode not in (None, 0, -signal.SIGTERM):
            code = process.exitcode
            how = (
                f"killed by {signal.Signals(-code).name}"
                if code < 0
                else f"exit code {code}"
            )
            dead.append(f"worker {process.pid} ({how})")
    return " and ".join(dead) or "a worker"
