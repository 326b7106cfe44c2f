"""A breath of the whole chain: does it build and step on this Python?

Not collected by pytest; run as a script with any supported Python.
"""

from importlib.metadata import version
import math
import platform
import time
import warnings

from pydrake.systems.analysis import Simulator

from drake_affetto.station.scenario import load_scenario
from drake_affetto.station.station import AffettoStation

DURATION = 0.05  # s


def main() -> None:
    warnings.simplefilter("error", DeprecationWarning)
    for name in ("drumming", "mirror"):
        began = time.process_time()
        station = AffettoStation(load_scenario(name))
        simulator = Simulator(station)
        simulator.AdvanceTo(DURATION)
        context = simulator.get_context()
        assert math.isclose(context.get_time(), DURATION)
        plant = station.plant
        state = plant.GetPositionsAndVelocities(
            plant.GetMyContextFromRoot(context)
        )
        assert all(map(math.isfinite, state)), state
        print(
            f"smoke: {name}: {DURATION} s simulated on Python "
            f"{platform.python_version()}, Drake {version('drake')} "
            f"({time.process_time() - began:.1f} s of processor time)"
        )


if __name__ == "__main__":
    main()
