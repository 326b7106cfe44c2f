"""What the figures of studies share: reading the results, writing the file."""

import argparse
from collections.abc import Callable, Sequence
import json
from pathlib import Path
import sys
from typing import Any

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt

from drake_affetto.common.errors import InputError
from drake_affetto.common.output import atomic_path, prepare_output


def load_results(folder: str | Path, studies: Sequence[str]) -> dict[str, Any]:
    """The results that a study left in its folder.

    Args:
        folder: Folder that holds the results.json.
        studies: Kinds of study that are accepted.

    Raises:
        InputError: If there is no such file, or it is of another study.
    """
    path = Path(folder) / "results.json"
    if not path.is_file():
        raise InputError(f"no such file: {path}")
    results = json.loads(path.read_text())
    if results.get("study") not in studies:
        raise InputError(
            f"{path} is of study {results.get('study')!r}, expected "
            + " or ".join(map(repr, studies))
        )
    return results


def save(figure: plt.Figure, out: Path, name: str) -> None:
    """Writes `figure` to out/name.png and prints the path."""
    with atomic_path(out / f"{name}.png") as fresh:
        figure.savefig(fresh, dpi=130)
    print(out / f"{name}.png")


def run(
    name: str,
    description: str,
    studies: Sequence[str],
    draw: Callable[[dict[str, Any]], plt.Figure],
) -> int:
    """Draws one study's figure as a command; returns the exit code.

    Args:
        name: Name of the figure's file, without its ending.
        description: First line of the command's help.
        studies: Kinds of study that the figure shows; the first one's name
            is the default folder in out/.
        draw: Makes the figure from the results.
    """
    parser = argparse.ArgumentParser(description=description)
    default = f"out/{studies[0]}"
    parser.add_argument("--results", metavar="DIR", default=default)
    parser.add_argument("--out", metavar="DIR", default=default)
    args = parser.parse_args()
    try:
        results = load_results(args.results, studies)
        out = prepare_output(args.out)
    except InputError as error:
        print(f"{name}: {error}", file=sys.stderr)
        return 2
    save(draw(results), out, name)
    return 0
