"""What several tests of the actuators share: one column, and ways to run it."""

import numpy as np

from drake_affetto.pneumatics.chamber import (
    FLOW_MODE,
    Row,
    memory_size,
    step_joints,
)
from drake_affetto.pneumatics.parameters import (
    ActuatorClass,
    JointActuator,
    PneumaticParameters,
)

Q_LOWER, Q_UPPER = -1.0, 1.0
ATMOSPHERE, SUPPLY = 101.3e3, 659.3e3


def one_joint(*, exponent=1.2, **fields):
    """Parameters of "joint", without friction and dead time by default."""
    values = {
        "area_ratio": 1.0,
        "coulomb_torque": 0.0,
        "breakaway_torque": 0.0,
        "dead_time": 0.0,
        **fields,
    }
    return PneumaticParameters(
        supply_pressure=SUPPLY,
        atmospheric_pressure=ATMOSPHERE,
        polytropic_exponent=exponent,
        classes={"test": ActuatorClass(**values)},
        joints={"joint": JointActuator(actuator="test")},
    )


def make_parameters(n=1, *, exponent=1.2, q=(Q_LOWER, Q_UPPER), **fields):
    """(ROWS, n): n equal joints as `one_joint` has it."""
    parameters = one_joint(exponent=exponent, **fields)
    return parameters.for_joints(
        ["joint"] * n, np.full(n, q[0]), np.full(n, q[1])
    )


def closed(array):
    """The same actuators with valves that do not leak at rest."""
    array = array.copy()
    array[Row.UNDERLAP] = 0.0
    array[Row.C_LEAK] = 0.0
    return array


class Actuators:
    """The kernel with its state, for tests that need no system."""

    def __init__(
        self,
        parameters,
        pressure,
        *,
        h=0.001,
        mode=FLOW_MODE,
        look_ahead=0.0,
        max_dead_time=0.2,
    ):
        self.parameters = parameters
        self.n = parameters.shape[1]
        self.h = h
        self.mode = mode
        self.look_ahead = look_ahead
        self.pressure = np.broadcast_to(
            np.asarray(pressure, dtype=float), 2 * self.n
        ).copy()
        self.torque = np.zeros(self.n)
        self.mass_flow = np.zeros(2 * self.n)
        self.memory = np.zeros(memory_size(self.n, h, max_dead_time))
        # What is wrong, and what is above the command, if anything.
        self.conditions = None
        self.action = 0

    def step(self, command, q, v=0.0):
        """One step with commands and joint state held."""
        size = self.n if self.mode == FLOW_MODE else 2 * self.n
        state = np.concatenate(
            [np.broadcast_to(q, self.n), np.broadcast_to(v, self.n)]
        ).astype(float)
        step_joints(
            self.h,
            self.mode,
            self.look_ahead,
            self.parameters,
            np.broadcast_to(np.asarray(command, dtype=float), size).copy(),
            state,
            self.pressure,
            self.torque,
            self.mass_flow,
            self.memory,
            0.0,
            self.action,
            self.conditions,
        )
        return self.pressure.copy()
