"""`affetto report`: the results of studies as one page."""

import argparse
from pathlib import Path

from drake_affetto.report import write_report


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declares the command's options."""
    parser.add_argument(
        "folders",
        metavar="DIR",
        nargs="+",
        type=Path,
        help="the folder of a study: demo, drum, mirror, toy, tune, ...",
    )
    parser.add_argument(
        "--out",
        metavar="FILE",
        type=Path,
        help="the page; without it report.html in the first DIR",
    )


def run(args: argparse.Namespace) -> int:
    """Writes the page; returns the exit code.

    Raises:
        InputError: if a folder does not fit or the page cannot be written.
    """
    path = args.out or args.folders[0] / "report.html"
    written = write_report(args.folders, path, "report")
    size = written.stat().st_size / 1e6
    print(f"{written} ({size:.1f} MB): open it in a browser")
    return 0
