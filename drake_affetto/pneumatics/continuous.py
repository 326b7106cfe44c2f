"""The same chambers in continuous time, the reference for the discrete ones.

Written from the equations, sharing no code with the compiled kernel, and in
Drake's scalar types, so that it can be integrated with error control and
differentiated. It is far too slow for trials.
"""

import numpy as np
from numpy.typing import NDArray
from pydrake.autodiffutils import AutoDiffXd
from pydrake.math import sqrt
from pydrake.systems.framework import BasicVector_, Context_, LeafSystem_
from pydrake.systems.scalar_conversion import TemplateSystem

from drake_affetto.common.errors import require
from drake_affetto.common.systems import input_port, output_port
from drake_affetto.pneumatics.chamber import ROWS, Row
from drake_affetto.pneumatics.flow import (
    GAS_CONSTANT,
    LAMINAR_RATIO,
    REFERENCE_DENSITY,
    REFERENCE_TEMPERATURE,
)


def _mass_flow(p_up, p_down, C, b, T_up, T_down):
    """ISO 6358 flow [kg/s] in any scalar type, from `up` to `down`."""
    if p_down > p_up:
        return -_mass_flow(p_down, p_up, C, b, T_down, T_up)
    r = p_down / p_up
    edge = max(LAMINAR_RATIO, 0.5 * (1.0 + b))
    if r <= b:
        phi = 1.0
    elif r <= edge:
        phi = sqrt(1.0 - ((r - b) / (1.0 - b)) ** 2)
    else:
        at_edge = np.sqrt(1.0 - ((edge - b) / (1.0 - b)) ** 2)
        phi = at_edge * (1.0 - r) / (1.0 - edge)
    density = REFERENCE_DENSITY * sqrt(REFERENCE_TEMPERATURE / T_up)
    return C * density * p_up * phi


def _clip(x, low, high):
    if x < low:
        return 0.0 * x + low
    if x > high:
        return 0.0 * x + high
    return x


@TemplateSystem.define(
    "ContinuousPneumaticActuation_", T_list=[float, AutoDiffXd]
)
def ContinuousPneumaticActuation_(T):
    """Makes the class for the scalar type `T`, float or AutoDiffXd.

    Long: Drake's templates are functions, which hold the whole class.
    """

    class Impl(LeafSystem_[T]):
        """Valves and chambers of `n` joints in continuous time.

        .. pydrake_system::

            name: ContinuousPneumaticActuation
            input_ports:
            - valve_opening (in flow mode)
            - pressure_command (in regulator mode)
            - estimated_state
            output_ports:
            - actuation
            - chamber_pressure

        Ports and units are those of `PneumaticActuation`. It has neither dead
        time nor dry friction, and its valves need a lag above zero. The state
        is [p (2n), m (2n), spool (2n)] in Pa, kg and strokes.
        """

        def _construct(
            self,
            parameters: NDArray[np.float64],
            *,
            mode: str = "flow",
            converter=None,
        ):
            LeafSystem_[T].__init__(self, converter=converter)
            array = np.array(parameters, dtype=float)
            require(
                array.ndim == 2 and array.shape[0] == ROWS,
                "parameters",
                array.shape,
                f"an array of shape ({ROWS}, n)",
            )
            require(
                bool(np.all(array[Row.VALVE_LAG] > 0.0)),
                "valve lag",
                array[Row.VALVE_LAG],
                "a time above 0 s",
            )
            require(
                mode in ("flow", "regulator"),
                "mode",
                mode,
                "'flow' or 'regulator'",
            )
            self._array = array
            self._mode = mode
            n = array.shape[1]
            self._n = n
            self._state_index = self.DeclareContinuousState(6 * n)
            if mode == "flow":
                self._command_port = self.DeclareVectorInputPort(
                    "valve_opening", n
                )
            else:
                self._command_port = self.DeclareVectorInputPort(
                    "pressure_command", 2 * n
                )
            self._state_port = self.DeclareVectorInputPort(
                "estimated_state", 2 * n
            )
            state_only = {self.xc_ticket()}
            self.DeclareVectorOutputPort(
                "actuation", n, self._calc_torque, state_only
            )
            self.DeclareVectorOutputPort(
                "chamber_pressure", 2 * n, self._calc_pressure, state_only
            )

        def _construct_copy(self, other, converter=None):
            Impl._construct(
                self, other._array, mode=other._mode, converter=converter
            )

        get_command_input_port = input_port(
            "`valve_opening` or `pressure_command`.", index=0
        )
        get_estimated_state_input_port = input_port(
            "[q; q̇] (2n), rad and rad/s."
        )
        get_actuation_output_port = output_port(
            "Torque on each joint (n), N m."
        )
        get_chamber_pressure_output_port = output_port(
            "[p_a; p_b] (2n), Pa absolute."
        )

        def set_pressures(self, context: Context_[T], p_a, p_b, q) -> None:
            """Sets pressures (n) [Pa absolute] at the joint angles q [rad].

            Valves are at rest and the air has ambient temperature.
            """
            n, par = self._n, self._array
            pressure = np.concatenate(
                [np.broadcast_to(p_a, n), np.broadcast_to(p_b, n)]
            )
            volume = np.array(
                [
                    self._volume(i, np.asarray(q, dtype=float), side)
                    for side in range(2)
                    for i in range(n)
                ]
            )
            RT = GAS_CONSTANT * np.tile(par[Row.TEMPERATURE], 2)
            mass = pressure * volume / RT
            context.SetContinuousState(
                np.concatenate([pressure, mass, np.zeros(2 * n)])
            )

        def _volume(self, i, q, side):
            par = self._array[:, i]
            if side == 0:
                return par[Row.V_A] + par[Row.K_A] * (q[i] - par[Row.Q_LOWER])
            return par[Row.V_B] + par[Row.K_B] * (par[Row.Q_UPPER] - q[i])

        def DoCalcTimeDerivatives(self, context, derivatives):
            """Derivatives of pressures, masses and spools."""
            n = self._n
            x = context.get_continuous_state_vector().CopyToVector()
            command = self._command_port.Eval(context)
            joints = self._state_port.Eval(context)
            rate = np.empty(6 * n, dtype=object)
            for i in range(n):
                par = self._array[:, i]
                for side in range(2):
                    c = i + side * n
                    p, m, stroke = x[c], x[2 * n + c], x[4 * n + c]
                    if self._mode == "regulator":
                        gain = par[Row.REGULATOR_GAIN]
                        target = _clip(gain * (command[c] - p), -1.0, 1.0)
                    else:
                        sign = 1.0 if side == 0 else -1.0
                        target = _clip(sign * command[i], -1.0, 1.0)
                    rate[4 * n + c] = (target - stroke) / par[Row.VALVE_LAG]

                    volume = self._volume(i, joints, side)
                    slope = par[Row.K_A] if side == 0 else -par[Row.K_B]
                    volume_rate = slope * joints[n + i]
                    under = par[Row.UNDERLAP]
                    fill = _clip((stroke + under) / (1.0 + under), 0.0, 1.0)
                    vent = _clip((under - stroke) / (1.0 + under), 0.0, 1.0)
                    C_out = vent * par[Row.C_EXHAUST] + par[Row.C_LEAK]
                    ambient = par[Row.TEMPERATURE]
                    temperature = p * volume / (m * GAS_CONSTANT)
                    b = par[Row.CRITICAL_RATIO]
                    flow_in = _mass_flow(
                        par[Row.SUPPLY],
                        p,
                        fill * par[Row.C_FILL],
                        b,
                        ambient,
                        temperature,
                    )
                    flow_out = _mass_flow(
                        p, par[Row.ATMOSPHERE], C_out, b, temperature, ambient
                    )
                    T_in = ambient if flow_in >= 0.0 else temperature
                    T_out = temperature if flow_out >= 0.0 else ambient
                    heat = GAS_CONSTANT * (T_in * flow_in - T_out * flow_out)
                    rate[c] = (
                        par[Row.EXPONENT] / volume * (heat - p * volume_rate)
                    )
                    rate[2 * n + c] = flow_in - flow_out
            derivatives.get_mutable_vector().SetFromVector(
                rate if T is AutoDiffXd else rate.astype(float)
            )

        def _calc_torque(self, context: Context_[T], output: BasicVector_[T]):
            n, par = self._n, self._array
            p = context.get_continuous_state_vector().CopyToVector()
            output.SetFromVector(
                par[Row.K_A] * (p[:n] - par[Row.ATMOSPHERE])
                - par[Row.K_B] * (p[n : 2 * n] - par[Row.ATMOSPHERE])
            )

        def _calc_pressure(self, context: Context_[T], output: BasicVector_[T]):
            p = context.get_continuous_state_vector().CopyToVector()
            output.SetFromVector(p[: 2 * self._n])

    return Impl


ContinuousPneumaticActuation = ContinuousPneumaticActuation_[None]
"""The float instantiation."""
