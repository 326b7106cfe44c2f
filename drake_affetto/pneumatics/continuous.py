"""The same chambers in continuous time, the reference for the discrete ones.

Written from the equations, sharing no code with the compiled kernel, and in
Drake's scalar types, so that it can be integrated with error control and
differentiated. It is far too slow for trials.

Symbolic derivatives of the flow do not exist where it chooses between cases
(choked or not): an Expression can be evaluated, an AutoDiffXd differentiated.
"""

import numpy as np
from numpy.typing import NDArray
from pydrake.autodiffutils import AutoDiffXd
from pydrake.math import sqrt
from pydrake.symbolic import Expression
from pydrake.systems.framework import BasicVector_, Context_, LeafSystem_
from pydrake.systems.scalar_conversion import TemplateSystem

from drake_affetto.common.errors import require, require_choice
from drake_affetto.common.scalars import clip, select
from drake_affetto.common.systems import input_port, output_port
from drake_affetto.pneumatics.chamber import Row
from drake_affetto.pneumatics.flow import (
    GAS_CONSTANT,
    LAMINAR_RATIO,
    REFERENCE_DENSITY,
    REFERENCE_TEMPERATURE,
)
from drake_affetto.pneumatics.parameters import (
    Joints,
    PneumaticParameters,
    parameter_array,
    resting_pressure,
)


def _mass_flow(p_up, p_down, C, b, T_up, T_down):
    """ISO 6358 flow [kg/s] in any scalar type, from `up` to `down`."""
    return select(
        p_down > p_up,
        lambda: -_flow_down(p_down, p_up, C, b, T_down),
        lambda: _flow_down(p_up, p_down, C, b, T_up),
    )


def _flow_down(p_up, p_down, C, b, T_up):
    """The same from the higher pressure to the lower."""
    r = p_down / p_up
    edge = max(LAMINAR_RATIO, 0.5 * (1.0 + b))
    at_edge = np.sqrt(1.0 - ((edge - b) / (1.0 - b)) ** 2)
    phi = select(
        r <= b,
        lambda: 0.0 * r + 1.0,
        lambda: select(
            r <= edge,
            lambda: sqrt(1.0 - ((r - b) / (1.0 - b)) ** 2),
            lambda: at_edge * (1.0 - r) / (1.0 - edge),
        ),
    )
    density = REFERENCE_DENSITY * sqrt(REFERENCE_TEMPERATURE / T_up)
    return C * density * p_up * phi


@TemplateSystem.define(
    "ContinuousPneumaticActuation_", T_list=[float, AutoDiffXd, Expression]
)
def ContinuousPneumaticActuation_(T):
    """Makes the class for the scalar type `T`.

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
        is [p (2n), m (2n), spool (2n)] in Pa, kg and strokes; by default the
        pressures of the valves' rest in the middle of the joints' ranges. The
        parameters and joints are those of `PneumaticActuation`.
        """

        def _construct(
            self,
            parameters: PneumaticParameters | NDArray[np.float64],
            joints: Joints | None = None,
            *,
            mode: str = "flow",
            converter=None,
        ):
            LeafSystem_[T].__init__(self, converter=converter)
            array = parameter_array(parameters, joints)
            require(
                bool(np.all(array[Row.VALVE_LAG] > 0.0)),
                "valve lag",
                array[Row.VALVE_LAG],
                "a time above 0 s",
            )
            require_choice("mode", mode, "flow", "regulator")
            self._array = array
            self._mode = mode
            n = array.shape[1]
            self._n = n
            rest = resting_pressure(array)
            middle = 0.5 * (array[Row.Q_LOWER] + array[Row.Q_UPPER])
            self.DeclareContinuousState(
                BasicVector_[T](self._rest(rest, rest, middle))
            )
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

        def set_pressures(self, context: Context_[T], p_a, p_b, q=None) -> None:
            """Sets the chambers' pressures, with the valves at rest.

            The air has ambient temperature.

            Args:
                context: Context of the system.
                p_a: Pressures of the chambers a (n), Pa absolute.
                p_b: Pressures of the chambers b (n), Pa absolute.
                q: Angles of the joints (n), rad; by default those of the input
                    `estimated_state`.
            """
            if q is None:
                q = self._state_port.Eval(context)[: self._n]
            context.SetContinuousState(self._rest(p_a, p_b, q))

        def set_strokes(self, context: Context_[T], opening) -> None:
            """Puts the spools where openings hold them.

            Args:
                context: Context of the system.
                opening: v⁺ (n) in [-1, 1]; v⁻ = -v⁺.
            """
            state = context.get_continuous_state_vector().CopyToVector()
            state[4 * self._n :] = np.concatenate([opening, -opening])
            context.SetContinuousState(state)

        def get_parameters(self, context: Context_[T]) -> NDArray[np.float64]:
            """A copy of the (ROWS, n) parameter array."""
            return self._array.copy()

        def _rest(self, p_a, p_b, q):
            """The state (6n) of air at rest with ambient temperature."""
            n, par = self._n, self._array
            pressure = np.concatenate(
                [np.broadcast_to(p_a, n), np.broadcast_to(p_b, n)]
            )
            q = np.asarray(q)
            volume = np.array(
                [
                    self._volume(i, q, side)
                    for side in range(2)
                    for i in range(n)
                ]
            )
            RT = GAS_CONSTANT * np.tile(par[Row.TEMPERATURE], 2)
            mass = pressure * volume / RT
            return np.concatenate([pressure, mass, np.zeros(2 * n)])

        def _volume(self, i, q, side):
            par = self._array[:, i]
            if side == 0:
                return par[Row.V_A] + par[Row.K_A] * (q[i] - par[Row.Q_LOWER])
            return par[Row.V_B] + par[Row.K_B] * (par[Row.Q_UPPER] - q[i])

        @staticmethod
        def _exchange(par, p, temperature, stroke):
            """Net flow [kg/s] and gas constant × enthalpy flow / c_p."""
            under, b = par[Row.UNDERLAP], par[Row.CRITICAL_RATIO]
            ambient = par[Row.TEMPERATURE]
            fill = clip((stroke + under) / (1.0 + under), 0.0, 1.0)
            vent = clip((under - stroke) / (1.0 + under), 0.0, 1.0)
            C_in = fill * par[Row.C_FILL]
            C_out = vent * par[Row.C_EXHAUST] + par[Row.C_LEAK]
            flow_in = _mass_flow(
                par[Row.SUPPLY], p, C_in, b, ambient, temperature
            )
            flow_out = _mass_flow(
                p, par[Row.ATMOSPHERE], C_out, b, temperature, ambient
            )
            # Air has the temperature of where it comes from.
            T_in = select(flow_in >= 0.0, lambda: ambient, lambda: temperature)
            T_out = select(
                flow_out >= 0.0, lambda: temperature, lambda: ambient
            )
            heat = GAS_CONSTANT * (T_in * flow_in - T_out * flow_out)
            return flow_in - flow_out, heat

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
                        target = clip(gain * (command[c] - p), -1.0, 1.0)
                    else:
                        sign = 1.0 if side == 0 else -1.0
                        target = clip(sign * command[i], -1.0, 1.0)
                    rate[4 * n + c] = (target - stroke) / par[Row.VALVE_LAG]

                    volume = self._volume(i, joints, side)
                    slope = par[Row.K_A] if side == 0 else -par[Row.K_B]
                    volume_rate = slope * joints[n + i]
                    temperature = p * volume / (m * GAS_CONSTANT)
                    flow, heat = self._exchange(par, p, temperature, stroke)
                    rate[c] = (
                        par[Row.EXPONENT] / volume * (heat - p * volume_rate)
                    )
                    rate[2 * n + c] = flow
            derivatives.get_mutable_vector().SetFromVector(
                rate.astype(float) if T is float else rate
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
