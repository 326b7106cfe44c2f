"""Modes of the membrane, the shell and the table as damped oscillators."""

import dataclasses
import math

import numpy as np
from numpy.typing import NDArray
from scipy import linalg, special

from drake_affetto.common.typing import Array
from drake_affetto.sound.voice_config import BodyConfig, VoiceConfig

_AIR_DENSITY = 1.2  # kg/m^3

_SOUND_SPEED = 343.0  # m/s


@dataclasses.dataclass(frozen=True)
class Modes:
    """Damped oscillators and what they sound like, N of them."""

    omega: Array
    """Undamped angular frequency (N), rad/s."""
    alpha: Array
    """Decay rate (N), 1/s: free motion falls as exp(-alpha t)."""
    mass: Array
    """Modal mass (N), kg."""
    gain: Array
    """Pressure at the microphone by modal acceleration (N), Pa s^2/m."""


@dataclasses.dataclass(frozen=True)
class MembraneModes(Modes):
    """Modes of the membrane, ordered by frequency."""

    order: NDArray[np.int64]
    """Number of nodal diameters m (N)."""
    circle: NDArray[np.int64]
    """Number of nodal circles n, the rim among them (N)."""
    zero: Array
    """j_mn (N)."""
    mean: Array
    """Mean of the mode shape over the head (N): the response to a force
    spread over all of it, 0 for m > 0."""


def membrane_modes(config: VoiceConfig) -> MembraneModes:
    """The modes of `config.membrane` as its microphone hears them.

    With air loading, a travelling pattern of wavenumber kappa = j_mn / a
    carries rho / kappa of air per area on each side. Decay is the sum of rim,
    internal loss and, for m = 0, the radiation of a simple source. Modes
    above 0.45 of the sampling rate are left out.
    """
    membrane = config.membrane
    a = membrane.radius
    order = np.repeat(np.arange(membrane.orders), membrane.circles)
    circle = np.tile(np.arange(1, membrane.circles + 1), membrane.orders)
    zero = np.concatenate(
        [special.jn_zeros(m, membrane.circles) for m in range(membrane.orders)]
    )
    kappa = zero / a
    density = np.full_like(kappa, membrane.surface_density)
    if membrane.air_loading:
        density += 2.0 * _AIR_DENSITY / kappa
    omega = kappa * np.sqrt(membrane.tension / density)
    slope = special.jv(order + 1, zero)
    area = math.pi * a**2
    mass = density * area * slope**2 * np.where(order == 0, 1.0, 0.5)
    mean = np.where(order == 0, 2.0 * slope / zero, 0.0)
    # Rayleigh integral: 2 pi * integral of J_m(kappa r) J_m(beta r) r dr,
    # in closed form because J_m(kappa a) = 0. On the axis (beta = 0) only
    # m = 0 is heard.
    beta = omega / _SOUND_SPEED * math.sin(config.microphone_angle)
    integral = (
        a * kappa * slope * special.jv(order, beta * a) / (kappa**2 - beta**2)
    )
    gain = (
        _AIR_DENSITY
        / (4.0 * math.pi * config.microphone_distance)
        * (2.0 * math.pi * integral)
    )
    radiation = (
        _AIR_DENSITY
        * (mean * area * omega) ** 2
        / (8.0 * math.pi * _SOUND_SPEED * mass)
    )
    alpha = membrane.decay_rate + 0.5 * membrane.loss_factor * omega + radiation
    keep = omega < 2.0 * math.pi * 0.45 * config.rate
    pick = np.flatnonzero(keep)[np.argsort(omega[keep], kind="stable")]
    return MembraneModes(
        omega=omega[pick],
        alpha=alpha[pick],
        mass=mass[pick],
        gain=gain[pick],
        order=order[pick],
        circle=circle[pick],
        zero=zero[pick],
        mean=mean[pick],
    )


def body_modes(body: BodyConfig, config: VoiceConfig) -> Modes:
    """The resonances of shell or table as simple sources."""
    omega = 2.0 * math.pi * np.asarray(body.frequencies, dtype=float)
    return Modes(
        omega=omega,
        alpha=0.5 * omega / np.asarray(body.qualities, dtype=float),
        mass=np.asarray(body.masses, dtype=float),
        gain=np.full_like(
            omega,
            _AIR_DENSITY
            * body.area
            / (4.0 * math.pi * config.microphone_distance),
        ),
    )


def transition_matrix(modes: Modes, step: float) -> Array:
    """Exact steps (N, 2, 4) of the oscillators for linearly changing force.

    Columns: q, q', force at the start, force at the end of the step.
    """
    result = np.zeros((len(modes.omega), 2, 4))
    for i, (omega, alpha, mass) in enumerate(
        zip(modes.omega, modes.alpha, modes.mass, strict=True)
    ):
        # q, q', force and its slope as one linear system.
        matrix = np.zeros((4, 4))
        matrix[0, 1] = 1.0
        matrix[1] = [-(omega**2), -2.0 * alpha, 1.0 / mass, 0.0]
        matrix[2, 3] = 1.0
        flow = linalg.expm(matrix * step)
        result[i, :, :2] = flow[:2, :2]
        result[i, :, 2] = flow[:2, 2] - flow[:2, 3] / step
        result[i, :, 3] = flow[:2, 3] / step
    return result
