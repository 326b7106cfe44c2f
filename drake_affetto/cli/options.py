"""Options of the commands: those of a plan, and those that studies share."""

import argparse
from collections.abc import Iterator
import contextlib
import dataclasses
from pathlib import Path
import typing
from typing import TYPE_CHECKING, Any, TypeVar

from drake_affetto.common.errors import InputError, require_range
from drake_affetto.common.fields import option_name
from drake_affetto.common.output import prepare_output

if TYPE_CHECKING:
    from drake_affetto.runner.executor import TrialExecutor
    from drake_affetto.runner.workers import WorkerPool

STORE = "trials.sqlite"
WORKERS = 2

Plan = TypeVar("Plan")


def add_plan_arguments(parser: argparse.ArgumentParser, plan: type) -> None:
    """Declares an option for each field of a plan that has a help text.

    Earlier names of an option work too, but the help does not show them.

    Args:
        parser: Parser of the command.
        plan: Dataclass with fields of `drake_affetto.common.fields`.
    """
    kinds = typing.get_type_hints(plan)
    for field in dataclasses.fields(plan):
        if not field.metadata.get("help"):
            continue
        kind = kinds[field.name]
        how: dict[str, Any] = {"metavar": field.metadata["metavar"]}
        if kind is bool:
            how = {"action": "store_true"}
        elif typing.get_origin(kind) is tuple:
            how |= {"type": typing.get_args(kind)[0], "nargs": "+"}
        else:
            how |= {"type": kind}
        default = field.default
        if isinstance(default, tuple):
            # An empty one has nothing to show in the help.
            default = list(default)
        parser.add_argument(
            option_name(field),
            help=field.metadata["help"],
            default=default,
            **how,
        )
        for alias in field.metadata["aliases"]:
            parser.add_argument(
                f"--{alias}",
                dest=field.name,
                help=argparse.SUPPRESS,
                default=argparse.SUPPRESS,
                **how,
            )


def make_plan(plan: type[Plan], args: argparse.Namespace, **more: Any) -> Plan:
    """The plan that the options describe.

    Args:
        plan: Dataclass that `add_plan_arguments` was given.
        args: Parsed options.
        more: Fields that have no option of their own.
    """
    values = {}
    for field in dataclasses.fields(plan):  # type: ignore[arg-type]
        if hasattr(args, field.name):
            value = getattr(args, field.name)
            values[field.name] = (
                tuple(value) if isinstance(value, list) else value
            )
    return plan(**(values | more))


def add_output_argument(
    parser: argparse.ArgumentParser, default: str | None
) -> None:
    """Declares --out, the folder of results."""
    parser.add_argument(
        "--out", metavar="DIR", default=default, help="folder for the results"
    )


def add_seed_argument(
    parser: argparse.ArgumentParser,
    text: str = "seed of everything that is random",
) -> None:
    """Declares --seed."""
    parser.add_argument("--seed", type=int, default=0, metavar="N", help=text)


def add_workers_argument(parser: Any) -> None:
    """Declares --workers."""
    parser.add_argument(
        "--workers",
        type=int,
        # Not the number itself: argparse would not see it beside --dask.
        default=None,
        metavar="N",
        help=f"worker processes ({WORKERS}); 0 runs all in this one",
    )


def add_restart_argument(parser: argparse.ArgumentParser) -> None:
    """Declares --restart."""
    parser.add_argument(
        "--restart",
        action="store_true",
        help="delete the trials that an earlier run into DIR has finished",
    )


def add_study_arguments(
    parser: argparse.ArgumentParser, out: str | None
) -> None:
    """Declares the options that studies on the robot share.

    Args:
        parser: Parser of the command.
        out: Default folder of the results; None where the command declares
            --out itself.
    """
    if out is not None:
        add_output_argument(parser, out)
    where = parser.add_mutually_exclusive_group()
    add_workers_argument(where)
    where.add_argument(
        "--dask",
        metavar="ADDRESS",
        help="run the trials on the Dask cluster whose scheduler is there",
    )
    parser.add_argument(
        "--reuse",
        metavar="DIR",
        action="append",
        default=[],
        help="take finished trials over from another study's folder",
    )


def worker_count(args: argparse.Namespace) -> int:
    """The number of worker processes.

    Raises:
        InputError: If it does not fit.
    """
    if args.workers is None:
        return WORKERS
    require_range("--workers", args.workers, 0, 256)
    return args.workers


def check_study_arguments(args: argparse.Namespace) -> None:
    """Raises InputError for the first shared option that does not fit."""
    worker_count(args)
    for folder in args.reuse:
        if not (Path(folder) / STORE).is_file():
            raise InputError(f"--reuse: there is no {STORE} in {folder}")


@contextlib.contextmanager
def tells_how_to_continue(console: Any, out: Path) -> Iterator[None]:
    """On Ctrl-C, says on the console that the same command continues."""
    try:
        yield
    except KeyboardInterrupt:
        console.print(
            f"Finished trials are kept in {out}; the same command goes on "
            "from there."
        )
        raise


@contextlib.contextmanager
def worker_pool(
    args: argparse.Namespace, scenario: str
) -> Iterator["WorkerPool"]:
    """Workers of a study that was called with the shared options.

    Worker processes begin at once to import what they need, while this
    process does so too.

    Args:
        args: Parsed options.
        scenario: Scenario of the first trials, by name or path.
    """
    from drake_affetto.experiments.worker import prepare
    from drake_affetto.runner.workers import WorkerPool

    with contextlib.ExitStack() as stack:
        cluster = None
        if getattr(args, "dask", None) is not None:
            from drake_affetto.experiments.trials import software
            from drake_affetto.runner.dask_cluster import cluster_executor

            cluster = stack.enter_context(cluster_executor(args.dask, software))
        pool = stack.enter_context(
            WorkerPool(
                worker_count(args),
                cluster,
                prepare=prepare,
                arguments=(scenario,),
            )
        )
        pool.start()
        yield pool


@contextlib.contextmanager
def trial_executor(
    args: argparse.Namespace, path: Path, console: Any, pool: "WorkerPool"
) -> Iterator["TrialExecutor"]:
    """The executor of a study that was called with the shared options.

    Args:
        args: Parsed options.
        path: File of the study's trials.
        console: A rich console.
        pool: Workers of the study.

    Yields:
        An executor whose trials are kept in `path`.
    """
    from drake_affetto.experiments.worker import run_task
    from drake_affetto.runner.executor import TrialExecutor
    from drake_affetto.runner.store import TrialStore

    with (
        TrialStore(path) as store,
        tells_how_to_continue(console, path.parent),
    ):
        for folder in args.reuse:
            taken = store.merge(Path(folder) / STORE)
            console.print(f"{taken} finished trials taken over from {folder}")
        with TrialExecutor(run_task, store, pool=pool) as executor:
            yield executor
        if executor.reused:
            console.print(f"{executor.reused} trials were finished already")


@contextlib.contextmanager
def study(
    args: argparse.Namespace, console: Any, *scenarios: str
) -> Iterator[tuple[Path, "TrialExecutor"]]:
    """Folder and executor of a study on the robot.

    The workers start first, for that takes longest. The folder is made only
    if the scenarios fit.

    Args:
        args: Parsed options.
        console: A rich console.
        scenarios: Scenarios by name or path, that of the first trials first.

    Yields:
        The folder of the results and the executor of the trials.
    """
    with worker_pool(args, scenarios[0]) as pool:
        with console.status(f"Starting {pool.workers} workers"):
            from drake_affetto.station.scenario import load_scenario

            for scenario in scenarios:
                load_scenario(scenario)
            out = prepare_output(args.out)
        with trial_executor(args, out / STORE, console, pool) as executor:
            yield out, executor


def rate_text(rate: Any) -> str:
    """A `SuccessRate` with its interval, for a table."""
    return f"{rate.mean:4.0%}  [{rate.low:.0%}, {rate.high:.0%}]"
