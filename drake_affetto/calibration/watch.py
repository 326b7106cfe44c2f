"""Noticing that a belief that was right has become wrong."""

import math

from drake_affetto.calibration.config import WatchConfig


class StrokeWatch:
    """Strokes that should be heard and are not, counted up (Page 1954).

    So are drums that are seen where none can stand. Each adds the log of how
    much likelier it is if the mirror has moved; the sum never falls below
    zero. Once it reaches the threshold, the belief is taken to be wrong.
    """

    def __init__(
        self, config: WatchConfig, threshold: float | None = None
    ) -> None:
        """Begins at zero.

        Args:
            config: How often strokes are heard.
            threshold: Sum at which the belief is taken to be wrong; None for
                the configuration's.
        """
        self._config = config
        self._threshold = config.threshold if threshold is None else threshold
        self.sum = 0.0

    def see(self, plausible: bool) -> bool:
        """Takes in where a drum is seen; whether the belief is wrong now.

        Args:
            plausible: Whether a drum can stand there, as believed.
        """
        right = self._config.strange_when_right
        wrong = self._config.strange_when_wrong
        if plausible:
            return self._step(math.log((1.0 - wrong) / (1.0 - right)))
        return self._step(math.log(wrong / right))

    def add(self, chance: float, heard: bool) -> bool:
        """Takes in a stroke; whether the belief is taken to be wrong now.

        Args:
            chance: Probability that the stroke is heard, as believed.
            heard: Whether it was.
        """
        right = min(chance, self._config.hit_when_right)
        # A stroke of which little was expected does not speak against it.
        wrong = min(self._config.hit_when_wrong, right)
        if heard:
            return self._step(math.log(wrong / right))
        return self._step(math.log((1.0 - wrong) / (1.0 - right)))

    def _step(self, log_ratio: float) -> bool:
        self.sum = max(0.0, self.sum + log_ratio)
        return self.sum >= self._threshold

    def reset(self) -> None:
        """Begins anew, after a calibration."""
        self.sum = 0.0
