"""The station as a robot that is stepped from tick to tick."""

import numpy as np
from pydrake.geometry import Meshcat
from pydrake.systems.analysis import ApplySimulatorConfig, Simulator

from drake_affetto.common.errors import InputError, require
from drake_affetto.common.typing import Array
from drake_affetto.robot.wire import RobotWire, load_wire
from drake_affetto.station.scenario import Scenario
from drake_affetto.station.station import AffettoStation

# Simulated time before the first tick, s: everything is compiled by then, and
# the vented robot has come to rest.
WARM_UP = 5.0


def check_served(scenario: Scenario, rate: float) -> RobotWire:
    """Sees that a scenario can stand behind the wire; returns its wire.

    Args:
        scenario: The scenario.
        rate: Rate of the sensors, Hz.

    Raises:
        InputError: Naming what does not fit.
    """
    require(
        scenario.wire != "",
        "scenario.wire",
        scenario.wire,
        "the YAML file of the robot's wire, as in the scenario robot",
    )
    require(
        scenario.motion_source == scenario.valve_source == "external",
        "motion_source, valve_source",
        (scenario.motion_source, scenario.valve_source),
        "external both, for the client to move the robot",
    )
    require(
        scenario.pneumatics.mode == "regulator",
        "pneumatics.mode",
        scenario.pneumatics.mode,
        "regulator, for commands are pressures",
    )
    require(
        not scenario.hardware,
        "hardware",
        scenario.hardware,
        "false: a robot is served only if it is simulated",
    )
    steps = 1.0 / (rate * scenario.plant_config.time_step)
    if steps < 0.5 or abs(steps - round(steps)) > 1e-6:
        raise InputError(
            f"--rate is {rate:g}, expected one whose period is a multiple of "
            f"the step of {scenario.plant_config.time_step:g} s"
        )
    return load_wire(scenario.wire, scenario.active_joints)


class SimulatedRobot:
    """A simulated robot: pressures are commanded, sensors are read."""

    def __init__(
        self, scenario: Scenario, rate: float, meshcat: Meshcat | None = None
    ):
        """Builds the station, and lets the vented robot come to rest.

        Args:
            scenario: One that `check_served` has passed.
            rate: Rate of the sensors and of the ticks, Hz.
            meshcat: Browser window that shows it, where the mouse may pull the
                right hand.

        Raises:
            InputError: If the scenario does not fit.
        """
        scenario.control.period = 1.0 / rate
        self.station = AffettoStation(
            scenario, meshcat, by_mouse=meshcat is not None
        )
        self._period = 1.0 / rate
        self._ticks = 0
        self._context = self.station.CreateDefaultContext()
        n = self.station.num_joints
        atmosphere = load_wire(scenario.wire).atmospheric_pressure
        self._command = self.station.GetInputPort(
            "affetto.pressure_command"
        ).FixValue(self._context, np.full(2 * n, atmosphere))
        desired = self.station.GetInputPort("affetto.desired_state")
        desired.FixValue(self._context, np.zeros(2 * n))
        self._state = self.station.GetOutputPort("affetto.estimated_state")
        self._pressure = self.station.GetOutputPort("affetto.chamber_pressure")
        self._drum = self.station.GetOutputPort("drum.contact_force")
        self._strike = 0.0
        self._simulator = Simulator(self.station, self._context)
        ApplySimulatorConfig(scenario.simulator_config, self._simulator)
        self._simulator.set_target_realtime_rate(0.0)
        for _ in range(round(WARM_UP * rate)):
            self.advance()
            self.read()

    @property
    def time(self) -> float:
        """Simulated time, s, with the warm-up."""
        return self._ticks * self._period

    def command(self, pressure: Array) -> None:
        """Sets the regulators' set-points [p_a; p_b] (2n,), Pa absolute.

        Args:
            pressure: Set-points [p_a; p_b] (2n,), Pa absolute.
        """
        self._command.GetMutableData().get_mutable_value().SetFromVector(
            pressure
        )

    def advance(self) -> None:
        """Simulates one tick."""
        self._ticks += 1
        self._simulator.AdvanceTo(self.time)

    def read(self) -> tuple[Array, Array]:
        """Angles (n,), rad, and pressures [p_a; p_b] (2n,), Pa absolute."""
        n = self.station.num_joints
        state = self._state.Eval(self._context)
        return state[:n], self._pressure.Eval(self._context)

    def finished_strike(self) -> float:
        """Greatest force of a strike on the drum that is just over, N; else 0.

        It looks at the drum once a call, so call it each tick.
        """
        force = float(self._drum.Eval(self._context)[0])
        strike = 0.0 if force > 0.0 else self._strike
        self._strike = max(self._strike, force) if force > 0.0 else 0.0
        return strike
