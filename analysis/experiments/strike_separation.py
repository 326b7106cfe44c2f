"""Does R > 0.15 tell the head's hits from strikes aimed elsewhere? A curve.

    python analysis/experiments/strike_separation.py [--strikes 2100]
        [--seed 0] [--workers 1] [--out out/strikes]

Strikes at head, rim, shell, table and beside, with the robot and the drum of a
scenario. Goes on where it was interrupted. Prints a table and writes
results.json and separation.png.
"""

import argparse
from collections.abc import Sequence
from pathlib import Path
import sys

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np
from rich.console import Console
from rich.table import Table

from drake_affetto.common.errors import InputError, require_range
from drake_affetto.common.output import (
    atomic_path,
    prepare_output,
    write_json,
)
from drake_affetto.common.typing import Array
from drake_affetto.experiments.strike_separation import (
    AIMS,
    Count,
    count,
    hear,
    run_separation_trial,
    run_strikes,
)
from drake_affetto.runner import TrialExecutor, TrialStore
from drake_affetto.sound.config import load_sound_config
from drake_affetto.station.scenario import load_scenario


def table(counts: Sequence[Count]) -> Table:
    """The counts of each aim and of all."""
    shown = Table(title="strikes, and what was heard of them")
    for head in (
        "aim",
        "strikes",
        "head hit",
        "missed",
        "least R",
        "head untouched",
        "false",
        "greatest R",
    ):
        shown.add_column(head, justify="right")
    for each in counts:
        shown.add_row(
            each.aim,
            str(each.strikes),
            str(each.hits),
            str(each.missed),
            "" if each.least is None else f"{each.least:.3f}",
            str(each.untouched),
            str(each.false),
            "" if each.greatest is None else f"{each.greatest:.3f}",
        )
    return shown


def draw(
    path: Path, rewards: Array, impulse: Array, hit: float, threshold: float
) -> None:
    """Shares of missed and false hits over the threshold, and R by impulse."""
    struck, none = rewards[impulse > hit], rewards[impulse <= 0.0]
    figure, (left, right) = plt.subplots(
        1, 2, figsize=(11, 4.2), layout="constrained"
    )
    steps = np.linspace(-0.05, 0.6, 600)
    for values, above, name in (
        (struck, False, f"missed, of {struck.size} hits"),
        (none, True, f"false, of {none.size} that left the head alone"),
    ):
        shares = [
            np.mean(values > s) if above else np.mean(values <= s)
            for s in steps
        ]
        left.plot(steps, 1e3 * np.array(shares), label=name)
    left.axvline(threshold, color="k", linestyle="--", linewidth=1)
    left.axhline(1.0, color="0.6", linewidth=1)
    left.set_yscale("symlog", linthresh=1.0)
    left.set_ylim(0.0, 1100.0)
    left.set_xlabel("threshold of R")
    left.set_ylabel("of 1,000")
    left.legend(fontsize=8)
    shown = np.maximum(impulse, 3e-5)
    right.semilogx(shown, rewards, ".", markersize=3)
    right.axvline(hit, color="0.6", linewidth=1)
    right.axhline(threshold, color="k", linestyle="--", linewidth=1)
    right.set_xlabel("impulse on the head [N s]; left end: none")
    right.set_ylabel("reward R")
    with atomic_path(path) as fresh:
        figure.savefig(fresh, dpi=130)
    plt.close(figure)


def main() -> int:
    """Runs the study."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--strikes", type=int, default=2100)
    parser.add_argument("--scenario", default="drumming")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--workers", type=int, default=1)
    parser.add_argument("--out", type=Path, default=Path("out/strikes"))
    args = parser.parse_args()
    try:
        require_range("--strikes", args.strikes, 150, 1_000_000)
        require_range("--workers", args.workers, 0, 1000)
        sound = load_sound_config(load_scenario(args.scenario).sound)
        out = prepare_output(args.out)
        with TrialExecutor(
            run_separation_trial,
            TrialStore(out / "trials.sqlite"),
            workers=args.workers,
        ) as executor:
            outcomes = run_strikes(
                executor,
                strikes=args.strikes,
                scenario=args.scenario,
                seed=args.seed,
            )
    except InputError as error:
        print(f"strike_separation: {error}", file=sys.stderr)
        return 2
    except KeyboardInterrupt:
        return 130
    rewards = hear(outcomes, sound, seed=args.seed)
    judged = np.isfinite(rewards)
    aims = np.array([name for name, _ in outcomes])[judged]
    impulse = np.array([r["impulse"] for _, (r, _) in outcomes])[judged]
    rewards = rewards[judged]
    threshold = sound.reward.threshold
    counts = [
        count(
            name,
            rewards[chosen],
            impulse[chosen],
            sound.hit_impulse,
            threshold,
        )
        for name, chosen in (
            *((name, aims == name) for name in AIMS),
            ("all", np.ones(aims.size, dtype=bool)),
        )
    ]
    draw(out / "separation.png", rewards, impulse, sound.hit_impulse, threshold)
    write_json(
        out / "results.json",
        {"seed": args.seed, "threshold": threshold, "counts": counts},
    )
    Console(width=100).print(table(counts))
    return 0


if __name__ == "__main__":
    sys.exit(main())
