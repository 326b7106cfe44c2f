"""Worker processes that are prepared before the first call."""

import os
from pathlib import Path
import time

from drake_affetto.runner.executor import TrialExecutor
from drake_affetto.runner.store import TrialStore
from drake_affetto.runner.workers import WorkerPool


def leave_mark(folder, threads):
    assert os.environ["OMP_NUM_THREADS"] == threads
    (folder / str(os.getpid())).touch()


def sleep_long(folder):
    (folder / str(os.getpid())).touch()
    time.sleep(60.0)


def own_mark(folder):
    return (folder / str(os.getpid())).is_file()


def run_spec(spec):
    return {"prepared": own_mark(Path(spec["folder"]))}, {}


def test_every_worker_is_prepared_before_its_first_call(tmp_path):
    with WorkerPool(2, prepare=leave_mark, arguments=(tmp_path, "1")) as pool:
        pool.start()
        for future in pool.starting:
            future.result(timeout=60.0)
        assert len(list(tmp_path.iterdir())) >= 1
        found = {}
        pool.run(
            own_mark,
            lambda: {i: (tmp_path,) for i in range(6) if i not in found},
            found.__setitem__,
            label="marks",
        )
    assert found == dict.fromkeys(range(6), True)


def test_workers_that_are_not_needed_do_not_hold_up_the_end(tmp_path):
    begun = time.monotonic()
    with WorkerPool(2, prepare=sleep_long, arguments=(tmp_path,)) as pool:
        pool.start()
        while not list(tmp_path.iterdir()):
            assert time.monotonic() - begun < 50.0
            time.sleep(0.05)
    assert time.monotonic() - begun < 50.0


def test_executor_uses_and_leaves_open_a_pool_that_runs(tmp_path):
    specs = {
        i: {"kind": "mark", "n": i, "folder": str(tmp_path)} for i in range(3)
    }
    with WorkerPool(1, prepare=leave_mark, arguments=(tmp_path, "1")) as pool:
        pool.start()
        with (
            TrialStore(tmp_path / "trials.sqlite") as store,
            TrialExecutor(run_spec, store, pool=pool, quiet=True) as executor,
        ):
            found = executor.run("marks", specs)
        assert [result["prepared"] for result, _ in found.values()] == [
            True
        ] * 3
        assert pool.executor.submit(os.getpid).result(timeout=60.0)


def test_nothing_starts_where_calls_run_in_this_process(tmp_path):
    with WorkerPool(0, prepare=leave_mark, arguments=(tmp_path, "1")) as pool:
        pool.start()
        assert pool.starting == []
    assert list(tmp_path.iterdir()) == []
