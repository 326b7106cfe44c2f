"""A log of the wire as CSV, in the columns of the robot's own library."""

from collections.abc import Sequence
from pathlib import Path
from types import TracebackType

from drake_affetto.common.errors import InputError
from drake_affetto.common.typing import Array


class WireRecording:
    """Writes a row a tick; what was written outlives a killed process.

    Columns: t, s; rq, rpa, rpb of each joint, %, kPa gauge; ca, cb of each
    joint, 0..255. The reference is the client's own and never on the wire.
    """

    def __init__(self, path: str | Path, num_joints: int):
        """Begins the file.

        Args:
            num_joints: Number of joints, n.

        Raises:
            InputError: If it cannot be written.
        """
        self._path, self._n = Path(path), num_joints
        try:
            # A line is handed to the system as it is finished.
            self._file = self._path.open("w", encoding="ascii", buffering=1)
        except OSError as error:
            raise InputError(
                f"cannot write {path}: {error.strerror}"
            ) from error
        names = ["rq", "rpa", "rpb", "ca", "cb"]
        header = [f"{name}{k}" for name in names for k in range(num_joints)]
        self._file.write(",".join(["t", *header]) + "\n")

    def add(self, time: float, sensors: Array, levels: Sequence[float]) -> None:
        """Adds a row.

        Args:
            time: Time, s.
            sensors: q pa pb of each joint (3n,).
            levels: ca cb of each joint (2n,).
        """
        row = [f"{time:.4f}"]
        row += [f"{x:.1f}" for c in range(3) for x in sensors[c::3]]
        row += [f"{x:.6g}" for c in range(2) for x in levels[c::2]]
        try:
            self._file.write(",".join(row) + "\n")
        except OSError as error:
            raise InputError(
                f"cannot write {self._path}: {error.strerror}"
            ) from error

    def __enter__(self) -> "WireRecording":
        """Returns the recording itself."""
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        """Closes the file."""
        self._file.close()
