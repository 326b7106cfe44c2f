"""What makes one trial differ from the next: a scenario's one switch."""

import dataclasses

from drake_affetto.common.errors import naming
from drake_affetto.common.fields import file_name, file_names
from drake_affetto.common.yaml_config import load_config
from drake_affetto.pneumatics.variation import ActuatorVariation
from drake_affetto.sensing.readings import SensorParameters

DEFAULT_FILE = "package://drake_affetto/variation.yaml"


@dataclasses.dataclass
class VariationParameters:
    """How the robot departs from its model.

    Attributes:
        actuators: Friction, valves and air supply, drawn once a trial.
        sensors: Resolution and noise of its sensors, and their filter.
    """

    actuators: ActuatorVariation = dataclasses.field(
        default_factory=ActuatorVariation
    )
    sensors: SensorParameters = dataclasses.field(
        default_factory=SensorParameters
    )

    def check(self, where: str) -> None:
        """Raises InputError naming the first field that does not fit."""
        self.actuators.check(f"{where}.actuators")
        self.sensors.check(f"{where}.sensors")


@dataclasses.dataclass
class VariationConfig:
    """Whether a scenario's robot varies, and how.

    Attributes:
        enabled: Switches all of it. Without it joints and pressures are known
            exactly, and one command always gives one and the same movement.
        parameters: YAML file of `VariationParameters`.
        overlays: YAML files that change some of them.
    """

    enabled: bool = False
    parameters: str = file_name(DEFAULT_FILE)
    overlays: list[str] = file_names()

    def check(self, where: str) -> None:
        """Raises InputError for a file or a value in it that does not fit."""
        with naming(where):
            self.load()

    def load(self) -> VariationParameters:
        """Reads the parameters.

        Raises:
            InputError: For a file or a value that does not fit, by name.
        """
        return load_config(VariationParameters, self.parameters, self.overlays)
