"""`affetto identify`: fits a joint's actuator to logs of the robot."""

import argparse
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from drake_affetto.cli.options import add_output_argument, whole_number
from drake_affetto.common.errors import InputError
from drake_affetto.common.owner import claim_folder

if TYPE_CHECKING:
    from drake_affetto.identification.problem import JointProblem
    from drake_affetto.robot.log import RobotLog

# Rms difference to the robot's control law from which a log is remarked on,
# kPa.
_LAW_TOLERANCE = 2.0


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declares the command's options."""
    parser.add_argument(
        "--fit",
        nargs="+",
        required=True,
        metavar="LOG",
        help="logs (CSV of the robot's library) to fit to",
    )
    parser.add_argument(
        "--test",
        nargs="+",
        required=True,
        metavar="LOG",
        help="logs to predict, which the fit does not use",
    )
    parser.add_argument(
        "--joint",
        type=whole_number,
        default=5,
        metavar="N",
        help="number of the joint in the logs; 5 is the left elbow",
    )
    parser.add_argument(
        "--overlay",
        action="append",
        default=[],
        metavar="FILE",
        help="YAML file that changes pneumatics.yaml before the fit, for "
        "instance its supply pressure: "
        "package://drake_affetto/robot_pneumatics.yaml",
    )
    add_output_argument(parser, "out/identify")


def run(args: argparse.Namespace) -> int:
    """Fits, predicts and writes the results; returns the exit code.

    Raises:
        InputError: If a log, the joint or the folder does not fit.
    """
    from rich.console import Console

    from drake_affetto.identification.problem import JointProblem
    from drake_affetto.identification.study import run_identification
    from drake_affetto.pneumatics.parameters import load_parameters
    from drake_affetto.robot.controller import (
        load_robot_controller,
        require_joint,
    )
    from drake_affetto.robot.log import read_log

    # Everything is read and checked before the folder is made.
    controller = load_robot_controller()
    joint = require_joint(controller, args.joint)
    require_distinct(args.fit, args.test)
    fit = [read_log(path, args.joint, controller) for path in args.fit]
    test = [read_log(path, args.joint, controller) for path in args.test]
    supply = load_parameters(overlays=args.overlay)
    problem = JointProblem(
        joint=joint,
        controller=controller,
        supply=supply,
        actuator=supply.classes[joint.actuator],
    )
    folder = claim_folder(args.out, "identify")

    console = Console()
    _print_notes(problem, fit, test)
    results = run_identification(problem, fit, test, args.fit, folder, console)
    _print_errors(results, console)
    _print_parameters(results, console)
    console.print(f"written to {folder}", highlight=False)
    return 0


def require_distinct(fit: Sequence[str], test: Sequence[str]) -> None:
    """Sees that each log is given once, and what is tested was not fitted.

    Raises:
        InputError: If two logs have one name or one content, or a file cannot
            be read.
    """
    names: dict[str, str] = {}
    contents: dict[bytes, str] = {}
    for option, paths in (("--fit", fit), ("--test", test)):
        for path in paths:
            stem = Path(path).stem
            try:
                content = Path(path).read_bytes()
            except OSError as error:
                raise InputError(
                    f"{option}: cannot read {path}: {error.strerror}"
                ) from error
            if content in contents:
                raise InputError(
                    f"{option}: {path} is the same log as "
                    f"{contents[content]}; a log that was fitted is not held "
                    "out, and none counts twice"
                )
            if stem in names:
                raise InputError(
                    f"{option}: two logs are called {stem}; their results "
                    "would overwrite each other"
                )
            names[stem] = path
            contents[content] = path


def _print_notes(
    problem: "JointProblem",
    fit: Sequence["RobotLog"],
    test: Sequence["RobotLog"],
) -> None:
    """Prints what limits the use of these logs."""
    from drake_affetto.robot.control_law import control_law_error

    for log in (*fit, *test):
        error = control_law_error(log, problem.joint, problem.controller)
        if error > _LAW_TOLERANCE:
            print(
                f"note: the commands of {log.name} are not those of the "
                f"robot's PID law (rms difference {error:.1f} kPa); expect "
                "little of its closed loop"
            )


def _print_errors(results: dict[str, Any], console: Any) -> None:
    from rich.table import Table

    table = Table(
        title=f"{results['joint']}: errors from "
        f"{results['judged_from_s']:g} s on (rms)"
    )
    for head in ("log", "used for", "loop", "q [%]", "p_a [kPa]", "p_b [kPa]"):
        table.add_column(head)
    rows = [
        (name, use, results["logs"][name])
        for use in ("fit", "test")
        for name in results[use]
    ]
    for name, use, entry in [*rows, ("all tests", "test", results)]:
        for loop in ("closed", "open"):
            errors = entry[f"{loop}_loop"].values()
            table.add_row(name, use, loop, *(f"{x:.2f}" for x in errors))
    console.print(table)


def _print_parameters(results: dict[str, Any], console: Any) -> None:
    from rich.table import Table

    table = Table(title="parameters")
    for head in ("name", "value", "±", "unit", ""):
        table.add_column(head)
    for name, entry in results["parameters"].items():
        std = entry["std"]
        table.add_row(
            name,
            f"{entry['value']:.4g}",
            "" if std is None else f"{std:.2g}",
            entry["unit"],
            "" if entry["determined"] else "not determined",
        )
    console.print(table)
