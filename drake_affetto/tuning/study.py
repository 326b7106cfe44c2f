"""`affetto tune`: the controllers' gains, by optimisation on the whole robot.

Trials are simulations of the station, which follows the test trajectory; they
are kept in an Optuna study in SQLite as they finish. A study that was killed
goes on from there.
"""

from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from concurrent.futures import FIRST_COMPLETED, Executor, Future, wait
from concurrent.futures.process import BrokenProcessPool
import contextlib
import dataclasses
import hashlib
import itertools
import math
import multiprocessing
import os
from pathlib import Path
import threading
from typing import Any

import numpy as np
from numpy.typing import NDArray
import optuna
from optuna.trial import FrozenTrial, TrialState
import yaml

from drake_affetto import __version__
from drake_affetto.common.errors import InputError, require
from drake_affetto.common.output import (
    write_json,
    write_text_atomic,
)
from drake_affetto.control.pidf import (
    PidfGains,
    load_control,
)
from drake_affetto.station.scenario import Scenario, load_scenario
from drake_affetto.tuning.references import (
    DEFAULT_FILE,
    HELD_OUT,
    REST,
    TEST,
    Evaluation,
    Excursion,
    JointCosts,
    JointwiseCmaEs,
    Reference,
    TuningConfig,
    excursion,
    joint_costs,
    load_tuning,
    make_reference,
    rest_std,
)
from drake_affetto.tuning.results import (
    GAINS,
    START_FILE,
    Assessment,
    Run,
    TunePlan,
    parameter_names,
)

Array = NDArray[np.float64]


_STUDY_FILE = "study.sqlite"
_STUDY_NAME = "tune"
# How often a trial whose worker died is tried again.
_RETRIES = 2


class TrackingBench:
    """The robot, following references under any gains.

    The station is built once; gains and references are its context's.
    """

    def __init__(self, scenario: Scenario, tuning: TuningConfig):
        """Builds the station with `desired_state` as its input."""
        # Drake is loaded where it is needed: the command's help is not.
        from pydrake.systems.analysis import Simulator
        from pydrake.systems.framework import DiagramBuilder, TriggerType
        from pydrake.systems.primitives import (
            LogVectorOutput,
            TrajectorySource,
        )
        from pydrake.trajectories import PiecewisePolynomial

        from drake_affetto.scene.world import joint_limits
        from drake_affetto.station.station import AffettoStation

        self._polynomial = PiecewisePolynomial
        self.tuning = tuning
        scenario = dataclasses.replace(scenario, motion_source="external")
        builder = DiagramBuilder()
        self.station = builder.AddNamedSystem(
            "station", AffettoStation(scenario)
        )
        self.names = list(self.station.joints.names)
        n = self.station.num_joints
        self._source = builder.AddNamedSystem(
            "reference",
            TrajectorySource(PiecewisePolynomial(np.zeros((2 * n, 1)))),
        )
        builder.Connect(
            self._source.get_output_port(),
            self.station.GetInputPort("affetto.desired_state"),
        )
        self._logs = [
            LogVectorOutput(
                self.station.GetOutputPort(f"affetto.{name}"),
                builder,
                publish_triggers={TriggerType.kPeriodic},
                publish_period=1.0 / tuning.sample_rate,
            )
            for name in ("estimated_state", "valve_opening")
        ]
        self._simulator = Simulator(builder.Build())
        self._context = self._simulator.get_mutable_context()
        self.lower, self.upper = joint_limits(self.station.plant, self.names)
        self.space: Excursion = excursion(
            tuning,
            self.names,
            self.station.start_posture,
            self.lower,
            self.upper,
        )

    @property
    def span(self) -> Array:
        """(n,) range of each joint, rad."""
        return self.upper - self.lower

    def reference(self, name: str) -> Reference:
        """The reference called `name`, for this robot."""
        return make_reference(name, self.tuning, self.space)

    def run(
        self,
        reference: Reference,
        gains: PidfGains,
        report: Callable[[float, Run], bool] | None = None,
        report_every: float = math.inf,
    ) -> Run:
        """Follows `reference` from rest at the start posture.

        Args:
            report: called on the way with the time and what there is so far;
                the run stops where it returns True.
            report_every: s.
        """
        station, context = self.station, self._context
        desired = np.hstack([reference.q, reference.rate()]).T
        self._source.UpdateTrajectory(
            self._polynomial.FirstOrderHold(reference.t, desired)
        )
        context.SetTime(0.0)
        mine = station.GetMyMutableContextFromRoot(context)
        station.reset(mine)
        # Where no reference leads the hand.
        region = station.scenario.drum_region
        station.set_drum_position(mine, [region.x[1], region.y[1]])
        controller = station.GetMutableSubsystemContext(
            station.controller, mine
        )
        held = station.controller.get_pid_output_output_port().Eval(controller)
        station.controller.set_gains(controller, gains)
        station.controller.set_integral(controller, held)
        for log in self._logs:
            log.FindMutableLog(context).Clear()
        self._simulator.Initialize()
        time = 0.0
        while time < reference.duration:
            time = min(time + report_every, reference.duration)
            self._simulator.AdvanceTo(time)
            if (
                report is not None
                and time < reference.duration
                and report(time, self._recorded(reference))
            ):
                break
        return self._recorded(reference)

    def _recorded(self, reference: Reference) -> Run:
        state, opening = (self._read(log) for log in self._logs)
        count = min(len(state), len(opening), len(reference.t))
        return Run(state[:count, : len(self.names)], opening[:count])

    def _read(self, log) -> Array:
        data = log.FindLog(self._context)
        t = data.sample_times()
        # A time at which the simulator stopped is logged twice.
        keep = np.append(np.diff(t) > 1e-9, True)
        return data.data().T[keep].copy()

    def costs(self, reference: Reference, run: Run) -> JointCosts:
        """What `run` along `reference` has cost."""
        return joint_costs(
            reference, run.q, run.opening, self.span, self.tuning.cost
        )


# One bench for each process and plan.
_BENCHES: dict[tuple[str, str], TrackingBench] = {}


def bench(plan: TunePlan) -> TrackingBench:
    """This process's bench, built when first asked for."""
    key = (plan.scenario, plan.tuning)
    if key not in _BENCHES:
        _BENCHES[key] = TrackingBench(
            load_scenario(plan.scenario), load_tuning(plan.tuning)
        )
    return _BENCHES[key]


class JointwiseSampler(optuna.samplers.BaseSampler):
    """`JointwiseCmaEs` as the sampler of an Optuna study.

    Which candidate of the search a trial is, `candidate` says; it is set
    before the study is asked, and kept in the trial's user attributes. A
    trial that a kill has ended is not its candidate's last: another one does
    its work.
    """

    def __init__(self, joints: Sequence[str], search: JointwiseCmaEs):
        """Takes the joints, in the order of the search."""
        self.joints = tuple(joints)
        self.search = search
        self.space = search_space(joints, search.bound)
        self.candidate = 0

    def infer_relative_search_space(self, study, trial):
        """All gains' factors together."""
        return dict(self.space)

    def sample_relative(self, study, trial, search_space):
        """The factors of `candidate`, by the parameters' names."""
        x = self.search.ask(self.candidate, history_of(study, self.joints))
        factors = {}
        for name, factor in zip(self.space, np.exp(x).ravel(), strict=True):
            limits = self.space[name]
            factors[name] = float(np.clip(factor, limits.low, limits.high))
        return factors

    def sample_independent(self, study, trial, name, distribution):
        """Never needed: all parameters are sampled together."""
        raise RuntimeError(f"{name} is no gain of this study")


def search_space(
    joints: Sequence[str], bound: float
) -> dict[str, optuna.distributions.FloatDistribution]:
    """The factors of all gains, with logarithms from -bound to bound."""
    return {
        name: optuna.distributions.FloatDistribution(
            math.exp(-bound), math.exp(bound), log=True
        )
        for name in parameter_names(joints)
    }


def finished_trials(study: optuna.Study) -> dict[int, FrozenTrial]:
    """The study's finished trials, pruned ones too, by their candidate."""
    found: dict[int, FrozenTrial] = {}
    for trial in study.get_trials(
        deepcopy=False, states=(TrialState.COMPLETE, TrialState.PRUNED)
    ):
        found.setdefault(trial.user_attrs["candidate"], trial)
    return found


def history_of(
    study: optuna.Study, joints: Sequence[str]
) -> dict[int, Evaluation]:
    """The study's finished trials as the search sees them."""
    names = parameter_names(joints)
    shape = (len(joints), len(GAINS))
    return {
        candidate: Evaluation(
            x=np.log([t.params[name] for name in names]).reshape(shape),
            cost=np.array([t.user_attrs["joint_costs"][j] for j in joints]),
        )
        for candidate, t in finished_trials(study).items()
    }


def _earlier(
    study: optuna.Study, search: JointwiseCmaEs, candidate: int
) -> list[FrozenTrial]:
    """Complete trials that a candidate may be compared with.

    The start, and all of earlier generations: whatever the order in which
    workers finish, these are there.
    """
    first = search.generation(candidate) * search.generation_size
    return [
        trial
        for other, trial in finished_trials(study).items()
        if trial.state == TrialState.COMPLETE
        and (other < first or other == 0 < candidate)
    ]


class FarFromBestPruner(optuna.pruners.BasePruner):
    """Stops a trial that is far worse than the best was at the same time."""

    def __init__(self, factor: float, search: JointwiseCmaEs):
        """Takes how many times the best trial's cost is too much."""
        self._factor = factor
        self._search = search

    def prune(self, study, trial) -> bool:
        """Whether `trial` is to be stopped after its last report."""
        step = trial.last_step
        known = [
            other.intermediate_values[step]
            for other in _earlier(
                study, self._search, trial.user_attrs["candidate"]
            )
        ]
        if not known:
            return False
        return bool(trial.intermediate_values[step] > self._factor * min(known))


def scaled_gains(
    start: PidfGains,
    names: Sequence[str],
    factors: Mapping[str, float],
) -> PidfGains:
    """The gains of a trial: those of the start times the trial's factors.

    Args:
        start: of the joints `names`.
        factors: by the names of `parameter_names`.
    """
    array = start.to_array()
    for key, factor in factors.items():
        joint, gain = key.rsplit(".", 1)
        array[GAINS.index(gain), list(names).index(joint)] *= factor
    return PidfGains.from_array(array)


def open_study(
    out: Path, plan: TunePlan
) -> tuple[optuna.Study, JointwiseSampler]:
    """The study in the folder `out`, made where there is none."""
    optuna.logging.set_verbosity(optuna.logging.WARNING)
    storage = optuna.storages.RDBStorage(
        f"sqlite:///{(out / _STUDY_FILE).resolve().as_posix()}",
        engine_kwargs={"connect_args": {"timeout": 60}},
    )
    tuning = load_tuning(plan.tuning)
    search = make_search(plan, tuning)
    sampler = JointwiseSampler(plan.joints, search)
    study = optuna.create_study(
        storage=storage,
        study_name=_STUDY_NAME,
        sampler=sampler,
        pruner=FarFromBestPruner(tuning.search.prune_factor, search),
        direction="minimize",
        load_if_exists=True,
    )
    return study, sampler


def make_search(plan: TunePlan, tuning: TuningConfig) -> JointwiseCmaEs:
    """The search of a plan, before its first trial."""
    search = tuning.search
    return JointwiseCmaEs(
        len(plan.joints),
        len(GAINS),
        sigma=search.sigma,
        bound=math.log(search.largest_factor),
        population=search.population,
        seed=plan.seed,
    )


def _die_with_parent() -> None:
    """Ends this worker as soon as the process that started it is gone.

    Otherwise the worker of a killed study would write into it while it is
    already going on elsewhere.
    """
    parent = multiprocessing.parent_process()
    if parent is None:
        return

    def watch() -> None:
        parent.join()
        os._exit(1)

    threading.Thread(target=watch, daemon=True).start()


_watched = False


def run_trial(out: str, plan: TunePlan, candidate: int) -> int:
    """Runs one candidate as a trial of the study in the folder `out`.

    Args:
        candidate: its number; all earlier generations have finished.

    Returns:
        The candidate's number.
    """
    global _watched
    if not _watched:
        _die_with_parent()
        _watched = True
    robot = bench(plan)
    key = (out, plan)
    if key not in _STUDIES:
        _STUDIES[key] = open_study(Path(out), plan)
    study, sampler = _STUDIES[key]
    sampler.candidate = candidate
    trial = study.ask({**sampler.space})
    trial.set_user_attr("candidate", candidate)
    reference = robot.reference(TEST)
    start = load_control(plan.start).for_joints(robot.names)
    where = [robot.names.index(joint) for joint in plan.joints]
    so_far: list[list[float]] = []

    def report(_: float, run: Run) -> bool:
        costs = robot.costs(reference, run)
        so_far.append(costs.total[where].tolist())
        trial.report(costs.mean(), len(so_far))
        return trial.should_prune()

    run = robot.run(
        reference,
        scaled_gains(start, robot.names, trial.params),
        report,
        robot.tuning.search.report_every,
    )
    pruned = len(run.q) < len(reference.t)
    costs = robot.costs(reference, run)
    by_joint = costs.total[where]
    if pruned:
        # A part of the trajectory costs more or less than the whole: as much
        # more as it did for the trials that went all the way.
        ratio = [
            np.array(list(other.user_attrs["joint_costs"].values()))
            / np.array(other.user_attrs["so_far"][len(so_far) - 1])
            for other in _earlier(study, sampler.search, candidate)
        ]
        by_joint = by_joint * np.median(ratio, axis=0)
    trial.set_user_attr("so_far", so_far)
    trial.set_user_attr(
        "joint_costs", dict(zip(plan.joints, by_joint.tolist(), strict=True))
    )
    if pruned:
        study.tell(trial, state=TrialState.PRUNED)
    else:
        study.tell(trial, costs.mean())
    return candidate


_STUDIES: dict[tuple[str, TunePlan], tuple[optuna.Study, JointwiseSampler]] = {}


def load_plan(
    joints: Sequence[str] | None,
    *,
    seed: int = 0,
    scenario: str = "drumming",
    start: str = START_FILE,
    tuning: str = DEFAULT_FILE,
) -> TunePlan:
    """A plan, checked before anything runs.

    Args:
        joints: active joints of the scenario; None for all of them.

    Raises:
        InputError: where joints, files or their values do not fit.
    """
    loaded = load_scenario(scenario)
    require(
        loaded.valve_source == "pidf",
        "scenario.valve_source",
        loaded.valve_source,
        "'pidf', for its gains are tuned",
    )
    active = loaded.active_joints
    chosen = list(active) if joints is None else list(joints)
    require(len(chosen) > 0, "--joints", chosen, "at least one joint")
    for joint in chosen:
        require(
            joint in active,
            "--joints",
            joint,
            f"active joints of {scenario!r}: {', '.join(active)}",
        )
    require(
        len(set(chosen)) == len(chosen), "--joints", chosen, "no joint twice"
    )
    load_control(start).for_joints(active)
    load_tuning(tuning)
    return TunePlan(
        joints=tuple(joint for joint in active if joint in chosen),
        seed=seed,
        scenario=scenario,
        start=start,
        tuning=tuning,
    )


def _fingerprint(plan: TunePlan) -> str:
    """Of all that determines a trial: a study holds trials of one kind."""
    from drake_affetto.pneumatics.parameters import load_parameters

    robot = bench(plan)
    scenario = robot.station.scenario
    actuators = load_parameters(
        scenario.pneumatics.parameters, tuple(scenario.pneumatics.overlays)
    )
    control = load_control(
        scenario.control.parameters, tuple(scenario.control.overlays)
    )
    limits = dataclasses.replace(control, gains={})
    parts = (
        __version__,
        plan.joints,
        plan.seed,
        robot.names,
        robot.tuning,
        load_control(plan.start).for_joints(robot.names),
        limits,
        scenario.control.period,
        scenario.plant_config.time_step,
        actuators,
        np.stack([robot.space.start, robot.lower, robot.upper]).tolist(),
    )
    return hashlib.sha256(repr(parts).encode()).hexdigest()[:16]


@contextlib.contextmanager
def _alone(out: Path) -> Iterator[None]:
    """Holds the folder, so that no second `affetto tune` works in it.

    The system lets go of it however this process ends.
    """
    try:
        import fcntl
    except ImportError:  # not a Unix: nobody checks
        yield
        return
    with (out / ".lock").open("w") as file:
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError as error:
            raise InputError(
                f"another `affetto tune` is at work in {out}"
            ) from error
        yield


def _prepare_study(
    out: Path, plan: TunePlan, restart: bool
) -> tuple[optuna.Study, JointwiseCmaEs]:
    """The study, ready to go on: of this plan, and without zombies."""
    path = out / _STUDY_FILE
    if restart:
        for suffix in ("", "-wal", "-shm", "-journal"):
            Path(f"{path}{suffix}").unlink(missing_ok=True)
        for old in ("results.json", "gains.yaml", "study.html"):
            (out / old).unlink(missing_ok=True)
    mark = _fingerprint(plan)
    try:
        study, sampler = open_study(out, plan)
        known = study.user_attrs.get("fingerprint")
        if known is None:
            study.set_user_attr("fingerprint", mark)
            study.set_user_attr("joints", list(plan.joints))
            known = mark
        # Nobody else is at work here: what runs is what a kill left behind.
        for trial in study.get_trials(
            deepcopy=False, states=(TrialState.RUNNING,)
        ):
            if known == mark:
                study.tell(trial.number, state=TrialState.FAIL)
    except Exception as error:
        # Whatever the database makes of a file that is no study.
        text = str(error).splitlines()[0]
        raise InputError(f"cannot keep a study in {path}: {text}") from error
    if known != mark:
        raise InputError(
            f"{out} holds a study of other joints, seed or models; take "
            "another --out, or --restart to throw it away"
        )
    return study, sampler.search


class _Workers:
    """An executor that can be replaced when its processes have died."""

    def __init__(self, count: int):
        """Makes the executor: `count` processes, or this one for 0."""
        from drake_affetto.runner.workers import make_executor

        self._make = make_executor
        self.count = count
        self.executor = make_executor(count)

    def renew(self) -> None:
        """Starts new processes."""
        self.executor.shutdown(wait=True)
        self.executor = self._make(self.count)

    def __enter__(self) -> "_Workers":
        return self

    def __exit__(self, kind: type | None, *_: object) -> None:
        if kind is not None:
            # Trials on their way are lost; the next start tries them again.
            processes = getattr(self.executor, "_processes", None) or {}
            for process in list(processes.values()):
                with contextlib.suppress(OSError, ValueError):
                    process.terminate()
        self.executor.shutdown(wait=kind is None, cancel_futures=True)


def _run_trials(
    out: Path,
    plan: TunePlan,
    trials: int,
    workers: _Workers,
    restart: bool,
    console: Any,
) -> optuna.Study:
    """Runs what is missing of `trials` and returns the study."""
    from rich.progress import (
        BarColumn,
        MofNCompleteColumn,
        Progress,
        TextColumn,
        TimeElapsedColumn,
        TimeRemainingColumn,
    )

    study, search = _prepare_study(out, plan, restart)
    finished = set(finished_trials(study))
    if console is not None and finished:
        console.print(f"{len(finished)} trials were there already")
    progress = Progress(
        TextColumn("Tuning"),
        BarColumn(),
        MofNCompleteColumn(),
        TextColumn("{task.fields[note]}"),
        TimeElapsedColumn(),
        TimeRemainingColumn(),
        console=console,
        disable=console is None,
    )
    bar = progress.add_task("", total=trials, note=_note(study))
    progress.update(bar, completed=len(finished))
    deaths = 0
    with progress:
        while any(c not in finished for c in range(trials)):
            try:
                for candidate in _outcomes(
                    workers, out, plan, search, finished, trials
                ):
                    finished.add(candidate)
                    progress.update(
                        bar, completed=len(finished), note=_note(study)
                    )
            except BrokenProcessPool as error:
                deaths += 1
                if deaths > _RETRIES:
                    raise InputError(
                        "worker processes die again and again (memory may "
                        f"be short); {len(finished)} finished trials are "
                        f"kept in {out}"
                    ) from error
                progress.console.print("A worker died; going on")
                workers.renew()
                study, search = _prepare_study(out, plan, False)
                finished = set(finished_trials(study))
    return study


def _note(study: optuna.Study) -> str:
    """What the progress display says of the best trial."""
    try:
        return f"best cost {study.best_value:.3f}"
    except ValueError:  # none has finished
        return ""


def _outcomes(
    workers: _Workers,
    out: Path,
    plan: TunePlan,
    search: JointwiseCmaEs,
    finished: Collection[int],
    trials: int,
) -> Iterator[int]:
    """Runs the candidates that are not finished, generation by generation.

    The start comes before all others: they are compared with it.
    """
    size = search.generation_size
    bounds = {0, min(1, trials), *range(size, trials, size), trials}
    for first, end in itertools.pairwise(sorted(bounds)):
        todo = [c for c in range(first, end) if c not in finished]
        running: set[Future] = set()
        while todo or running:
            while todo and len(running) < max(1, workers.count):
                running.add(
                    workers.executor.submit(
                        run_trial, str(out), plan, todo.pop(0)
                    )
                )
            done, running = wait(running, return_when=FIRST_COMPLETED)
            for future in done:
                yield future.result()


def run_reference(plan: TunePlan, name: str, gains: Array) -> Run:
    """Follows the reference `name` with `gains` (4, n), in this process."""
    robot = bench(plan)
    return robot.run(robot.reference(name), PidfGains.from_array(gains))


def assess(plan: TunePlan, best: PidfGains, executor: Executor) -> Assessment:
    """Runs start and best gains along all references."""
    robot = bench(plan)
    start = load_control(plan.start).for_joints(robot.names)
    names = (TEST, *HELD_OUT, REST)
    references = {name: robot.reference(name) for name in names}
    jobs = {
        name: [
            executor.submit(run_reference, plan, name, gains.to_array())
            for gains in (start, best)
        ]
        for name in names
    }
    runs = {
        name: (pair[0].result(), pair[1].result())
        for name, pair in jobs.items()
    }
    costs = {
        name: (
            robot.costs(references[name], pair[0]),
            robot.costs(references[name], pair[1]),
        )
        for name, pair in runs.items()
    }
    return Assessment(references, runs, costs)


def mirrored(joint: str) -> str | None:
    """The joint's counterpart on the other side, or None."""
    for side, other in (("right_", "left_"), ("left_", "right_")):
        if joint.startswith(side):
            return other + joint.removeprefix(side)
    return None


def overlay_text(
    plan: TunePlan, names: Sequence[str], gains: PidfGains, heading: str
) -> str:
    """An overlay of `ControlParameters` with the gains that were searched.

    Both arms get the same: the other side's joints are mirrored, unless they
    were searched themselves.
    """
    rows: dict[str, list[str]] = {}
    array = gains.to_array()
    for i, joint in enumerate(names):
        if joint in plan.joints:
            rows[joint] = [f"{value:.3e}" for value in array[:, i]]
    for joint in list(rows):
        other = mirrored(joint)
        if other is not None and other not in rows:
            rows[other] = rows[joint]
    lines = [f"# {line}".rstrip() for line in heading.splitlines()]
    lines.append("gains:")
    for joint, row in rows.items():
        pairs = ", ".join(f"{g}: {v}" for g, v in zip(GAINS, row, strict=True))
        lines.append(f"  {joint}: {{{pairs}}}")
    text = "\n".join(lines) + "\n"
    # The file must be what the reader makes of it.
    assert set(yaml.safe_load(text)["gains"]) == set(rows)
    return text


def _rounded(gains: PidfGains) -> PidfGains:
    """The gains as `overlay_text` writes them."""
    return PidfGains.from_array(
        [[float(f"{v:.3e}") for v in row] for row in gains.to_array()]
    )


def make_results(
    plan: TunePlan,
    study: optuna.Study,
    best: FrozenTrial,
    gains: PidfGains,
    assessment: Assessment,
) -> dict[str, Any]:
    """What results.json holds."""
    robot = bench(plan)
    names = robot.names
    start = load_control(plan.start).for_joints(names)
    degrees = np.degrees(1.0) * robot.span / 100.0

    def side(which: int, values: PidfGains) -> dict[str, Any]:
        array = values.to_array()
        result: dict[str, Any] = {
            "cost": assessment.costs[TEST][which].mean(),
            "gains": {
                joint: dict(zip(GAINS, array[:, i].tolist(), strict=True))
                for i, joint in enumerate(names)
            },
            "trajectories": {},
        }
        for name in (TEST, *HELD_OUT):
            costs = assessment.costs[name][which]
            error = costs.tracking * degrees
            result["trajectories"][name] = {
                "cost": costs.mean(),
                "tracking_error_deg": _by(names, error),
                "tracking_percent": _by(names, costs.tracking),
                "effort_percent": _by(names, costs.effort),
                "oscillation_percent": _by(names, costs.oscillation),
            }
        reference = assessment.references[REST]
        q = assessment.runs[REST][which].q
        result["rest_oscillation_percent"] = _by(
            names,
            100.0
            * rest_std(q, reference.rest, robot.tuning.sample_rate)
            / robot.span,
        )
        return result

    hand, tuned = side(0, start), side(1, gains)
    count = dict.fromkeys(TrialState, 0)
    for trial in study.get_trials(deepcopy=False):
        count[trial.state] += 1
    return {
        "study": "tune",
        "version": __version__,
        "seed": plan.seed,
        "scenario": plan.scenario,
        "start": plan.start,
        "tuning": plan.tuning,
        "joints": list(plan.joints),
        "trials": {
            "finished": count[TrialState.COMPLETE] + count[TrialState.PRUNED],
            "complete": count[TrialState.COMPLETE],
            "pruned": count[TrialState.PRUNED],
            "interrupted": count[TrialState.FAIL],
            "best": best.number,
        },
        "hand_tuned": hand,
        "best": tuned,
        "improvement": 1.0 - tuned["cost"] / hand["cost"],
        "held_out_improvement": {
            name: 1.0
            - tuned["trajectories"][name]["cost"]
            / hand["trajectories"][name]["cost"]
            for name in HELD_OUT
        },
    }


def _by(names: Sequence[str], values: Array) -> dict[str, float]:
    return dict(zip(names, np.asarray(values).tolist(), strict=True))


def run_tune(
    out: Path,
    plan: TunePlan,
    *,
    trials: int = 216,
    workers: int = 2,
    restart: bool = False,
    page: bool = True,
    console: Any = None,
) -> dict[str, Any]:
    """Runs the study in the folder `out` until it has `trials` trials.

    Args:
        plan: from `load_plan`.
        trials: finished ones, earlier runs' included.
        workers: worker processes; 0 for this one.
        restart: whether to throw away what an earlier run has left.
        page: whether to write study.html too.
        console: a rich console for progress; None for silence.

    Returns:
        What results.json holds.

    Raises:
        InputError: if the folder holds another study.
    """
    with _alone(out), _Workers(workers) as executor:
        study = _run_trials(out, plan, trials, executor, restart, console)
        if console is not None:
            console.print("Following the held-out trajectories ...")
        robot = bench(plan)
        start = load_control(plan.start).for_joints(robot.names)
        best = study.best_trial
        gains = _rounded(scaled_gains(start, robot.names, best.params))
        assessment = assess(plan, gains, executor.executor)
        results = make_results(plan, study, best, gains, assessment)
        heading = (
            f"Gains from `affetto tune`: trial {best.number} of "
            f"{results['trials']['finished']}, seed {plan.seed}.\n"
            f"Cost on the test trajectory {results['best']['cost']:.3f}; of "
            f"the hand-tuned gains {results['hand_tuned']['cost']:.3f}.\n"
            "A scenario takes them up with: control: {overlays: [THIS FILE]}"
        )
        write_text_atomic(
            out / "gains.yaml",
            overlay_text(plan, robot.names, gains, heading),
        )
        if page:
            from drake_affetto.tuning.page import write_page

            if console is not None:
                console.print("Writing the study's page ...")
            write_page(out / "study.html", plan, study, results, assessment)
        # Last: where results.json is, all the rest is.
        write_json(out / "results.json", results)
    return results
