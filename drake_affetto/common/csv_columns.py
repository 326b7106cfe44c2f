"""Columns of numbers from a CSV file with a header, as robots log them."""

from collections.abc import Sequence
import csv
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from drake_affetto.common.errors import InputError, shown
from drake_affetto.common.fields import read_number


def read_columns(
    path: Path, needed: Sequence[str], optional: Sequence[str] = ()
) -> dict[str, NDArray[np.float64]]:
    """Reads the columns with these names; empty lines are passed over.

    Args:
        path: the CSV file.
        needed: names of columns that have to be there.
        optional: names of columns that are read if they are there.

    Returns:
        Each column (N,) by its name, N at least 2. Numbers may be infinite or
        not a number, if the file says so.

    Raises:
        InputError: for a file that cannot be read, a column that is missing
            or there twice, a cell that is no number, or fewer than two rows.
    """
    rows = []
    try:
        with path.open(encoding="utf-8-sig", newline="") as file:
            reader = csv.reader(file)
            header = [name.strip() for name in next(reader, [])]
            missing = [name for name in needed if name not in header]
            if missing:
                raise InputError(
                    f"{path}: no column {', '.join(missing)}; it has "
                    f"{len(header)} columns"
                )
            twice = [n for n in (*needed, *optional) if header.count(n) > 1]
            if twice:
                raise InputError(f"{path}: two columns {', '.join(twice)}")
            names = [*needed, *(name for name in optional if name in header)]
            places = [header.index(name) for name in names]
            for row in reader:
                if not row:
                    continue
                rows.append(
                    [
                        _number(
                            row,
                            place,
                            f"{path}: line {reader.line_num}, column {name}",
                        )
                        for name, place in zip(names, places, strict=True)
                    ]
                )
    except OSError as error:
        raise InputError(f"cannot read {path}: {error.strerror}") from error
    except UnicodeDecodeError as error:
        raise InputError(f"{path} is not UTF-8 text") from error
    except csv.Error as error:
        raise InputError(f"{path} is no CSV file: {error}") from error
    if len(rows) < 2:
        raise InputError(f"{path}: fewer than two rows")
    return dict(zip(names, np.array(rows).T, strict=True))


def _number(row: Sequence[str], place: int, where: str) -> float:
    """The number in a cell.

    Raises:
        InputError: If the cell is missing or holds something else.
    """
    if place >= len(row):
        raise InputError(f"{where} is missing: there are {len(row)} cells")
    cell = row[place]
    try:
        return read_number(cell, float)
    except ValueError:
        raise InputError(
            f"{where} is {shown(cell)}, expected a number"
        ) from None
