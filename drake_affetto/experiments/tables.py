"""A study's trials as one table, with the columns of `COLUMNS`.

`read_trials` gives a pandas DataFrame (`pip install 'drake_affetto[data]'`),
`affetto export` writes it to a file. Columns hold missing values where a kind
of trial has no such number.
"""

import dataclasses
from pathlib import Path
from typing import TYPE_CHECKING, Any

from drake_affetto.common.errors import InputError, require
from drake_affetto.common.output import STORE, atomic_path
from drake_affetto.runner.store import TrialRow, TrialStore

if TYPE_CHECKING:
    import pandas as pd

SUFFIXES = (".csv", ".parquet")


@dataclasses.dataclass(frozen=True)
class Column:
    """One column of the table.

    Attributes:
        name: Its name.
        dtype: Its type in pandas, which can hold missing values.
        unit: Its unit, "1" for a pure number, "" for what is none.
        about: What it says.
    """

    name: str
    dtype: str
    unit: str
    about: str


COLUMNS = (
    Column("key", "string", "", "key of the trial: all that determines it"),
    Column("kind", "string", "", "look, demonstration, strike or drumming"),
    Column("phase", "string", "", "phase of the study that planned it first"),
    Column("scenario", "string", "", "name of the scenario"),
    Column("version", "string", "", "version of drake_affetto"),
    Column("finished_at", "datetime64[us, UTC]", "", "end of the computation"),
    Column("seed", "Int64", "1", "seed of the noise and the teacher"),
    Column("x", "Float64", "m", "the drum on the table, world frame"),
    Column("y", "Float64", "m", "the drum on the table, world frame"),
    Column("variability", "Float64", "1", "factor of the teacher's variation"),
    Column("found", "boolean", "", "whether the gaze settled on the marker"),
    Column("tau_1", "Float64", "1", "task parameter: y_img, or x_img"),
    Column("tau_2", "Float64", "rad or 1", "task parameter: q3*, or y_img"),
    Column("duration", "Float64", "s", "time that the search took"),
    Column("attempts", "Int64", "1", "how often the teacher guided the arm"),
    Column("max_pull", "Float64", "N", "greatest force of the teacher"),
    Column("reward", "Float64", "1", "R of the sound (paper Eq. 10)"),
    Column("success", "boolean", "", "whether R is above the threshold"),
    Column("max_force", "Float64", "N", "greatest force on the drum's head"),
    Column("impulse", "Float64", "N s", "impulse on the drum's head"),
)


def read_trials(path: str | Path) -> "pd.DataFrame":
    """The trials of a study, a row each, earliest first.

    Args:
        path: Folder of a study, or a table that `affetto export` made of one.

    Returns:
        The columns of `COLUMNS`; `attrs["units"]` has their units.

    Raises:
        InputError: If there is no study or table, it is damaged or has other
            columns, or pandas is not installed.
    """
    pd = import_pandas()
    path = Path(path)
    if path.suffix in SUFFIXES and not path.is_dir():
        return _typed(_read_table(path), str(path))
    with open_store(path) as store:
        rows = [_row(each, f"{store.path}") for each in store.rows()]
    return _typed(pd.DataFrame(rows, columns=_names(), dtype=object), str(path))


def write_trials(path: str | Path, table: "pd.DataFrame") -> None:
    """Writes a table of trials as .csv or .parquet, whole or not at all.

    Args:
        table: A row each trial, as `read_trials` gives it.

    Raises:
        InputError: If the name ends otherwise, or it cannot be written.
    """
    path = check_suffix(path)
    with atomic_path(path) as fresh:
        if path.suffix == ".csv":
            table.to_csv(fresh, index=False)
        else:
            try:
                table.to_parquet(fresh, index=False)
            except ImportError as error:
                raise _missing("pyarrow") from error


def check_suffix(path: str | Path) -> Path:
    """Returns a table's path; raises InputError for another kind of file."""
    path = Path(path)
    require(
        path.suffix in SUFFIXES,
        "table",
        str(path),
        f"a file that ends in {' or '.join(SUFFIXES)}",
    )
    return path


def open_store(folder: str | Path) -> TrialStore:
    """Opens the trials of a study's folder to read.

    Raises:
        InputError: If there are none.
    """
    path = Path(folder) / STORE
    if not path.is_file():
        raise InputError(f"there is no study in {folder}: no {STORE}")
    return TrialStore(path, read_only=True)


def import_pandas() -> Any:
    """The module; raises InputError with the way out where it is missing."""
    try:
        import pandas
    except ImportError as error:
        raise _missing("pandas") from error
    return pandas


def _missing(package: str) -> InputError:
    return InputError(
        f"{package} is not installed: pip install 'drake_affetto[data]'"
    )


def _names() -> list[str]:
    return [column.name for column in COLUMNS]


def _row(row: TrialRow, where: str) -> dict[str, Any]:
    scenario = row.spec.get("scenario", {})
    both = {**row.spec, **row.result}
    try:
        x, y = both.get("xy", (None, None))
        tau = both.get("tau", (None, None))
        known = {
            "key": row.key,
            "kind": row.kind,
            "phase": row.phase,
            # Version 0.1.0 called it "name".
            "scenario": scenario.get("@name", scenario.get("name")),
            "version": scenario.get("version"),
            "finished_at": row.finished_at,
            "x": x,
            "y": y,
            "tau_1": tau[0],
            "tau_2": tau[1],
        }
    except (TypeError, ValueError, IndexError, AttributeError) as error:
        raise InputError(f"{where}: trial {row.key} is damaged") from error
    return {name: known.get(name, both.get(name)) for name in _names()}


def _read_table(path: Path) -> "pd.DataFrame":
    pd = import_pandas()
    require(path.is_file(), "table", str(path), "an existing file")
    try:
        if path.suffix == ".csv":
            # Numbers are told apart by their columns, not by their looks.
            return pd.read_csv(path, dtype=str, keep_default_na=False)
        return pd.read_parquet(path)
    except ImportError as error:
        raise _missing("pyarrow") from error
    except (ValueError, OSError) as error:
        raise InputError(f"{path} is no table of trials: {error}") from error


def _typed(table: "pd.DataFrame", where: str) -> "pd.DataFrame":
    """The table with the types and units of `COLUMNS`."""
    if list(table.columns) != _names():
        other = sorted(set(_names()) ^ set(map(str, table.columns)))
        raise InputError(
            f"{where} is no table of trials: missing or unknown columns "
            f"{', '.join(other) or 'in another order'}"
        )
    for column in COLUMNS:
        try:
            table[column.name] = _cast(table[column.name], column.dtype)
        except (TypeError, ValueError) as error:
            raise InputError(
                f"{where}: column {column.name} holds what is no "
                f"{column.dtype}: {error}"
            ) from error
    table.attrs["units"] = {each.name: each.unit for each in COLUMNS}
    return table


def _cast(values: "pd.Series", dtype: str) -> "pd.Series":
    pd = import_pandas()
    if dtype.startswith("datetime64"):
        return pd.to_datetime(values, utc=True).astype(dtype)
    if values.dtype != dtype:
        values = values.astype(object)
        values = values.where(values.notna() & (values != ""), None)
    if dtype == "boolean":
        return values.replace({"True": True, "False": False}).astype(dtype)
    if dtype in ("Int64", "Float64"):
        return pd.to_numeric(values).astype(dtype)
    return values.astype(dtype)
