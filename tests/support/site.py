"""The documentation's sources, to build elsewhere."""

import os
from pathlib import Path
import shutil
import subprocess
import sys

ROOT = Path(__file__).parents[2]
EXTENSIONS = ROOT / "docs/extensions"


def copy_sources(folder: Path) -> Path:
    """A tree in which the site can be built without touching the checkout."""
    folder.mkdir()
    shutil.copytree(
        ROOT / "docs",
        folder / "docs",
        ignore=shutil.ignore_patterns("tutorials", "rooms", "__pycache__"),
    )
    for name in ("drake_affetto", "models"):
        (folder / name).symlink_to(ROOT / name)
    for name in ("CHANGELOG.md", "CONTRIBUTING.md"):
        shutil.copy(ROOT / name, folder / name)
    shutil.copytree(
        ROOT / "analysis/tutorials",
        folder / "analysis/tutorials",
        ignore=shutil.ignore_patterns("__pycache__"),
    )
    return folder


def build(
    folder: Path, tutorials: str, *words: str
) -> subprocess.CompletedProcess[str]:
    """Builds the site of a copy into its out/docs, as `make docs` does.

    Args:
        folder: As `copy_sources` gives it.
        tutorials: Names of those that are run, joined by commas.
        words: Further words of the command.
    """
    command = [sys.executable, "-m", "sphinx", "-W", "--keep-going"]
    command += ["-b", "html", "-d", "out/docs-work/doctrees", *words]
    return subprocess.run(
        [*command, "docs", "out/docs"],
        cwd=folder,
        env=os.environ | {"AFFETTO_DOCS_TUTORIALS": tutorials},
        capture_output=True,
        text=True,
        timeout=600,
    )
