"""The demo at its smallest, through the real chain, and its promises."""

import json

import pytest

from drake_affetto.common.typed_json import to_plain
from drake_affetto.experiments import demo as demo_module
from drake_affetto.experiments.demo import run_demo
from drake_affetto.experiments.plans import DemoPlan
from drake_affetto.skill.scheme_names import PAPER_SCHEMES

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
