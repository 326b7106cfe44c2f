"""The results of an identification, and the files that hold them."""

from collections.abc import Sequence
import dataclasses
from pathlib import Path
from typing import Any

import numpy as np
import yaml

from drake_affetto import __version__
from drake_affetto.common.output import (
    write_text_atomic,
)
from drake_affetto.common.typing import Array
from drake_affetto.identification.bands import LEVEL, Band
from drake_affetto.identification.fit import FitState
from drake_affetto.identification.prediction import Prediction
from drake_affetto.identification.problem import JointProblem
from drake_affetto.identification.simulator import (
    JUDGED_FROM,
    Simulated,
)
from drake_affetto.identification.uncertainty import (
    Uncertainty,
)
from drake_affetto.robot.log import RobotLog


def _rms(predictions: Sequence[Prediction], kind: str) -> Array:
    """Rms errors over several logs, (3,): angle and both pressures."""
    each = [getattr(p, kind).rms(p.log) for p in predictions]
    return np.sqrt(np.mean(np.square(each), axis=0))


def _named(rms: Array) -> dict[str, float]:
    names = ("q_rms_percent", "pa_rms_kpa", "pb_rms_kpa")
    return {name: float(x) for name, x in zip(names, rms, strict=True)}


def _by_channel(values: Array) -> dict[str, float]:
    return {
        name: float(x)
        for name, x in zip(("q", "pa", "pb"), values, strict=True)
    }


def _bands(predictions: Sequence[Prediction]) -> dict[str, Any]:
    """Coverage of the bands over several logs, by loop and channel."""
    loops = predictions[0].bands if predictions else {}
    return {
        loop: _by_channel(
            np.mean([p.bands[loop].coverage(p.log) for p in predictions], 0)
        )
        for loop in loops
    }


def _per_log(predictions: Sequence[Prediction]) -> dict[str, Any]:
    return {
        p.log.name: {
            "start_delay_s": p.start_delay,
            "closed_loop": _named(p.closed_loop.rms(p.log)),
            "open_loop": _named(p.open_loop.rms(p.log)),
            "open_loop_percent_per_kpa": p.drift_per_kpa,
            "bands": {
                loop: {
                    "coverage": _by_channel(band.coverage(p.log)),
                    "half_width": _by_channel(band.half_width(p.log)),
                }
                for loop, band in p.bands.items()
            },
        }
        for p in predictions
    }


def make_results(
    problem: JointProblem,
    state: FitState,
    uncertainty: Uncertainty,
    fitted: Sequence[Prediction],
    tested: Sequence[Prediction],
) -> dict[str, Any]:
    """Gathers the content of results.json.

    Args:
        problem: The joint.
        state: The finished fit.
        uncertainty: Uncertainty of the fit.
        fitted: Predictions of the logs of the fit.
        tested: Predictions of the other logs.
    """
    parameters = {
        p.name: {
            "value": state.values[p.name],
            "std": uncertainty.std[p.name],
            "unit": p.unit,
            "determined": uncertainty.determined[p.name],
            **(
                {"squared_error_at_half_and_double": state.profile[p.name]}
                if p.name in state.profile
                else {}
            ),
        }
        for p in problem.parameters()
    }
    parameters["torque_constant"] = {
        "value": problem.actuator.torque_constant,
        "std": None,
        "unit": "m³/rad",
        "determined": False,
    }
    return {
        "version": __version__,
        "joint": problem.joint.name,
        "fit": [p.log.name for p in fitted],
        "test": [p.log.name for p in tested],
        "judged_from_s": JUDGED_FROM,
        "closed_loop": _named(_rms(tested, "closed_loop")),
        "open_loop": _named(_rms(tested, "open_loop")),
        "fit_closed_loop": _named(_rms(fitted, "closed_loop")),
        "fit_open_loop": _named(_rms(fitted, "open_loop")),
        # Of the logs that were held out; none where the fit had one log.
        "bands": {"level": LEVEL, "coverage": _bands(tested)},
        "logs": {**_per_log(fitted), **_per_log(tested)},
        "parameters": parameters,
        "undetermined": [
            {
                "what": "torque_constant, and with it in proportion every "
                "volume, conductance, torque and the inertia: angles and "
                "pressures tell only their ratios",
            },
            *(
                {"std_of_bounds": spread, "weights": weights}
                for spread, weights in uncertainty.undetermined
            ),
        ],
    }


def write_csv(path: Path, simulated: Simulated) -> None:
    """Writes a simulated log: time, angle in % and pressures in kPa."""
    rows = np.stack(
        [simulated.t, simulated.q, simulated.p_a, simulated.p_b], axis=1
    )
    lines = ["t,q,pa,pb"]
    lines += [",".join(f"{x:.6g}" for x in row) for row in rows]
    write_text_atomic(path, "\n".join(lines) + "\n")


def write_band(path: Path, log: RobotLog, band: Band) -> None:
    """Writes a prediction interval: time, and both ends of each channel."""
    rows = np.column_stack([log.t, band.lower, band.upper])
    lines = ["t,q_low,pa_low,pb_low,q_high,pa_high,pb_high"]
    lines += [",".join(f"{x:.6g}" for x in row) for row in rows]
    write_text_atomic(path, "\n".join(lines) + "\n")


def actuator_yaml(
    problem: JointProblem,
    state: FitState,
    uncertainty: Uncertainty,
    logs: Sequence[str],
) -> str:
    """The fit as an overlay of the actuators' parameters.

    A scenario names it among its `pneumatics.overlays`. Fitted values that do
    not belong to the actuator (inertia, load, the robot's network) are written
    as comments.

    Args:
        problem: The joint.
        state: The finished fit.
        uncertainty: Uncertainty of the fit.
        logs: Names of the logs.
    """
    actuator = problem.fitted_actuator(state.values)
    before = dataclasses.asdict(problem.actuator)
    after = dataclasses.asdict(actuator)
    # It comes from the robot's network and its 30 Hz clock, not the valve.
    after.pop("dead_time")
    changed = {k: v for k, v in after.items() if v != before[k]}
    lines = [
        f"# Actuator of {problem.joint.name}, fitted to the logs",
        f"# {', '.join(logs)}.",
        "# SI units; ± one standard deviation.",
        "classes:",
        f"  {problem.joint.actuator}:",
    ]
    for name, value in changed.items():
        text = yaml.safe_dump(float(f"{value:.4g}")).split("\n")[0]
        note = ""
        if name in uncertainty.std:
            note = f"  # ± {uncertainty.std[name]:.2g}"
            if not uncertainty.determined[name]:
                note += " at best, not determined"
        lines.append(f"    {name}: {text}{note}")
    lines.append("# Of the joint and the robot's control stack:")
    units = {p.name: p.unit for p in problem.parameters()}
    for name, value in state.values.items():
        if name not in changed:
            lines.append(
                f"#   {name}: {value:.4g} ± {uncertainty.std[name]:.2g} "
                f"{units[name]}"
            )
    return "\n".join(lines) + "\n"
