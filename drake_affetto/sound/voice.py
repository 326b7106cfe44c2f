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

import math

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import signal, special

from drake_affetto.common.errors import (
    require,
    require_array,
)
from drake_affetto.common.typing import Array
from drake_affetto.sound.modes import (
    body_modes,
    membrane_modes,
    transition_matrix,
)
from drake_affetto.sound.ringing import ring
from drake_affetto.sound.voice_config import VoiceConfig

_MICROPHONE = 0x50BD


def microphone_noise(seed: int) -> np.random.Generator:
    """The generator of the microphone's noise in the trial of a seed."""
    return np.random.default_rng([seed, _MICROPHONE])


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
            id(modes): transition_matrix(modes, step)
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
        """Sampling rate of the sound, Hz."""
        return self.config.rate

    def mode_shapes(self, radius: ArrayLike) -> Array:
        """Membrane mode shapes J_m(j_mn r/a), (T, N), at radii (T), m.

        Args:
            radius: Distances from the center of the head (T), m.
        """
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
            t: times of the samples (T), evenly spaced, s.
            head_force: normal force on the head (T), N.
            head_radius: where it acts, distance from the center (T), m;
                read only where there is force.
            shell_force: force on the shell (T), N.
            table_force: force on the table (T), N.
            mass_flow: air through the valves, (T) or (T, valves), kg/s;
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
        ring(
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
