"""The `affetto` command.

Each sub-command lives in a module that offers

    add_arguments(parser)  its options, on an argparse parser
    run(args) -> int       the work, and the exit code

and only the module of the command asked for is imported, so `affetto --help`
is instant. Exit codes: 0 done, 1 nothing came of it, 2 the user's input does
not fit (one line on stderr), 128 + N ended by signal N: 130 interrupted
(Ctrl-C), 143 terminated, 129 the terminal was closed, 141 the reader of a pipe
went away.
"""

import argparse
from collections.abc import Sequence
import importlib
import os
import sys
from typing import NoReturn

from drake_affetto import __version__
from drake_affetto.common.errors import InputError

# Name of a command, which is also its module beside this one, and what it does.
COMMANDS = {
    "demo": "teach, drum, look through the mirror, transfer",
    "drum": "learn to drum from demonstrations (Fig. 3)",
    "mirror": "drum in a changed view, by transfer (Fig. 5)",
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


class _Parser(argparse.ArgumentParser):
    """argparse, but an error is one line."""

    def error(self, message: str) -> NoReturn:
        print(
            f"{_PROGRAM}: error: {_one_line(message)} (see {self.prog} --help)",
            file=sys.stderr,
        )
        raise SystemExit(2)


def _one_line(message: object) -> str:
    return " ".join(str(message).split())


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


def main(argv: Sequence[str] | None = None) -> int:
    """Runs the command in `argv` (sys.argv[1:]) and returns its exit code."""
    argv = sys.argv[1:] if argv is None else argv
    for name in _THREADS:
        # Before numpy is imported, which reads it then.
        os.environ.setdefault(name, "1")
    try:
        try:
            args = make_parser(_chosen(argv)).parse_args(argv)
            return int(args.run(args) or 0)
        finally:
            sys.stdout.flush()
    except SystemExit as leaving:  # argparse, after --help or an error
        return leaving.code if isinstance(leaving.code, int) else 1
    except InputError as error:
        print(f"{_PROGRAM}: error: {_one_line(error)}", file=sys.stderr)
        return 2
    except KeyboardInterrupt:
        print(f"{_PROGRAM}: interrupted", file=sys.stderr)
        return 130
    except BrokenPipeError:
        # What is left in the buffer has no reader: give it to nobody, or the
        # interpreter complains of it on its way out.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 141
