"""Parameters of the drum's sound: membrane, shell, table, valve noise."""

import dataclasses
import math

from drake_affetto.common.errors import (
    require,
    require_range,
)


@dataclasses.dataclass
class MembraneConfig:
    """The drum's head."""

    radius: float = 0.065
    """Radius a, m."""
    surface_density: float = 0.26
    """Mass per area sigma, kg/m^2."""
    tension: float = 200.0
    """Tension T, N/m."""
    orders: int = 5
    """Number of angular orders: m = 0 .. orders - 1."""
    circles: int = 3
    """Number of modes for each order: n = 1 .. circles."""
    loss_factor: float = 0.012
    """Internal loss eta: a mode decays by eta omega / 2."""
    decay_rate: float = 4.0
    """Decay common to all modes (rim and support), 1/s."""
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
    """Resonance frequencies, Hz."""
    qualities: list[float] = dataclasses.field(default_factory=list)
    """Quality factor of each resonance."""
    masses: list[float] = dataclasses.field(default_factory=list)
    """Modal mass of each resonance, kg."""
    area: float = 0.01
    """Effective radiating area: volume velocity by modal velocity, m^2."""
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
    """Sound pressure (rms) at the microphone by mass flow, Pa s/kg."""
    low: float = 1500.0
    """Lower edge of the hiss's band, Hz."""
    high: float = 7000.0
    """Upper edge of the hiss's band, Hz."""

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
    """Sampling rate of the sound, Hz."""
    membrane: MembraneConfig = dataclasses.field(default_factory=MembraneConfig)
    shell: BodyConfig = dataclasses.field(default_factory=_shell_default)
    table: BodyConfig = dataclasses.field(default_factory=_table_default)
    hiss: HissConfig = dataclasses.field(default_factory=HissConfig)
    rim_coupling: float = 0.05
    """Part of a force at the edge of the head that shakes the shell; it falls
    with the square of the radius towards the center."""
    microphone_distance: float = 0.3
    """Distance from the head's center to the microphone, m."""
    microphone_angle: float = 1.0
    """Angle between the drum's axis and the microphone's direction, rad."""
    microphone_noise: float = 1e-3
    """Noise of the microphone, white, rms, Pa."""

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
