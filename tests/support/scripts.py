"""Runs the scripts of analysis/ as a reader would."""

from pathlib import Path
import subprocess
import sys

ANALYSIS = Path(__file__).parents[2] / "analysis"


def run(script, *words):
    """Runs analysis/`script` in the root of the checkout."""
    return subprocess.run(
        [sys.executable, str(ANALYSIS / script), *map(str, words)],
        capture_output=True,
        text=True,
        timeout=300,
        cwd=ANALYSIS.parent,
    )
