import importlib
import os
from pathlib import Path
import signal
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


@pytest.mark.parametrize("word", ["-9e-2", "-.5", "-3.", "-1E+5", "-inf", "-7"])
def test_negative_numbers_of_any_notation_are_no_options(command, word):
    got = []

    def run(args):
        got.append(args.place)

    command(run)
    sys.modules["drake_affetto.cli.probe"].add_arguments = lambda parser: (
        parser.add_argument("--place", nargs=2, type=float)
    )
    assert cli.main(["probe", "--place", "0.2", word]) == 0
    assert got == [[0.2, float(word)]]


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


# A command that does what `work` says, in a process of its own.
PROBE = """
import signal, sys, time, types
from drake_affetto.cli import main as cli
def run(args):
{}
probe = types.ModuleType("drake_affetto.cli.probe")
probe.add_arguments = lambda parser: None
probe.run = run
sys.modules[probe.__name__] = probe
cli.COMMANDS["probe"] = "probe it"
sys.exit(cli.main(["probe"]))
"""
RICH = (
    "from rich.console import Console",
    "Console().print('a line')",
)


def script(*work):
    return PROBE.format("\n".join(f"    {line}" for line in work))


def environment(*, buffered=True):
    found = dict(os.environ)
    found.pop("PYTHONUNBUFFERED", None)
    return found if buffered else found | {"PYTHONUNBUFFERED": "1"}


@pytest.mark.parametrize("buffered", [True, False])
@pytest.mark.parametrize("work", [("print('a line')",), RICH])
def test_reader_of_the_pipe_may_leave(work, buffered):
    read, write = os.pipe()
    os.close(read)
    try:
        done = subprocess.run(
            [sys.executable, "-c", script(*work)],
            stdout=write,
            stderr=subprocess.PIPE,
            text=True,
            env=environment(buffered=buffered),
        )
    finally:
        os.close(write)
    assert (done.returncode, done.stderr) == (141, "")


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="no full device")
@pytest.mark.parametrize("buffered", [True, False])
@pytest.mark.parametrize("words", ["probe", "rich", "--help", "--version"])
def test_a_full_output_is_one_line(words, buffered):
    work = RICH if words == "rich" else ("print('a line')",)
    code = script(*work)
    if words.startswith("-"):
        code = code.replace('main(["probe"])', f'main(["{words}"])')
    with open("/dev/full", "w") as full:
        done = subprocess.run(
            [sys.executable, "-c", code],
            stdout=full,
            stderr=subprocess.PIPE,
            text=True,
            env=environment(buffered=buffered),
        )
    assert (done.returncode, done.stderr) == (
        1,
        "affetto: error: cannot write the output: No space left on device\n",
    )


@pytest.mark.parametrize(
    ("closed", "code", "err"),
    [
        ("<&-", 0, ""),
        ("2>&-", 0, ""),
        (
            ">&-",
            1,
            "affetto: error: cannot write the output: Bad file descriptor\n",
        ),
        (">&- 2>&-", 1, ""),
    ],
)
def test_a_closed_stream_is_not_taken_for_a_file(tmp_path, closed, code, err):
    """What is opened next would get its number, and all that is printed."""
    path = tmp_path / "results"
    work = script(
        f"file = open({str(path)!r}, 'w')",
        "assert file.fileno() > 2",
        "print('a line'); print('a note', file=sys.stderr)",
    )
    done = subprocess.run(
        ["sh", "-c", f'exec "$0" -c "$1" {closed}', sys.executable, work],
        capture_output=True,
        text=True,
        env=environment(),
    )
    note = "a note\n" if code == 0 and "2>" not in closed else ""
    assert (done.returncode, done.stderr) == (code, err + note)
    assert path.exists() == (code == 0)
    if path.exists():
        assert path.read_text() == ""


@pytest.mark.parametrize(
    ("name", "said"),
    [("SIGTERM", "terminated"), ("SIGHUP", "the terminal was closed")],
)
def test_a_signal_ends_it_in_one_line_and_shows_the_cursor(name, said):
    """Even where the output looks like a terminal, whose cursor is hidden."""
    work = script(
        "from rich.console import Console",
        "console = Console(force_terminal=True)",
        "with console.status('Waiting'):",
        "    print('ready', file=sys.__stderr__, flush=True)",
        "    time.sleep(60)",
    )
    process = subprocess.Popen(
        [sys.executable, "-c", work],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        env=environment() | {"TERM": "xterm"},
    )
    assert process.stderr.readline() == "ready\n"
    number = getattr(signal, name)
    process.send_signal(number)
    out, err = process.communicate(timeout=60)
    assert process.returncode == 128 + number
    assert err == f"affetto: {said}\n"
    assert out.rindex("\x1b[?25h") > out.rindex("\x1b[?25l")


def test_what_is_to_survive_the_terminal_does():
    """As `nohup` asks for."""
    work = script(
        "import os",
        "os.kill(os.getpid(), signal.SIGHUP)",
        "print('goes on')",
    )
    done = subprocess.run(
        ["sh", "-c", 'trap "" HUP; exec "$0" -c "$1"', sys.executable, work],
        capture_output=True,
        text=True,
    )
    assert (done.returncode, done.stdout) == (0, "goes on\n")


def test_handlers_are_as_before_when_it_returns(command):
    before = signal.getsignal(signal.SIGTERM)
    inside = []
    command(lambda args: inside.append(signal.getsignal(signal.SIGTERM)))
    cli.main(["probe"])
    assert signal.getsignal(signal.SIGTERM) is before
    assert inside[0] is not before


def test_faults_of_files_keep_their_trace(command):
    def run(args):
        Path("/dev/null/nothing").read_text()

    command(run)
    with pytest.raises(OSError, match="nothing"):
        cli.main(["probe"])


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
    ("mirror", "--samples 0", "--samples"),
    ("mirror", "--schemes nonsense", "--schemes"),
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
