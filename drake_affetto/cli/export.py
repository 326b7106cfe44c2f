"""`affetto export`: the trials of a study as a table, for other programs."""

import argparse
from pathlib import Path

from drake_affetto.cli.options import STORE
from drake_affetto.common.errors import InputError
from drake_affetto.common.owner import check_file, claim_file


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declares the command's options."""
    parser.add_argument("folder", metavar="DIR", help="folder of a study")
    parser.add_argument(
        "--to",
        metavar="FILE",
        type=Path,
        required=True,
        help="table (.csv, .parquet); signals with --trial (.mat, .npz)",
    )
    parser.add_argument(
        "--trial",
        metavar="KEY",
        help="the time series of this trial, which is run again, instead",
    )


def run(args: argparse.Namespace) -> int:
    """Writes the table or the signals; returns the exit code.

    Raises:
        InputError: For a folder without a study, an unknown trial or another
            kind of file.
    """
    if not (Path(args.folder) / STORE).is_file():
        raise InputError(f"there is no study in {args.folder}: no {STORE}")
    if args.trial is not None:
        from drake_affetto.experiments import signals

        signals.check_suffix(args.to)
        check_file(args.to, "export")
        found = signals.read_signals(args.folder, args.trial)
        claim_file(args.to, "export")
        found.save(args.to)
    else:
        from drake_affetto.experiments import tables

        tables.check_suffix(args.to)
        check_file(args.to, "export")
        table = tables.read_trials(args.folder)
        claim_file(args.to, "export")
        tables.write_trials(args.to, table)
    print(args.to)
    return 0
