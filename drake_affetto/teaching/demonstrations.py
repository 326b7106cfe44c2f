"""Demonstrations and the HDF5 file that keeps them.

The file is HDF5. Its root carries the attributes `format`, `format_version`
and `about`; each demonstration is a group `demonstrations/000000`, ... with

- datasets `t` (T,) and `q` (T, n), and where they exist `theta` (n K,),
  `task_parameter` (d,), `prototype` (bands, frames) and `drum_xy` (2,), each
  with a checksum and the attributes `unit` and `about`;
- attributes `joint_names` (n), `attempt`, `teacher`, `scenario`, `version`,
  `content`, and where they exist `seed`, `reward` and `max_pull`, N.

A demonstration is added to a copy, which then replaces the file. If the
process is killed at any moment, only the demonstration that it was writing is
lost.
"""

from collections.abc import Iterable, Iterator, Mapping, Sequence
import contextlib
import dataclasses
import fcntl
import json
import os
from pathlib import Path
import re
import shutil
from typing import Any

import h5py
import numpy as np

import drake_affetto
from drake_affetto.common.csv_columns import read_columns
from drake_affetto.common.errors import (
    InputError,
    naming,
    require,
    require_array,
    require_file,
)
from drake_affetto.common.log_limits import (
    load_limits,
    require_between,
    require_times,
)
from drake_affetto.common.output import atomic_path, write_target
from drake_affetto.common.stored_size import greatest_size
from drake_affetto.common.typing import Array

FORMAT = "drake_affetto demonstrations"
FORMAT_VERSION = 2

ROBOT_LOG_JOINTS = (
    "waist_yaw",
    *(
        f"{side}_{joint}"
        for side in ("left", "right")
        for joint in (
            "shoulder_elevation",
            "shoulder_abduction",
            "shoulder_flexion",
            "elbow_rotation",
            "elbow_flexion",
            "wrist_supination",
        )
    ),
)
"""The joints of the 13-DOF robot in the order of its logs: q0, q1, ..."""

# What h5py raises for a damaged file.
_DAMAGE = (
    AttributeError,
    KeyError,
    MemoryError,
    OSError,
    OverflowError,
    RuntimeError,
    TypeError,
    ValueError,
)

# Unit and meaning of each array of `Demonstration`, as written to the file.
_ARRAYS = {
    "t": ("s", "time of each sample"),
    "q": ("rad", "joint angles, a column for each of joint_names"),
    "drum_xy": ("m", "the drum on the table, world frame"),
    "theta": ("1", "movement primitive that was encoded from q"),
    "task_parameter": ("1", "task parameter as the camera saw it"),
    "prototype": ("1", "spectrogram of the replay's sound, bands by frames"),
}


@dataclasses.dataclass(eq=False)
class Demonstration:
    """One demonstrated movement, and the outcome of its replay.

    Attributes:
        t: Times (T,), rising, s.
        q: Joint angles (T, n), rad.
        joint_names: Names of the n joints.
        drum_xy: Position of the drum on the table (2,), world frame, m.
        seed: Seed of everything that is random in it.
        attempt: Number of earlier attempts at the same position.
        theta: Policy parameters (n K,), encoded from `q`.
        task_parameter: Task parameter (d,), if the gaze found the drum.
        reward: Reward of the robot's own replay.
        prototype: Spectrogram of that replay's sound (bands, frames).
        max_pull: Greatest force of the teacher, N.
        teacher: Kind of teacher: "simulated", "by mouse", or other text.
        scenario: Name of the scenario, or of the log that it comes from.
        version: Version of this package that made it.
        content: Digests of what made it: the scenario's values and files, see
            `station.content`. Empty in files of version 0.1.0.

    Raises:
        InputError: If arrays do not fit each other, times do not rise, or
            numbers are not finite.
    """

    t: Array
    q: Array
    joint_names: tuple[str, ...]
    drum_xy: Array | None = None
    seed: int | None = None
    attempt: int = 0
    theta: Array | None = None
    task_parameter: Array | None = None
    reward: float | None = None
    prototype: Array | None = None
    max_pull: float | None = None
    teacher: str = ""
    scenario: str = ""
    version: str = drake_affetto.__version__
    content: dict[str, str] = dataclasses.field(default_factory=dict)

    def __post_init__(self):
        self.joint_names = tuple(str(name) for name in self.joint_names)
        self._array("t", 1)
        self._array("q", 2)
        self._array("drum_xy", 1)
        self._array("theta", 1)
        self._array("task_parameter", 1)
        self._array("prototype", 2)
        require(len(self.t) >= 2, "t", f"{len(self.t)} samples", "at least 2")
        require(
            bool(np.all(np.diff(self.t) > 0.0)),
            "t",
            "times that do not rise",
            "rising times",
        )
        expected = (len(self.t), len(self.joint_names))
        require(
            self.q.shape == expected,
            "q",
            f"an array of shape {self.q.shape}",
            f"shape {expected}: times by joints",
        )
        if self.drum_xy is not None:
            require(
                self.drum_xy.shape == (2,),
                "drum_xy",
                f"an array of shape {self.drum_xy.shape}",
                "x and y",
            )
        if self.seed is not None:
            self.seed = int(self.seed)
            require(0 <= self.seed < 2**63, "seed", self.seed, "0 to 2^63 - 1")
        self.attempt = int(self.attempt)
        require(self.attempt >= 0, "attempt", self.attempt, "at least 0")
        for field in ("reward", "max_pull"):
            value = getattr(self, field)
            if value is not None:
                require(
                    bool(np.isfinite(value)), field, value, "a finite number"
                )
                setattr(self, field, float(value))

    def _array(self, field: str, dimensions: int) -> None:
        """Makes the field an array of its own, of floats."""
        value = getattr(self, field)
        if value is None and field not in ("t", "q"):
            return
        shape = (None,) * dimensions
        setattr(self, field, require_array(field, value, shape).copy())


def append_demonstration(
    path: str | Path,
    demonstration: Demonstration,
    expected: int | None = None,
) -> int:
    """Adds a demonstration to a file; creates the file if there is none.

    Several processes may add to one file.

    Args:
        path: The file.
        demonstration: What is added.
        expected: How many demonstrations the file is known to hold; None if
            it does not matter.

    Returns:
        Number of demonstrations that the file holds now.

    Raises:
        InputError: If the file is not one of demonstrations, is damaged or
            cannot be written, or holds another number of demonstrations than
            expected. Then it is not changed.
    """
    path = write_target(path)
    with _only_writer(path), atomic_path(path) as fresh:
        if path.exists():
            shutil.copyfile(path, fresh)
        # Damage shows while the copy is read and added to, not in the file.
        with _opened(fresh, "r+" if fresh.exists() else "x", path) as file:
            try:
                group = file.require_group("demonstrations")
                number = len(group)
                if expected is not None and number != expected:
                    raise InputError(
                        f"another process, too, adds to {path}: it holds "
                        f"{number} demonstrations, expected {expected}"
                    )
                _write(group.create_group(f"{number:06d}"), demonstration)
            except InputError:
                raise
            except _DAMAGE as error:
                raise InputError(
                    f"cannot add to {path}: {_short(error)}"
                ) from error
        _to_disk(fresh)
    return number + 1


def write_demonstrations(
    path: str | Path, demonstrations: Iterable[Demonstration]
) -> None:
    """Writes a file of exactly these demonstrations, whole or not at all.

    Args:
        demonstrations: What the file is to hold.

    Raises:
        InputError: If it cannot be written.
    """
    path = write_target(path)
    with _only_writer(path), atomic_path(path) as fresh:
        with _opened(fresh, "x", path) as file:
            group = file.require_group("demonstrations")
            for number, demonstration in enumerate(demonstrations):
                _write(group.create_group(f"{number:06d}"), demonstration)
        _to_disk(fresh)


def _to_disk(path: Path) -> None:
    with path.open("rb") as file:
        os.fsync(file.fileno())


def read_demonstrations(path: str | Path) -> list[Demonstration]:
    """All demonstrations of a file, in the order in which they were added.

    Raises:
        InputError: If there is no such file, or it is not one of
            demonstrations, was written by a newer version of this package, or
            is damaged.
    """
    path = require_file("demonstrations", path)
    with _opened(path) as file:
        where = str(path)
        try:
            demonstrations = []
            group = file["demonstrations"]
            for number, name in enumerate(sorted(group)):
                require(
                    name == f"{number:06d}",
                    f"demonstration {number:06d}",
                    "missing",
                    f"all numbers up to {len(group) - 1:06d}",
                )
                where = f"{path}: demonstration {name}"
                demonstrations.append(_read(group[name]))
            return demonstrations
        except InputError as error:
            raise InputError(f"{where}: {error}") from error
        except _DAMAGE as error:
            raise InputError(f"{where} is damaged: {_short(error)}") from error


def from_robot_csv(
    path: str | Path,
    limits: Mapping[str, tuple[float, float]],
    *,
    joints: Sequence[str] = ROBOT_LOG_JOINTS,
    drum_xy: Sequence[float] | None = None,
) -> Demonstration:
    """Converts a log of the robot's own library.

    Column `t` is the time in seconds. Columns `q0`, `q1`, ... are the measured
    angles in percent of each joint's range. The demonstration's time starts
    at 0.

    Args:
        path: The CSV file.
        limits: Lower and upper limit of each wanted joint, rad, by name. The
            demonstration has the joints in this order.
        joints: Names of the log's joints, for q0, q1, ...
        drum_xy: Position of the drum (2,), if it is known, m.

    Raises:
        InputError: If the file or a column is missing, a cell is not a number,
            times do not rise, a joint is unknown, or limits are in the wrong
            order.
    """
    path = require_file("log", path)
    require(len(limits) > 0, "limits", limits, "at least one joint")
    columns = ["t"]
    for name, (lower, upper) in limits.items():
        require(name in joints, "limits", name, f"one of {', '.join(joints)}")
        require(
            bool(np.isfinite([lower, upper]).all()) and lower < upper,
            f"limits of {name}",
            (lower, upper),
            "a lower and a higher angle",
        )
        columns.append(f"q{list(joints).index(name)}")
    data = read_columns(path, columns)
    possible = load_limits()
    low, high = possible.angle
    require_times(path, data["t"], possible)
    for column in columns[1:]:
        require_between(path, column, data, low, high, "% of the range")
    table = np.stack(list(data.values()), axis=1)
    lower, upper = np.array([tuple(pair) for pair in limits.values()]).T
    with naming(str(path)):
        return Demonstration(
            t=table[:, 0] - table[0, 0],
            q=lower + table[:, 1:] / 100.0 * (upper - lower),
            joint_names=tuple(limits),
            drum_xy=None if drum_xy is None else np.asarray(drum_xy),
            scenario=path.name,
        )


@contextlib.contextmanager
def _opened(
    file_path: Path, mode: str = "r", name: Path | None = None
) -> Iterator[h5py.File]:
    """Opens a file and checks that it is one of demonstrations.

    Args:
        file_path: The file.
        mode: Mode of h5py; "x" creates the file.
        name: Name in error messages, for a temporary copy.
    """
    path = name or file_path
    try:
        # The format with checksums over its own structure.
        file = h5py.File(file_path, mode, libver=("v110", "v110"))
    except OSError as error:
        text = str(error)
        if "truncated" in text:
            what = "is truncated"
        elif "signature" in text:
            what = "is no HDF5 file"
        else:
            what = f"cannot be opened: {_short(error)}"
        raise InputError(f"{path} {what}") from error
    with file:
        if mode == "x":
            file.attrs["format"] = _packed(FORMAT)
            file.attrs["format_version"] = FORMAT_VERSION
            file.attrs["about"] = _packed(
                "Movements taught to a drumming robot by hand. Each group of "
                "/demonstrations is one; its datasets name their units."
            )
        try:
            found = _text(file.attrs.get("format", ""))
            version = int(file.attrs.get("format_version", 0))
        except _DAMAGE as error:
            raise InputError(f"{path} is damaged: {_short(error)}") from error
        if found != FORMAT:
            raise InputError(f"{path} is not a file of demonstrations")
        if not 1 <= version <= FORMAT_VERSION:
            raise InputError(
                f"{path} has format version {version}, which this version of "
                f"drake_affetto does not know (it knows {FORMAT_VERSION})"
            )
        yield file


def _write(group: h5py.Group, demonstration: Demonstration) -> None:
    for field, (unit, about) in _ARRAYS.items():
        value = getattr(demonstration, field)
        if value is None:
            continue
        dataset = group.create_dataset(
            field,
            data=value,
            chunks=value.shape if value.size else None,
            fletcher32=value.size > 0,
        )
        dataset.attrs["unit"] = _packed(unit)
        dataset.attrs["about"] = _packed(about)
    group.attrs["joint_names"] = _packed(demonstration.joint_names)
    for field in (
        "seed",
        "attempt",
        "reward",
        "max_pull",
        "teacher",
        "scenario",
        "version",
    ):
        value = getattr(demonstration, field)
        if value is not None:
            text = isinstance(value, str)
            group.attrs[field] = _packed(value) if text else value
    if demonstration.content:
        group.attrs["content"] = _packed(json.dumps(demonstration.content))


def _read(group: h5py.Group) -> Demonstration:
    arrays: dict[str, Any] = {
        field: _array(group, field) if field in group else None
        for field in _ARRAYS
    }
    attributes = group.attrs
    seed = attributes.get("seed")
    reward, max_pull = (
        float(attributes[field]) if field in attributes else None
        for field in ("reward", "max_pull")
    )
    return Demonstration(
        **arrays,
        joint_names=tuple(map(_text, attributes["joint_names"])),
        seed=None if seed is None else int(seed),
        attempt=int(attributes["attempt"]),
        reward=reward,
        max_pull=max_pull,
        # Files of earlier versions do not have it.
        teacher=_text(attributes.get("teacher", "")),
        scenario=_text(attributes["scenario"]),
        version=_text(attributes["version"]),
        content=_content(_text(attributes.get("content", "{}"))),
    )


def _array(group: h5py.Group, field: str) -> Any:
    """A dataset's content; not if it declares what it cannot hold."""
    dataset = group[field]
    require(
        isinstance(dataset, h5py.Dataset), field, type(dataset), "a dataset"
    )
    size = dataset.size * dataset.dtype.itemsize if dataset.shape else 0
    room = greatest_size(dataset.id.get_storage_size())
    require(
        size <= room,
        field,
        f"an array of shape {dataset.shape}",
        f"at most {room} bytes, by what is stored of it",
    )
    return dataset[()]


def _packed(text: str | Sequence[str]) -> Any:
    """Text, or several, of fixed length.

    HDF5 keeps others apart, without a checksum, and reads on for ever where
    they are damaged.
    """
    several = [text] if isinstance(text, str) else list(text)
    data = [each.encode() for each in several]
    length = max(1, *(len(each) for each in data))
    packed = np.array(data, h5py.string_dtype("utf-8", length))
    return packed[0] if isinstance(text, str) else packed


def _text(value: Any) -> str:
    """Text of an attribute; files of version 0.1.0 have it as such."""
    return value.decode() if isinstance(value, bytes) else str(value)


def _content(text: str) -> dict[str, str]:
    content = json.loads(text)
    require(isinstance(content, dict), "content", content, "an object")
    return {str(name): str(each) for name, each in content.items()}


@contextlib.contextmanager
def _only_writer(path: Path) -> Iterator[None]:
    """Locks the folder against other writers, and removes their leftovers.

    The operating system releases the lock when the process ends, even if it is
    killed. Then a hidden copy remains beside the file, which the next writer
    removes.
    """
    try:
        folder = os.open(path.parent, os.O_RDONLY)
    except OSError as error:
        raise InputError(f"cannot write {path}: {error.strerror}") from error
    try:
        fcntl.flock(folder, fcntl.LOCK_EX)
        left_over = re.compile(
            rf"\.{re.escape(path.stem[:100])}\.[0-9a-f]{{8}}"
            rf"{re.escape(path.suffix)}"
        )
        for name in os.listdir(folder):
            if left_over.fullmatch(name):
                with contextlib.suppress(OSError):
                    os.unlink(name, dir_fd=folder)
        yield
    finally:
        os.close(folder)


def _short(error: Exception) -> str:
    """The first line of an error message, without quotation marks."""
    strerror = getattr(error, "strerror", None)
    lines = str(strerror or error).splitlines() or [type(error).__name__]
    return lines[0].strip("'\"")
