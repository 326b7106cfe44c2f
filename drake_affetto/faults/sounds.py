"""What a microphone with a fault records."""

import math

import numpy as np

from drake_affetto.common.typing import Array
from drake_affetto.faults.schedule import FaultSchedule
from drake_affetto.sound import impact
from drake_affetto.sound.voice import DrumVoice

# A hum of the mains: frequency, Hz, and strength of its overtones [est].
_MAINS = 50.0
_OVERTONES = (1.0, 0.5, 0.7, 0.3, 0.4, 0.2)

# Someone else's strokes come after so long, s [est].
_INTERVAL = (0.25, 0.7)


def with_faults(
    sound: Array,
    voice: DrumVoice,
    schedule: FaultSchedule,
    start: float,
    movement: float,
) -> Array:
    """A recording as the microphone gives it.

    Args:
        sound: The recording (samples,), Pa.
        voice: Voice of the drum, and rate of the recording.
        schedule: Faults of the trial.
        start: Time of the first sample, s.
        movement: Time at which the movement begins, s.
    """
    heard = np.array(sound)
    t = start + np.arange(len(heard)) / voice.rate
    # What is in the room first, then what the microphone makes of it.
    order = ("other_drum", "microphone_hum", "microphone_clipped")
    numbered = sorted(
        (
            (number, fault)
            for number, fault in enumerate(schedule.faults)
            if fault.place == "microphone"
        ),
        key=lambda each: (*order, "microphone_dead").index(each[1].kind),
    )
    for number, fault in numbered:
        onset, end = fault.span(schedule.begin, movement)
        now = (t >= onset) & (t < end)
        if fault.kind == "other_drum":
            heard += fault.size * _other_drum(
                voice, schedule.rng(number), start, len(heard), (onset, end)
            )
        elif fault.kind == "microphone_hum":
            phase = schedule.rng(number).uniform(0.0, 2.0 * math.pi)
            for i, part in enumerate(_OVERTONES, start=1):
                wave = np.sin(2.0 * math.pi * _MAINS * i * t + i * phase)
                heard[now] += fault.size * part * wave[now]
        elif fault.kind == "microphone_clipped":
            heard[now] = np.clip(heard[now], -fault.size, fault.size)
        else:
            heard[now] = 0.0
    return heard


def _other_drum(
    voice: DrumVoice,
    rng: np.random.Generator,
    start: float,
    samples: int,
    span: tuple[float, float],
) -> Array:
    """Strokes of someone else's drum like ours, tapped by hand, Pa."""
    step = 1e-3
    t = np.arange(math.ceil(samples / voice.rate / step) + 2) * step
    force = np.zeros(len(t))
    # It began before anyone listened, or begins as the fault does.
    when = max(span[0], start) + rng.uniform(0.0, _INTERVAL[1])
    while when < min(span[1], start + t[-1]):
        tap = impact.contact_force(
            t, impact.stroke(t, when - start, 0.06, 0.02, 0.4, 0.1, 0.4)
        )
        force += np.nan_to_num(tap)
        when += rng.uniform(*_INTERVAL)
    if not force.any():
        return np.zeros(samples)
    place = np.full(len(t), 0.5 * voice.config.membrane.radius)
    sound = voice.synthesize(t, force, place)
    return np.resize(np.append(sound, np.zeros(samples)), samples)
