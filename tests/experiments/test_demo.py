"""The demo at its smallest, through the real chain, and its promises."""

import json

import numpy as np
import pytest

from drake_affetto.cli.main import main
from drake_affetto.common.typed_json import to_plain
from drake_affetto.experiments import demo as demo_module
from drake_affetto.experiments.demo import run_demo
from drake_affetto.experiments.plans import DemoPlan
from drake_affetto.experiments.trials import draw_positions
from drake_affetto.skill.scheme_names import PAPER_SCHEMES
from drake_affetto.station.scenario import load_scenario

SMALL = DemoPlan(
    demonstrations=3, evaluations=1, samples=3, mirror_evaluations=1
)


@pytest.fixture(scope="module")
def demo(tmp_path_factory):
    out = tmp_path_factory.mktemp("demo")
    results = run_demo(out, SMALL, workers=1)
    return out, to_plain(results)


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
    (position,) = results["mirror"]["positions"]
    assert set(position) == {"xy", "tau"}
    schemes = results["mirror"]["schemes"]
    assert list(schemes) == [*PAPER_SCHEMES, "transfer_default"]
    for scheme in schemes.values():
        assert len(scheme["rewards"]) == 1
    # The teaching worked: the robot's own replay sounded.
    for taught in drumming["taught"]:
        if taught["success"]:
            assert taught["reward"] > 0.15
            assert 1 <= taught["attempts"] <= 4


def test_both_parts_learn_the_same_skill_from_the_same_demonstrations():
    plan = DemoPlan(seed=7)
    assert plan.mirror.demonstrations == plan.drum.demonstrations
    assert plan.mirror.direct == plan.drum.scenario
    assert plan.mirror.seed == plan.drum.seed == 7


@pytest.mark.slow
def test_same_seed_same_file_in_whatever_process(demo, tmp_path):
    out, _ = demo
    run_demo(tmp_path, SMALL, workers=0, media=False)
    first = (out / "results.json").read_bytes()
    assert (tmp_path / "results.json").read_bytes() == first


@pytest.mark.slow
@pytest.mark.parametrize("elsewhere", [False, True])
def test_finished_trials_are_not_run_again(
    demo, tmp_path, monkeypatch, elsewhere
):
    out, results = demo

    def refuse(spec):
        raise AssertionError("this trial had been finished")

    monkeypatch.setattr(demo_module, "run_task", refuse)
    where = {"out": tmp_path, "reuse": [out]} if elsewhere else {"out": out}
    again = run_demo(plan=SMALL, workers=0, media=False, **where)
    assert to_plain(again) == results


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
