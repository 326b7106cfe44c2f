"""`affetto identify`: fit a joint's actuator to logs of the robot.

The fit goes on where it stopped when it is started again with the same logs
and the same output folder.
"""

from collections.abc import Sequence
import dataclasses
import hashlib
import json
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
import yaml

from drake_affetto import __version__
from drake_affetto.common.errors import InputError
from drake_affetto.common.output import (
    atomic_path,
    write_json,
    write_text_atomic,
)
from drake_affetto.identification.fit import (
    ANGLE_SCALE,
    JUDGED_FROM,
    PROFILED,
    STAGES,
    FitState,
    JointProblem,
    JointSimulator,
    Simulated,
    Uncertainty,
    fit_logs,
    profile_fit,
)
from drake_affetto.robot.log import (
    RobotLog,
)

_STATE_FILE = "state.json"
_ACTUATOR_FILE = "actuator.yaml"
# Raised when a change of the model makes a stored state worthless.
_STATE_VERSION = 1
_LAW_TOLERANCE = 2.0


@dataclasses.dataclass(frozen=True)
class Prediction:
    """A log and its two simulations.

    Attributes:
        log: the log.
        start_delay: dead time of its start, from its first second, s.
        closed_loop: under the robot's own control law.
        open_loop: under the logged commands.
    """

    log: RobotLog
    start_delay: float
    closed_loop: Simulated
    open_loop: Simulated


def predict(
    simulator: JointSimulator, values: dict[str, float], log: RobotLog
) -> Prediction:
    """Simulates `log` free-running, in closed and in open loop."""
    delay = simulator.estimate_start_delay(values, log)
    return Prediction(
        log=log,
        start_delay=delay,
        closed_loop=simulator.run(values, log, start_delay=delay),
        open_loop=simulator.run(
            values, log, start_delay=delay, closed_loop=False
        ),
    )


def _require_distinct(paths: Sequence[str], option: str) -> None:
    stems = [Path(path).stem for path in paths]
    for stem in stems:
        if stems.count(stem) > 1:
            raise InputError(
                f"{option}: two logs are called {stem}; their results would "
                "overwrite each other"
            )


def _fit(
    problem: JointProblem,
    logs: Sequence[RobotLog],
    paths: Sequence[str],
    folder: Path,
) -> FitState:
    """Fits with progress shown, from where a former run stopped."""
    from rich.console import Console
    from rich.progress import (
        BarColumn,
        Progress,
        TextColumn,
        TimeElapsedColumn,
    )

    key = _key(problem, paths)
    state = _read_state(folder / _STATE_FILE, key)
    if state is not None:
        print(
            f"found {state.stage + len(state.profile)} of "
            f"{len(STAGES) + len(PROFILED)} stages done in {folder}, going on "
            "from there"
        )

    def keep(reached: FitState) -> None:
        write_json(
            folder / _STATE_FILE,
            {"key": key, "state": dataclasses.asdict(reached)},
        )

    with Progress(
        TextColumn("{task.description}"),
        BarColumn(),
        TextColumn("{task.fields[note]}"),
        TimeElapsedColumn(),
        console=Console(),
    ) as progress:
        done = 0 if state is None else state.stage + len(state.profile)
        task = progress.add_task(
            "fitting",
            total=len(STAGES) + len(PROFILED),
            completed=done,
            note="",
        )
        best = [float("inf")]

        def on_evaluation(stage: int, cost: float) -> None:
            best[0] = min(best[0], cost)
            progress.update(
                task,
                description=f"fitting to {STAGES[stage]}",
                note=f"error {ANGLE_SCALE * best[0] ** 0.5:.2f} % of range",
            )

        def on_stage(reached: FitState) -> None:
            keep(reached)
            best[0] = float("inf")
            progress.update(
                task, completed=reached.stage + len(reached.profile)
            )

        def on_profile(name: str, ratio: float) -> None:
            progress.update(
                task,
                description=f"varying {name}",
                note=f"squared error x {ratio:.2f}",
            )

        state = fit_logs(
            problem,
            logs,
            state=state,
            on_evaluation=on_evaluation,
            on_stage=on_stage,
        )
        return profile_fit(
            problem,
            logs,
            state,
            on_evaluation=on_profile,
            on_parameter=on_stage,
        )


def _key(problem: JointProblem, paths: Sequence[str]) -> str:
    """Names everything that determines a fit."""
    digest = hashlib.sha256()
    parts: list[Any] = [
        _STATE_VERSION,
        __version__,
        dataclasses.asdict(problem),
        [dataclasses.astuple(p) for p in problem.parameters()],
    ]
    digest.update(json.dumps(parts, sort_keys=True).encode())
    for path in paths:
        digest.update(Path(path).name.encode())
        digest.update(Path(path).read_bytes())
    return digest.hexdigest()


def _read_state(path: Path, key: str) -> FitState | None:
    """The state that a former run left, if it is one of the same fit."""
    try:
        stored = json.loads(path.read_text(encoding="utf-8"))
        if stored["key"] != key:
            return None
        return FitState(**stored["state"])
    except (OSError, ValueError, KeyError, TypeError):
        return None


def _rms(predictions: Sequence[Prediction], kind: str) -> NDArray[np.float64]:
    """Root mean squares (3) over several logs."""
    each = [getattr(p, kind).rms(p.log) for p in predictions]
    return np.sqrt(np.mean(np.square(each), axis=0))


def _named(rms: NDArray[np.float64]) -> dict[str, float]:
    names = ("q_rms_percent", "pa_rms_kpa", "pb_rms_kpa")
    return {name: float(x) for name, x in zip(names, rms, strict=True)}


def _per_log(predictions: Sequence[Prediction]) -> dict[str, Any]:
    return {
        p.log.name: {
            "start_delay_s": p.start_delay,
            "closed_loop": _named(p.closed_loop.rms(p.log)),
            "open_loop": _named(p.open_loop.rms(p.log)),
        }
        for p in predictions
    }


def _results(
    problem: JointProblem,
    state: FitState,
    uncertainty: Uncertainty,
    fitted: Sequence[Prediction],
    tested: Sequence[Prediction],
) -> dict[str, Any]:
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


def _write_csv(path: Path, simulated: Simulated) -> None:
    rows = np.stack(
        [simulated.t, simulated.q, simulated.p_a, simulated.p_b], axis=1
    )
    lines = ["t,q,pa,pb"]
    lines += [",".join(f"{x:.6g}" for x in row) for row in rows]
    write_text_atomic(path, "\n".join(lines) + "\n")


def actuator_yaml(
    problem: JointProblem,
    state: FitState,
    uncertainty: Uncertainty,
    logs: Sequence[str],
) -> str:
    """The fit as an overlay of the actuators' parameters.

    A scenario names it among its `pneumatics.overlays`. What is not the
    actuator's (inertia, load, the robot's network) stands in comments.
    """
    actuator = problem.fitted_actuator(state.values)
    before = dataclasses.asdict(problem.actuator)
    after = dataclasses.asdict(actuator)
    # Not the valve's own: through the robot's network and its 30 Hz clock.
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


def _draw(path: Path, prediction: Prediction) -> None:
    """A log, measured and simulated."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    log = prediction.log
    figure = Figure(figsize=(11, 7), layout="constrained")
    FigureCanvasAgg(figure)
    axes = figure.subplots(
        2, 2, sharex=True, sharey="row", height_ratios=[3, 2]
    )
    for column, (kind, title) in enumerate(
        (
            ("closed_loop", "closed loop, the robot's own PID law"),
            ("open_loop", "open loop, the logged commands"),
        )
    ):
        simulated = getattr(prediction, kind)
        rms = simulated.rms(log)
        top, bottom = axes[:, column]
        top.set_title(
            f"{title}\nrms {rms[0]:.1f} %, {rms[1]:.1f} and {rms[2]:.1f} kPa",
            fontsize=10,
        )
        if column == 0:
            top.plot(log.t, log.q_des, "0.7", label="reference")
        top.plot(log.t, log.q, "k", label="measured")
        top.plot(simulated.t, simulated.q, "C3", label="simulated")
        for measured, model, colour, name in (
            (log.p_a, simulated.p_a, "C0", "a"),
            (log.p_b, simulated.p_b, "C1", "b"),
        ):
            bottom.plot(log.t, measured, "k", lw=1)
            bottom.plot(simulated.t, model, colour, label=f"chamber {name}")
        bottom.set_xlabel("time [s]")
        top.legend(loc="upper right", fontsize=8)
        bottom.legend(loc="lower right", fontsize=8)
        for axis in (top, bottom):
            axis.grid(alpha=0.3)
    axes[0, 0].set_ylabel("joint angle [% of range]")
    axes[1, 0].set_ylabel("pressure [kPa gauge]")
    figure.suptitle(log.name)
    with atomic_path(path) as fresh:
        figure.savefig(fresh, dpi=110)
