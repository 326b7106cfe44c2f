"""Installs the project into a virtual environment of its own.

Run by `setup_env.sh`, which finds the interpreter and sets the environment
variables read here. Uses the standard library alone.
"""

import collections
import ctypes
import fcntl
import hashlib
import importlib.util
import os
from pathlib import Path
import subprocess
import sys
import time
from typing import IO, NoReturn
import venv

ROOT = Path(__file__).resolve().parents[1]
VENV = Path(os.path.abspath(ROOT / os.environ.get("AFFETTO_VENV", ".venv")))
EXTRAS = os.environ.get("AFFETTO_EXTRAS", "dev")
STAMP = VENV / "affetto-setup.stamp"
LOG = VENV / "affetto-setup.log"
SUPPORTED = ("3.11", "3.12", "3.13")
# What `import` must find before the environment counts as complete.
TOP_LEVEL = ("drake_affetto", "pydrake", "numpy")


def fail(message: str) -> NoReturn:
    print(f"setup: error: {message}", file=sys.stderr)
    raise SystemExit(1)


def say(message: str) -> None:
    print(f"setup: {message}", flush=True)


def wanted_stamp() -> str:
    """What the environment was made from; a difference calls for a set-up.

    The checkout's own place is part of it: an editable install points there.
    """
    digest = hashlib.sha256()
    for name in ("pyproject.toml", "constraints.txt"):
        digest.update((ROOT / name).read_bytes())
    return f"{digest.hexdigest()} [{EXTRAS}] {ROOT} {VENV}\n"


def stamp_is_current() -> bool:
    try:
        return STAMP.read_text(encoding="utf-8") == wanted_stamp()
    except (OSError, UnicodeDecodeError):
        return False


def is_current() -> bool:
    """Whether this interpreter's environment needs nothing."""
    return stamp_is_current() and all(
        importlib.util.find_spec(name) is not None for name in TOP_LEVEL
    )


def check_libraries() -> None:
    """The cameras render through EGL, which no Python package brings along."""
    if not sys.platform.startswith("linux"):
        return
    try:
        ctypes.CDLL("libEGL.so.1")
    except OSError:
        fail(
            "the cameras need the EGL library libEGL.so.1, which was not "
            "found; install it, on Debian and Ubuntu by: apt install libegl1"
        )


def environment_is_sound() -> bool:
    """Whether VENV holds a working, supported Python that still fits there."""
    try:
        version = subprocess.run(
            [
                VENV / "bin/python",
                "-I",
                "-c",
                "import pip, sys; print('%d.%d' % sys.version_info[:2])",
            ],
            stdin=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            text=True,
            check=True,
        ).stdout.strip()
        # A moved environment's scripts still call the place it stood at.
        script = (VENV / "bin/pip").read_bytes()[:1000]
    except (OSError, subprocess.CalledProcessError):
        return False
    if os.environ.get("AFFETTO_PYTHON"):
        here = f"{sys.version_info[0]}.{sys.version_info[1]}"
        if version != here:
            return False
    return version in SUPPORTED and any(
        os.fsencode(place / "bin") in script for place in (VENV, VENV.resolve())
    )


def make_environment() -> None:
    if environment_is_sound():
        return
    foreign = VENV.exists() and not (VENV / "pyvenv.cfg").exists()
    if foreign and (not VENV.is_dir() or any(VENV.iterdir())):
        fail(f"{VENV} is no virtual environment; move it away")
    again = "again " if VENV.exists() else ""
    version = sys.version.split()[0]
    say(f"making {VENV.name} {again}with Python {version}")
    venv.create(VENV, clear=True, symlinks=True, with_pip=True)


def run_pip(log: IO[str], *what: str) -> None:
    """Installs `what` as pinned, with a sign of life and a log."""
    command = [str(VENV / "bin/python"), "-I", "-m", "pip", "install"]
    command += ["--no-input", "--no-user", "--no-compile"]
    command += ["--disable-pip-version-check", "--progress-bar=off"]
    command += ["--constraint", str(ROOT / "constraints.txt"), *what]
    last_lines: collections.deque[str] = collections.deque(maxlen=200)
    seen = 0
    process = subprocess.Popen(
        command,
        cwd=ROOT,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        errors="replace",
    )
    assert process.stdout is not None
    with process:
        for line in process.stdout:
            log.write(line)
            last_lines.append(line.strip())
            if line.startswith(("Collecting ", "Processing ")):
                seen += 1
                if seen % 20 == 0:
                    say(f"{seen} packages found")
            elif line.startswith("Installing collected packages") and seen > 20:
                say(f"{seen} packages found; writing them")
    if process.returncode != 0:
        errors = [text for text in last_lines if text.startswith("ERROR")]
        reason = [*errors[:1], *reversed(last_lines), "pip said nothing"][0]
        fail(f"pip could not install ({reason}); the whole log is {LOG}")


def install_packages() -> None:
    say("installing the packages that constraints.txt pins (about a minute)")
    target = f"{ROOT}[{EXTRAS}]" if EXTRAS else str(ROOT)
    with LOG.open("w", encoding="utf-8") as log:
        # The build tool comes first and is then used as it stands: pip would
        # otherwise take its newest release, for constraints do not reach there.
        run_pip(log, "hatchling")
        run_pip(log, "--no-build-isolation", "--editable", target)


def compile_packages() -> None:
    """Compiles on all cores what pip would have compiled on one."""
    say("compiling")
    subprocess.run(
        [str(VENV / "bin/python"), "-I", "-m", "compileall", "-q", "-j0"]
        + [str(path) for path in VENV.glob("lib/python3.*/site-packages")],
        stdin=subprocess.DEVNULL,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
        check=False,  # some packages carry templates that are no Python
    )


def install() -> None:
    check_libraries()
    began = time.monotonic()
    # One set-up at a time: others wait here, and then find it done.
    with (ROOT / "pyproject.toml").open("rb") as lock:
        try:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            say("another set-up is under way; waiting for it")
            fcntl.flock(lock, fcntl.LOCK_EX)
            if stamp_is_current() and environment_is_sound():
                return
        STAMP.unlink(missing_ok=True)
        make_environment()
        install_packages()
        compile_packages()
        fresh = STAMP.with_suffix(".tmp")
        fresh.write_text(wanted_stamp(), encoding="utf-8")
        fresh.replace(STAMP)
    say(f"{VENV.name} is ready after {time.monotonic() - began:.0f} s")


def main() -> None:
    command = sys.argv[1]
    try:
        if command == "is-current":
            raise SystemExit(0 if is_current() else 1)
        if command == "check-libraries":
            check_libraries()
        else:
            install()
    except KeyboardInterrupt:
        print("setup: interrupted", file=sys.stderr)
        raise SystemExit(130) from None
    except (OSError, subprocess.CalledProcessError) as error:
        fail(str(error))


if __name__ == "__main__":
    main()
