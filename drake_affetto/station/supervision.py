"""Whether a scenario's robot is supervised, and what then happens."""

import dataclasses

from drake_affetto.common.errors import naming, require_choice
from drake_affetto.common.fields import file_name, file_names
from drake_affetto.common.yaml_config import load_config
from drake_affetto.faults.supervision import SupervisorParameters
from drake_affetto.pneumatics.conditions import REST, VENT

DEFAULT_FILE = "package://drake_affetto/supervisor.yaml"

_ACTIONS = {"vent": VENT, "hold": REST}


@dataclasses.dataclass
class SupervisionConfig:
    """A scenario's supervisor.

    Attributes:
        enabled: Whether there is one. A trial that it does not pass is not
            valid: it is neither judged nor learned from.
        parameters: YAML file of its thresholds, `SupervisorParameters`.
        overlays: YAML files that change some of them.
        on_invalid: What the valves then do: "vent" (all chambers are emptied)
            or "hold" (all valves rest in their middle, and the chambers keep
            their air for a while).
    """

    enabled: bool = False
    parameters: str = file_name(DEFAULT_FILE)
    overlays: list[str] = file_names()
    on_invalid: str = "hold"

    @property
    def action(self) -> int:
        """What the valves are told, see `pneumatics.conditions`."""
        return _ACTIONS[self.on_invalid]

    def check(self, where: str) -> None:
        """Raises InputError for a file or a value in it that does not fit."""
        require_choice(f"{where}.on_invalid", self.on_invalid, *_ACTIONS)
        with naming(where):
            self.load()

    def load(self) -> SupervisorParameters:
        """Reads the thresholds.

        Raises:
            InputError: For a file or a value that does not fit, by name.
        """
        return load_config(SupervisorParameters, self.parameters, self.overlays)
