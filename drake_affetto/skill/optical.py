"""The optical map as one of the maps that a transfer can learn."""

from drake_affetto.common.typing import Array
from drake_affetto.perception.optical_map import OpticalMap
from drake_affetto.skill.mappings import Mapping


class OpticalMapping(OpticalMap, Mapping):
    """h of `TransferRegressor` with the mirror's plane as its parameters.

    See `OpticalMap` for what it is given.
    """

    def expectation(self, parameters: Array) -> tuple[Array, Array] | None:
        """Where a mirror may stand; see `PlaneExpectation`."""
        return self.unexpected(parameters)
