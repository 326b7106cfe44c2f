"""What worker processes call."""

import subprocess
import sys

from drake_affetto.experiments import trials, worker


def test_it_imports_nothing_heavy():
    code = (
        "import sys; import drake_affetto.experiments.worker;"
        "print(*{'pydrake', 'cv2', 'sklearn', 'numba'} & set(sys.modules))"
    )
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True
    )
    assert (done.stdout, done.returncode) == ("\n", 0)


def test_it_leaves_it_to_the_study_to_refuse_a_scenario():
    before = dict(trials._RUNNERS)
    worker.prepare("no such scenario")
    assert before == trials._RUNNERS


def test_it_runs_a_trial(monkeypatch):
    monkeypatch.setattr(trials, "run_task", lambda spec: (spec, {}))
    assert worker.run_task({"kind": "probe"}) == ({"kind": "probe"}, {})
