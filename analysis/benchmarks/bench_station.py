"""Speed of the closed loop beside that of the bare plant, in one run."""

import time

import numpy as np
from pydrake.multibody.plant import AddMultibodyPlant
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder

from drake_affetto.scene import world
from drake_affetto.station.scenario import load_scenario
from drake_affetto.station.station import AffettoStation


def _bare_plant(scenario) -> Simulator:
    """The same world with the same joints locked, and no torque."""
    builder = DiagramBuilder()
    plant, _ = AddMultibodyPlant(scenario.plant_config, builder)
    world.add_world(plant, scenario.world)
    plant.Finalize()
    diagram = builder.Build()
    simulator = Simulator(diagram)
    context = plant.GetMyMutableContextFromRoot(simulator.get_mutable_context())
    world.lock_inactive(plant, context, scenario.active_joints)
    plant.get_actuation_input_port().FixValue(
        context, np.zeros(plant.num_actuators())
    )
    return simulator


def measure(duration: float = 1.0, repeats: int = 7) -> tuple[float, float]:
    """CPU seconds per simulated second: bare plant, closed loop.

    The two take turns, and the least of each counts, so that whatever else
    the machine does weighs on neither alone.
    """
    scenario = load_scenario("drumming")
    station = AffettoStation(scenario)
    closed = Simulator(station, station.CreateDefaultContext())
    bare = _bare_plant(scenario)
    for simulator in (bare, closed):
        simulator.AdvanceTo(0.2)  # compiles, fills caches
    cost: dict[str, list[float]] = {"bare": [], "closed": []}
    for k in range(repeats):
        for name, simulator in (("bare", bare), ("closed", closed)):
            begin = time.process_time()
            simulator.AdvanceTo(0.2 + (k + 1) * duration)
            cost[name].append((time.process_time() - begin) / duration)
    return min(cost["bare"]), min(cost["closed"])


def run() -> None:
    """Prints the closed loop's speed (8 joints, 1 kHz, 200 Hz control)."""
    bare, closed = measure()
    print(f"bare plant          {1 / bare:6.1f} × real time")
    print(
        f"closed loop         {1 / closed:6.1f} × real time"
        f"  ({closed / bare:.2f} × the bare plant's time; at least 4 × real "
        "time is wanted)"
    )


if __name__ == "__main__":
    run()
