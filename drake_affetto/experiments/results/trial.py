"""Results of trials: one row in the store each."""

import dataclasses
from dataclasses import field
from typing import Any, ClassVar, get_type_hints

import numpy as np

from drake_affetto.common.errors import InputError, require_array
from drake_affetto.common.study_results import COUNT
from drake_affetto.common.typed_json import from_plain, to_plain
from drake_affetto.experiments.results.rates import (
    NOT_NEGATIVE,
    REWARD,
    TAU,
)


@dataclasses.dataclass(frozen=True)
class GazeResult:
    """A search for the drum with the gaze.

    Attributes:
        found: Whether the gaze settled on the marker.
        tau: Task parameter τ (2,); zeros where nothing was found.
        duration: Time that the search took, s.
    """

    KIND: ClassVar[str] = "look"
    ARRAYS: ClassVar[dict[str, int]] = {}

    found: bool
    tau: list[float] = field(metadata=TAU)
    duration: float = field(metadata=NOT_NEGATIVE)


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
    ARRAYS: ClassVar[dict[str, int]] = {"theta": 1, "q": 2, "prototype": 2}

    xy: list[float] = field(metadata=TAU)
    found: bool
    tau: list[float] = field(metadata=TAU)
    attempts: int = field(metadata=COUNT)
    success: bool
    reward: float = field(metadata=REWARD)
    max_pull: float = field(metadata=NOT_NEGATIVE)
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
    ARRAYS: ClassVar[dict[str, int]] = {"reward_over_time": 1}

    reward: float = field(metadata=REWARD)
    success: bool
    max_force: float = field(metadata=NOT_NEGATIVE)
    impulse: float = field(metadata=NOT_NEGATIVE)
    landing: float = field(metadata=NOT_NEGATIVE)
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
    ARRAYS: ClassVar[dict[str, int]] = {}

    found: bool
    tau: list[float] = field(metadata=TAU)
    reward: float = field(metadata=REWARD)
    success: bool
    max_force: float = field(metadata=NOT_NEGATIVE)
    impulse: float = field(metadata=NOT_NEGATIVE)


@dataclasses.dataclass(frozen=True)
class HandLookResult:
    """A look at the robot's own hand in the mirror.

    Attributes:
        readings: Angles of the joints by the robot's sensors, rad.
        pixel: Where the hand's marker is seen, px; None if it is not.
        area: Its area, px².
    """

    KIND: ClassVar[str] = "hand_look"
    ARRAYS: ClassVar[dict[str, int]] = {}

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
    ARRAYS: ClassVar[dict[str, int]] = {}

    found: bool
    tau: list[float]
    moments: list[float] | None


@dataclasses.dataclass(frozen=True)
class WatchedResult:
    """The whole chain with faults, watched by the supervisor.

    Times are since the trial's beginning, when the robot rests.

    Attributes:
        found: Whether the gaze settled on the marker.
        tau: Task parameter τ (2,).
        reward: Reward from the sound; 0 without a movement.
        heard: Whether it is above the threshold.
        invalid: Why the supervisor does not pass the trial; empty: it does.
        detected_at: When it said so, s; None: never.
        onset: When the first fault began, s; None: none did.
        movement_at: When the movement began, s; None: none did.
        max_force: Greatest force on the drum or the table, N.
        impulse: Impulse on the drum's head, N s.
        max_speed: Greatest speed of a joint, rad/s.
        scores: (checks,) greatest score of each check, see
            `faults.supervision`.
    """

    KIND: ClassVar[str] = "watched"
    ARRAYS: ClassVar[dict[str, int]] = {"scores": 1}

    found: bool
    tau: list[float] = field(metadata=TAU)
    reward: float = field(metadata=REWARD)
    heard: bool
    invalid: str
    detected_at: float | None
    onset: float | None
    movement_at: float | None
    max_force: float = field(metadata=NOT_NEGATIVE)
    impulse: float = field(metadata=NOT_NEGATIVE)
    max_speed: float = field(metadata=NOT_NEGATIVE)
    scores: np.ndarray


TrialResult = (
    GazeResult
    | DemonstrationResult
    | StrikeResult
    | DrummingResult
    | HandLookResult
    | EllipseLookResult
    | WatchedResult
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
        WatchedResult,
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
    kind: str,
    plain: dict[str, Any],
    arrays: dict[str, np.ndarray],
    where: str = "",
) -> Any:
    """The inverse of `pack`, for a trial of the kind `kind`.

    Args:
        kind: Kind of trial, a key of `TRIAL_RESULTS`.
        plain: Its result as it was stored.
        arrays: Its arrays as they were stored.
        where: Name of the row in error messages, ending in ": ".

    Raises:
        InputError: If there is no such kind of trial, or the result has other
            fields or arrays.
    """
    if kind not in TRIAL_RESULTS:
        raise InputError(f"no kind of trial is called {kind!r}")
    result = TRIAL_RESULTS[kind]
    hints = get_type_hints(result)
    known = {each.name: each.metadata for each in dataclasses.fields(result)}
    other = sorted({*plain, *arrays} - {*known})
    if other:
        raise InputError(f"{where}a {kind} has no field {other[0]!r}")
    values: dict[str, Any] = {}
    for name in known:
        place = f"{where}{name}"
        found = arrays if name in result.ARRAYS else plain
        if name not in found:
            raise InputError(f"{place} is missing")
        if found is plain:
            values[name] = from_plain(
                hints[name], plain[name], place, known[name]
            )
        else:
            shape = (None,) * result.ARRAYS[name]
            require_array(place, arrays[name], shape)
            # As it was: it may be of single precision.
            values[name] = arrays[name]
    return result(**values)
