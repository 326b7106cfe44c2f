"""The tutorials, run as a reader would."""

import re

import numpy as np
import pytest

from support.scripts import ANALYSIS, run

SCRIPT = "tutorials/own_parts.py"


@pytest.mark.slow
def test_tutorial_runs_and_the_drum_agrees_with_what_it_says():
    done = run(SCRIPT)
    assert (done.returncode, done.stderr) == (0, "")
    heard = dict(re.findall(r"   (.*?) +R = (.*)", done.stdout))
    assert len(heard) == 4
    missed = [what for what, said in heard.items() if "no sound" in said]
    assert missed == ["a stroke that turns 3 cm above the head"]
    for what, said in heard.items():
        reward = float(said.split(":")[0])
        assert reward < 0.05 if what in missed else reward > 0.3, what


@pytest.mark.slow
def test_help_is_told_and_what_is_unknown_refused():
    helped = run(SCRIPT, "--help")
    assert helped.returncode == 0
    assert "controller" in helped.stdout
    assert run(SCRIPT, "--magic").returncode == 2


@pytest.mark.slow
def test_tutorial_runs_and_says_what_it_promises(tmp_path):
    done = run("tutorials/transfer.py", "--out", str(tmp_path))
    assert (done.returncode, done.stderr) == (0, "")
    assert len(list(tmp_path.glob("*.png"))) == 4
    missed = {
        what.strip(): float(value)
        for what, value in re.findall(r"   (.*?) +([\d.]+) mm", done.stdout)
    }
    assert missed["after transfer"] < 0.2 * missed["the skill unchanged"]
    rows = {
        line.split()[0]: [float(v) for v in line.split()[1:]]
        for line in done.stdout.splitlines()
        if re.match(r"   [a-z_]+( +[\d.]+){5}$", line)
    }
    # With three demonstrations.
    assert rows["transfer_default"][0] < 0.5 * rows["relearn"][0]
    assert rows["transfer_default"][0] < rows["transfer"][0]


@pytest.mark.slow
def test_a_learner_runs_and_draws_its_curve(tmp_path, monkeypatch):
    monkeypatch.setenv("AFFETTO_CACHE", str(tmp_path / "cache"))
    words = ("--episodes", "12", "--tests", "3", "--out", str(tmp_path))
    done = run("tutorials/learn_by_reward.py", *words)
    assert (done.returncode, done.stderr) == (0, "")
    assert re.search(r"the lessons' mean +\d+% +[\d.]+", done.stdout)
    assert (tmp_path / "learning_curve.png").stat().st_size > 5000


# How many lines each may have.
SHORT = {
    "gain_gradient.py": 40,
    "linearize_and_lqr.py": 40,
    "pneumatic_arm.py": 40,
    "pneumatic_gripper.py": 40,
    "parts/blob_sensor.py": 25,
    "parts/dmp_source.py": 25,
    "parts/drum_microphone.py": 25,
    "parts/gaze_servo.py": 25,
    "parts/mirror_camera.py": 25,
}
NUMBER = re.compile(r"-?\d+\.?\d*(?:e[+-]?\d+)?")


def printed(name):
    """The numbers that a short tutorial prints."""
    done = run(f"tutorials/{name}")
    assert (done.returncode, done.stderr) == (0, "")
    return np.array([float(text) for text in NUMBER.findall(done.stdout)])


@pytest.mark.parametrize(("name", "most"), SHORT.items())
def test_short_tutorials_are_short(name, most):
    text = (ANALYSIS / "tutorials" / name).read_text()
    assert len(text.splitlines()) <= most


def test_there_is_no_other_example_of_a_part():
    folder = ANALYSIS / "tutorials"
    parts = {f"parts/{path.name}" for path in (folder / "parts").glob("*.py")}
    assert parts == {name for name in SHORT if name.startswith("parts/")}


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "joints"), [("pneumatic_arm.py", 2), ("pneumatic_gripper.py", 6)]
)
def test_other_robots_reach_their_posture(name, joints):
    errors = printed(name)
    assert len(errors) == joints
    assert np.all(np.abs(errors) < 0.02)  # rad


@pytest.mark.slow
def test_lqr_brings_the_arm_back_and_held_valves_do_not():
    held, lqr = printed("linearize_and_lqr.py").reshape(2, 3)[:, :2]
    assert np.abs(held).max() > 0.05
    assert np.abs(lqr).max() < 0.005


@pytest.mark.slow
def test_gradient_by_the_gains_is_that_of_finite_differences():
    exact, finite = printed("gain_gradient.py").reshape(8, 2).T
    assert np.all(np.abs(exact) > 1e-3)
    np.testing.assert_allclose(exact, finite, atol=2e-6)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "expected", "atol"),
    [
        # Where the disc was drawn, in a box from pixel -0.5 to 319.5, 239.5.
        ("blob_sensor.py", [80.5 / 320, 180.5 / 240, 1.0], 5e-4),
        ("dmp_source.py", [0.0], 1e-3),
        ("gaze_servo.py", [0.4, 0.3], 5e-3),
    ],
)
def test_parts_do_by_themselves_what_they_should(name, expected, atol):
    np.testing.assert_allclose(printed(f"parts/{name}"), expected, atol=atol)


@pytest.mark.slow
def test_the_microphone_feels_the_ball_where_it_falls():
    force, radius = printed("parts/drum_microphone.py")
    assert force > 10.0  # many times the ball's weight, 1 N
    assert radius == pytest.approx(0.02, abs=1e-3)


@pytest.mark.slow
def test_the_camera_sees_the_marker_also_in_the_mirror():
    reflected, direct = printed("parts/mirror_camera.py").reshape(2, 2)
    # In the upper half of the image stands the mirror.
    assert reflected[1] < 120 < direct[1]
