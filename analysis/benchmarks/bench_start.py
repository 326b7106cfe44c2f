"""How long commands take to start, beside a bare `import numpy`."""

from pathlib import Path
import resource
import sqlite3
import subprocess
import sys
import tempfile
import time

import drake_affetto

_REFERENCE = "import numpy"

# What a command's help may take, s.
_HELP_LIMIT = 0.5
# When a study with warm caches should have its first trial, s.
_FIRST_TRIAL_LIMIT = 5.0
# What a study waits for its first trial at most: numba may have to compile.
_PATIENCE = 300.0


def _programs() -> dict[str, str]:
    """Python programs by the name under which they are shown."""
    package = Path(drake_affetto.__file__).parent
    rooms = sorted(face.parent.name for face in package.glob("*/__init__.py"))
    command = "from drake_affetto.cli.main import main; main({})"
    return {
        "affetto --help": command.format(["--help"]),
        "affetto drum --help": command.format(["drum", "--help"]),
        **{f"import {room}": f"import drake_affetto.{room}" for room in rooms},
        "AffettoStation": "from drake_affetto.station import AffettoStation",
        "a worker's imports": "import drake_affetto.experiments.trials",
    }


def cpu_time(program: str) -> float:
    """CPU seconds of a new Python that runs `program`."""

    def spent() -> float:
        usage = resource.getrusage(resource.RUSAGE_CHILDREN)
        return usage.ru_utime + usage.ru_stime

    begin = spent()
    subprocess.run(
        [sys.executable, "-c", program], check=True, stdout=subprocess.DEVNULL
    )
    return spent() - begin


def measure(programs: dict[str, str], repeats: int = 5) -> dict[str, float]:
    """The least CPU seconds of each program; they take turns."""
    least = dict.fromkeys(programs, float("inf"))
    for _ in range(repeats):
        for name, program in programs.items():
            least[name] = min(least[name], cpu_time(program))
    return least


def first_trial(workers: int = 2) -> float:
    """Seconds until `affetto drum` has stored its first trial."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "trials.sqlite"
        words = ["drum", "--workers", str(workers), "--out", folder]
        errors = Path(folder) / "errors.txt"
        begin = time.monotonic()
        with errors.open("w") as file:
            study = subprocess.Popen(
                [sys.executable, "-m", "drake_affetto.cli", *words],
                stdout=subprocess.DEVNULL,
                stderr=file,
            )
        try:
            while not _has_trial(path):
                ended = study.poll() is not None
                if ended or time.monotonic() - begin > _PATIENCE:
                    raise RuntimeError(f"no trial: {errors.read_text()}")
                time.sleep(0.02)
            return time.monotonic() - begin
        finally:
            # A shell that runs this in the background has it ignore SIGINT.
            study.terminate()
            study.wait()


def _has_trial(path: Path) -> bool:
    if not path.is_file():
        return False
    store = sqlite3.connect(f"file:{path}?mode=ro", uri=True)
    try:
        (count,) = store.execute("SELECT count(*) FROM trials").fetchone()
    except sqlite3.Error:
        # The study is about to make the table.
        return False
    finally:
        store.close()
    return count > 0


def imports() -> None:
    """Prints the times of helps and imports."""
    programs = {_REFERENCE: _REFERENCE} | _programs()
    least = measure(programs)
    for name, seconds in least.items():
        text = f"{name:<24}{seconds:6.2f} s"
        if name != _REFERENCE:
            text += f"  ({seconds / least[_REFERENCE]:5.2f} × import numpy)"
        if name.endswith("--help"):
            text += f"; at most {_HELP_LIMIT} s is wanted"
        print(text)


def run() -> None:
    """Prints the times of helps, imports and a study's first trial."""
    imports()
    first_trial()  # Fills numba's cache.
    seconds = min(first_trial() for _ in range(3))
    print(
        f"{'first trial of a study':<24}{seconds:6.2f} s  (time that passes, "
        f"2 workers; at most {_FIRST_TRIAL_LIMIT:g} s is wanted)"
    )


if __name__ == "__main__":
    run()
