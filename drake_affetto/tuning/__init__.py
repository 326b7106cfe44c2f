"""Searches the gains of the controllers on the whole robot."""

from typing import TYPE_CHECKING

from drake_affetto.common.lazy import attach

if TYPE_CHECKING:
    from drake_affetto.tuning.cma_es import JointwiseCmaEs
    from drake_affetto.tuning.config import TuningConfig, load_tuning
    from drake_affetto.tuning.costs import JointCosts, joint_costs
    from drake_affetto.tuning.environment import Rollout, TrackingEnvironment
    from drake_affetto.tuning.plan import TunePlan, load_plan
    from drake_affetto.tuning.references import Reference, make_reference
    from drake_affetto.tuning.study import run_tune

__getattr__, __dir__, __all__ = attach(
    __name__,
    {
        "JointCosts": "costs",
        "JointwiseCmaEs": "cma_es",
        "Reference": "references",
        "Rollout": "environment",
        "TrackingEnvironment": "environment",
        "TunePlan": "plan",
        "TuningConfig": "config",
        "joint_costs": "costs",
        "load_plan": "plan",
        "load_tuning": "config",
        "make_reference": "references",
        "run_tune": "study",
    },
)
