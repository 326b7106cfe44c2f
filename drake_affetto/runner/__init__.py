"""Runs keyed tasks on workers and keeps their results; knows no robot."""

from typing import TYPE_CHECKING

from drake_affetto.common.lazy import attach

if TYPE_CHECKING:
    from drake_affetto.runner.dask_cluster import cluster_executor
    from drake_affetto.runner.executor import TrialExecutor
    from drake_affetto.runner.store import TrialStore, trial_key
    from drake_affetto.runner.workers import (
        InProcessExecutor,
        WorkerPool,
        make_executor,
    )

__getattr__, __dir__, __all__ = attach(
    __name__,
    {
        "InProcessExecutor": "workers",
        "TrialExecutor": "executor",
        "TrialStore": "store",
        "WorkerPool": "workers",
        "cluster_executor": "dask_cluster",
        "make_executor": "workers",
        "trial_key": "store",
    },
)
