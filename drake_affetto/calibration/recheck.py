"""Whether the mirror still is where the hand was seen in it."""

from collections.abc import Sequence

import numpy as np

from drake_affetto.calibration.config import WatchConfig
from drake_affetto.calibration.hand import HandLook, hand_pixels
from drake_affetto.calibration.knowledge import RobotKnowledge
from drake_affetto.calibration.plane import PlaneEstimate
from drake_affetto.common.typing import Array


class HandRecheck:
    """Looks again at postures at which the hand was seen in the mirror.

    A look agrees where the marker shows at about the pixel at which the
    believed plane has it. The majority of an odd number of looks decides: one
    image may be a gross outlier, or the marker be hidden.
    """

    def __init__(
        self,
        knowledge: RobotKnowledge,
        plane: PlaneEstimate,
        seen: Sequence[HandLook],
        config: WatchConfig,
    ) -> None:
        """Chooses the postures.

        Args:
            knowledge: The robot's model of itself, corrected.
            plane: The believed plane.
            seen: Looks at which the hand was seen where that plane has it.
            config: How many looks decide, and by what.

        Raises:
            ValueError: If there are no such looks.
        """
        self._knowledge, self._plane = knowledge, plane
        self._config = config
        if not seen:
            raise ValueError("a recheck needs looks at which the hand was seen")
        # The least outlying first: there the marker is seen best.
        self._postures = [look.readings for look in sorted(seen, key=self._off)]
        self._votes: list[bool] = []

    @property
    def moved(self) -> bool | None:
        """Whether the mirror has moved; None while that is open."""
        needed = self._config.recheck_looks // 2 + 1
        against = sum(self._votes)
        if against >= needed:
            return True
        return False if len(self._votes) - against >= needed else None

    @property
    def looks(self) -> int:
        """Number of looks until now."""
        return len(self._votes)

    def next_posture(self) -> Array:
        """Angles of the joints (n,) at which to look next, rad."""
        return self._postures[self.looks % len(self._postures)]

    def add(self, look: HandLook) -> None:
        """Takes in a look.

        Args:
            look: Readings of the joints, and the pixel of the marker, if it was
                seen.
        """
        self._votes.append(self._off(look) > self._config.recheck_limit)

    def _off(self, look: HandLook) -> float:
        """How far the marker is off where the plane has it, px."""
        if look.pixel is None:
            return np.inf
        plane = self._plane
        uv = hand_pixels(
            self._knowledge, plane.parameters, plane.reference, look.readings
        )
        off = float(np.linalg.norm(uv - look.pixel))
        return off if np.isfinite(off) else np.inf
