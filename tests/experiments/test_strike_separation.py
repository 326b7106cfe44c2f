"""Strikes that are aimed beside the head, and what is heard of them."""

import numpy as np
import pytest

from drake_affetto.experiments.strike_separation import (
    AIMS,
    count,
    hear,
    run_strikes,
    sound_of,
)
from drake_affetto.sound.config import SoundConfig
from drake_affetto.sound.voice import DrumVoice


def forces(head=0.0, shell=0.0, radius=0.01):
    """Forces (T, 6) of a push of 20 ms after half a second."""
    t = np.arange(0.0, 1.6, 0.0025)
    push = np.where(
        (t > 0.5) & (t < 0.52), np.sin(np.pi * (t - 0.5) / 0.02), 0.0
    )
    rows = np.zeros((t.size, 6), dtype=np.float32)
    rows[:, 0] = t
    rows[:, 1] = head * push
    rows[:, 2] = np.where(rows[:, 1] > 0.0, radius, 0.0)
    rows[:, 3] = shell * push
    return rows


def outcome(name, **kinds):
    return name, ({"impulse": 0.0}, {"forces": forces(**kinds)})


def test_hits_are_heard_and_knocks_on_the_shell_are_not():
    rng = np.random.default_rng(0)
    taught = [
        outcome("head", head=rng.uniform(3, 9), radius=rng.uniform(0, 0.03))
        for _ in range(26)
    ]
    rewards = hear(
        [*taught, outcome("shell", shell=60.0), outcome("near")],
        SoundConfig(),
    )
    # Prototypes do not judge themselves.
    assert np.isnan(rewards[:25]).all()
    assert rewards[25] > 0.3
    assert np.all(rewards[26:] < 0.12)


def test_a_sound_is_its_seed_s_and_its_forces_alone():
    voice = DrumVoice(SoundConfig().voice)
    first = sound_of(voice, forces(head=5.0), 1)
    np.testing.assert_array_equal(sound_of(voice, forces(head=5.0), 1), first)
    assert np.any(sound_of(voice, forces(head=5.0), 2) != first)


def test_light_touches_are_neither_hits_nor_none():
    found = count(
        "rim",
        np.array([0.1, 0.5, 0.2, 0.6, 0.0]),
        np.array([1.0, 1.0, 0.0, 1e-3, 0.0]),
        2e-3,
        0.15,
    )
    assert (found.strikes, found.hits, found.untouched) == (5, 2, 2)
    assert (found.missed, found.false) == (1, 1)
    assert (found.least, found.greatest) == (0.1, 0.2)


def test_shares_of_the_aims_are_a_whole():
    assert sum(aim.share for aim in AIMS.values()) == pytest.approx(1.0)


class Plan:
    """Takes specs for results, and runs nothing."""

    def __init__(self):
        self.specs = {}

    def run(self, label, specs):
        self.specs[label] = specs
        return {k: ({}, {"theta": np.zeros(4)}) for k in specs}


def test_a_part_of_the_plan_has_every_aim(monkeypatch):
    monkeypatch.setattr(
        "drake_affetto.experiments.strike_separation._drum_limits",
        lambda _: (np.array([0.1, -0.4]), np.array([0.6, 0.4])),
    )
    monkeypatch.setattr(
        "drake_affetto.experiments.strike_separation.runner_of", lambda _: None
    )
    plan = Plan()
    names = [name for name, _ in run_strikes(plan, strikes=400, seed=3)]
    assert len(names) == 400
    assert set(names[:100]) == set(AIMS)
    low = {tuple(s["xy"]) for s in plan.specs["Low movements"].values()}
    for spec in plan.specs["Strikes"].values():
        aim = AIMS[spec["aim"]]
        known = np.array(
            [s["xy"] for s in plan.specs["Movements"].values()]
            if not aim.low
            else list(low)
        )
        apart = np.linalg.norm(known - spec["xy"], axis=1)
        assert np.any((apart >= aim.least - 1e-9) & (apart <= aim.most + 1e-9))
