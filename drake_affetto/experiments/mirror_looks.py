"""Looks into the mirror: at the robot's own hand, and at the drum's marker.

What a look returns is what the robot has: its joints' readings and pixels.
"""

from typing import Any

import numpy as np

from drake_affetto.common.typing import Array, Image
from drake_affetto.experiments.episode import TrialRunner
from drake_affetto.experiments.results.trial import (
    EllipseLookResult,
    HandLookResult,
)
from drake_affetto.motion.minimum_jerk import minimum_jerk
from drake_affetto.perception.blob import Blob, BlobConfig, detect

# When the arm has come to the posture of a look, and when it leaves it, as
# parts of a movement.
_ARRIVE, _LEAVE = 0.42, 0.72
IMAGES = (0.62, 0.66, 0.70)
"""Images are taken at these parts of a movement, once the arm is at rest."""

# Points of the way to a posture and back.
_POINTS = 121


def way_to(
    start: Array, posture: Array, duration: float
) -> tuple[Array, Array]:
    """A smooth way to a posture, a rest there, and back.

    Args:
        start: Angles at the beginning and end (n,), rad.
        posture: Angles in between (n,), rad.
        duration: Of all of it, s.

    Returns:
        Times (T,), s, and angles (T, n), rad.
    """
    part = np.linspace(0.0, 1.0, _POINTS)
    there = minimum_jerk(part / _ARRIVE)
    back = minimum_jerk((part - _LEAVE) / (1.0 - _LEAVE))
    share = there - back
    return part * duration, start + share[:, None] * (posture - start)


def look_at_hand(
    trials: TrialRunner, xy: Array, seed: int, posture: Array, blob: BlobConfig
) -> HandLookResult:
    """Moves the arm to a posture and looks for the hand in the mirror.

    Args:
        trials: Runner of the scenario.
        xy: Position of the drum meanwhile (2,), m.
        seed: Seed of the noise.
        posture: Angles of the joints (n,), rad.
        blob: How the hand's marker looks.

    Returns:
        The mean reading and pixel of some images of the arm at rest.
    """
    trials.settle(xy, seed)
    return look_from_here(trials, posture, blob)


def look_from_here(
    trials: TrialRunner, posture: Array, blob: BlobConfig
) -> HandLookResult:
    """The same from the start posture, in a simulation that goes on."""
    duration = trials.scenario.dmp.duration
    theta = trials.dmp.encode(
        *way_to(trials.station.start_posture, posture, duration)
    )
    start = trials.context.get_time() + trials.scenario.policy.delay
    trials.play(theta, start)
    readings, blobs = [], []
    for part in IMAGES:
        trials.advance(start + part * duration)
        state = trials.port("affetto.estimated_state")
        readings.append(state[: trials.station.num_joints])
        blobs.append(detect(_image(trials), blob))
    seen = [each for each in blobs if each is not None]
    # Seen now and then, it stands at an edge.
    whole = len(seen) == len(blobs)
    return HandLookResult(
        readings=np.mean(readings, axis=0).tolist(),
        pixel=_middle(seen).tolist() if whole else None,
        area=float(np.mean([each.area for each in seen])) if whole else 0.0,
    )


def look_at_ellipse(
    trials: TrialRunner, xy: Array, seed: int
) -> EllipseLookResult:
    """Searches for the drum, then measures the shape of its marker.

    Args:
        trials: Runner of the scenario.
        xy: Position of the drum (2,), m.
        seed: Seed of the noise.
    """
    gaze = trials.look(xy, seed)
    # The gaze rests no longer than it needs: one image it is.
    blob = detect(_image(trials), trials.scenario.blob) if gaze.found else None
    return EllipseLookResult(
        gaze.found,
        gaze.task_parameter.tolist(),
        None if blob is None else list(blob.moments),
    )


def _image(trials: TrialRunner) -> Image:
    image: Any = trials.port("camera.color_image")
    return image.data


def _middle(blobs: list[Blob]) -> Array:
    """Mean place (2,) of blobs, px."""
    return np.mean([[each.u, each.v] for each in blobs], axis=0)
