"""The identify command, from its arguments to its files."""

import argparse
import csv
import json
import shutil

import numpy as np
import pytest

from drake_affetto.cli import identify as command
from drake_affetto.common.errors import InputError
from drake_affetto.identification import fit, study, uncertainty
from drake_affetto.identification.problem import JointProblem
from drake_affetto.identification.study import read_state
from drake_affetto.pneumatics.parameters import (
    ActuatorClass,
    JointActuator,
    PneumaticParameters,
    load_parameters,
)
from drake_affetto.robot.controller import RobotController, RobotJoint
from support.robot_bench import make_log, make_problem, true_values, write_csv


@pytest.fixture
def logs(tmp_path, monkeypatch):
    """Three short logs, and a fit that does not take long."""
    for module in (fit, study):
        monkeypatch.setattr(module, "FIT_STAGES", ("windows", "runs"))
    for module in (uncertainty, study):
        monkeypatch.setattr(module, "PROFILED", ("inertia",))
    monkeypatch.setattr(fit, "_EVALUATIONS", (3, 3))
    monkeypatch.setattr(uncertainty, "_PROFILE_EVALUATIONS", 1)
    problem = make_problem()
    values = true_values(problem)
    return [
        write_csv(
            tmp_path / f"run_{seed}.csv",
            make_log(problem, values, seconds=3.0, seed=seed),
        )
        for seed in range(3)
    ]


def run(*words):
    parser = argparse.ArgumentParser()
    command.add_arguments(parser)
    return command.run(parser.parse_args([str(word) for word in words]))


def read_rows(path):
    with path.open() as file:
        return list(csv.reader(file))


def test_results_are_those_of_the_contract(tmp_path, logs, capsys):
    out = tmp_path / "out"
    code = run("--fit", logs[0], "--test", logs[1], logs[2], "--out", out)
    assert code == 0
    results = json.loads((out / "results.json").read_text())
    assert results["fit"] == ["run_0"]
    assert results["test"] == ["run_1", "run_2"]
    assert results["parameters"]["inertia"]["value"] > 0.0
    assert results["parameters"]["torque_constant"]["determined"] is False
    for kind in ("closed", "open"):
        squares = []
        for stem, path in (("run_1", logs[1]), ("run_2", logs[2])):
            header, *rows = read_rows(out / f"{stem}_{kind}.csv")
            assert header == ["t", "q", "pa", "pb"]
            found = np.array(rows, dtype=float)
            names, *measured = read_rows(path)
            measured = np.array(measured, dtype=float)
            # At the log's own times, in its units.
            np.testing.assert_allclose(found[:, 0], measured[:, 0], atol=1e-5)
            columns = [names.index(x) for x in ("rq5", "rpa5", "rpb5")]
            judged = found[:, 0] >= 1.0
            error = found[:, 1:] - measured[:, columns]
            squares.append(np.mean(error[judged] ** 2, axis=0))
        rms = np.sqrt(np.mean(squares, axis=0))
        told = results[f"{kind}_loop"]
        np.testing.assert_allclose(
            rms,
            [told["q_rms_percent"], told["pa_rms_kpa"], told["pb_rms_kpa"]],
            rtol=1e-3,
        )
    for name in ("run_0", "run_1", "run_2"):
        assert (out / f"{name}.png").stat().st_size > 10_000
    assert "all tests" in capsys.readouterr().out


def test_fitted_actuator_can_be_included(tmp_path, logs):
    out = tmp_path / "out"
    run("--fit", logs[0], "--test", logs[1], "--out", out)
    results = json.loads((out / "results.json").read_text())
    plain = load_parameters()
    fitted = load_parameters(overlays=[out / "actuator.yaml"])
    told = results["parameters"]["dead_volume"]["value"]
    assert fitted.classes["elbow"].dead_volume == pytest.approx(told, rel=1e-3)
    assert fitted.classes["elbow"].dead_time == plain.classes["elbow"].dead_time
    assert fitted.classes["waist"] == plain.classes["waist"]


def test_a_second_run_goes_on_from_the_first(tmp_path, logs, capsys):
    out = tmp_path / "out"
    run("--fit", logs[0], "--test", logs[1], "--out", out)
    first = (out / "results.json").read_text()
    # As after being killed in the middle of the fit.
    state = json.loads((out / "state.json").read_text())
    state["state"]["stage"] = 2
    (out / "state.json").write_text(json.dumps(state))
    (out / "results.json").unlink()
    capsys.readouterr()
    run("--fit", logs[0], "--test", logs[1], "--out", out)
    assert "going on from there" in capsys.readouterr().out
    assert (out / "results.json").read_text() == first
    # Another log is another fit, and a torn state is no state.
    run("--fit", logs[2], "--test", logs[1], "--out", out)
    assert "going on from there" not in capsys.readouterr().out
    for text in (
        "{",
        "[" * 10**5,
        json.dumps(state | {"state": {"values": {"inertia": "low"}}}),
        json.dumps(state | {"state": {"values": {}, "stage": 99}}),
    ):
        (out / "state.json").write_text(text)
        assert read_state(out / "state.json", state["key"]) is None
    (out / "state.json").write_text("{")
    run("--fit", logs[2], "--test", logs[1], "--out", out)
    assert "going on from there" not in capsys.readouterr().out


def test_bad_logs_stop_it_before_anything_is_written(tmp_path, logs):
    out = tmp_path / "out"
    with pytest.raises(InputError, match="nowhere"):
        run("--fit", logs[0], "--test", tmp_path / "nowhere", "--out", out)
    with pytest.raises(InputError, match="joint is 40"):
        run(
            "--fit",
            logs[0],
            "--test",
            logs[1],
            "--joint",
            40,
            "--out",
            out,
        )
    copy = tmp_path / "copy.csv"
    shutil.copy(logs[0], copy)
    link = tmp_path / "link.csv"
    link.symlink_to(logs[0])
    (tmp_path / "far").mkdir()
    namesake = tmp_path / "far" / logs[0].name
    shutil.copy(logs[1], namesake)
    for words, message in (
        (("--fit", logs[0], "--test", logs[1], logs[1]), "--test: .*run_1"),
        (("--fit", logs[0], logs[0], "--test", logs[1]), "--fit: .*run_0"),
        (("--fit", logs[0], "--test", logs[0]), "--test: .* is not held out"),
        (("--fit", logs[0], "--test", copy), "--test: .*copy.* is the same"),
        (("--fit", logs[0], "--test", link), "--test: .*link.* is the same"),
        (("--fit", logs[0], "--test", namesake), "two logs are called run_0"),
    ):
        with pytest.raises(InputError, match=message):
            run(*words, "--out", out)
    assert not out.exists()


def test_logs_of_other_gains_are_remarked_on(tmp_path, logs, capsys):
    names, *rows = read_rows(logs[1])
    column = names.index("ca5")
    for row in rows:
        row[column] = str(float(row[column]) * 1.1)
    other = tmp_path / "other.csv"
    other.write_text("\n".join(",".join(r) for r in [names, *rows]) + "\n")
    run("--fit", logs[0], "--test", other, "--out", tmp_path / "out")
    assert "not those of the robot's PID law" in capsys.readouterr().out


def test_the_key_of_a_stored_fit_stays(tmp_path, monkeypatch):
    monkeypatch.setattr(study, "__version__", "0.1.0")
    path = tmp_path / "run.csv"
    path.write_text("t,q\n")
    problem = JointProblem(
        joint=RobotJoint(name="elbow", actuator="arm", kP=2.0),
        controller=RobotController(joints=[RobotJoint(name="elbow")]),
        supply=PneumaticParameters(
            supply_pressure=659.3e3,
            classes={"arm": ActuatorClass()},
            joints={"elbow": JointActuator(actuator="arm")},
        ),
        actuator=ActuatorClass(),
    )
    assert study.fit_key(problem, [str(path)]) == (
        "db4cb326fe74a4711d6869a92b1e6e706944c82b573f7219ff3801adfe9d0101"
    )
