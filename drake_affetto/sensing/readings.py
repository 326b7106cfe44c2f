"""Readings of angle and pressure sensors, and the software behind them.

An angle is read with noise, in steps of the sensor's resolution; the robot's
own software then passes it through a low-pass filter and takes the difference
of two filtered angles for the speed:

    r_k = round((q_k + ε_k)/δ) δ,
    y_k = Σ b_i r_{k-i} - Σ a_i y_{k-i},   q̇_k = (y_k - y_{k-1})/T.

A pressure is read with noise in steps, and is not filtered.
"""

from collections.abc import Sequence
import dataclasses
import enum

import numba
import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.signal import butter

from drake_affetto.common.errors import InputError, require, require_range
from drake_affetto.common.fields import check_ranges, number
from drake_affetto.common.typing import Array

NOISE_ROWS = 512
"""Samples whose noise is drawn at once."""


class ReadingFault(enum.IntEnum):
    """The rows of what is wrong with the readings, a column for each of 3n.

    `STUCK`: 1 where a reading stays as it is. `ADDED`: what is added to it,
    rad or Pa. `FORCED`: what it is in place of itself; NaN: nothing.
    """

    STUCK = 0
    ADDED = 1
    FORCED = 2


FAULT_ROWS = len(ReadingFault)


@dataclasses.dataclass
class SensorParameters:
    """Sensors of all joints.

    Attributes:
        angle_resolution: Step of an angle's reading, fraction of the range.
        angle_noise: Standard deviation of an angle's noise, fraction of the
            joint's range.
        joint_noise: The same for joints that differ, by their names.
        pressure_resolution: Step of a pressure's reading, Pa.
        pressure_noise: Standard deviation of a pressure's noise, Pa.
        filter_order: Order of the angles' Butterworth low-pass filter.
        filter_cutoff: Its cut-off frequency, Hz; 0: angles are not filtered.
    """

    angle_resolution: float = number(0.0, 0.0, 0.1)
    angle_noise: float = number(0.0, 0.0, 0.1)
    joint_noise: dict[str, float] = dataclasses.field(default_factory=dict)
    pressure_resolution: float = number(0.0, 0.0, 1e5)
    pressure_noise: float = number(0.0, 0.0, 1e5)
    filter_order: int = number(1, 1, 8)
    filter_cutoff: float = number(0.0, 0.0, 1e4)

    def check(self, where: str) -> None:
        """Raises InputError naming the first field that does not fit."""
        check_ranges(self, where)
        for name, value in self.joint_noise.items():
            require_range(f"{where}.joint_noise.{name}", value, 0.0, 0.1)

    def filter_rows(self, period: float) -> Array:
        """Coefficients (2, filter_order + 1) of the filter, b above a.

        Args:
            period: Time between two samples, s.

        Raises:
            InputError: For a cut-off that this rate cannot have.
        """
        if self.filter_cutoff == 0.0:
            return np.eye(1, self.filter_order + 1).repeat(2, axis=0)
        nyquist = 0.5 / period
        require(
            self.filter_cutoff < nyquist,
            "filter_cutoff",
            self.filter_cutoff,
            f"below half the rate of the samples, {nyquist:g} Hz",
        )
        return np.stack(butter(self.filter_order, self.filter_cutoff / nyquist))

    def scales(
        self, names: Sequence[str], q_lower: ArrayLike, q_upper: ArrayLike
    ) -> Array:
        """Noise and resolution of each reading, rows of (2, 3n).

        Args:
            names: Names of the n joints.
            q_lower: Their lower limits (n,), rad.
            q_upper: Their upper limits (n,), rad.

        Returns:
            For the n angles, rad, and the 2n pressures, Pa.

        Raises:
            InputError: For limits that do not fit.
        """
        span = np.asarray(q_upper, float) - np.asarray(q_lower, float)
        if span.shape != (len(names),) or not np.all(
            np.isfinite(span) & (span > 0.0)
        ):
            raise InputError(
                f"limits of {len(names)} joints are needed, lower below upper"
            )
        noise = [self.joint_noise.get(name, self.angle_noise) for name in names]
        pressures = np.ones(2 * span.size)
        return np.stack(
            [
                np.append(noise * span, self.pressure_noise * pressures),
                np.append(
                    self.angle_resolution * span,
                    self.pressure_resolution * pressures,
                ),
            ]
        )


def noise_block(seed: int, block: int, size: int) -> Array:
    """Normal deviates (NOISE_ROWS, size) of a trial's samples.

    They depend on the arguments alone, so that a trial's noise is the same
    however it is simulated.

    Args:
        seed: Seed of the trial.
        block: Number of the sample divided by NOISE_ROWS, rounded down.
        size: Number of readings in a sample.
    """
    rng = np.random.default_rng([seed, block, 0x5E2503])
    return rng.standard_normal((NOISE_ROWS, size))


def memory_size(n: int, order: int) -> int:
    """Size of the memory of `read_sensors`: [filled, filters (n · order)]."""
    return 1 + n * order


@numba.njit(cache=True)
def read_sensors(
    period: float,
    scales: NDArray[np.float64],
    coefficients: NDArray[np.float64],
    deviates: NDArray[np.float64],
    row: int,
    true_state: NDArray[np.float64],
    true_pressure: NDArray[np.float64],
    estimate: NDArray[np.float64],
    pressure: NDArray[np.float64],
    memory: NDArray[np.float64],
    faults: NDArray[np.float64] | None = None,
    raw: NDArray[np.float64] | None = None,
) -> None:
    """Takes one sample of n joints, in place.

    The filter is in its transposed direct form II (Oppenheim and Schafer,
    Discrete-Time Signal Processing, Sec. 6.3).

    Args:
        period: Time since the last sample, s.
        scales: (2, 3n), see `SensorParameters.scales`.
        coefficients: (2, order + 1), see `SensorParameters.filter_rows`.
        deviates: (NOISE_ROWS, 3n) normal deviates, see `noise_block`.
        row: which of them are this sample's.
        true_state: (2n) angles, and speeds that are not read, rad, rad/s.
        true_pressure: (2n) Pa.
        estimate: (2n) [q; q̇] of the software, rad, rad/s; advanced.
        pressure: (2n) readings, Pa; set.
        memory: See `memory_size`; advanced. Where its first entry is 0 the
            filters rest at the first reading, with no speed.
        faults: (FAULT_ROWS · 3n) what is wrong, see `ReadingFault`; None:
            nothing.
        raw: (3n) readings before the filter, kept where one is stuck;
            advanced. It goes with `faults`.
    """
    n = true_state.size // 2
    order = coefficients.shape[1] - 1
    first = memory[0] == 0.0
    memory[0] = 1.0
    for c in range(3 * n):
        reading = true_state[c] if c < n else true_pressure[c - n]
        reading += scales[0, c] * deviates[row, c]
        step = scales[1, c]
        if step > 0.0:
            reading = step * np.rint(reading / step)
        if faults is not None and raw is not None:
            forced = faults[6 * n + c]
            reading += faults[3 * n + c]
            if not np.isnan(forced):
                reading = forced
            if faults[c] > 0.0 and not first:
                reading = raw[c]
            raw[c] = reading
        if c >= n:
            pressure[c - n] = reading
            continue
        w = memory[1 + c * order : 1 + (c + 1) * order]
        if first:
            estimate[c] = reading
            tail = 0.0
            for i in range(order - 1, -1, -1):
                tail += coefficients[0, i + 1] - coefficients[1, i + 1]
                w[i] = tail * reading
        y = coefficients[0, 0] * reading + w[0]
        for i in range(order):
            ahead = w[i + 1] if i + 1 < order else 0.0
            w[i] = coefficients[0, i + 1] * reading + ahead
            w[i] -= coefficients[1, i + 1] * y
        estimate[n + c] = (y - estimate[c]) / period
        estimate[c] = y
