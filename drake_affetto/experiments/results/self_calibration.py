"""Results of the study in which the robot finds the mirror by itself."""

import dataclasses
from dataclasses import field

from drake_affetto.common.errors import InputError
from drake_affetto.experiments.results.rates import (
    NOT_EMPTY,
    Position,
    SuccessRate,
)

REPLAY = "self_calibration.html"
"""Name of the 3D replay in the study's folder."""


@dataclasses.dataclass(frozen=True)
class PlaneRow:
    """What one repeat's calibration came to.

    Attributes:
        parameters: Azimuth and elevation of the normal, rad, and distance from
            the camera, m; None where nothing was found.
        covariance: (3, 3) of these, as stated.
        angle_error: Angle of the believed from the true normal, degrees.
        offset_error: How far the middle of the glass is off the believed
            plane, mm.
        covered: Whether the true plane is in the stated region of 95 %.
        looks: Number of looks.
        strokes: Number of own strokes.
        failure: What was missing; None where the plane was found.
    """

    parameters: list[float] | None
    covariance: list[list[float]] | None
    angle_error: float | None
    offset_error: float | None
    covered: bool | None
    looks: int
    strokes: int
    failure: str | None = None


@dataclasses.dataclass(frozen=True)
class MethodResult:
    """One way in which the robot finds the mirror.

    Attributes:
        success_rate: Success at the unseen positions over the repeats.
        per_repeat: Share of successes in each repeat.
        looks: Mean number of looks.
        strokes: Mean number of own strokes.
        angle_error: Median error of the normal, degrees.
        offset_error: Median error of the plane's place, mm.
        coverage: Share of repeats whose stated region covers the truth.
        planes: What each repeat came to.
        heard: Whether each own stroke was heard, for each repeat.
    """

    success_rate: SuccessRate
    per_repeat: list[float]
    looks: float
    strokes: float
    angle_error: float | None
    offset_error: float | None
    coverage: SuccessRate | None
    planes: list[PlaneRow] = field(metadata=NOT_EMPTY)
    heard: list[list[bool]] = field(default_factory=list)


@dataclasses.dataclass(frozen=True)
class StrokesResult:
    """Strokes at drums seen in the mirror, one after another, by ear.

    Attributes:
        start: Belief with which they begin, "ellipse" or "prior".
        by_stroke: Share of repeats in which the stroke of each number is
            heard.
        late: Success over the strokes `late_from` to `late_to`.
        late_from: Number of the first of these, from 1.
        late_to: Number of the last of these.
        chance: Success of strokes by the first belief's best plane, at the
            same positions.
    """

    start: str
    by_stroke: list[float]
    late: SuccessRate
    late_from: int
    late_to: int
    chance: SuccessRate


@dataclasses.dataclass(frozen=True)
class WatchResult:
    """How a mirror that is turned in the middle of a study is noticed.

    Attributes:
        turned_by: Angle by which it is turned, degrees.
        turned_after: Number of strokes after which it is turned.
        delays: Strokes from then on until it was noticed, for each repeat;
            None where it was not.
        noticed: Share of repeats in which it was noticed within six strokes.
        false_alarms: Alarms while the belief was right.
        quiet_strokes: Number of strokes in which there could be such alarms.
        recovered: Success after the robot calibrated again; None if it did
            not.
        quiet_looks: Number of looks at the hand in the quiet strokes.
        noticed_by_strokes: Share of repeats in which strokes alone would have
            told within six; None if that was not counted.
        false_alarms_by_strokes: Alarms by strokes alone while the belief was
            right.
    """

    turned_by: float
    turned_after: int
    delays: list[int | None]
    noticed: SuccessRate
    false_alarms: int
    quiet_strokes: int
    recovered: SuccessRate | None = None
    quiet_looks: int = 0
    noticed_by_strokes: SuccessRate | None = None
    false_alarms_by_strokes: int = 0


@dataclasses.dataclass(frozen=True)
class BeliefStep:
    """A belief over the mirror in the first repeat, seen from above.

    Attributes:
        method: Way of finding the mirror.
        step: Number of looks or strokes until then.
        lines: Where believed mirrors meet the height of the drum's marker:
            two points on each, x and y, m.
    """

    method: str
    step: int
    lines: list[tuple[Position, Position]]


@dataclasses.dataclass(frozen=True)
class SelfCalibrationResults:
    """The robot finds the mirror by itself: `affetto mirror --self-calibrate`.

    Attributes:
        repeats: Number of repeats, each with a mirror of its own.
        evaluations: Number of unseen positions of a repeat.
        rotation: Greatest turn of the mirror about each axis, degrees.
        translation: Greatest shift along each axis, m.
        methods: Results by method: hand, ellipse, ear.
        by_ear: Strokes by ear, from several beliefs.
        watch: How a turned mirror is noticed; None if it was not tried.
        beliefs: Beliefs of the first repeat, for the picture.
        true_line: The mirror of the first repeat at the same height.
    """

    repeats: int
    evaluations: int
    rotation: float
    translation: float
    methods: dict[str, MethodResult] = field(metadata=NOT_EMPTY)
    by_ear: list[StrokesResult] = field(default_factory=list)
    watch: WatchResult | None = None
    beliefs: list[BeliefStep] = field(default_factory=list)
    true_line: list[Position] = field(default_factory=list)

    def check(self, where: str) -> None:
        """Raises InputError where parts do not fit each other."""
        for name, method in self.methods.items():
            if len(method.planes) != self.repeats:
                raise InputError(
                    f"{where}.methods.{name} has {len(method.planes)} planes "
                    f"of {self.repeats} repeats"
                )
