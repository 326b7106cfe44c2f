"""What the actuators cost at 1 kHz, beside the bare plant and plain numpy."""

import time

import numpy as np
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import (
    DiagramBuilder,
    EventStatus,
    LeafSystem,
)
from pydrake.systems.primitives import ConstantVectorSource, MatrixGain
from reference_plant import STEP, add_reference_plant, lock_all_but

from drake_affetto.common.systems import input_port, output_port
from drake_affetto.pneumatics.actuation import PneumaticActuation
from drake_affetto.pneumatics.chamber import Row
from drake_affetto.pneumatics.flow import GAS_CONSTANT, REFERENCE_DENSITY
from drake_affetto.pneumatics.parameters import (
    load_parameters,
    resting_pressure,
)
from drake_affetto.scene.joints import select_joints
from drake_affetto.scene.world import (
    ACTIVE_JOINTS,
    WorldConfig,
    joint_limits,
    joint_names,
)
from drake_affetto.station.scenario import load_scenario

_SLICE = 0.05
_TRIES = 100


class NumpyActuation(LeafSystem):
    """The same actuators as one would first write them: wide numpy.

    Isothermal flow temperature and explicit Euler, so it computes less than
    the compiled kernel does.
    """

    def __init__(self, parameters):
        """Declares the ports of `PneumaticActuation`."""
        super().__init__()
        self._par = par = parameters
        n = self._n = par.shape[1]
        self._command_port = self.DeclareVectorInputPort("valve_opening", n)
        self._state_port = self.DeclareVectorInputPort("estimated_state", 2 * n)
        rest = resting_pressure(par)
        self._pressure = self.DeclareDiscreteState(np.tile(rest, 2))
        self._torque = self.DeclareDiscreteState(n)
        self._spool = self.DeclareDiscreteState(2 * n)
        self._bristle = self.DeclareDiscreteState(n)
        slots = round(float(np.max(par[Row.DEAD_TIME])) / STEP) + 1
        self._line = np.zeros((slots, n))
        self.DeclareStateOutputPort("actuation", self._torque)
        self.DeclarePeriodicDiscreteUpdateEvent(STEP, 0.0, self._update)

    get_command_input_port = input_port("v⁺ (n).", index=0)
    get_estimated_state_input_port = input_port("[q; q̇] (2n).")
    get_actuation_output_port = output_port("Torque (n), N m.")

    def _update(self, context, discrete_state):
        par, n, h = self._par, self._n, STEP
        state = self._state_port.Eval(context)
        q, v = state[:n], state[n:]
        self._line = np.roll(self._line, 1, axis=0)
        self._line[0] = np.clip(self._command_port.Eval(context), -1.0, 1.0)
        u = self._line[-1]
        spool = discrete_state.get_mutable_value(self._spool)
        target = np.concatenate([u, -u])
        lag = np.tile(par[Row.VALVE_LAG], 2)
        spool += (1.0 - np.exp(-h / lag)) * (target - spool)
        under = np.tile(par[Row.UNDERLAP], 2)
        fill = np.clip((spool + under) / (1.0 + under), 0.0, 1.0)
        vent = np.clip((under - spool) / (1.0 + under), 0.0, 1.0)
        c_fill = fill * np.tile(par[Row.C_FILL], 2)
        c_out = vent * np.tile(par[Row.C_EXHAUST], 2)
        c_out += np.tile(par[Row.C_LEAK], 2)
        p = discrete_state.get_mutable_value(self._pressure)
        supply, atmosphere = par[Row.SUPPLY, 0], par[Row.ATMOSPHERE, 0]
        b = np.tile(par[Row.CRITICAL_RATIO], 2)
        flow = REFERENCE_DENSITY * (
            c_fill * supply * self._phi(p / supply, b)
            - c_out * p * self._phi(atmosphere / p, b)
        )
        K = np.concatenate([par[Row.K_A], par[Row.K_B]])
        stroke = np.concatenate([q - par[Row.Q_LOWER], par[Row.Q_UPPER] - q])
        volume = np.concatenate([par[Row.V_A], par[Row.V_B]]) + K * stroke
        sweep = K * np.concatenate([v, -v])
        heat = GAS_CONSTANT * par[Row.TEMPERATURE, 0] * flow
        p += h * par[Row.EXPONENT, 0] / volume * (heat - p * sweep)
        limit = par[Row.COULOMB] + (par[Row.BREAKAWAY] - par[Row.COULOMB]) * (
            np.exp(-((v / par[Row.STRIBECK_VELOCITY]) ** 2))
        )
        z = discrete_state.get_mutable_value(self._bristle)
        z += h * v
        np.clip(z, -limit / par[Row.STIFFNESS], limit / par[Row.STIFFNESS], z)
        friction = np.clip(
            par[Row.STIFFNESS] * z + par[Row.DAMPING] * v, -limit, limit
        )
        torque = K * (p - atmosphere)
        discrete_state.get_mutable_value(self._torque)[:] = (
            torque[:n] - torque[n:] - friction
        )
        return EventStatus.Succeeded()

    @staticmethod
    def _phi(r, b):
        inside = 1.0 - ((np.maximum(r, b) - b) / (1.0 - b)) ** 2
        return np.sqrt(np.maximum(inside, 0.0))


def _simulator(names, make):
    """The robot with `make`'s actuators, or with none.

    The torques reach the plant multiplied by zero: so it makes the same motion
    in all variants, and what differs is the actuators' cost alone.
    """
    builder = DiagramBuilder()
    plant = add_reference_plant(builder, WorldConfig())
    robot = plant.GetModelInstanceByName("affetto")
    selection = select_joints(plant, names, robot)
    n = len(names)
    to_plant = builder.AddSystem(MatrixGain(0.0 * selection.actuation_matrix))
    builder.Connect(
        to_plant.get_output_port(), plant.get_actuation_input_port(robot)
    )
    if make is None:
        source = builder.AddSystem(ConstantVectorSource(np.zeros(n)))
        builder.Connect(source.get_output_port(), to_plant.get_input_port())
    else:
        parameters = load_parameters().for_joints(
            names, *joint_limits(plant, names)
        )
        system = builder.AddSystem(make(parameters))
        state_of_joints = builder.AddSystem(MatrixGain(selection.state_matrix))
        source = builder.AddSystem(ConstantVectorSource(np.full(n, 0.02)))
        builder.Connect(
            plant.get_state_output_port(robot), state_of_joints.get_input_port()
        )
        builder.Connect(
            state_of_joints.get_output_port(),
            system.get_estimated_state_input_port(),
        )
        builder.Connect(
            source.get_output_port(), system.get_command_input_port()
        )
        builder.Connect(
            system.get_actuation_output_port(), to_plant.get_input_port()
        )
    diagram = builder.Build()
    context = diagram.CreateDefaultContext()
    lock_all_but(plant, context, names)
    simulator = Simulator(diagram, context)
    simulator.AdvanceTo(0.2)  # compiles, fills caches
    return simulator


def measure(names) -> tuple[float, float, float]:
    """CPU time [µs] a step: bare plant, with compiled, with numpy actuators.

    The three take turns, and the least of each counts, so that whatever else
    the machine does weighs on none alone.
    """
    simulators = [
        _simulator(names, make)
        for make in (None, PneumaticActuation, NumpyActuation)
    ]
    least = [np.inf] * 3
    for k in range(_TRIES):
        for i, simulator in enumerate(simulators):
            begin = time.process_time()
            simulator.AdvanceTo(0.2 + (k + 1) * _SLICE)
            spent = time.process_time() - begin
            least[i] = min(least[i], 1e6 * spent * STEP / _SLICE)
    return least[0], least[1], least[2]


def run() -> None:
    """Prints the net cost of the actuators of 8 and of 22 joints."""
    everything = joint_names(
        add_reference_plant(DiagramBuilder(), WorldConfig())
    )
    print("CPU time a step of 1 ms; net = over the bare plant")
    step = load_scenario("drumming").plant_config.time_step
    for names in (list(ACTIVE_JOINTS), everything):
        bare, compiled, plain = measure(names)
        print(
            f"{len(names):3d} joints: bare plant {bare:.0f} us; compiled "
            f"actuators +{compiled - bare:.1f} us ({compiled / bare:.2f} x "
            f"bare); plain numpy +{plain - bare:.1f} us ({plain / bare:.2f} x)"
        )
        # An update costs the same whatever its length.
        net = (compiled - bare) * STEP / step
        print(
            f"           {(plain - bare) / (compiled - bare):.1f} x faster "
            f"than numpy; at the scenarios' step of {1e3 * step:g} ms "
            f"+{net:.1f} us a simulated ms ({net / bare:.0%} of the bare "
            "plant's; at most 15 % is wanted)"
        )


if __name__ == "__main__":
    run()
