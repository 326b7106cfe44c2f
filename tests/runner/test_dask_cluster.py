"""Trials on a Dask cluster of two workers, one of which is killed."""

import os
from pathlib import Path
import signal
import threading
import time

import pytest

from drake_affetto.common.errors import InputError
from drake_affetto.experiments.drumming import DrumPlan, run_drum
from drake_affetto.experiments.trials import software
from drake_affetto.runner.dask_cluster import cluster_executor
from drake_affetto.runner.executor import TrialExecutor
from drake_affetto.runner.store import TrialStore
from support import fake_world

distributed = pytest.importorskip(
    "distributed", reason="dask.distributed is an optional extra"
)

PLAN = DrumPlan(demonstrations=5, evaluations=3, repeats=2)


def worker_pid() -> int:
    return os.getpid()


@pytest.fixture(scope="module")
def scheduler(tmp_path_factory):
    os.environ["FAKE_WORLD_MARKS"] = str(
        tmp_path_factory.mktemp("dask") / "marks"
    )
    os.environ["FAKE_WORLD_SECONDS"] = "0.05"
    try:
        with distributed.LocalCluster(
            n_workers=2, threads_per_worker=1, dashboard_address=None
        ) as running:
            yield running
    finally:
        del os.environ["FAKE_WORLD_MARKS"], os.environ["FAKE_WORLD_SECONDS"]


def kill_one_worker(address: str, marks: Path) -> None:
    """Kills a worker in the middle of its trials."""
    with distributed.Client(address, set_as_default=False) as client:
        pids = client.run(worker_pid)
        while marks.read_text().count("\n") < 12:
            time.sleep(0.02)
        os.kill(next(iter(pids.values())), signal.SIGKILL)


@pytest.mark.slow
def test_nothing_is_lost_when_a_worker_is_killed(scheduler, tmp_path):
    marks = Path(os.environ["FAKE_WORLD_MARKS"])
    marks.touch()
    address = scheduler.scheduler_address
    killer = threading.Thread(target=kill_one_worker, args=(address, marks))
    killer.start()
    with (
        TrialStore(tmp_path / "dask.sqlite") as store,
        cluster_executor(address, software) as cluster,
        TrialExecutor(
            fake_world.run, store, executor=cluster, quiet=True
        ) as executor,
    ):
        results = run_drum(executor, PLAN)
        kept = len(store)
    killer.join(timeout=30.0)
    assert not killer.is_alive()
    with (
        TrialStore(tmp_path / "here.sqlite") as store,
        TrialExecutor(fake_world.run, store, workers=0, quiet=True) as executor,
    ):
        assert run_drum(executor, PLAN) == results
        # Nothing counted twice.
        assert len(store) == kept


def process():
    """Software that differs from one process to another."""
    return {"process": str(os.getpid())}


@pytest.mark.slow
def test_workers_with_other_models_are_refused(scheduler):
    with (
        pytest.raises(InputError, match=r"has .*, expected .*process"),
        cluster_executor(scheduler.scheduler_address, process),
    ):
        pass
