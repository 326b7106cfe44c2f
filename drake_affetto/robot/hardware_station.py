"""The station with hardware: the same ports, but a robot behind them."""

from pydrake.systems.framework import Context, Diagram, DiagramBuilder
from pydrake.systems.primitives import PassThrough

from drake_affetto.common.errors import require, require_range
from drake_affetto.common.systems import export
from drake_affetto.robot.controller import load_robot_controller
from drake_affetto.robot.wire import load_wire
from drake_affetto.robot.wire_driver import WireDriver
from drake_affetto.sensing.joint_sensors import JointSensors
from drake_affetto.sensing.readings import SensorParameters
from drake_affetto.station.scenario import Scenario
from drake_affetto.station.station import AffettoStation


class HardwareStation(Diagram):
    """Drives a robot over its wire; ports are those of `AffettoStation`.

    .. pydrake_system::

        name: HardwareStation
        input_ports:
        - affetto.desired_state
        - affetto.pressure_command
        output_ports:
        - affetto.desired_state
        - affetto.estimated_state
        - affetto.chamber_pressure
        - affetto.link

    - affetto.desired_state (2n): rad, rad/s; handed on, as in the simulation.
    - affetto.pressure_command (2n): set-points [p_a; p_b], Pa absolute.
    - affetto.estimated_state (2n): [q; q̇], filtered as the robot's own software
      does, rad, rad/s.
    - affetto.chamber_pressure (2n): [p_a; p_b] as read, Pa absolute.
    - affetto.link (3): see `WireDriver`; while its first entry is 0 the robot
      is vented whatever the command.

    Camera and drum have no ports: they are not on this wire.
    """

    def __init__(
        self,
        scenario: Scenario,
        *,
        host: str = "127.0.0.1",
        sensor_port: int = 50000,
        command_port: int = 50010,
    ):
        """Builds the diagram and listens to the robot.

        Args:
            scenario: One with `hardware: true` and a `wire`.
            host: Address of the robot.
            sensor_port: Own port, to which the robot sends.
            command_port: The robot's port of commands.

        Raises:
            InputError: If the scenario does not fit, or a port is in use.
        """
        super().__init__()
        scenario.check()
        require(scenario.hardware, "hardware", scenario.hardware, "true")
        for name, port in (("sensor", sensor_port), ("command", command_port)):
            require_range(f"{name}_port", port, 1, 65535)
        self.scenario = scenario
        wire = load_wire(scenario.wire, scenario.active_joints)
        controller = load_robot_controller()
        builder = DiagramBuilder()
        self.driver = builder.AddNamedSystem(
            "wire_driver",
            WireDriver(
                wire,
                host,
                sensor_port,
                command_port,
                sensor_rate=controller.sensor_rate,
                command_rate=controller.control_rate,
            ),
        )
        lower = [min(j.at_0, j.at_100) for j in wire.joints]
        upper = [max(j.at_0, j.at_100) for j in wire.joints]
        self.filter = JointSensors.AddToBuilder(
            builder=builder,
            joint_state=self.driver.get_joint_state_output_port(),
            true_pressure=self.driver.get_chamber_pressure_output_port(),
            # The sensors are real: what is left of them here is the filter.
            parameters=SensorParameters(
                filter_order=controller.filter_order,
                filter_cutoff=controller.filter_cutoff,
            ),
            joint_names=wire.names,
            limits=(lower, upper),
            period=1.0 / controller.sensor_rate,
            name="filter",
        )
        desired = builder.AddNamedSystem(
            "desired_state", PassThrough(2 * len(wire.joints))
        )
        builder.ExportInput(desired.get_input_port(), "affetto.desired_state")
        builder.ExportOutput(desired.get_output_port(), "affetto.desired_state")
        builder.ExportInput(
            self.driver.get_pressure_command_input_port(),
            "affetto.pressure_command",
        )
        export(
            builder,
            "affetto",
            self.filter.get_estimated_state_output_port(),
            self.filter.get_chamber_pressure_output_port(),
            self.driver.get_link_output_port(),
        )
        builder.BuildInto(self)
        self.set_name("hardware_station")

    @property
    def num_joints(self) -> int:
        """n, how many joints are on the wire."""
        return len(self.scenario.active_joints)

    def wait(self, context: Context, timeout: float = 5.0) -> None:
        """Waits for the robot; outputs are then what it reads.

        Args:
            context: The station's, or that of a diagram around it.
            timeout: Longest time, s.

        Raises:
            InputError: If the robot is silent.
        """
        driver = self.driver.GetMyMutableContextFromRoot(context)
        self.driver.wait(driver, timeout)
        self.filter.reset(
            self.filter.GetMyMutableContextFromRoot(context),
            self.driver.get_joint_state_output_port().Eval(driver),
            self.driver.get_chamber_pressure_output_port().Eval(driver),
        )

    def close(self) -> None:
        """Vents the robot and lets go of the ports."""
        self.driver.close()


def make_station(scenario: Scenario, **addresses) -> Diagram:
    """The station of a scenario: simulated, or with the hardware.

    Args:
        scenario: The scenario; its field `hardware` decides.
        addresses: host, sensor_port and command_port of `HardwareStation`.
    """
    if scenario.hardware:
        return HardwareStation(scenario, **addresses)
    return AffettoStation(scenario)
