"""Parameters of the drum's sound: membrane, shell, table, valve noise."""

import dataclasses
import math

from drake_affetto.common.errors import require, require_range
from drake_affetto.common.fields import check_ranges, number


@dataclasses.dataclass
class MembraneConfig:
    """The drum's head.

    Attributes:
        radius: Radius a, m.
        surface_density: Mass per area sigma, kg/m^2.
        tension: Tension T, N/m.
        orders: Number of angular orders: m = 0 .. orders - 1.
        circles: Number of modes for each order: n = 1 .. circles.
        loss_factor: Internal loss eta: a mode decays by eta omega / 2.
        decay_rate: Decay common to all modes (rim and support), 1/s.
        air_loading: Whether the air on both sides adds to the membrane's mass.
        hand_damping: Dashpot of a hand that rests on the head, per newton of
            its force, s/m: what Hunt-Crossley dissipation is to small
            vibrations.
    """

    radius: float = number(0.04, 1e-3, 1.0)
    surface_density: float = number(0.26, 1e-3, math.inf)
    tension: float = number(200.0, 1e-3, math.inf)
    orders: int = number(5, 1, 20)
    circles: int = number(3, 1, 20)
    loss_factor: float = number(0.012, 0.0, 1.0)
    decay_rate: float = number(4.0, 0.0, math.inf)
    air_loading: bool = True
    hand_damping: float = number(0.05, 0.0, math.inf)

    def check(self, where: str) -> None:
        """Raises InputError naming the field that does not fit."""
        check_ranges(self, where)


@dataclasses.dataclass
class BodyConfig:
    """A solid body that is knocked on: some resonances in parallel.

    Attributes:
        frequencies: Resonance frequencies, Hz.
        qualities: Quality factor of each resonance.
        masses: Modal mass of each resonance, kg.
        area: Effective radiating area: volume velocity by modal velocity, m^2.
        coupling: Part of a force on this body that shakes the head as a whole.
    """

    frequencies: list[float] = dataclasses.field(default_factory=list)
    qualities: list[float] = dataclasses.field(default_factory=list)
    masses: list[float] = dataclasses.field(default_factory=list)
    area: float = number(0.01, 0.0, math.inf)
    coupling: float = number(0.0, 0.0, 1.0)

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
        check_ranges(self, where)


@dataclasses.dataclass
class HissConfig:
    """The noise of air jets in the valves.

    Attributes:
        gain: Sound pressure (rms) at the microphone by mass flow, Pa s/kg.
        low: Lower edge of the hiss's band, Hz.
        high: Upper edge of the hiss's band, Hz.
    """

    gain: float = number(10.0, 0.0, math.inf)
    low: float = number(1500.0, 1.0, math.inf)
    high: float = 7000.0

    def check(self, where: str) -> None:
        """Raises InputError naming the field that does not fit."""
        check_ranges(self, where)
        require_range(f"{where}.high", self.high, self.low * 1.01)


def _shell_default() -> BodyConfig:
    return BodyConfig(
        frequencies=[1770.0, 3330.0, 5020.0],
        qualities=[15.0, 15.0, 12.0],
        masses=[0.074, 0.074, 0.062],
        area=0.0092,
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
    """All that the drum's sound depends on besides the forces.

    Attributes:
        rate: Sampling rate of the sound, Hz.
        membrane: The drum's head.
        shell: The drum's shell.
        table: The table on which the drum stands.
        hiss: The noise of the valves.
        rim_coupling: Part of a force at the edge of the head that shakes the
            shell; it falls with the square of the radius towards the center.
        microphone_distance: Distance from the head's center to the microphone,
            m.
        microphone_angle: Angle between the drum's axis and the microphone's
            direction, rad.
        microphone_noise: Noise of the microphone, white, rms, Pa.
    """

    rate: float = number(16000.0, 4000.0, 192000.0)
    membrane: MembraneConfig = dataclasses.field(default_factory=MembraneConfig)
    shell: BodyConfig = dataclasses.field(default_factory=_shell_default)
    table: BodyConfig = dataclasses.field(default_factory=_table_default)
    hiss: HissConfig = dataclasses.field(default_factory=HissConfig)
    rim_coupling: float = number(0.05, 0.0, 1.0)
    microphone_distance: float = number(0.3, 1e-2, math.inf)
    microphone_angle: float = number(1.0, 0.0, math.pi / 2)
    microphone_noise: float = number(1e-3, 0.0, math.inf)

    def check(self, where: str) -> None:
        """Raises InputError naming the field that does not fit."""
        check_ranges(self, where)
        self.membrane.check(f"{where}.membrane")
        self.shell.check(f"{where}.shell")
        self.table.check(f"{where}.table")
        self.hiss.check(f"{where}.hiss")
        require_range(
            f"{where}.hiss.high", self.hiss.high, high=0.49 * self.rate
        )
