"""The search as an Optuna study."""

from collections.abc import Mapping, Sequence
import math
from pathlib import Path

import numpy as np
import optuna
from optuna.trial import FrozenTrial, TrialState

from drake_affetto.control.pidf import (
    PidfGains,
)
from drake_affetto.tuning.cma_es import EvaluatedCandidate, JointwiseCmaEs
from drake_affetto.tuning.config import (
    TuningConfig,
    load_tuning,
)
from drake_affetto.tuning.plan import (
    GAINS,
    TunePlan,
    parameter_names,
)

STUDY_FILE = "study.sqlite"

_STUDY_NAME = "tune"


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
) -> dict[int, EvaluatedCandidate]:
    """The study's finished trials as the search sees them."""
    names = parameter_names(joints)
    shape = (len(joints), len(GAINS))
    return {
        candidate: EvaluatedCandidate(
            x=np.log([t.params[name] for name in names]).reshape(shape),
            cost=np.array([t.user_attrs["joint_costs"][j] for j in joints]),
        )
        for candidate, t in finished_trials(study).items()
    }


def comparable_trials(
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
            for other in comparable_trials(
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
        f"sqlite:///{(out / STUDY_FILE).resolve().as_posix()}",
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
