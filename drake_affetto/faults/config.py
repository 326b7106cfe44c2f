"""Faults of the robot and its surroundings, as a scenario lists them."""

from collections.abc import Sequence
import dataclasses
import math

from drake_affetto.common.errors import require, require_choice, require_range

TRIAL = "trial"
MOVEMENT = "movement"
"""What an onset is counted from."""

TO_THE_END = 1e6
"""Length of a fault that does not go away, s."""


@dataclasses.dataclass(frozen=True)
class Kind:
    """One kind of fault.

    Attributes:
        place: What it acts on: "joint", "chamber" (a joint's, a or b),
            "supply", "ticks", "camera", "microphone" or "scene".
        low: Least size.
        high: Greatest size; equal to `low` where the fault has no size.
        unit: What the size is, for errors and tables.
        text: What happens.
    """

    place: str
    low: float
    high: float
    unit: str
    text: str

    @property
    def has_size(self) -> bool:
        """Whether one such fault can be larger than another."""
        return self.low < self.high


def _whole(place: str, text: str) -> Kind:
    return Kind(place, 1.0, 1.0, "", text)


#: Kinds of faults by their names: where each acts, its least and greatest size
#: with the unit, and what it does.
KINDS: dict[str, Kind] = {
    "joint_stuck": _whole("joint", "a joint's reading stays as it is"),
    "joint_offset": Kind(
        "joint", 0.0, 3.0, "rad", "a joint's reading jumps by so much"
    ),
    "joint_dropouts": Kind(
        "joint", 0.0, 1.0, "share", "so many readings are the sensor's zero"
    ),
    "joint_noise": Kind(
        "joint", 0.0, 3.0, "rad", "noise of that deviation on a joint's reading"
    ),
    "pressure_stuck": _whole("chamber", "a pressure's reading stays as it is"),
    "pressure_offset": Kind(
        "chamber", 0.0, 1e6, "Pa", "a pressure's reading jumps by so much"
    ),
    "valve_stuck_open": Kind(
        "chamber", 0.0, 1.0, "share", "a valve stays open to the supply so far"
    ),
    "valve_stuck_closed": _whole("chamber", "a valve lets nothing through"),
    "valve_sluggish": Kind(
        "chamber", 1.0, 1e4, "times", "a valve's lag is so many times its own"
    ),
    "chamber_leak": Kind(
        "chamber",
        0.0,
        10.0,
        "share",
        "a chamber leaks by that share of its exhaust's conductance",
    ),
    "supply_sag": Kind(
        "supply", 0.0, 1.0, "share", "that share of the supply's gauge is lost"
    ),
    "supply_lost": _whole("supply", "the supply falls to the atmosphere"),
    "ticks_late": Kind(
        "ticks", 0.0, 0.5, "s", "the controller's commands come so late"
    ),
    "ticks_dropped": Kind(
        "ticks", 0.0, 1.0, "share", "so many of the commands never come"
    ),
    "camera_frozen": _whole("camera", "the camera repeats one image"),
    "camera_dark": Kind(
        "camera", 0.0, 20.0, "stops", "so much less light in the image"
    ),
    "camera_overexposed": Kind(
        "camera", 0.0, 20.0, "stops", "so much more light in the image"
    ),
    "camera_blurred": Kind(
        "camera", 0.0, 100.0, "px", "the image is smeared over so many pixels"
    ),
    "marker_hidden": Kind(
        "camera",
        0.0,
        1.0,
        "share",
        "that share of the marker's width is hidden",
    ),
    "second_marker": Kind(
        "camera",
        0.0,
        10.0,
        "times",
        "a disc of the marker's color, of so many times its radius",
    ),
    "microphone_dead": _whole("microphone", "the microphone gives zeros"),
    "microphone_clipped": Kind(
        "microphone", 1e-6, 1e3, "Pa", "the microphone takes no more than that"
    ),
    "microphone_hum": Kind(
        "microphone", 0.0, 1e3, "Pa", "a hum of the mains, of that amplitude"
    ),
    "other_drum": Kind(
        "microphone",
        0.0,
        100.0,
        "times",
        "someone strikes a like drum, so many times as loud as a tap on ours",
    ),
    "hand_lost": _whole("scene", "the soft hand is gone: no contact with it"),
    "drum_moved": Kind("scene", 0.0, 0.5, "m", "the drum is moved by so much"),
}

_CHAMBERS = ("a", "b")


@dataclasses.dataclass
class Fault:
    """A fault of a trial.

    What of it is random (the sign of an offset, where a drum is moved to) is
    drawn from the trial's seed. An onset beyond the trial's end is allowed: the
    fault then never acts.

    Attributes:
        kind: One of `KINDS`.
        onset: When it begins, s since the robot is at rest and looks for the
            drum, or since its movement begins (`since`).
        length: How long it lasts, s.
        size: How large it is, in the kind's unit; 1 where a kind has no size.
        joint: Active joint that it is of, for kinds of joints and chambers.
        channel: Chamber of the joint, "a" or "b".
        since: What the onset is counted from: "trial" or "movement".
    """

    kind: str = ""
    onset: float = 0.0
    length: float = TO_THE_END
    size: float = 1.0
    joint: str = ""
    channel: str = ""
    since: str = TRIAL

    def check(self, where: str, joints: Sequence[str]) -> None:
        """Raises InputError naming the first field that does not fit.

        Args:
            where: Name of the fault in errors.
            joints: Names of the active joints.
        """
        self.check_kind(where)
        kind = KINDS[self.kind]
        require_range(f"{where}.onset", self.onset, 0.0, TO_THE_END)
        require_range(f"{where}.length", self.length, 1e-3, TO_THE_END)
        if kind.has_size:
            require_range(
                f"{where}.size ({kind.unit})", self.size, kind.low, kind.high
            )
        else:
            require(
                self.size == 1.0,
                f"{where}.size",
                self.size,
                f"1, for {self.kind} has no size",
            )
        of_joint = kind.place in ("joint", "chamber")
        require(
            self.joint in (joints if of_joint else ("",)),
            f"{where}.joint",
            self.joint,
            f"one of the active joints {', '.join(joints)}"
            if of_joint
            else f"none, for {self.kind} is of no joint",
        )
        of_chamber = kind.place == "chamber"
        require(
            self.channel in (_CHAMBERS if of_chamber else ("",)),
            f"{where}.channel",
            self.channel,
            "chamber 'a' or 'b' of the joint"
            if of_chamber
            else f"none, for {self.kind} has no channels",
        )
        require_choice(f"{where}.since", self.since, TRIAL, MOVEMENT)

    def check_kind(self, where: str) -> None:
        """Raises InputError unless there is such a kind of fault."""
        require(
            self.kind in KINDS,
            f"{where}.kind",
            self.kind,
            f"one of {', '.join(KINDS)}",
        )

    @property
    def place(self) -> str:
        """What it acts on, see `Kind`."""
        return KINDS[self.kind].place

    def span(self, begin: float, movement: float) -> tuple[float, float]:
        """When it begins and ends, s.

        Args:
            begin: Time at which the trial begins, s; infinite: not yet.
            movement: Time at which its movement begins, s; infinite: not yet.
        """
        start = movement if self.since == MOVEMENT else begin
        onset = start + self.onset if math.isfinite(begin) else math.inf
        return onset, onset + self.length
