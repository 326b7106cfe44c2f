"""The `affetto` command.

Each sub-command lives in a module that offers

    add_arguments(parser)  its options, on an argparse parser
    run(args) -> int       the work, and the exit code

and only the module of the command asked for is imported, so `affetto --help`
is instant. Exit codes: 0 done, 1 nothing came of it, 2 the user's input does
not fit (one line on stderr), 128 + N ended by signal N: 130 interrupted
(Ctrl-C), 143 terminated, 129 the terminal was closed, 141 the reader of a pipe
went away. 1 is also that of an output which cannot be written.
"""

import argparse
from collections.abc import Iterator, Sequence
import contextlib
import errno
import importlib
import os
import re
import signal
import sys
import threading
from typing import Any, NoReturn

from drake_affetto import __version__
from drake_affetto.common.errors import InputError, one_line

# Name of a command, which is also its module beside this one, and what it does.
COMMANDS = {
    "demo": "teach, drum, look through the mirror, transfer",
    "drum": "learn to drum from demonstrations (Fig. 3)",
    "mirror": "drum in a changed view, by transfer (Fig. 5)",
    "faults": "what faults do to the robot, and whether it notices",
    "teach": "record demonstrations in a file",
    "look": "show what the camera sees; calibrate it",
    "toy": "the paper's toy experiment of transfer (Fig. 2)",
    "report": "the results of studies as one page",
    "identify": "fit the actuators to a robot's logs",
    "tune": "tune the controllers' gains on the whole robot",
    "export": "trials of a study as a table, or one trial's signals",
    "status": "show how far a study is",
    "serve": "answer the real robot's own software in real time",
    "view": "show the robot in a browser, with sliders",
    "diagram": "draw a station's systems and their connections",
}

_PROGRAM = "affetto"

# How many threads linear algebra uses. Sums differ in the last digit with
# their number, so that the same seed gives the same numbers only with one; and
# the worker processes use the other cores.
_THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS")


# Why an output takes no more.
_FULL = (errno.EBADF, errno.EDQUOT, errno.EFBIG, errno.EIO, errno.ENOSPC)


class _Parser(argparse.ArgumentParser):
    """argparse, but an error is one line, and -9e-2 is a number.

    Help that cannot be written is an error too.
    """

    def __init__(self, *args: Any, **kwargs: Any):
        super().__init__(*args, **kwargs)
        # argparse takes words like these for options otherwise.
        self._negative_number_matcher = _NEGATIVE_NUMBER

    def _print_message(self, message: str, file: Any = None) -> None:
        # argparse's own hides that nothing was written.
        if message:
            (file or sys.stderr).write(message)

    def error(self, message: str) -> NoReturn:
        print(
            f"{_PROGRAM}: error: {one_line(message)} (see {self.prog} --help)",
            file=sys.stderr,
        )
        raise SystemExit(2)


_NEGATIVE_NUMBER = re.compile(
    r"-(?:(?:\d+\.?\d*|\.\d+)(?:e[-+]?\d+)?|inf(?:inity)?|nan)$",
    re.IGNORECASE,
)


def _chosen(argv: Sequence[str]) -> str | None:
    """The sub-command in `argv`; the options before it take no value."""
    return next((word for word in argv if not word.startswith("-")), None)


def make_parser(command: str | None = None) -> argparse.ArgumentParser:
    """The parser of the whole command, with the options of `command` alone."""
    parser = _Parser(
        prog=_PROGRAM,
        description="The drumming child robot Affetto in simulation.",
        epilog=f"`{_PROGRAM} COMMAND --help` lists the options of a command.",
        allow_abbrev=False,
    )
    parser.add_argument(
        "--version", action="version", version=f"%(prog)s {__version__}"
    )
    commands = parser.add_subparsers(
        dest="command", metavar="COMMAND", required=True, title="commands"
    )
    for name, summary in COMMANDS.items():
        sub = commands.add_parser(
            name,
            help=summary,
            description=summary[0].upper() + summary[1:] + ".",
            formatter_class=argparse.ArgumentDefaultsHelpFormatter,
            allow_abbrev=False,
        )
        if name == command:
            module = importlib.import_module(f"drake_affetto.cli.{name}")
            module.add_arguments(sub)
            sub.set_defaults(run=module.run)
    return parser


class Ended(KeyboardInterrupt):
    """A signal ends the command: what is open is closed, as on Ctrl-C."""

    def __init__(self, number: int) -> None:
        super().__init__()
        self.number = number


# What ends a command besides Ctrl-C, and what is said then.
_ENDINGS = {"SIGTERM": "terminated", "SIGHUP": "the terminal was closed"}


@contextlib.contextmanager
def _ends_by_signal() -> Iterator[None]:
    """Lets signals end the block by an exception; a second one by force."""
    before: dict[int, Any] = {}

    def end(number: int, _: object) -> None:
        signal.signal(number, signal.SIG_DFL)
        raise Ended(number)

    for name in _ENDINGS:
        number = getattr(signal, name, None)
        # Elsewhere than in the main thread nobody may; nohup has its reason.
        if (
            number is not None
            and threading.current_thread() is threading.main_thread()
            and signal.getsignal(number) is signal.SIG_DFL
        ):
            before[number] = signal.signal(number, end)
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


def _open_streams() -> None:
    """Sees that files which are opened later are not taken for a stream.

    Raises:
        OSError: If the standard output is closed.
    """
    closed = sys.stdout is None
    for number, name in ((0, "stdin"), (1, "stdout"), (2, "stderr")):
        if getattr(sys, name) is None:
            mode = "r" if number == 0 else "w"
            with contextlib.suppress(OSError):
                os.dup2(os.open(os.devnull, os.O_RDWR), number)
                stream = open(number, mode, closefd=False)  # noqa: SIM115
                setattr(sys, name, stream)
    if closed:
        raise OSError(errno.EBADF, os.strerror(errno.EBADF))


def _say(message: str) -> None:
    """One line on stderr, if anybody can read it."""
    with contextlib.suppress(OSError, ValueError):
        print(f"{_PROGRAM}: {message}", file=sys.stderr, flush=True)


def _drop_output() -> None:
    """Gives what is left in the buffer to nobody.

    Without it the interpreter complains of it on its way out.
    """
    with contextlib.suppress(OSError, ValueError):
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


def main(argv: Sequence[str] | None = None) -> int:
    """Runs the command in `argv` (sys.argv[1:]) and returns its exit code."""
    argv = sys.argv[1:] if argv is None else argv
    for name in _THREADS:
        # Before numpy is imported, which reads it then.
        os.environ.setdefault(name, "1")
    try:
        _open_streams()
        with _ends_by_signal():
            return _run(argv)
    except InputError as error:
        _say(f"error: {one_line(error)}")
        return 2
    except Ended as ending:
        _drop_output()
        _say(_ENDINGS[signal.Signals(ending.number).name])
        return 128 + ending.number
    except KeyboardInterrupt:
        _say("interrupted")
        return 130
    except BrokenPipeError:
        _drop_output()
        return 141
    except OSError as error:
        # Of files, errors are told by those who write them, as InputError.
        if error.filename is not None or error.errno not in _FULL:
            raise
        _drop_output()
        _say(f"error: cannot write the output: {error.strerror}")
        return 1


def _run(argv: Sequence[str]) -> int:
    try:
        try:
            args = make_parser(_chosen(argv)).parse_args(argv)
            return int(args.run(args) or 0)
        finally:
            sys.stdout.flush()
    except SystemExit as leaving:  # argparse, after --help or an error
        if isinstance(leaving.__context__, BrokenPipeError):
            # So does rich, which has no other word for it.
            raise BrokenPipeError from leaving
        return leaving.code if isinstance(leaving.code, int) else 1
