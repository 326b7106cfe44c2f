"""Does the reward hear what happened? Made-up trials and how they separate.

The trials of `made_up_trials` come from one-dimensional impacts with a wide
variety of hands, strokes and places, not from the robot: they ask whether
the sound alone tells a hit on the head from everything else that happens
at a drum.
"""

from collections.abc import Iterator
import dataclasses

import numpy as np
from numpy.typing import ArrayLike
from scipy import stats

from drake_affetto.common.errors import require
from drake_affetto.common.typing import Array
from drake_affetto.sound import impact
from drake_affetto.sound.reward import SUCCESS_THRESHOLD
from drake_affetto.sound.voice import DrumVoice

HITS = ("head", "head and rim")
OTHERS = (
    "silence",
    "miss",
    "slow press",
    "shell, soft",
    "shell, hard",
    "table, soft",
    "table, hard",
)
KINDS = HITS + OTHERS


@dataclasses.dataclass
class Trial:
    """One made-up trial."""

    kind: str
    impulse: float
    """Impulse on the head, N s."""
    rate_of_force: float
    """Fastest change of the force on the head, N/s."""
    pressure: Array
    """The recording, Pa."""


def random_hand(rng: np.random.Generator, hard: bool = False) -> impact.Hand:
    """A rubber hand, or (hard) a forearm that knocks without rubber."""
    return impact.Hand(
        mass=rng.uniform(0.2, 0.6),
        arm_stiffness=rng.uniform(100.0, 400.0),
        arm_damping=rng.uniform(6.0, 18.0),
        stiffness=rng.uniform(5e3, 2e4) if hard else rng.uniform(400, 800),
        dissipation=rng.uniform(0.5, 1.5) if hard else rng.uniform(1, 2),
    )


def random_mass_flow(
    t: Array, rng: np.random.Generator, valves: int = 16
) -> Array:
    """Flow through the valves (T, valves), kg/s: leakage and movements."""
    knots = np.arange(t[0], t[-1] + 0.25, 0.15)
    opening = np.maximum(rng.normal(0.0, 1.0, (len(knots), valves)), 0.0)
    scale = rng.uniform(5e-5, 2e-4)
    flow = np.empty((len(t), valves))
    for i in range(valves):
        flow[:, i] = np.interp(t, knots, opening[:, i])
    return 5e-6 + scale * flow


def made_up_trial(
    kind: str,
    voice: DrumVoice,
    rng: np.random.Generator,
    duration: float = 3.5,
) -> Trial:
    """One random trial of a kind out of `KINDS`."""
    require(kind in KINDS, "kind", kind, f"one of {KINDS}")
    t = np.arange(0.0, duration, 1e-3)
    depth = rng.uniform(0.003, 0.03)
    fall = rng.uniform(0.3, 0.7)
    dwell = rng.uniform(0.0, 0.35)
    if kind == "miss":
        depth = -rng.uniform(0.02, 0.06)
    elif kind == "slow press":
        depth, fall, dwell = rng.uniform(0.003, 0.012), 6.0, 0.0
    path = impact.stroke(
        t,
        rng.uniform(0.2, 1.2),
        rng.uniform(0.04, 0.15),
        depth,
        fall,
        dwell,
        rng.uniform(0.3, 0.8),
    )
    if kind == "slow press":
        # Led down from just above the head, at millimeters a second.
        path = np.interp(
            t, [0.0, 0.3 * duration, duration], [1e-3, 1e-3, -depth]
        )
    force = impact.contact_force(
        t, path, random_hand(rng, hard=kind.endswith("hard"))
    )
    none = np.zeros_like(t)
    head = force if kind in (*HITS, "slow press") else none
    shell = force if kind.startswith("shell") else none
    if kind == "head and rim":
        share = rng.uniform(0.2, 0.6)
        head, shell = (1.0 - share) * force, share * force
        place = rng.uniform(0.8, 0.98)
    else:
        place = 0.9 * np.sqrt(rng.uniform())
    pressure = voice.synthesize(
        t,
        head,
        np.full_like(t, place * voice.config.membrane.radius),
        shell,
        force if kind.startswith("table") else none,
        None if kind == "silence" else random_mass_flow(t, rng),
        rng,
    )
    return Trial(
        kind,
        float(head.sum() * 1e-3),
        float(np.abs(np.diff(head)).max() * 1e3),
        pressure,
    )


def made_up_trials(
    voice: DrumVoice, rng: np.random.Generator, count: int
) -> Iterator[Trial]:
    """`count` random trials of each kind."""
    for kind in KINDS:
        for _ in range(count):
            yield made_up_trial(kind, voice, rng)


@dataclasses.dataclass
class Separation:
    """How well a reward separates hits from everything else."""

    auc: float
    """Probability that a hit has the higher reward."""
    threshold: float
    false_hits: int
    """Trials above the threshold that were none."""
    missed_hits: int
    """Hits that are not above the threshold."""
    hits: int
    others: int


def separation(
    rewards: ArrayLike,
    hits: ArrayLike,
    threshold: float = SUCCESS_THRESHOLD,
) -> Separation:
    """Compares rewards (N) with what happened, booleans (N).

    The area under the ROC curve is NaN where all trials are of one sort.

    Raises:
        InputError: if the two differ in length.
    """
    values = np.asarray(rewards, dtype=float)
    truth = np.asarray(hits, dtype=bool)
    require(
        values.ndim == 1 and values.shape == truth.shape,
        "hits",
        f"an array of shape {truth.shape}",
        f"one for each of the {values.size} rewards",
    )
    positive = int(truth.sum())
    negative = len(truth) - positive
    auc = float("nan")
    if positive and negative:
        ranks = stats.rankdata(values)
        auc = (float(ranks[truth].sum()) - 0.5 * positive * (positive + 1)) / (
            positive * negative
        )
    return Separation(
        auc=auc,
        threshold=threshold,
        false_hits=int(np.sum((values > threshold) & ~truth)),
        missed_hits=int(np.sum((values <= threshold) & truth)),
        hits=positive,
        others=negative,
    )
