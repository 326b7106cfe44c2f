"""What the commands of studies share: they ask for trials by a plan.

A command is a `StudyCommand` with a plan, a default folder, and what it does
besides. Nothing heavy is imported here before the options are read.
"""

import argparse
from collections.abc import Callable, Iterator
import contextlib
import dataclasses
from pathlib import Path
from typing import TYPE_CHECKING, Any, Generic, TypeVar

from drake_affetto.cli.options import (
    STORE,
    add_output_argument,
    add_plan_arguments,
    add_study_arguments,
    check_study_arguments,
    make_plan,
    worker_count,
)
from drake_affetto.common.output import write_json
from drake_affetto.common.owner import claim_folder
from drake_affetto.experiments.plans import Plan

if TYPE_CHECKING:
    from drake_affetto.runner.executor import Result, Spec, TrialExecutor
    from drake_affetto.runner.workers import WorkerPool

P = TypeVar("P", bound=Plan)


@dataclasses.dataclass(frozen=True)
class Call(Generic[P]):
    """A study that was called for.

    Attributes:
        plan: Its plan.
        args: Parsed options of the command.
        console: A rich console.
        out: Folder of the results.
        executor: Executor of the trials, which are kept in the folder.
    """

    plan: P
    args: argparse.Namespace
    console: Any
    out: Path
    executor: "TrialExecutor"


class StudyCommand(Generic[P]):
    """A command that runs trials by a plan, and writes results.json.

    Attributes:
        command: Its name.
        plan: Dataclass of the plan; its fields are options.
        out: Default folder of the results; None where the command declares
            --out itself.
        trials: Word for what the study's executor runs.
    """

    command: str
    plan: type[P]
    out: str | None = None
    trials = "trials"

    def add_arguments(self, parser: argparse.ArgumentParser) -> None:
        """Declares the command's options."""
        self.add_options(parser)
        add_plan_arguments(parser, self.plan)
        if self.out is not None:
            add_output_argument(parser, self.out)
        add_study_arguments(parser)

    def run(self, args: argparse.Namespace) -> int:
        """Runs the study; returns the exit code.

        Raises:
            InputError: If an option does not fit or the folder cannot be
                written.
        """
        plan = self.make_plan(args)
        plan.check()
        check_study_arguments(args)

        from rich.console import Console

        return self.work(plan, args, Console()) or 0

    def add_options(self, parser: argparse.ArgumentParser) -> None:
        """Declares what options this command has besides."""

    def make_plan(self, args: argparse.Namespace) -> P:
        """The plan that the options describe."""
        return make_plan(self.plan, args)

    def work(
        self, plan: P, args: argparse.Namespace, console: Any
    ) -> int | None:
        """Runs what is missing, shows the results and writes them.

        Returns:
            The exit code, if it is not 0.
        """
        with self._call(plan, args, console) as call:
            found = self.study(call)
        results = self.finish(call, found)
        path = call.out / "results.json"
        write_json(path, results)
        self.show(results, console)
        console.print(f"results: {path}")
        return None

    @contextlib.contextmanager
    def _call(
        self, plan: P, args: argparse.Namespace, console: Any
    ) -> Iterator[Call[P]]:
        """The study with its workers and its folder.

        The workers start first, for that takes longest. The folder is made
        only if the scenarios fit.
        """
        scenarios = self.scenarios(plan, args)
        with worker_pool(args, *scenarios[:1]) as pool:
            with console.status(f"Starting {pool.workers} workers"):
                run = self.runs_trials()
                if scenarios:
                    from drake_affetto.station.scenario import load_scenario

                    for scenario in scenarios:
                        load_scenario(scenario)
                out = claim_folder(args.out, self.command)
            with trial_executor(
                args, out / STORE, console, pool, run, self.trials
            ) as executor:
                yield Call(plan, args, console, out, executor)

    def scenarios(self, plan: P, args: argparse.Namespace) -> tuple[str, ...]:
        """Scenarios by name or path, that of the first trials first."""
        raise NotImplementedError

    def runs_trials(self) -> "Callable[[Spec], Result]":
        """The function that runs one trial."""
        from drake_affetto.experiments.worker import run_task

        return run_task

    def study(self, call: Call[P]) -> Any:
        """Asks for the trials; what it returns is given to `finish`."""
        raise NotImplementedError

    def finish(self, call: Call[P], found: Any) -> Any:
        """Does what needs no trials, and gives the content of results.json."""
        return found

    def show(self, results: Any, console: Any) -> None:
        """Prints the results."""


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
    args: argparse.Namespace, scenario: str | None = None
) -> Iterator["WorkerPool"]:
    """Workers of a study that was called with the shared options.

    Worker processes begin at once to import what they need, while this
    process does so too.

    Args:
        args: Parsed options.
        scenario: Scenario of the first trials, by name or path; None for
            trials without the robot.
    """
    from drake_affetto.experiments.worker import prepare
    from drake_affetto.runner.workers import WorkerPool

    with contextlib.ExitStack() as stack:
        cluster = None
        if args.dask is not None:
            from drake_affetto.experiments.trials import software
            from drake_affetto.runner.dask_cluster import cluster_executor

            cluster = stack.enter_context(cluster_executor(args.dask, software))
        pool = stack.enter_context(
            WorkerPool(
                worker_count(args),
                cluster,
                prepare=None if scenario is None else prepare,
                arguments=(scenario,),
            )
        )
        pool.start()
        yield pool


@contextlib.contextmanager
def trial_executor(
    args: argparse.Namespace,
    path: Path,
    console: Any,
    pool: "WorkerPool",
    run: "Callable[[Spec], Result]",
    trials: str = "trials",
) -> Iterator["TrialExecutor"]:
    """The executor of a study that was called with the shared options.

    Args:
        args: Parsed options.
        path: File of the study's trials.
        console: A rich console.
        pool: Workers of the study.
        run: Function of a module that runs one trial.
        trials: Word for what it runs.

    Yields:
        An executor whose trials are kept in `path`.
    """
    from drake_affetto.runner.executor import TrialExecutor
    from drake_affetto.runner.store import TrialStore

    with (
        TrialStore(path) as store,
        tells_how_to_continue(console, path.parent),
    ):
        for folder in args.reuse:
            taken = store.merge(Path(folder) / STORE)
            console.print(f"{taken} finished trials taken over from {folder}")
        with TrialExecutor(run, store, pool=pool) as executor:
            yield executor
        if executor.reused:
            console.print(f"{executor.reused} {trials} were finished already")


def rate_text(rate: Any) -> str:
    """A `SuccessRate` with its interval, for a table."""
    return f"{rate.mean:4.0%}  [{rate.low:.0%}, {rate.high:.0%}]"
