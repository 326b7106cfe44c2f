"""The drum's voice: modal synthesis of a struck membrane, shell and table.

The head is an ideal circular membrane of radius a, tension T and surface
density sigma, clamped at its rim, whose modes

    phi_mn(r, theta) = J_m(j_mn r / a) cos(m theta)

are damped oscillators driven by the contact force at its own radius r,

    M_mn (q'' + 2 alpha_mn q' + omega_mn^2 q) = phi_mn(r, 0) F,

with j_mn the n-th zero of J_m, omega_mn = (j_mn / a) sqrt(T / sigma) and
M_mn = sigma * integral of phi_mn^2 (N. H. Fletcher and T. D. Rossing, The
Physics of Musical Instruments, ch. 3 and 18). theta = 0 is where the force
acts, so the sine modes stay silent. The pressure at the microphone is the
Rayleigh integral of the head's acceleration in the far field, of a drum that
is open below (a simple source, 4 pi, and no stiffness of enclosed air).
Shell and table are a few resonances each, with a mass and a radiating area.

A soft hand excites modes by the kink with which it arrives and leaves
(F' = k v), hardly by pressing: loudness follows the speed of the strike.
"""

import dataclasses
import math
from pathlib import Path

import numba
import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import linalg, signal, special
from scipy.io import wavfile

from drake_affetto.common.errors import (
    InputError,
    require,
    require_array,
    require_range,
)
from drake_affetto.common.typing import Array

_AIR_DENSITY = 1.2  # kg/m^3
_SOUND_SPEED = 343.0  # m/s


@dataclasses.dataclass
class MembraneConfig:
    """The drum's head."""

    radius: float = 0.065
    """Radius a [m]."""
    surface_density: float = 0.26
    """Mass per area sigma [kg/m^2]."""
    tension: float = 200.0
    """Tension T [N/m]."""
    orders: int = 5
    """Number of angular orders: m = 0 .. orders - 1."""
    circles: int = 3
    """Number of modes for each order: n = 1 .. circles."""
    loss_factor: float = 0.012
    """Internal loss eta: a mode decays by eta omega / 2."""
    decay_rate: float = 4.0
    """Decay common to all modes (rim and support) [1/s]."""
    air_loading: bool = True
    """Whether the air on both sides adds to the membrane's mass."""
    hand_damping: float = 0.05
    """Dashpot of a hand that rests on the head, per newton of its force
    [s/m]: what Hunt-Crossley dissipation is to small vibrations."""

    def check(self, where: str) -> None:
        """Raises InputError naming the field that does not fit."""
        require_range(f"{where}.radius", self.radius, 1e-3, 1.0)
        require_range(f"{where}.surface_density", self.surface_density, 1e-3)
        require_range(f"{where}.tension", self.tension, 1e-3)
        require_range(f"{where}.orders", self.orders, 1, 20)
        require_range(f"{where}.circles", self.circles, 1, 20)
        require_range(f"{where}.loss_factor", self.loss_factor, 0.0, 1.0)
        require_range(f"{where}.decay_rate", self.decay_rate, 0.0)
        require_range(f"{where}.hand_damping", self.hand_damping, 0.0)


@dataclasses.dataclass
class BodyConfig:
    """A solid body that is knocked on: some resonances in parallel."""

    frequencies: list[float] = dataclasses.field(default_factory=list)
    """Resonance frequencies [Hz]."""
    qualities: list[float] = dataclasses.field(default_factory=list)
    """Quality factor of each resonance."""
    masses: list[float] = dataclasses.field(default_factory=list)
    """Modal mass of each resonance [kg]."""
    area: float = 0.01
    """Effective radiating area: volume velocity by modal velocity [m^2]."""
    coupling: float = 0.0
    """Part of a force on this body that shakes the head as a whole."""

    def check(self, where: str) -> None:
        """Raises InputError naming the field that does not fit."""
        for name in ("qualities", "masses"):
            values = getattr(self, name)
            require(
                len(values) == len(self.frequencies),
                f"{where}.{name}",
                values,
                f"{len(self.frequencies)} numbers, one for each frequency",
            )
        for name in ("frequencies", "qualities", "masses"):
            for i, value in enumerate(getattr(self, name)):
                require_range(f"{where}.{name}[{i}]", value, 1e-3)
        require_range(f"{where}.area", self.area, 0.0)
        require_range(f"{where}.coupling", self.coupling, 0.0, 1.0)


@dataclasses.dataclass
class HissConfig:
    """The noise of air jets in the valves."""

    gain: float = 10.0
    """Sound pressure (rms) at the microphone by mass flow [Pa s/kg]."""
    low: float = 1500.0
    """Lower edge of the hiss's band [Hz]."""
    high: float = 7000.0
    """Upper edge of the hiss's band [Hz]."""

    def check(self, where: str) -> None:
        """Raises InputError naming the field that does not fit."""
        require_range(f"{where}.gain", self.gain, 0.0)
        require_range(f"{where}.low", self.low, 1.0)
        require_range(f"{where}.high", self.high, self.low * 1.01)


def _shell_default() -> BodyConfig:
    return BodyConfig(
        frequencies=[670.0, 1260.0, 1900.0],
        qualities=[15.0, 15.0, 12.0],
        masses=[0.12, 0.12, 0.1],
        area=0.015,
        coupling=1e-4,
    )


def _table_default() -> BodyConfig:
    return BodyConfig(
        frequencies=[48.0, 77.0, 118.0, 260.0],
        qualities=[4.0, 4.0, 5.0, 6.0],
        masses=[10.0, 8.0, 8.0, 5.0],
        area=0.1,
        coupling=5e-5,
    )


@dataclasses.dataclass
class VoiceConfig:
    """All that the drum's sound depends on besides the forces."""

    rate: float = 16000.0
    """Sampling rate of the sound [Hz]."""
    membrane: MembraneConfig = dataclasses.field(default_factory=MembraneConfig)
    shell: BodyConfig = dataclasses.field(default_factory=_shell_default)
    table: BodyConfig = dataclasses.field(default_factory=_table_default)
    hiss: HissConfig = dataclasses.field(default_factory=HissConfig)
    rim_coupling: float = 0.05
    """Part of a force at the edge of the head that shakes the shell; it falls
    with the square of the radius towards the center."""
    microphone_distance: float = 0.3
    """Distance from the head's center to the microphone [m]."""
    microphone_angle: float = 1.0
    """Angle between the drum's axis and the microphone's direction [rad]."""
    microphone_noise: float = 1e-3
    """Noise of the microphone, white, rms [Pa]."""

    def check(self, where: str) -> None:
        """Raises InputError naming the field that does not fit."""
        require_range(f"{where}.rate", self.rate, 4000.0, 192000.0)
        self.membrane.check(f"{where}.membrane")
        self.shell.check(f"{where}.shell")
        self.table.check(f"{where}.table")
        self.hiss.check(f"{where}.hiss")
        require_range(
            f"{where}.hiss.high", self.hiss.high, high=0.49 * self.rate
        )
        require_range(f"{where}.rim_coupling", self.rim_coupling, 0.0, 1.0)
        require_range(
            f"{where}.microphone_distance", self.microphone_distance, 1e-2
        )
        require_range(
            f"{where}.microphone_angle",
            self.microphone_angle,
            0.0,
            math.pi / 2,
        )
        require_range(f"{where}.microphone_noise", self.microphone_noise, 0.0)


@dataclasses.dataclass(frozen=True)
class Modes:
    """Damped oscillators and what they sound like, N of them."""

    omega: Array
    """Undamped angular frequency (N) [rad/s]."""
    alpha: Array
    """Decay rate (N) [1/s]: free motion falls as exp(-alpha t)."""
    mass: Array
    """Modal mass (N) [kg]."""
    gain: Array
    """Pressure at the microphone by modal acceleration (N) [Pa s^2/m]."""


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


def _transition(modes: Modes, step: float) -> Array:
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


@numba.njit(cache=True)
def _touch(first, second, third):
    """The part of an interval in which a contact sets in.

    Args:
        first: force at the contact's first sample; it was zero before.
        second: how much the force rises to the next sample.
        third: and from there to the one after that.

    Returns:
        How long before its first sample the contact began (0 to 1), and the
        slopes of the force there and at the first sample: by a parabola
        through the three samples, held monotone.
    """
    if first < 0.0:
        length, start, end = _touch(-first, -second, -third)
        return length, -start, -end
    bend = third - second
    end = min(max(second - 0.5 * bend, 0.0), 3.0 * max(second, 0.0))
    start = np.sqrt(max(end**2 - 2.0 * bend * first, 0.0))
    if start + end > 2.0 * first:
        return 2.0 * first / (start + end), start, end
    # It set in just after the sample before.
    end = min(end, 2.0 * first)
    return 1.0, 2.0 * first - end, end


@numba.njit(cache=True)
def _touches(drive):
    """How the forces (T, N) run between their samples.

    A soft contact sets in with a kink (F' = k v), and at some time between
    two samples: there its course is extrapolated, so that what the kink
    excites depends little on how the samples happen to lie. So with its end.

    Returns:
        Slopes at the samples (T, N) by period; and of the interval after
        each sample the length of the part in which there is force (T, N), 0
        to 1, and where that is not all of it, the slope at which the force
        sets in or ends (T, N).
    """
    rows, count = drive.shape
    slope = np.zeros((rows, count))
    length = np.ones((rows, count))
    edge = np.zeros((rows, count))
    for k in range(1, rows - 1):
        for i in range(count):
            force = drive[k, i]
            before = force - drive[k - 1, i]
            after = drive[k + 1, i] - force
            if before * after > 0.0:
                # Central difference, limited to what stays monotone.
                limit = 3.0 * min(abs(before), abs(after))
                slope[k, i] = max(-limit, min(limit, 0.5 * (before + after)))
            if force != 0.0 and drive[k - 1, i] == 0.0 and k + 2 < rows:
                length[k - 1, i], edge[k - 1, i], slope[k, i] = _touch(
                    force, after, drive[k + 2, i] - drive[k + 1, i]
                )
            elif force != 0.0 and drive[k + 1, i] == 0.0 and k > 1:
                length[k, i], edge[k, i], slope[k, i] = _touch(
                    force, -before, drive[k - 2, i] - drive[k - 1, i]
                )
                edge[k, i] *= -1.0
                slope[k, i] *= -1.0
    return slope, length, edge


@numba.njit(cache=True)
def _ring(
    drive,
    dashpot,
    shape,
    transition,
    mass,
    stiffness,
    gain,
    period,
    rate,
    pressure,
):
    """Adds what the modes radiate to `pressure`.

    Between its samples the modal force follows a monotone cubic (C1, no
    overshoot): a hold or a chain of lines would ring at the sampling
    frequency of the simulation, a spline would swing before the touch. Where
    a contact begins or ends, see `_touches`.

    Args:
        drive: modal forces (T, N) [N], `period` apart.
        dashpot: damping constant of the hand (T) [N s/m].
        shape: mode shapes at the hand (T, N).
        transition: see `_transition`.
        mass: modal masses (N).
        stiffness: modal stiffnesses (N).
        gain: pressure by acceleration (N).
        period: time between rows of `drive` [s].
        rate: sampling rate of `pressure` [Hz].
        pressure: the sound (S), added to.
    """
    rows, count = drive.shape
    slope, length, edge = _touches(drive)
    # What pushes from the start has done so for long: no jump at t = 0.
    force = drive[0].copy()
    q = force / stiffness
    v = np.zeros(count)
    step = 1.0 / rate
    quiet = True
    for n in range(1, len(pressure)):
        position = n / (rate * period)
        k = min(int(position), rows - 2)
        u = min(position - k, 1.0)
        if quiet:
            # Nothing moves and nothing pushes: skip to the next force.
            driven = False
            for i in range(count):
                if drive[k, i] != 0.0 or drive[k + 1, i] != 0.0:
                    driven = True
            if not driven:
                continue
            quiet = False
        c = dashpot[k] + u * (dashpot[k + 1] - dashpot[k])
        near = k if u < 0.5 else k + 1
        total = 0.0
        speed = 0.0
        mobility = 0.0
        for i in range(count):
            new = 0.0
            left, right = drive[k, i], drive[k + 1, i]
            if left != 0.0 or right != 0.0:
                part = length[k, i]
                rise_left, rise_right = slope[k, i], slope[k + 1, i]
                x = u
                if left == 0.0:
                    x = max((u - 1.0) / part + 1.0, 0.0)
                    rise_left = edge[k, i]
                elif right == 0.0:
                    x = min(u / part, 1.0)
                    rise_right = edge[k, i]
                y = 1.0 - x
                new = y * y * (
                    (1.0 + 2.0 * x) * left + x * part * rise_left
                ) + x * x * ((1.0 + 2.0 * y) * right - y * part * rise_right)
            a = transition[i]
            q_new = (
                a[0, 0] * q[i]
                + a[0, 1] * v[i]
                + a[0, 2] * force[i]
                + a[0, 3] * new
            )
            v_new = (
                a[1, 0] * q[i]
                + a[1, 1] * v[i]
                + a[1, 2] * force[i]
                + a[1, 3] * new
            )
            total += gain[i] * (v_new - v[i])
            q[i] = q_new
            v[i] = v_new
            force[i] = new
            speed += shape[near, i] * v_new
            mobility += shape[near, i] ** 2 / mass[i]
        if c > 0.0:
            # The hand slows the point that it touches (implicit step).
            impulse = c * step * speed / (1.0 + c * step * mobility)
            for i in range(count):
                change = -impulse * shape[near, i] / mass[i]
                v[i] += change
                total += gain[i] * change
        pressure[n] += total * rate
        if n % 1024 == 0:
            energy = 0.0
            for i in range(count):
                energy += v[i] ** 2 + force[i] ** 2
            if energy < 1e-24:
                q[:] = 0.0
                v[:] = 0.0
                force[:] = 0.0
                quiet = True


class DrumVoice:
    """Turns contact forces into the sound that a microphone records."""

    def __init__(self, config: VoiceConfig | None = None):
        """Precomputes the modes.

        Raises:
            InputError: if a number of the config does not fit.
        """
        self.config = VoiceConfig() if config is None else config
        self.config.check("voice")
        self.membrane = membrane_modes(self.config)
        self._shapes = special.jv(
            self.membrane.order,
            np.linspace(0.0, 1.0, 2048)[:, None] * self.membrane.zero,
        )
        self.shell = body_modes(self.config.shell, self.config)
        self.table = body_modes(self.config.table, self.config)
        step = 1.0 / self.config.rate
        self._steps = {
            id(modes): _transition(modes, step)
            for modes in (self.membrane, self.shell, self.table)
        }
        self._hiss_filter = signal.butter(
            2,
            [self.config.hiss.low, self.config.hiss.high],
            btype="bandpass",
            fs=self.config.rate,
            output="sos",
        )
        # White noise of unit variance leaves the filter with this rms.
        impulse = signal.sosfilt(
            self._hiss_filter, np.eye(1, 4096, dtype=float)[0]
        )
        self._hiss_rms = float(np.sqrt(np.sum(impulse**2)))

    @property
    def rate(self) -> float:
        """Sampling rate of the sound [Hz]."""
        return self.config.rate

    def mode_shapes(self, radius: ArrayLike) -> Array:
        """Membrane mode shapes J_m(j_mn r/a), (T, N), at radii (T) [m]."""
        scaled = np.clip(
            np.asarray(radius, dtype=float) / self.config.membrane.radius,
            0.0,
            1.0,
        )
        # Linear in a table of 2048 radii: within 1e-5 of the Bessel function,
        # at a fiftieth of its cost.
        place = scaled * (len(self._shapes) - 1)
        below = np.minimum(place.astype(int), len(self._shapes) - 2)
        share = (place - below)[:, None]
        return (1.0 - share) * self._shapes[below] + share * self._shapes[
            below + 1
        ]

    def synthesize(
        self,
        t: ArrayLike,
        head_force: ArrayLike,
        head_radius: ArrayLike,
        shell_force: ArrayLike | None = None,
        table_force: ArrayLike | None = None,
        mass_flow: ArrayLike | None = None,
        rng: np.random.Generator | None = None,
    ) -> Array:
        """The sound pressure at the microphone.

        Args:
            t: times of the samples (T), evenly spaced [s].
            head_force: normal force on the head (T) [N].
            head_radius: where it acts, distance from the center (T) [m];
                read only where there is force.
            shell_force: force on the shell (T) [N].
            table_force: force on the table (T) [N].
            mass_flow: air through the valves, (T) or (T, valves) [kg/s];
                several jets add as independent noises.
            rng: source of all noise. Without it the microphone is noiseless
                and the valves are silent.

        Returns:
            Samples [Pa] at `rate`, the first at t[0]; as many as fit into
            the span of `t`.

        Raises:
            InputError: for arrays of unequal length, uneven times or numbers
                that are not finite.
        """
        times = _vector("t", t)
        require(len(times) >= 2, "t", f"{len(times)} samples", "at least two")
        rows = len(times)
        period = float(times[-1] - times[0]) / (rows - 1)
        require(
            period > 0.0
            and bool(
                np.allclose(
                    np.diff(times), period, rtol=0.0, atol=1e-3 * period
                )
            ),
            "t",
            "uneven times",
            "evenly spaced, rising times",
        )
        head = _vector("head_force", head_force, rows)
        shell = _vector("shell_force", shell_force, rows)
        table = _vector("table_force", table_force, rows)
        radius = _vector("head_radius", head_radius, rows)
        config = self.config
        samples = math.floor((rows - 1) * period * config.rate + 1e-6) + 1
        pressure = np.zeros(samples)

        shape = np.zeros((rows, len(self.membrane.omega)))
        touched, places = _held_radius(head, radius)
        if len(touched):
            shape[touched] = self.mode_shapes(places)
        shaken = config.shell.coupling * shell + config.table.coupling * table
        self._add(
            self.membrane,
            shape * head[:, None] + shaken[:, None] * self.membrane.mean,
            pressure,
            period,
            config.membrane.hand_damping * head,
            shape,
        )
        edge = np.zeros(rows)
        edge[touched] = (places / config.membrane.radius) ** 2
        knock = shell + config.rim_coupling * edge * head
        for modes, force in ((self.shell, knock), (self.table, table)):
            self._add(
                modes,
                np.repeat(force[:, None], len(modes.omega), axis=1),
                pressure,
                period,
            )
        if rng is not None:
            pressure += config.microphone_noise * rng.standard_normal(samples)
            if mass_flow is not None:
                pressure += self._hiss(mass_flow, rows, period, samples, rng)
        return pressure

    def _add(self, modes, drive, pressure, period, dashpot=None, shape=None):
        """Adds the sound of `modes` under modal forces `drive` (T, N)."""
        if not len(modes.omega) or not drive.any():
            return
        _ring(
            np.ascontiguousarray(drive),
            np.zeros(len(drive)) if dashpot is None else dashpot,
            np.zeros_like(drive) if shape is None else shape,
            self._steps[id(modes)],
            modes.mass,
            modes.mass * modes.omega**2,
            modes.gain,
            period,
            self.config.rate,
            pressure,
        )

    def _hiss(self, mass_flow, rows, period, samples, rng) -> Array:
        flow = np.asarray(mass_flow, dtype=float)
        require(
            flow.ndim in (1, 2) and len(flow) == rows,
            "mass_flow",
            flow.shape,
            f"an array of {rows} rows",
        )
        require_array("mass_flow", flow)
        if flow.ndim == 2:
            flow = np.sqrt(np.sum(flow**2, axis=1))
        level = np.interp(
            np.arange(samples) / self.config.rate,
            np.arange(rows) * period,
            np.abs(flow),
        )
        noise = signal.sosfilt(self._hiss_filter, rng.standard_normal(samples))
        return (self.config.hiss.gain / self._hiss_rms) * level * noise


def _vector(
    field: str, values: ArrayLike | None, rows: int | None = None
) -> Array:
    if values is None:
        return np.zeros(rows or 0)
    return np.ascontiguousarray(
        require_array(field, values, (rows,), expected="one number a sample")
    )


def _held_radius(
    force: Array, radius: Array
) -> tuple[NDArray[np.int64], Array]:
    """Samples in or beside a contact, and the contact's radius there.

    Just before and after a contact there is no place yet; the contact's own
    is meant, so that the modal force does not start from the center.
    """
    contact = force > 0.0
    place = np.where(contact, radius, np.nan)
    place[:-1] = np.where(contact[:-1], place[:-1], place[1:])
    free_after = ~contact[1:] & contact[:-1]
    place[1:][free_after] = radius[:-1][free_after]
    touched = np.flatnonzero(np.isfinite(place))
    return touched, place[touched]


def write_wav(
    path: str | Path,
    pressure: ArrayLike,
    rate: float,
    full_scale: float = 2.0,
) -> float:
    """Writes a recording as 16-bit mono WAV.

    The gain is fixed, so that the loudness of two files can be compared; only
    a sound beyond `full_scale` is written more quietly, by whole steps of
    6 dB, rather than clipped.

    Args:
        path: the file.
        pressure: sound pressure (S) [Pa].
        rate: sampling rate [Hz].
        full_scale: pressure of the largest sample value [Pa].

    Returns:
        The full scale that was used [Pa].

    Raises:
        InputError: if the file cannot be written.
    """
    samples = _vector("pressure", pressure)
    require_range("full_scale", full_scale, 1e-9)
    peak = float(np.max(np.abs(samples), initial=0.0))
    while peak > full_scale:
        full_scale *= 2.0
    data = np.round(samples / full_scale * 32767.0).astype(np.int16)
    try:
        wavfile.write(path, round(rate), data)
    except OSError as error:
        raise InputError(f"cannot write {path}: {error.strerror}") from error
    return full_scale
