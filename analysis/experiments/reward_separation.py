"""Does R > 0.15 tell drum hits from everything else? ROC and histogram.

    python analysis/experiments/reward_separation.py [--count N]
        [--seed N] [--out DIR]

Makes up trials of every kind (`drake_affetto.sound.separation`), judges each
by the prototypes of 25 made-up demonstrations and by the experimenter's taps,
prints how they separate and writes `reward_separation.png`.
"""

import argparse
from pathlib import Path

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np

from drake_affetto.common.output import atomic_path, prepare_output
from drake_affetto.sound.config import load_sound_config
from drake_affetto.sound.reward import (
    cut_prototype,
    reward,
    spectrogram,
    tap_prototypes,
)
from drake_affetto.sound.separation import (
    HITS,
    KINDS,
    made_up_trial,
    made_up_trials,
    separation,
)
from drake_affetto.sound.voice import DrumVoice


def demonstrations(voice, config, taps, rng, count=25):
    """Prototypes of hits that the taps let count."""
    found = []
    while len(found) < count:
        sound = made_up_trial("head", voice, rng).pressure
        heard = spectrogram(sound, voice.rate, config)
        if reward(heard, taps) > config.threshold:
            found.append(cut_prototype(heard, config))
    return found


def draw(path, kinds, rewards, config):
    """Histogram by kind (left) and ROC (right)."""
    hits = np.isin(kinds, HITS)
    figure, (left, right) = plt.subplots(
        1, 2, figsize=(11, 4.2), width_ratios=[2, 1], layout="constrained"
    )
    colors = plt.colormaps["tab10"](np.arange(len(KINDS)))
    values = rewards["demonstrations"]
    left.hist(
        [values[kinds == kind] for kind in KINDS],
        bins=np.linspace(min(-0.1, values.min()), 1.0, 45),
        stacked=True,
        label=KINDS,
        color=colors,
    )
    left.axvline(config.threshold, color="k", linestyle="--", linewidth=1)
    left.set_yscale("symlog", linthresh=10)
    left.set_xlabel("reward R")
    left.set_ylabel("trials")
    left.set_title(f"25 demonstrations; dashed: R = {config.threshold:g}")
    left.legend(fontsize=8, loc="upper center", ncols=2)
    for name, values in rewards.items():
        steps = np.unique(np.append(values, [-np.inf, np.inf]))[::-1]
        false = [np.mean(values[~hits] > step) for step in steps]
        true = [np.mean(values[hits] > step) for step in steps]
        auc = separation(values, hits).auc
        (line,) = right.plot(false, true, label=f"{name}: AUC {auc:.4f}")
        right.plot(
            np.mean(values[~hits] > config.threshold),
            np.mean(values[hits] > config.threshold),
            "o",
            color=line.get_color(),
        )
    right.set_xlim(-0.003, 0.1)
    right.set_ylim(0.9, 1.003)
    right.set_xlabel("share of other trials above")
    right.set_ylabel("share of hits above")
    right.set_title(f"ROC, a corner of it; dots: R = {config.threshold:g}")
    right.legend(fontsize=8, loc="lower right")
    with atomic_path(path) as fresh:
        figure.savefig(fresh, dpi=130)
    plt.close(figure)


def main():
    """Runs the study."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--count", type=int, default=100, help="of each kind")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--out", type=Path, default=Path("out/separation"))
    arguments = parser.parse_args()
    out = prepare_output(arguments.out)
    settings = load_sound_config()
    config = settings.reward
    voice = DrumVoice(settings.voice)
    rng = np.random.default_rng(arguments.seed)
    taps = tap_prototypes(voice, config)
    prototypes = {
        "demonstrations": demonstrations(voice, config, taps, rng),
        "taps": taps,
    }
    kinds = []
    rewards = {name: [] for name in prototypes}
    for trial in made_up_trials(voice, rng, arguments.count):
        kinds.append(trial.kind)
        heard = spectrogram(trial.pressure, voice.rate, config)
        for name, chosen in prototypes.items():
            rewards[name].append(reward(heard, chosen))
    kinds = np.array(kinds)
    rewards = {name: np.array(values) for name, values in rewards.items()}
    for name, values in rewards.items():
        result = separation(values, np.isin(kinds, HITS), config.threshold)
        print(
            f"{name}: AUC {result.auc:.5f}; at R > {config.threshold:g} "
            f"{result.false_hits} of {result.others} others count as hits, "
            f"{result.missed_hits} of {result.hits} hits are missed"
        )
        for kind in KINDS:
            low, mid, high = np.percentile(values[kinds == kind], [0, 50, 100])
            above = int(np.sum(values[kinds == kind] > config.threshold))
            print(
                f"  {kind:13s} R {low:6.3f} {mid:6.3f} {high:6.3f}"
                f"  above {above:3d} of {np.sum(kinds == kind)}"
            )
    path = out / "reward_separation.png"
    draw(path, kinds, rewards, config)
    print(f"figure: {path}")


if __name__ == "__main__":
    main()
