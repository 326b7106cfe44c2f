"""Worker processes that outlive the death of one of them.

Any `concurrent.futures.Executor` may run the calls: worker processes, this
process, or a cluster.
"""

from collections.abc import Callable, Hashable, Mapping, Sequence
from concurrent.futures import (
    FIRST_COMPLETED,
    BrokenExecutor,
    Executor,
    Future,
    ProcessPoolExecutor,
    wait,
)
import contextlib
import functools
import itertools
import multiprocessing
import os
import signal
import threading
from typing import Any, TypeVar

from drake_affetto.common.errors import InputError

Key = TypeVar("Key", bound=Hashable)

# How often calls whose worker died are tried again.
_RETRIES = 2

# How many calls are handed to an executor whose size is not known.
_CLUSTER_AHEAD = 1000


class InProcessExecutor(Executor):
    """Runs each call at once, in this process: for watching, for debugging."""

    def submit(self, fn, /, *args, **kwargs) -> Future:  # type: ignore[override]
        """Calls `fn` and returns its outcome as a finished future.

        Args:
            args: Arguments of `fn`.
            kwargs: Its keyword arguments.
        """
        future: Future = Future()
        try:
            future.set_result(fn(*args, **kwargs))
        except Exception as error:
            future.set_exception(error)
        return future


def _begin_worker(
    prepare: Callable[..., None] | None, arguments: Sequence[Any]
) -> None:
    """What a worker process does first."""
    # Its linear algebra keeps to its own core.
    for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"):
        os.environ[name] = "1"
    # Ctrl-C reaches the whole group; only the study's process answers it.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_end_with_parent, daemon=True).start()
    if prepare is not None:
        prepare(*arguments)


def _ready() -> None:
    """The first call of a worker, which ends when it is prepared."""


def _end_with_parent() -> None:
    """Ends a worker whose study was killed; it would wait for ever."""
    parent = multiprocessing.parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)


def make_executor(
    workers: int,
    prepare: Callable[..., None] | None = None,
    arguments: Sequence[Any] = (),
) -> Executor:
    """Worker processes, or this process where `workers` is 0.

    Processes are spawned, not forked: neither Drake's renderer nor Python's
    threads survive a fork.

    Args:
        workers: Number of processes.
        prepare: Function of a module that imports little, called in each
            process when it starts, so that the first call need not wait for
            imports.
        arguments: Arguments of `prepare`.
    """
    if workers == 0:
        return InProcessExecutor()
    return ProcessPoolExecutor(
        workers,
        mp_context=multiprocessing.get_context("spawn"),
        initializer=_begin_worker,
        initargs=(prepare, tuple(arguments)),
    )


def _usable_cores() -> Sequence[int]:
    """The cores that this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return sorted(os.sched_getaffinity(0))
    return range(os.cpu_count() or 1)


class WorkerPool:
    """An executor that is replaced when its processes have died."""

    def __init__(
        self,
        workers: int = 2,
        executor: Executor | None = None,
        *,
        prepare: Callable[..., None] | None = None,
        arguments: Sequence[Any] = (),
    ):
        """Makes the executor.

        Args:
            workers: Number of processes; see `make_executor`.
            executor: Any other executor, such as a Dask cluster's, instead of
                worker processes. It is left open.
            prepare: What each process calls first; see `make_executor`.
            arguments: Arguments of `prepare`.
        """
        self.workers = workers if executor is None else 0
        self._make = functools.partial(
            make_executor, workers, prepare, arguments
        )
        self._owned = executor is None
        # Processes that were started ahead of the first call; a future of
        # each, which is done when a process is ready.
        self.starting: list[Future] = []
        # How many calls are handed over at a time.
        self._ahead = max(1, 8 * workers) if self._owned else _CLUSTER_AHEAD
        self._executor = executor or self._make()
        # The processes of the call in progress, for the crash report: the
        # executor forgets them when it breaks.
        self._seen: list[Any] = []

    @property
    def executor(self) -> Executor:
        """The executor of this moment; it changes after a worker's death."""
        return self._executor

    def start(self) -> None:
        """Starts worker processes before there is anything to do.

        This process needs a core too until it has planned the calls. So it
        starts as many as there are other cores, at least one; `run` starts
        the rest.
        """
        others = max(1, len(_usable_cores()) - 1)
        self.starting = [
            self._executor.submit(_ready)
            for _ in range(min(self.workers, others))
        ]

    def __enter__(self) -> "WorkerPool":
        return self

    def __exit__(self, kind: type | None, *_: object) -> None:
        if not self._owned:
            return
        processes = self._processes()
        idle = kind is None and all(each.done() for each in self.starting)
        self._executor.shutdown(wait=idle, cancel_futures=True)
        if not idle:
            # In the middle of a call, which is then not finished, or not even
            # ready for one.
            for process in processes:
                with contextlib.suppress(OSError, ValueError):
                    process.terminate()

    def run(
        self,
        function: Callable[..., Any],
        remaining: Callable[[], Mapping[Key, tuple]],
        keep: Callable[[Key, Any], None],
        *,
        label: str,
        on_death: Callable[[str], None] | None = None,
        ahead: int | None = None,
    ) -> None:
        """Calls `function` until nothing remains to be done.

        Calls whose worker died are tried again in new processes.

        Args:
            function: A module's function, for it is sent to other processes.
            remaining: Gives the arguments of each call that is not done yet,
                by key. It is asked again after a worker has died.
            keep: Takes each result in this process, in the order in which
                they finish.
            label: Name of this work in error messages.
            on_death: Function of a report, called after a worker's death
                and before the calls are tried again.
            ahead: How many calls are handed over at a time.

        Raises:
            InputError: If workers die again and again.
        """
        for attempt in range(_RETRIES + 1):
            try:
                self._run_once(function, remaining(), keep, ahead)
                return
            except BrokenExecutor as error:
                dead = _crash_report(self._seen)
                if attempt == _RETRIES or not self._owned:
                    left = len(remaining())
                    raise InputError(
                        f"{label}: worker processes die again and again, the "
                        f"last was {dead}; {left} trials are left (memory may "
                        "be short); those that were finished are kept"
                    ) from error
                if on_death is not None:
                    on_death(dead)
                self._executor = self._make()

    def _run_once(
        self,
        function: Callable[..., Any],
        calls: Mapping[Key, tuple],
        keep: Callable[[Key, Any], None],
        ahead: int | None,
    ) -> None:
        waiting = iter(calls.items())
        futures: dict[Future, Key] = {}
        try:
            while True:
                # Not all at once: in this process, submitting is running.
                for key, arguments in itertools.islice(
                    waiting, (ahead or self._ahead) - len(futures)
                ):
                    future = self._executor.submit(function, *arguments)
                    futures[future] = key
                self._seen = self._processes()
                if not futures:
                    return
                for future in wait(futures, return_when=FIRST_COMPLETED).done:
                    keep(futures.pop(future), future.result())
        except BaseException:
            for future in futures:
                future.cancel()
            raise

    def _processes(self) -> list[Any]:
        """The worker processes, where the executor has any of its own."""
        return list(
            (getattr(self._executor, "_processes", None) or {}).values()
        )


def _crash_report(processes: Sequence[Any]) -> str:
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
