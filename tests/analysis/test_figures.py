"""The scripts that draw the studies' figures, on what a fake world gives."""

import importlib.util
import json
import sys

import pytest

from drake_affetto.common.output import write_json
from drake_affetto.common.typed_json import to_plain
from drake_affetto.experiments import trials
from drake_affetto.experiments.drumming import run_drum
from drake_affetto.experiments.mirror import run_mirror
from drake_affetto.experiments.plans import DrumPlan, MirrorPlan
from drake_affetto.runner.executor import TrialExecutor
from drake_affetto.runner.store import TrialStore
from support import fake_world
from support.scripts import ANALYSIS, run


@pytest.fixture(scope="module")
def studies(tmp_path_factory):
    """Folders of a drum, a mirror and an all-scenarios study."""
    root = tmp_path_factory.mktemp("studies")
    with (
        TrialStore(root / "t.sqlite") as store,
        TrialExecutor(fake_world.run, store, workers=0, quiet=True) as executor,
    ):
        drum = to_plain(
            run_drum(
                executor,
                DrumPlan(
                    demonstrations=5, evaluations=4, repeats=2, active=True
                ),
            )
        )
        plan = MirrorPlan(
            scenario="mirror_and_camera",
            repeats=2,
            evaluations=3,
            demonstrations=6,
        )
        mirror = to_plain(run_mirror(executor, plan).results)
    every = {
        "study": "scenarios",
        "version": mirror["version"],
        "seed": 0,
        "scenarios": {"mirror": mirror, "camera_rolled": mirror},
    }
    for name, results in {
        "drum": drum,
        "mirror": mirror,
        "scenarios": every,
    }.items():
        (root / name).mkdir()
        write_json(root / name / "results.json", results)
    return root


@pytest.mark.slow
@pytest.mark.parametrize(
    ("script", "study"),
    [
        ("fig3_drumming", "drum"),
        ("fig5_mirror_transfer", "mirror"),
        ("fig5_mirror_transfer", "scenarios"),
    ],
)
def test_figures_are_drawn(studies, tmp_path, script, study):
    done = run(
        f"figures/{script}.py", "--results", studies / study, "--out", tmp_path
    )
    assert (done.returncode, done.stderr) == (0, "")
    assert (tmp_path / f"{script}.png").stat().st_size > 20_000


@pytest.mark.slow
@pytest.mark.parametrize("script", ["fig3_drumming", "fig5_mirror_transfer"])
def test_what_is_not_a_study_is_told(tmp_path, script):
    done = run(f"figures/{script}.py", "--results", tmp_path, "--out", tmp_path)
    assert done.returncode == 2
    assert "no such file" in done.stderr
    (tmp_path / "results.json").write_text('{"study": "toy"}')
    done = run(f"figures/{script}.py", "--results", tmp_path, "--out", tmp_path)
    assert done.returncode == 2
    assert "results.json" in done.stderr


def test_conditions_are_changed_one_at_a_time(tmp_path, monkeypatch):
    spec = importlib.util.spec_from_file_location(
        "when_transfer_wins", ANALYSIS / "experiments/when_transfer_wins.py"
    )
    script = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(script)
    monkeypatch.setattr(trials, "run_task", fake_world.run)
    words = "--samples 3 4 --repeats 1 --evaluations 2 --demonstrations 4"
    monkeypatch.setattr(
        sys,
        "argv",
        ["x", *words.split(), "--workers", "0", "--out", str(tmp_path)],
    )
    assert script.main() == 0
    results = json.loads((tmp_path / "results.json").read_text())
    assert results["study"] == "conditions"
    rows = results["conditions"]
    assert len(rows) == len(script.CONDITIONS) * len(script.SCHEMES) * 2
    assert {(row["factor"], row["value"]) for row in rows} == set(
        script.CONDITIONS
    )
    assert (tmp_path / "when_transfer_wins.png").stat().st_size > 20_000


@pytest.mark.slow
def test_fig_2_is_drawn(tmp_path):
    done = run("figures/fig2_toy.py", "--out", str(tmp_path))
    assert (done.returncode, done.stderr) == (0, "")
    assert (tmp_path / "fig2_toy.png").stat().st_size > 10_000
    wrong = run(
        "figures/fig2_toy.py",
        "--out",
        str(tmp_path),
        "--results",
        str(tmp_path),
    )
    assert wrong.returncode == 2
    assert "results.json" in wrong.stderr
