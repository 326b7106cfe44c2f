"""What a trial gives: the outcome of a search, the recording of a movement."""

import dataclasses

from drake_affetto.common.typing import Array


@dataclasses.dataclass
class GazeOutcome:
    """The outcome of a search for the drum with the gaze.

    Attributes:
        found: Whether the gaze settled on the marker.
        task_parameter: τ or τ̂ (2,); zeros if it did not settle.
        duration: Time that the search took, s.
        unseen: Whether it did not settle and hardly saw the marker at its end.
            If it did see it and did not come to rest, that is the robot's own
            failure.
    """

    found: bool
    task_parameter: Array
    duration: float
    unseen: bool = False


@dataclasses.dataclass
class Recording:
    """The recording of a movement.

    Attributes:
        t: Times of the contacts since the movement's start (T,), s: the middle
            of the plant's step over which a force is the mean.
        contact_force: Force on the head, N, and distance of the contact from
            its center, m (T, 2).
        knock_force: Forces on the shell and on the table (T, 2), N.
        hiss_flow: Root of the sum of squares of the air flows through all
            valves (T,), kg/s: as loud as their jets are together.
        joint_t: Times of the joints (S,), s.
        joint_state: Angles and speeds (S, 2n) as the robot's sensors have
            them, rad, rad/s.
        true_state: The same as they are, for judging only.
        desired_state: Desired angles and speeds (S, 2n), rad, rad/s.
        chamber_pressure: Absolute pressures (S, 2n), Pa.
        valve_opening: Commands to the valves (S, n), -1 to 1.
        sound: Sound pressure at the microphone (samples,), Pa.
        sound_rate: Sampling rate of the sound, 1/s.
    """

    t: Array
    contact_force: Array
    knock_force: Array
    hiss_flow: Array
    joint_t: Array
    joint_state: Array
    true_state: Array
    desired_state: Array
    chamber_pressure: Array
    valve_opening: Array
    sound: Array
    sound_rate: float

    @property
    def impulse(self) -> float:
        """Impulse on the head, N s; for judging only."""
        step = self.t[1] - self.t[0]
        return float(self.contact_force[:, 0].sum() * step)
