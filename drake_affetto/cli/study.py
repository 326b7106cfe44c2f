"""What the long studies share: options, folder, workers, going on later."""

import argparse
from collections.abc import Iterator
import contextlib
from pathlib import Path
from typing import Any

from drake_affetto.common.errors import InputError, require_range
from drake_affetto.experiments.trials import run_task, software
from drake_affetto.runner.executor import TrialExecutor
from drake_affetto.runner.store import TrialStore

STORE = "trials.sqlite"
WORKERS = 2


def add_study_arguments(parser: argparse.ArgumentParser, out: str) -> None:
    """Declares the options that every long study has."""
    parser.add_argument(
        "--out", metavar="DIR", default=out, help="where results go"
    )
    parser.add_argument(
        "--seed", type=int, default=0, help="of everything that is random"
    )
    where = parser.add_mutually_exclusive_group()
    where.add_argument(
        "--workers",
        type=int,
        # Not the number itself: argparse would not see it beside --dask.
        default=None,
        metavar="N",
        help=f"worker processes ({WORKERS}); 0 runs all in this one",
    )
    where.add_argument(
        "--dask",
        metavar="ADDRESS",
        help="hand the trials to the Dask cluster whose scheduler is there",
    )
    parser.add_argument(
        "--reuse",
        metavar="DIR",
        action="append",
        default=[],
        help="take finished trials over from another study's folder",
    )


def check_study_arguments(args: argparse.Namespace) -> None:
    """Raises InputError for the first shared option that does not fit."""
    require_range("--seed", args.seed, 0, 2**31 - 1)
    if args.workers is not None:
        require_range("--workers", args.workers, 0, 256)
    for folder in args.reuse:
        if not (Path(folder) / STORE).is_file():
            raise InputError(f"--reuse: there is no {STORE} in {folder}")


@contextlib.contextmanager
def campaign(
    args: argparse.Namespace, out: Path, console: Any
) -> Iterator[TrialExecutor]:
    """The executor of a study that was called with the shared options.

    Args:
        args: the options.
        out: the study's folder, prepared.
        console: of rich.

    Yields:
        An executor whose trials are kept in the study's folder. On Ctrl-C the
        console is told how to go on.
    """
    with contextlib.ExitStack() as stack:
        store = stack.enter_context(TrialStore(out / STORE))
        for folder in args.reuse:
            taken = store.absorb(Path(folder) / STORE)
            console.print(f"{taken} finished trials taken over from {folder}")
        cluster = None
        if args.dask is not None:
            from drake_affetto.runner.dask_cluster import cluster_executor

            cluster = stack.enter_context(cluster_executor(args.dask, software))
        executor = stack.enter_context(
            TrialExecutor(
                run_task,
                store,
                workers=WORKERS if args.workers is None else args.workers,
                executor=cluster,
            )
        )
        try:
            yield executor
        except KeyboardInterrupt:
            console.print(
                f"{len(store)} finished trials are kept in {out}; the same "
                "command goes on from there."
            )
            raise
        if executor.reused:
            console.print(f"{executor.reused} trials were finished already")
