"""SQLite files that are only read, also where nothing can be written."""

from pathlib import Path
import shutil
import sqlite3
import tempfile


class ReadOnlyDatabase:
    """A connection that cannot write, and what it reads.

    SQLite writes beside a file of which it only reads. Where it cannot (a
    read-only disk), a copy elsewhere is read.

    Attributes:
        connection: The connection.
        path: File that it reads: the one asked for, or the copy.
    """

    def __init__(self, path: Path) -> None:
        """Opens the file.

        Args:
            path: The file, which another process may be writing.

        Raises:
            sqlite3.Error: If it cannot be read or is no such file.
            OSError: If it cannot be copied.
        """
        self.path = path
        self._folder: tempfile.TemporaryDirectory | None = None
        self.connection = _connect(path)
        try:
            self.connection.execute("SELECT 1 FROM sqlite_master")
        except sqlite3.OperationalError as error:
            self.connection.close()
            cannot_open = error.sqlite_errorcode == sqlite3.SQLITE_CANTOPEN
            if not (cannot_open and path.is_file()):
                raise
            self._folder = tempfile.TemporaryDirectory()
            self.path = Path(self._folder.name) / path.name
            # With what is written, but not in the file itself yet.
            for suffix in ("", "-wal"):
                if suffix == "" or Path(f"{path}{suffix}").exists():
                    shutil.copyfile(f"{path}{suffix}", f"{self.path}{suffix}")
            self.connection = _connect(self.path)

    def close(self) -> None:
        """Closes the file, and removes the copy if there is one."""
        self.connection.close()
        if self._folder is not None:
            self._folder.cleanup()


def _connect(path: Path) -> sqlite3.Connection:
    uri = f"{path.resolve().as_uri()}?mode=ro"
    return sqlite3.connect(uri, timeout=30.0, uri=True)
