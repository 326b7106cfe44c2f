"""The search as an Optuna study: sampler, pruner and storage."""

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

    Each trial evaluates one candidate of the search. A candidate whose trial
    was interrupted is evaluated again by another trial, so that numbers of
    trials and of candidates differ then.

    Attributes:
        joints: Joints whose gains are searched.
        search: The search.
        space: Distributions by parameter name.
        candidate: Number of the next trial's candidate. It is set before
            `study.ask`, and stored in the trial's user attributes.
    """

    def __init__(self, joints: Sequence[str], search: JointwiseCmaEs):
        """Takes the search and its joints, in the order of the search."""
        self.joints = tuple(joints)
        self.search = search
        self.space = search_space(joints, search.bound)
        self.candidate = 0

    def infer_relative_search_space(self, study, trial):
        """All factors are sampled together."""
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
        """Never called: all factors are sampled together."""
        raise RuntimeError(f"{name} is no gain of this study")


def search_space(
    joints: Sequence[str], bound: float
) -> dict[str, optuna.distributions.FloatDistribution]:
    """The range of each gain's factor: its logarithm is in [-bound, bound]."""
    return {
        name: optuna.distributions.FloatDistribution(
            math.exp(-bound), math.exp(bound), log=True
        )
        for name in parameter_names(joints)
    }


def finished_trials(study: optuna.Study) -> dict[int, FrozenTrial]:
    """The study's finished trials, also the pruned ones, by candidate."""
    found: dict[int, FrozenTrial] = {}
    for trial in study.get_trials(
        deepcopy=False, states=(TrialState.COMPLETE, TrialState.PRUNED)
    ):
        found.setdefault(trial.user_attrs["candidate"], trial)
    return found


def history_of(
    study: optuna.Study, joints: Sequence[str]
) -> dict[int, EvaluatedCandidate]:
    """The finished trials in the form that the search needs."""
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
    """The complete trials that a candidate is compared with.

    They are the start and all of earlier generations, which have finished in
    whatever order workers finish.
    """
    first = search.generation(candidate) * search.generation_size
    return [
        trial
        for other, trial in finished_trials(study).items()
        if trial.state == TrialState.COMPLETE
        and (other < first or other == 0 < candidate)
    ]


class FarFromBestPruner(optuna.pruners.BasePruner):
    """Stops a trial that costs much more than the best did by that time."""

    def __init__(self, factor: float, search: JointwiseCmaEs):
        """Takes the ratio of costs at which a trial is stopped."""
        self._factor = factor
        self._search = search

    def prune(self, study, trial) -> bool:
        """Whether to stop `trial` after its last report."""
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
    """The gains of a trial: the start times the trial's factors.

    Args:
        start: Gains of the n joints.
        names: Names of the n joints.
        factors: Factors by the names of `parameter_names`.
    """
    array = start.to_array()
    for key, factor in factors.items():
        joint, gain = key.rsplit(".", 1)
        array[GAINS.index(gain), list(names).index(joint)] *= factor
    return PidfGains.from_array(array)


def open_study(
    out: Path, plan: TunePlan
) -> tuple[optuna.Study, JointwiseSampler]:
    """Opens the study in the folder `out`, or makes a new one."""
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
