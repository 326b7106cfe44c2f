import importlib
import os
import subprocess
import sys
import types

import pytest

from drake_affetto import __version__
from drake_affetto.cli import main as cli
from drake_affetto.common.errors import InputError


@pytest.fixture
def command(monkeypatch):
    """Registers a function as the command `probe`, and says what it got."""

    def register(run):
        def add_arguments(parser):
            parser.add_argument("--number", type=int, default=0)

        module = types.ModuleType("drake_affetto.cli.probe")
        vars(module).update(add_arguments=add_arguments, run=run)
        monkeypatch.setitem(sys.modules, module.__name__, module)
        monkeypatch.setitem(cli.COMMANDS, "probe", "probe it")

    return register


# What takes long to import; a help needs none of it.
HEAVY = {
    *("numpy", "scipy", "pydrake", "cv2", "numba", "sklearn", "rich", "yaml"),
    *("optuna", "plotly", "h5py", "matplotlib"),
}


def help_and_heavy_modules(*words):
    """What `affetto WORDS --help` prints, and the heavy modules it imports."""
    code = (
        "import sys; from drake_affetto.cli import main as cli;"
        "code = cli.main([*sys.argv[1:], '--help']);"
        f"print(*sorted({HEAVY!r} & set(sys.modules)), file=sys.stderr);"
        "sys.exit(code)"
    )
    done = subprocess.run(
        [sys.executable, "-c", code, *words], capture_output=True, text=True
    )
    assert done.returncode == 0, done.stderr
    return done.stdout, done.stderr.split()


def test_help_lists_the_commands_and_imports_nothing_heavy():
    text, heavy = help_and_heavy_modules()
    assert heavy == []
    for name, summary in cli.COMMANDS.items():
        assert name in text
        assert summary.split()[0] in text


@pytest.mark.parametrize("name", list(cli.COMMANDS))
def test_help_of_a_command_imports_nothing_heavy(name):
    text, heavy = help_and_heavy_modules(name)
    assert f"affetto {name}" in text
    assert heavy == []


@pytest.mark.parametrize("mine", [None, "3"])
def test_linear_algebra_uses_one_thread_unless_told_otherwise(mine):
    names = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS")
    environment = {k: v for k, v in os.environ.items() if k not in names}
    if mine is not None:
        environment |= dict.fromkeys(names, mine)
    code = (
        "import os, sys; from drake_affetto.cli import main as cli;"
        "cli.main(['--version']);"
        "assert 'numpy' not in sys.modules;"
        f"print(*(os.environ[name] for name in {names!r}))"
    )
    done = subprocess.run(
        [sys.executable, "-c", code],
        env=environment,
        capture_output=True,
        text=True,
    )
    assert done.stdout.split()[-2:] == [mine or "1"] * 2


@pytest.mark.parametrize("name", list(cli.COMMANDS))
def test_every_command_keeps_the_convention(name, capsys):
    module = importlib.import_module(f"drake_affetto.cli.{name}")
    assert callable(module.add_arguments)
    assert callable(module.run)
    assert cli.main([name, "--help"]) == 0
    assert f"affetto {name}" in capsys.readouterr().out


def test_version():
    done = subprocess.run(
        [sys.executable, "-m", "drake_affetto.cli", "--version"],
        capture_output=True,
        text=True,
    )
    assert (done.returncode, done.stdout) == (0, f"affetto {__version__}\n")


def test_arguments_reach_the_command_and_its_code_the_caller(command, capsys):
    command(lambda args: args.number)
    assert cli.main(["probe", "--number", "7"]) == 7
    assert cli.main(["probe"]) == 0


@pytest.mark.parametrize(
    ("words", "named"),
    [
        ([], "COMMAND"),
        (["drumm"], "drumm"),
        (["--verbose"], "COMMAND"),
        (["probe", "--number", "many"], "many"),
        (["probe", "--num", "3"], "--num"),
        (["probe", "extra"], "extra"),
    ],
)
def test_wrong_words_are_one_line_and_exit_2(command, capsys, words, named):
    command(lambda args: 0)
    assert cli.main(words) == 2
    out, err = capsys.readouterr()
    assert out == ""
    assert err.startswith("affetto: error: ")
    assert named in err
    assert err.count("\n") == 1
    assert err.endswith("\n")


def test_input_error_is_one_line_and_exit_2(command, capsys):
    def run(args):
        raise InputError("control.gain is -1,\n  expected a positive number")

    command(run)
    assert cli.main(["probe"]) == 2
    assert capsys.readouterr() == (
        "",
        "affetto: error: control.gain is -1, expected a positive number\n",
    )


def test_other_errors_keep_their_trace(command):
    def run(args):
        raise ValueError("a fault of the program")

    command(run)
    with pytest.raises(ValueError, match="a fault"):
        cli.main(["probe"])


def test_interrupt_is_one_line_and_exit_130(command, capsys):
    def run(args):
        raise KeyboardInterrupt

    command(run)
    assert cli.main(["probe"]) == 130
    assert capsys.readouterr().err == "affetto: interrupted\n"


@pytest.mark.parametrize("buffered", [True, False])
def test_reader_of_the_pipe_may_leave(buffered):
    code = (
        "import sys, types; from drake_affetto.cli import main as cli;"
        "probe = types.ModuleType('drake_affetto.cli.probe');"
        "probe.add_arguments = lambda parser: None;"
        "probe.run = lambda args: print('a line');"
        "sys.modules[probe.__name__] = probe;"
        "cli.COMMANDS['probe'] = 'probe it';"
        "sys.exit(cli.main(['probe']))"
    )
    environment = {
        key: value
        for key, value in os.environ.items()
        if key != "PYTHONUNBUFFERED"
    }
    if not buffered:
        environment["PYTHONUNBUFFERED"] = "1"
    read, write = os.pipe()
    os.close(read)
    try:
        done = subprocess.run(
            [sys.executable, "-c", code],
            stdout=write,
            stderr=subprocess.PIPE,
            text=True,
            env=environment,
        )
    finally:
        os.close(write)
    assert (done.returncode, done.stderr) == (141, "")


BAD_OPTIONS = [
    ("demo", "--seed -1", "--seed"),
    ("demo", "--reuse nowhere", "no trials.sqlite in nowhere"),
    ("drum", "--demonstrations 2", "--demonstrations"),
    ("drum", "--evaluations 0", "--evaluations"),
    ("drum", "--repeats 0", "--repeats"),
    ("drum", "--after 3 26", "--after"),
    ("drum", "--workers -1", "--workers"),
    ("drum", "--scenario drummin", "did you mean 'drumming'"),
    ("drum", "--reuse nowhere", "no trials.sqlite in nowhere"),
    ("mirror", "--samples 1", "--samples"),
    ("mirror", "--samples 3 3", "--samples"),
    ("mirror", "--repeats 0", "--repeats"),
    ("mirror", "--scenario miror", "did you mean 'mirror'"),
    ("mirror", "--scenario mirror --all-scenarios", "not allowed"),
    ("mirror", "--self-calibrate --all-scenarios", "--self-calibrate"),
    ("mirror", "--self-calibrate --calibration no.yaml", "no.yaml"),
    ("mirror", "--self-calibrate --scenario drumming", "into a mirror"),
    ("mirror", "--workers 2 --dask here", "not allowed"),
    ("mirror", "--dask tcp://127.0.0.1:9", "no Dask scheduler answers"),
    ("toy", "--repeats 0", "--repeats"),
    ("toy", "--seeds 0", "--seeds"),
    ("toy", "--seed -1", "--seed"),
    ("toy", "--workers -1", "--workers"),
    ("toy", "--dask tcp://127.0.0.1:9", "no Dask scheduler answers"),
    ("tune", "--trials 0", "--trials"),
    ("tune", "--workers -1", "--workers"),
    ("tune", "--seed -1", "--seed"),
    ("tune", "--joints elbow", "--joints"),
    ("tune", "--joints waist_yaw waist_yaw", "--joints"),
    # A joint of the robot, but locked in this scenario.
    ("tune", "--joints left_elbow_flexion", "--joints"),
    ("tune", "--scenario drumning", "drumming"),
    ("tune", "--start no_such.yaml", "no_such.yaml"),
    ("tune", "--tuning no_such.yaml", "no_such.yaml"),
]


@pytest.mark.parametrize(("name", "options", "word"), BAD_OPTIONS)
def test_bad_options_are_one_line_before_anything_runs(
    name, options, word, tmp_path, capsys, monkeypatch
):
    monkeypatch.setattr("drake_affetto.runner.dask_cluster._PATIENCE", 0.5)
    out = tmp_path / "out"
    assert cli.main([name, "--out", str(out), *options.split()]) == 2
    error = capsys.readouterr().err
    assert word in error
    assert error.count("\n") == 1
    assert not out.exists()


@pytest.mark.parametrize("name", ["demo", "drum", "mirror", "toy", "tune"])
def test_a_file_is_no_folder_for_results(name, tmp_path, capsys):
    (tmp_path / "file").touch()
    assert cli.main([name, "--out", str(tmp_path / "file")]) == 2
    assert "is a file" in capsys.readouterr().err
