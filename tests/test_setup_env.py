"""The set-up's own decisions; that it installs is seen by every `make`."""

import importlib.util
import os
from pathlib import Path
import subprocess
import sys

import pytest

ROOT = Path(__file__).parents[1]
VERSION = f"{sys.version_info[0]}.{sys.version_info[1]}"


def find_python(**environment: str) -> subprocess.CompletedProcess:
    return subprocess.run(
        ["sh", ROOT / "tools/find_python.sh"],
        env=os.environ | environment,
        capture_output=True,
        text=True,
    )


def script(path: Path, text: str) -> Path:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text("#!/bin/sh\n" + text)
    path.chmod(0o755)
    return path


@pytest.fixture
def setup_env(tmp_path, monkeypatch):
    """The script as a module, on a virtual environment that does not exist."""
    monkeypatch.setenv("AFFETTO_VENV", str(tmp_path / "venv"))
    monkeypatch.setenv("AFFETTO_EXTRAS", "dev")
    monkeypatch.delenv("AFFETTO_PYTHON", raising=False)
    path = ROOT / "tools/setup_env.py"
    spec = importlib.util.spec_from_file_location("setup_env", path)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_python_that_is_named_is_taken():
    done = find_python(AFFETTO_PYTHON=sys.executable)
    assert done.stdout == f"{VERSION} {sys.executable}\n"
    assert done.returncode == 0


@pytest.mark.parametrize(
    "text",
    [
        "exit 127",  # a shim whose version is not selected
        "echo 2.7",
        "echo 3.14",
        f"echo {VERSION}; exit 1",
        "",
    ],
)
def test_unfit_python_is_refused_in_one_line(tmp_path, text):
    unfit = script(tmp_path / "python", text)
    done = find_python(AFFETTO_PYTHON=str(unfit))
    assert done.returncode == 1
    assert done.stdout == ""
    assert done.stderr.startswith("setup: error: ")
    assert str(unfit) in done.stderr
    assert done.stderr.count("\n") == 1


def test_refusing_shims_are_passed_over(tmp_path):
    """The version manager's own copy is found behind its shim."""
    shims = tmp_path / "shims"
    for version in ("3.13", "3.12", "3.11"):
        script(shims / f"python{version}", "echo not selected >&2; exit 127")
    for name in ("python3", "python"):
        script(shims / name, "exit 127")
    real = tmp_path / "versions" / f"{VERSION}.99" / "bin/python"
    script(real, f'exec "{sys.executable}" "$@"')
    done = find_python(
        PATH=f"{shims}:{os.environ['PATH']}", PYENV_ROOT=str(tmp_path)
    )
    assert done.returncode == 0
    assert f"{VERSION} {real}" in done.stdout.splitlines()


def test_newest_comes_first():
    versions = [line.split()[0] for line in find_python().stdout.splitlines()]
    assert versions == sorted(set(versions), reverse=True)
    assert set(versions) <= {"3.11", "3.12", "3.13"}


def test_missing_egl_is_one_line_that_says_what_to_install(
    setup_env, monkeypatch, capsys
):
    def refuse(name):
        raise OSError(f"{name}: cannot open shared object file")

    monkeypatch.setattr(setup_env.ctypes, "CDLL", refuse)
    monkeypatch.setattr(setup_env.sys, "platform", "linux")
    with pytest.raises(SystemExit) as caught:
        setup_env.check_libraries()
    assert caught.value.code == 1
    message = capsys.readouterr().err
    assert "libegl1" in message
    assert message.count("\n") == 1
    monkeypatch.setattr(setup_env.sys, "platform", "darwin")
    setup_env.check_libraries()


def test_stamp_changes_with_what_the_environment_is_made_from(
    setup_env, tmp_path, monkeypatch
):
    for name in ("pyproject.toml", "constraints.txt"):
        (tmp_path / name).write_text("a")
    monkeypatch.setattr(setup_env, "ROOT", tmp_path)
    assert not setup_env.stamp_is_current()
    setup_env.VENV.mkdir()

    def stamp():
        setup_env.STAMP.write_text(setup_env.wanted_stamp())
        assert setup_env.stamp_is_current()

    for name in ("pyproject.toml", "constraints.txt"):
        stamp()
        os.utime(tmp_path / name)
        assert setup_env.stamp_is_current()
        (tmp_path / name).write_text("b")
        assert not setup_env.stamp_is_current()
    stamp()
    monkeypatch.setattr(setup_env, "EXTRAS", "")
    assert not setup_env.stamp_is_current()


def test_folder_with_other_things_in_it_is_left_alone(
    setup_env, tmp_path, capsys
):
    (tmp_path / "venv").mkdir()
    (tmp_path / "venv/thesis.tex").write_text("years of work")
    with pytest.raises(SystemExit):
        setup_env.make_environment()
    assert "no virtual environment" in capsys.readouterr().err
    assert (tmp_path / "venv/thesis.tex").read_text() == "years of work"


def test_environment_that_cannot_run_counts_as_broken(setup_env):
    assert not setup_env.environment_is_sound()
    script(setup_env.VENV / "bin/python", "exit 1")
    assert not setup_env.environment_is_sound()
    script(setup_env.VENV / "bin/python", "echo 3.12")
    script(setup_env.VENV / "bin/pip", "")
    assert not setup_env.environment_is_sound(), "its scripts are elsewhere's"
    script(setup_env.VENV / "bin/pip", f"exec {setup_env.VENV}/bin/python")
    assert setup_env.environment_is_sound()
    script(setup_env.VENV / "bin/python", "echo 3.9")
    assert not setup_env.environment_is_sound()
