"""Configuration of a movement primitive."""

import dataclasses

from drake_affetto.common.errors import (
    require,
)
from drake_affetto.common.fields import check_ranges, number


@dataclasses.dataclass
class DmpConfig:
    """The constants of a Dmp.

    Attributes:
        n_basis: K, how many basis functions each joint has.
        duration: s, T_0, in which the phase falls from 1 to 0.
        stiffness: 1/s², k_S.
        damping: 1/s, k_D; None for critical damping, 2 √k_S.
        width: the standard deviation of a basis function in units of the
            distance between neighbors, so V = (K - 1)² / (2 width²).
        method: how `encode` finds θ. "trajectory": the rollout comes closest
            to the demonstrated positions. "forcing": the forcing term comes
            closest to the one that the smoothed demonstration would need.
        ridge: weight of ‖θ‖² beside the mean squared error, the error being
            expressed as a forcing term.
        smoothing: s, time scale below which a demonstration is smoothed
            before it is differentiated ("forcing" only). It also blurs a
            movement that sets out abruptly; "trajectory" does not.

    The defaults were chosen on 3 s windows of a real demonstration (30 Hz), by
    the error on samples that were left out; within 25 to 400 1/s² of stiffness
    and widths of 0.5 to 1 they hardly matter.
    """

    n_basis: int = 15
    duration: float = number(3.0, 1e-3, 1e6)
    stiffness: float = number(100.0, 1e-6, 1e8)
    damping: float | None = number(None, 1e-6, 1e6)
    width: float = number(0.7, 0.2, 5.0)
    method: str = "trajectory"
    ridge: float = number(1e-6, 0.0, 1e6)
    smoothing: float = number(0.05, 1e-6, 10.0)

    def check(self, where: str) -> None:
        """Raises InputError naming the first field that does not fit."""
        require(
            isinstance(self.n_basis, int) and 2 <= self.n_basis <= 1000,
            f"{where}.n_basis",
            self.n_basis,
            "a whole number from 2 to 1000",
        )
        check_ranges(self, where)
        require(
            self.method in ("trajectory", "forcing"),
            f"{where}.method",
            self.method,
            "'trajectory' or 'forcing'",
        )
