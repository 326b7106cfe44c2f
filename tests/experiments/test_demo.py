"""The demo at its smallest, through the real chain, and its promises."""

import json

import numpy as np
import pytest

from drake_affetto.cli.main import main
from drake_affetto.experiments.demo import SCHEMES, DemoSize, run_demo
from drake_affetto.experiments.trials import draw_positions
from drake_affetto.station.scenario import load_scenario

SMALL = DemoSize(
    demonstrations=3, evaluations=1, samples=3, mirror_evaluations=1
)


@pytest.fixture(scope="module")
def demo(tmp_path_factory):
    out = tmp_path_factory.mktemp("demo")
    results = run_demo(out, seed=0, workers=1, size=SMALL)
    return out, results


@pytest.mark.slow
def test_the_results_have_the_agreed_form(demo):
    out, results = demo
    assert json.loads((out / "results.json").read_text()) == results
    drumming = results["drumming"]
    assert drumming["demonstrations"] >= 2
    (position,) = drumming["positions"]
    assert set(position) == {"xy", "tau", "reward", "success"}
    assert drumming["success_rate"] in (0.0, 1.0)
    assert position["success"] == (position["reward"] > 0.15)
    schemes = results["mirror"]["schemes"]
    assert set(schemes) == set(SCHEMES)
    for scheme in schemes.values():
        assert len(scheme["rewards"]) == 1
    # The teaching worked: the robot's own replay sounded.
    for taught in drumming["taught"]:
        if taught["success"]:
            assert taught["reward"] > 0.15
            assert 1 <= taught["attempts"] <= 4


@pytest.mark.slow
def test_same_seed_same_file_in_whatever_process(demo, tmp_path):
    out, _ = demo
    run_demo(tmp_path, seed=0, workers=0, size=SMALL, exhibits=False)
    first = (out / "results.json").read_bytes()
    assert (tmp_path / "results.json").read_bytes() == first


@pytest.mark.slow
def test_finished_trials_are_not_run_again(demo, monkeypatch):
    out, results = demo
    import drake_affetto.experiments.trials as tasks

    def refuse(spec):
        raise AssertionError("this trial had been finished")

    monkeypatch.setattr(tasks, "run_task", refuse)
    again = run_demo(out, seed=0, workers=0, size=SMALL, exhibits=False)
    assert again == results


@pytest.mark.slow
def test_what_a_person_gets_is_there(demo):
    out, _ = demo
    for name, start in (
        ("replay.html", b"<!DOCTYPE html>"),
        ("hit.wav", b"RIFF"),
        ("miss.wav", b"RIFF"),
        ("camera_direct.png", b"\x89PNG"),
        ("trial.png", b"\x89PNG"),
    ):
        assert (out / name).read_bytes()[:15].startswith(start), name


def test_positions_fill_the_region_and_depend_on_the_seed():
    scenario = load_scenario("drumming")
    region = scenario.drum_region
    low = np.array([region.x[0], region.y[0]])
    high = np.array([region.x[1], region.y[1]])
    for count in (1, 5, 12):
        first = draw_positions(scenario, count, np.random.default_rng(1))
        assert first.shape == (count, 2)
        assert np.all((first >= low) & (first <= high))
        again = draw_positions(scenario, count, np.random.default_rng(1))
        np.testing.assert_array_equal(first, again)
        other = draw_positions(scenario, count, np.random.default_rng(2))
        assert not np.array_equal(first, other)
    # Spread: each quarter of the region has some of 12.
    cells = ((first - low) / (high - low) > 0.5) @ [1, 2]
    assert set(cells.tolist()) == {0, 1, 2, 3}


def test_bad_options_end_before_anything_runs(tmp_path, capsys):
    target = tmp_path / "out"
    assert main(["demo", "--out", str(target), "--seed", "-1"]) == 2
    assert "--seed" in capsys.readouterr().err
    assert not target.exists()
    (tmp_path / "file").touch()
    assert main(["demo", "--out", str(tmp_path / "file")]) == 2
    assert "is a file" in capsys.readouterr().err
