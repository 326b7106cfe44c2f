"""`affetto identify`: fits the actuators to a robot's logs."""

import argparse
from pathlib import Path
from typing import Any

from drake_affetto.common.output import (
    prepare_output,
    write_json,
    write_text_atomic,
)
from drake_affetto.identification.fit import (
    JUDGED_FROM,
    JointProblem,
    JointSimulator,
    estimate_uncertainty,
)
from drake_affetto.identification.prediction import (
    _ACTUATOR_FILE,
    _LAW_TOLERANCE,
    _draw,
    _fit,
    _require_distinct,
    _results,
    _write_csv,
    actuator_yaml,
    predict,
)
from drake_affetto.pneumatics.parameters import load_parameters
from drake_affetto.robot.log import (
    law_mismatch,
    load_stack,
    read_log,
    require_joint,
)


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
        help="logs to predict, which the fit does not see",
    )
    parser.add_argument(
        "--joint",
        type=int,
        default=5,
        metavar="N",
        help="number of the joint in the logs; 5 is the left elbow",
    )
    parser.add_argument(
        "--out", metavar="DIR", default="out/identify", help="where results go"
    )


def run(args: argparse.Namespace) -> int:
    """Fits, predicts and writes the results.

    Raises:
        InputError: for a log, joint or folder that does not fit.
    """
    stack = load_stack()
    joint = require_joint(stack, args.joint)
    fit = [read_log(path, args.joint, stack) for path in args.fit]
    test = [read_log(path, args.joint, stack) for path in args.test]
    _require_distinct(args.fit, "--fit")
    _require_distinct(args.test, "--test")
    supply = load_parameters()
    problem = JointProblem(
        joint=joint,
        stack=stack,
        supply=supply,
        actuator=supply.classes[joint.actuator],
    )
    folder = prepare_output(args.out)

    for log in (*fit, *test):
        mismatch = law_mismatch(log, joint, stack)
        if mismatch > _LAW_TOLERANCE:
            print(
                f"note: the commands of {log.name} are not those of the "
                f"robot's PID law (rms difference {mismatch:.1f} kPa); expect "
                "little of its closed loop"
            )
    both = {log.name for log in fit} & {log.name for log in test}
    if both:
        print(f"note: fitted and tested on: {', '.join(sorted(both))}")

    state = _fit(problem, fit, args.fit, folder)
    uncertainty = estimate_uncertainty(problem, fit, state)
    simulator = JointSimulator(problem)
    tested = [predict(simulator, state.values, log) for log in test]
    fitted = [predict(simulator, state.values, log) for log in fit]
    results = _results(problem, state, uncertainty, fitted, tested)
    for prediction in tested:
        stem = prediction.log.name
        _write_csv(folder / f"{stem}_closed.csv", prediction.closed_loop)
        _write_csv(folder / f"{stem}_open.csv", prediction.open_loop)
    for prediction in (*fitted, *tested):
        _draw(folder / f"{prediction.log.name}.png", prediction)
    write_text_atomic(
        folder / _ACTUATOR_FILE,
        actuator_yaml(problem, state, uncertainty, [log.name for log in fit]),
    )
    # Last: where it is, everything is.
    write_json(folder / "results.json", results)
    _print_tables(results, folder)
    return 0


def _print_tables(results: dict[str, Any], folder: Path) -> None:
    from rich.console import Console
    from rich.table import Table

    console = Console()
    table = Table(
        title=f"{results['joint']}: errors from {JUDGED_FROM:g} s on (rms)"
    )
    for head in ("log", "used for", "loop", "q [%]", "p_a [kPa]", "p_b [kPa]"):
        table.add_column(head)
    for use in ("fit", "test"):
        for name in results[use]:
            entry = results["logs"][name]
            for loop in ("closed", "open"):
                rms = entry[f"{loop}_loop"]
                table.add_row(
                    name, use, loop, *(f"{x:.2f}" for x in rms.values())
                )
    for loop in ("closed", "open"):
        rms = results[f"{loop}_loop"]
        table.add_row(
            "all tests", "test", loop, *(f"{x:.2f}" for x in rms.values())
        )
    console.print(table)
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
    console.print(f"written to {folder}", highlight=False)
