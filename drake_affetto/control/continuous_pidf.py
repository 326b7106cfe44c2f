"""The same controller in continuous time, to be differentiated.

Written from the law in `pidf`, sharing no code with the compiled update, and in
Drake's scalar types. It has no sampling: the valves follow at once.
"""

import numpy as np
from pydrake.autodiffutils import AutoDiffXd
from pydrake.symbolic import Expression
from pydrake.systems.framework import BasicVector_, Context_, LeafSystem_
from pydrake.systems.scalar_conversion import TemplateSystem

from drake_affetto.common.errors import require_range
from drake_affetto.common.scalars import clip, select
from drake_affetto.common.systems import input_port, output_port
from drake_affetto.control.pidf import PidfGains

# Arithmetic of Expressions, which Drake tries as it looks for algebraic loops,
# sets a flag of the processor that numpy would take for one of its own.
_QUIET = np.errstate(invalid="ignore")


@TemplateSystem.define(
    "ContinuousPidfController_", T_list=[float, AutoDiffXd, Expression]
)
def ContinuousPidfController_(T):
    """Makes the class for the scalar type `T`.

    Long: Drake's templates are functions, which hold the whole class.
    """

    class Impl(LeafSystem_[T]):
        """PIDF control of `n` joints in continuous time.

        .. pydrake_system::

            name: ContinuousPidfController
            input_ports:
            - desired_state
            - estimated_state
            - chamber_pressure
            - equilibrium_offset (optional)
            output_ports:
            - valve_opening
            - pid_output

        Ports, units and law are those of `PidfController`; the outputs follow
        the inputs at once. The state is ∫e dt (n), rad s. The gains
        (kP, kI, kD, kF of all joints, 4n) are a numeric parameter, so that
        they can be given derivatives (`set_gains`).
        """

        def _construct(
            self,
            gains: PidfGains,
            *,
            integral_limit: float = 300e3,
            difference_limit: float = 550e3,
            integral_deadband: float = 0.0,
            converter=None,
        ):
            LeafSystem_[T].__init__(self, converter=converter)
            self._gains = gains
            self._limits = {
                "integral_limit": integral_limit,
                "difference_limit": difference_limit,
                "integral_deadband": integral_deadband,
            }
            for name, value in self._limits.items():
                require_range(name, value, 0.0)
            n = self._n = gains.kP.size
            self._gains_index = int(
                self.DeclareNumericParameter(
                    BasicVector_[T](gains.to_array().ravel())
                )
            )
            self._ports = [
                self.DeclareVectorInputPort(name, size)
                for name, size in (
                    ("desired_state", 2 * n),
                    ("estimated_state", 2 * n),
                    ("chamber_pressure", 2 * n),
                    ("equilibrium_offset", n),
                )
            ]
            self.DeclareContinuousState(n)
            self.DeclareVectorOutputPort("valve_opening", n, self._calc_opening)
            self.DeclareVectorOutputPort(
                "pid_output",
                n,
                self._calc_demand,
                {
                    self.xc_ticket(),
                    self.all_parameters_ticket(),
                    *(
                        self.input_port_ticket(self._ports[i].get_index())
                        for i in (0, 1, 3)
                    ),
                },
            )

        def _construct_copy(self, other, converter=None):
            Impl._construct(
                self, other._gains, **other._limits, converter=converter
            )

        get_desired_state_input_port = input_port(
            "[q_des; q̇_des] (2n), rad and rad/s."
        )
        get_estimated_state_input_port = input_port(
            "[q; q̇] (2n), rad and rad/s."
        )
        get_chamber_pressure_input_port = input_port("[p_a; p_b] (2n), Pa.")
        get_equilibrium_offset_input_port = input_port("u_eq (n), Pa.")
        get_valve_opening_output_port = output_port("v⁺ (n) in [-1, 1].")
        get_pid_output_output_port = output_port("u (n), Pa.")

        def set_gains(self, context: Context_[T], gains) -> None:
            """Sets the gains.

            Args:
                context: this system's context.
                gains: (4, n) rows kP, kI, kD, kF of type T, or `PidfGains`.
            """
            if isinstance(gains, PidfGains):
                gains = gains.to_array()
            context.get_mutable_numeric_parameter(
                self._gains_index
            ).SetFromVector(np.reshape(gains, 4 * self._n))

        def set_integral(self, context: Context_[T], pressure) -> None:
            """Sets the integral so that it asks for `pressure` (n), Pa.

            Joints without kI are left at 0.
            """
            k_i = self._rows(context)[1]
            share = np.broadcast_to(pressure, (self._n,))
            context.SetContinuousState(
                [
                    p / k if k > 0.0 else 0.0 * k
                    for p, k in zip(share, k_i, strict=True)
                ]
            )

        def _rows(self, context):
            parameter = context.get_numeric_parameter(self._gains_index)
            return parameter.CopyToVector().reshape(4, self._n)

        @_QUIET
        def _demand(self, context):
            """Error, demand before its limit, and integral (n each)."""
            n = self._n
            desired, state, _, offset = self._ports
            k_p, k_i, k_d, _ = self._rows(context)
            integral = context.get_continuous_state_vector().CopyToVector()
            error = desired.Eval(context) - state.Eval(context)
            u = k_p * error[:n] + k_d * error[n:] + k_i * integral
            if offset.HasValue(context):
                u = u + offset.Eval(context)
            return error[:n], u, integral

        @_QUIET
        def _opening(self, context, u):
            """Opening before its limit, and p_a - p_b (n each)."""
            n = self._n
            pressure = self._ports[2].Eval(context)
            difference = pressure[:n] - pressure[n:]
            limit = self._limits["difference_limit"]
            limited = np.array([clip(each, -limit, limit) for each in u])
            return self._rows(context)[3] * (limited - difference), difference

        def _calc_demand(self, context: Context_[T], output: BasicVector_[T]):
            limit = self._limits["difference_limit"]
            _, u, _ = self._demand(context)
            output.SetFromVector([clip(each, -limit, limit) for each in u])

        def _calc_opening(self, context: Context_[T], output: BasicVector_[T]):
            v, _ = self._opening(context, self._demand(context)[1])
            output.SetFromVector([clip(each, -1.0, 1.0) for each in v])

        def DoCalcTimeDerivatives(self, context, derivatives):
            """Rate of the integral, which waits where a limit is met."""
            error, u, integral = self._demand(context)
            v, difference = self._opening(context, u)
            k_i = self._rows(context)[1]
            derivatives.get_mutable_vector().SetFromVector(
                [
                    self._integral_rate(*joint)
                    for joint in zip(
                        error, u, v, difference, k_i, integral, strict=True
                    )
                ]
            )

        def _integral_rate(self, error, u, v, difference, k_i, integral):
            band = self._limits["integral_deadband"]
            most = self._limits["integral_limit"]
            limit = self._limits["difference_limit"]
            zero = 0.0 * error
            excess = error - clip(error, -band, band)
            # Above 0 where the error drives a limited signal further.
            driving = select(
                v * v > 1.0,
                lambda: (u - difference) * error,
                lambda: select(
                    u * u > limit * limit, lambda: u * error, lambda: zero
                ),
            )
            full = select(
                (k_i * integral) * (k_i * integral) > most * most,
                lambda: integral * excess,
                lambda: zero,
            )
            rate = select(driving > 0.0, lambda: zero, lambda: excess)
            rate = select(full > 0.0, lambda: zero, lambda: rate)
            return select(k_i > 0.0, lambda: rate, lambda: zero)

    return Impl


ContinuousPidfController = ContinuousPidfController_[None]
"""The float instantiation."""
