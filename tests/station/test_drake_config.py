"""Whatever Drake would refuse is refused by field, and nothing else."""

from pydrake.multibody.plant import MultibodyPlantConfig
from pydrake.systems.analysis import SimulatorConfig
import pytest

from drake_affetto.common.errors import InputError
from drake_affetto.station.drake_config import (
    LONGEST_STEP,
    check_plant_config,
    check_simulator_config,
)

PLANT = {
    "time_step": [0.0, -1.0, float("nan"), 1.01 * LONGEST_STEP],
    "penetration_allowance": [0.0, -1.0, float("inf")],
    "stiction_tolerance": [0.0, -1.0, float("nan")],
    "sap_near_rigid_threshold": [-1.0, float("nan")],
    "contact_model": ["jelly", ""],
    "discrete_contact_approximation": ["jelly"],
    "contact_surface_representation": ["jelly", ""],
}
SIMULATOR = {
    "integration_scheme": ["guess", ""],
    "max_step_size": [0.0, -1.0, float("nan")],
    "accuracy": [0.0, -1.0, float("inf")],
    "target_realtime_rate": [-1.0, float("nan")],
    "start_time": [1.0, float("nan")],
}


@pytest.mark.parametrize(
    ("field", "value"), [(f, v) for f, values in PLANT.items() for v in values]
)
def test_a_plant_s_field_that_cannot_be_is_named(field, value):
    config = MultibodyPlantConfig(time_step=0.001)
    check_plant_config(config, "s.plant_config")
    setattr(config, field, value)
    with pytest.raises(InputError) as caught:
        check_plant_config(config, "s.plant_config")
    told = str(caught.value)
    assert told.startswith(f"s.plant_config.{field} is {value!r}, expected ")
    assert "\n" not in told


@pytest.mark.parametrize(
    ("field", "value"),
    [(f, v) for f, values in SIMULATOR.items() for v in values],
)
def test_a_simulator_s_field_that_cannot_be_is_named(field, value):
    config = SimulatorConfig()
    check_simulator_config(config, "s.simulator_config")
    setattr(config, field, value)
    with pytest.raises(InputError) as caught:
        check_simulator_config(config, "s.simulator_config")
    told = str(caught.value)
    assert told.startswith(
        f"s.simulator_config.{field} is {value!r}, expected "
    )


def test_every_number_that_drake_takes_is_looked_at():
    """A field of a later Drake is seen here before it ends a process."""
    for config, known in (
        (MultibodyPlantConfig, PLANT),
        (SimulatorConfig, SIMULATOR),
    ):
        numbers = {f.name for f in config.__fields__ if f.type is not bool}
        assert numbers == set(known)
