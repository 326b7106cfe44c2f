"""Results of trials: one row in the store each."""

import dataclasses
from typing import Any, ClassVar

import numpy as np

from drake_affetto.common.errors import InputError
from drake_affetto.common.typed_json import to_plain


@dataclasses.dataclass(frozen=True)
class GazeResult:
    """A search for the drum with the gaze.

    Attributes:
        found: Whether the gaze settled on the marker.
        tau: Task parameter τ (2,); zeros where nothing was found.
        duration: Time that the search took, s.
    """

    KIND: ClassVar[str] = "look"
    ARRAYS: ClassVar[tuple[str, ...]] = ()

    found: bool
    tau: list[float]
    duration: float


@dataclasses.dataclass(frozen=True)
class DemonstrationResult:
    """A demonstration at one position of the drum, with its repetitions.

    Attributes:
        xy: Position of the drum, m.
        found: Whether the robot found the drum with its gaze.
        tau: Task parameter τ (2,).
        attempts: Number of times that the movement was demonstrated.
        success: Whether the robot's own replay made the drum sound.
        reward: Reward of the best replay (paper Eq. 10).
        max_pull: Greatest force of the teacher, N.
        theta: (F,) parameters of the movement; empty if nothing was found.
        q: (T, n) recorded joint angles, rad.
        prototype: (bands, frames) spectrogram of the best replay's hit.
    """

    KIND: ClassVar[str] = "demonstration"
    ARRAYS: ClassVar[tuple[str, ...]] = ("theta", "q", "prototype")

    xy: list[float]
    found: bool
    tau: list[float]
    attempts: int
    success: bool
    reward: float
    max_pull: float
    theta: np.ndarray
    q: np.ndarray
    prototype: np.ndarray


@dataclasses.dataclass(frozen=True)
class StrikeResult:
    """A movement at a drum whose task parameter is known already.

    Attributes:
        reward: Reward from the sound (paper Eq. 10).
        success: Whether the reward is above the threshold.
        max_force: Greatest force on the drum's head, N.
        impulse: Impulse on the drum's head, N s.
        landing: Distance from the head's center at which the palm comes down
            to its height, m.
        graze: Whether it touches the head although it comes down beside it.
        reward_over_time: (frames,) similarity to the prototypes as they
            slide over the recording.
    """

    KIND: ClassVar[str] = "strike"
    ARRAYS: ClassVar[tuple[str, ...]] = ("reward_over_time",)

    reward: float
    success: bool
    max_force: float
    impulse: float
    landing: float
    graze: bool
    reward_over_time: np.ndarray


@dataclasses.dataclass(frozen=True)
class DrummingResult:
    """The whole chain: gaze, skill, movement, sound.

    Attributes:
        found: Whether the gaze settled on the marker.
        tau: Task parameter τ (2,).
        reward: Reward from the sound (paper Eq. 10); 0 without a movement.
        success: Whether the reward is above the threshold.
        max_force: Greatest force on the drum's head, N.
        impulse: Impulse on the drum's head, N s.
    """

    KIND: ClassVar[str] = "drumming"
    ARRAYS: ClassVar[tuple[str, ...]] = ()

    found: bool
    tau: list[float]
    reward: float
    success: bool
    max_force: float
    impulse: float


@dataclasses.dataclass(frozen=True)
class HandLookResult:
    """A look at the robot's own hand in the mirror.

    Attributes:
        readings: Angles of the joints by the robot's sensors, rad.
        pixel: Where the hand's marker is seen, px; None if it is not.
        area: Its area, px².
    """

    KIND: ClassVar[str] = "hand_look"
    ARRAYS: ClassVar[tuple[str, ...]] = ()

    readings: list[float]
    pixel: list[float] | None
    area: float


@dataclasses.dataclass(frozen=True)
class EllipseLookResult:
    """A search for the drum, and the shape in which its marker then shows.

    Attributes:
        found: Whether the gaze settled on the marker.
        tau: Task parameter τ (2,).
        moments: Variances and covariance of the marker's pixels' places along
            u, u and v, and v, px²; None if it was not found.
    """

    KIND: ClassVar[str] = "ellipse_look"
    ARRAYS: ClassVar[tuple[str, ...]] = ()

    found: bool
    tau: list[float]
    moments: list[float] | None


TrialResult = (
    GazeResult
    | DemonstrationResult
    | StrikeResult
    | DrummingResult
    | HandLookResult
    | EllipseLookResult
)

TRIAL_RESULTS: dict[str, Any] = {
    kind.KIND: kind
    for kind in (
        GazeResult,
        DemonstrationResult,
        StrikeResult,
        DrummingResult,
        HandLookResult,
        EllipseLookResult,
    )
}


def pack(result: TrialResult) -> tuple[dict[str, Any], dict[str, np.ndarray]]:
    """A trial's result as the plain data and the arrays of the store."""
    values = {
        each.name: getattr(result, each.name)
        for each in dataclasses.fields(result)
    }
    arrays = {name: values.pop(name) for name in result.ARRAYS}
    return to_plain(values), arrays


def unpack(
    kind: str, plain: dict[str, Any], arrays: dict[str, np.ndarray]
) -> Any:
    """The inverse of `pack`, for a trial of the kind `kind`.

    Raises:
        InputError: If there is no such kind of trial.
    """
    if kind not in TRIAL_RESULTS:
        raise InputError(f"no kind of trial is called {kind!r}")
    return TRIAL_RESULTS[kind](**plain, **arrays)
