"""Options of the commands: those of a plan, and those that studies share."""

import argparse
import dataclasses
from pathlib import Path
import types
import typing
from typing import Any, TypeVar

from drake_affetto.common.errors import InputError, require_range, shown
from drake_affetto.common.fields import option_name, read_number
from drake_affetto.common.output import STORE

WORKERS = 2

Plan = TypeVar("Plan")
T = TypeVar("T", int, float)


def whole_number(text: str) -> int:
    """An option's whole number, in decimal digits.

    Raises:
        argparse.ArgumentTypeError: For another text.
    """
    return _number(text, int, "a whole number")


def real_number(text: str) -> float:
    """An option's number, in decimal notation.

    Raises:
        argparse.ArgumentTypeError: For another text.
    """
    return _number(text, float, "a number")


def _number(text: str, kind: type[T], expected: str) -> T:
    try:
        return read_number(text, kind)
    except ValueError:
        raise argparse.ArgumentTypeError(
            f"{shown(text)} is not {expected}"
        ) from None


_NUMBERS: dict[type, Any] = {int: whole_number, float: real_number}


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
            how |= {"type": _reader(typing.get_args(kind)[0]), "nargs": "+"}
        else:
            how |= {"type": _reader(kind)}
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


def _reader(kind: Any) -> Any:
    """What reads an option of that kind; None is of no kind."""
    if typing.get_origin(kind) in (typing.Union, types.UnionType):
        (kind,) = (k for k in typing.get_args(kind) if k is not type(None))
    return _NUMBERS.get(kind, kind)


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
    parser.add_argument(
        "--seed", type=whole_number, default=0, metavar="N", help=text
    )


def add_workers_argument(parser: Any) -> None:
    """Declares --workers."""
    parser.add_argument(
        "--workers",
        type=whole_number,
        # Not the number itself: argparse would not see it beside --dask.
        default=None,
        metavar="N",
        help=f"worker processes ({WORKERS}); 0 runs all in this one",
    )


def add_scenario_argument(
    parser: argparse.ArgumentParser, name: str = "--scenario", **how: Any
) -> None:
    """Declares which scenario is meant; `how` is for argparse."""
    parser.add_argument(
        name, default="drumming", help="scenario, by name or YAML file", **how
    )


def add_restart_argument(parser: argparse.ArgumentParser) -> None:
    """Declares --restart."""
    parser.add_argument(
        "--restart",
        action="store_true",
        help="delete the trials that an earlier run into DIR has finished",
    )


def add_study_arguments(parser: argparse.ArgumentParser) -> None:
    """Declares where a study's trials run and which it takes over."""
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
