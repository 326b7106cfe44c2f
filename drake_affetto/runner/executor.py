"""Runs planned trials on workers, and keeps each as it finishes.

Planning is apart from running: a plan is a mapping of specs (plain mappings
that determine a trial wholly), and any `concurrent.futures.Executor` may run
it.
"""

from collections.abc import Callable, Hashable, Mapping
from concurrent.futures import Executor, Future
from typing import Any, TypeVar

import numpy as np

from drake_affetto.runner.store import TrialStore, trial_key
from drake_affetto.runner.workers import WorkerPool

Spec = Mapping[str, Any]
Arrays = dict[str, np.ndarray]
Result = tuple[dict[str, Any], Arrays]
Key = TypeVar("Key", bound=Hashable)


def _difference(before: Spec, now: Spec) -> str:
    """In words, what a stored spec has other than one that is planned."""
    old, new = before.get("scenario"), now.get("scenario")
    if isinstance(old, Mapping) and isinstance(new, Mapping):
        names = [
            name
            for name in new
            if not name.startswith("@") and old.get(name) != new[name]
        ]
        if "version" in names:
            return f"version {old.get('version')}, now {new['version']}"
        if names:
            return f"the scenario's {' and '.join(names)} changed"
    return "the plan is another one"


class TrialExecutor:
    """Workers, a store and a progress display, for the phases of one study."""

    def __init__(
        self,
        run: Callable[[Spec], Result],
        store: TrialStore,
        *,
        workers: int = 2,
        executor: Executor | None = None,
        pool: WorkerPool | None = None,
        quiet: bool = False,
    ):
        """Takes `run`, a module's function, that runs one spec.

        Args:
            run: Runs one spec; it is sent to other processes.
            store: Where finished trials are kept.
            workers: Number of processes; see `make_executor`.
            executor: Any other executor, such as a Dask cluster's, instead of
                worker processes. It is left open.
            pool: Workers that run already, instead of `workers` new ones or
                `executor`. The pool is left open.
            quiet: Whether there is no progress display.

        Raises:
            InputError: If the store is damaged.
        """
        store.verify()
        # Here, for workers know this module and draw nothing.
        from drake_affetto.runner.progress import make_progress

        self._run = run
        self._store = store
        self._owned = pool is None
        self._quiet = quiet
        self._pool = pool or WorkerPool(workers, executor)
        self._progress = make_progress(quiet=quiet)
        self.reused = 0

    def where(self, spec: Spec) -> str:
        """How an error names the stored trial of `spec`, with a colon."""
        return f"{self._store.path}: trial {trial_key(spec)}: "

    def __enter__(self) -> "TrialExecutor":
        self._progress.start()
        self._show_start()
        return self

    def _show_start(self) -> None:
        """Shows that workers start, until the first of them is ready."""
        starting = self._pool.starting
        if not starting:
            return
        bar = self._progress.add_task(
            f"Starting {len(starting)} workers", total=None
        )

        def hide(_: Future) -> None:
            self._progress.update(bar, visible=False)

        for future in starting:
            future.add_done_callback(hide)

    def __exit__(self, *exception: Any) -> None:
        self._progress.stop()
        if self._owned:
            self._pool.__exit__(*exception)

    def run(
        self,
        label: str,
        specs: Mapping[Key, Spec],
        on_result: Callable[[Key, Result], None] | None = None,
    ) -> dict[Key, Result]:
        """Runs those of `specs` that the store does not have.

        Equal specs are one trial. A trial whose worker dies is tried again.

        Args:
            label: Name of this phase of the study.
            specs: What to run, each under a key of the caller's choice.
            on_result: Called with each result as soon as it is there, those
                of the store included.

        Returns:
            The result of each spec under the spec's key, in the order of
            `specs`, whichever worker finished first.

        Raises:
            InputError: If workers die again and again.
        """
        outdated, before = self._store.outdated(label, list(specs.values()))
        self._store.plan(label, list(specs.values()))
        # Equal specs are one trial: they share a key in the store.
        asked: dict[str, list[Key]] = {}
        trials: dict[str, Spec] = {}
        for key, spec in specs.items():
            trial = trial_key(spec)
            asked.setdefault(trial, []).append(key)
            trials[trial] = spec
        results: dict[Key, Result] = {}

        def keep(trial: str) -> bool:
            # As the store gives it back: a resumed study and one that was
            # not disturbed see the same numbers.
            result = self._store.get(trials[trial])
            if result is None:
                return False
            for key in asked[trial]:
                results[key] = result
                if on_result is not None:
                    on_result(key, result)
            return True

        missing = dict.fromkeys(trial for trial in trials if not keep(trial))
        self.reused += len(trials) - len(missing)
        if outdated and missing and not self._quiet:
            new = trials[next(iter(missing))]
            self._progress.console.print(
                f"{label}: {outdated} trials that were finished here do not "
                f"fit any more ({_difference(before, new)}); {len(missing)} "
                "are run",
                highlight=False,
                soft_wrap=True,
            )
        bar = self._progress.add_task(
            label, total=len(trials), completed=len(trials) - len(missing)
        )

        def put(trial: str, result: Result) -> None:
            self._store.put(trials[trial], *result)
            keep(trial)
            del missing[trial]
            self._progress.advance(bar)

        self._pool.run(
            self._run,
            lambda: {trial: (trials[trial],) for trial in missing},
            put,
            label=label,
            on_death=lambda dead: self._progress.console.print(
                f"{label}: {dead} died; its trials are tried again"
            ),
        )
        return {key: results[key] for key in specs}
