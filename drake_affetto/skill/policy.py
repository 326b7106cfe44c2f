"""The parameterized skill as a Drake system: from what is seen to θ."""

import dataclasses
import math
from typing import Any, Protocol

import numpy as np
from numpy.typing import ArrayLike
from pydrake.common.value import Value
from pydrake.systems.framework import (
    BasicVector,
    Context,
    DiagramBuilder,
    DiscreteValues,
    LeafSystem,
)

from drake_affetto.common.errors import (
    InputError,
    require,
    require_array,
    require_range,
)
from drake_affetto.common.systems import input_port, output_port


class Regressor(Protocol):
    """Anything fitted that predicts policy parameters."""

    def predict(self, X: np.ndarray) -> np.ndarray:
        """θ (N, F) for the task parameters X (N, d)."""


@dataclasses.dataclass
class SkillPolicyConfig:
    """When the skill's movement begins.

    Attributes:
        delay: s, from the instant of the prediction to the start of the
            movement.
        update_period: s, how often the policy looks whether to predict.
    """

    delay: float = 0.1
    update_period: float = 0.005

    def check(self, where: str) -> None:
        """Raises InputError naming the first field that does not fit."""
        require_range(f"{where}.delay", self.delay, 0.0, 1e6)
        require_range(f"{where}.update_period", self.update_period, 1e-5, 10.0)


class _Shared:
    """Holds an object that all copies of a context share."""

    def __init__(self, held: Any = None) -> None:
        self.held = held

    def __deepcopy__(self, memo: dict) -> "_Shared":
        return self


class SkillPolicy(LeafSystem):
    """Predicts the policy parameters once the gaze has settled.

    .. pydrake_system::

        name: SkillPolicy
        input_ports:
        - task_parameter
        - settled
        output_ports:
        - policy_parameters
        - start_time

    - task_parameter (d): τ, where the drum is seen.
    - settled (1): above 0.5 once τ can be relied on.
    - policy_parameters (F): θ, rad/s²; zeros before the prediction.
    - start_time (1): s; infinite before the prediction.

    Discrete state: θ (F), the start time (1), and whether both are latched (1).
    At the first update at which `settled` is high, θ = predict(τ) and the start
    time is now plus the delay. They then stay, whatever the inputs do, until
    `reset` or a new context.

    The regressor is a parameter of the context. Contexts hold it by reference:
    clones of a context share it, and it is not fitted here.

    Args:
        num_parameters: F.
        num_task_parameters: d.
        config: when the movement begins.

    Raises:
        InputError: if a value does not fit; in a simulation, if there is no
            regressor when `settled` rises, τ is not finite then, or the
            regressor does not return finite numbers of the right shape.
    """

    def __init__(
        self,
        num_parameters: int,
        *,
        num_task_parameters: int = 2,
        config: SkillPolicyConfig | None = None,
    ) -> None:
        super().__init__()
        require(num_parameters > 0, "num_parameters", num_parameters, "above 0")
        require(
            num_task_parameters > 0,
            "num_task_parameters",
            num_task_parameters,
            "above 0",
        )
        config = SkillPolicyConfig() if config is None else config
        config.check("policy")
        self._size = num_parameters
        self._delay = config.delay

        self._task_input = self.DeclareVectorInputPort(
            name="task_parameter", size=num_task_parameters
        )
        self._settled_input = self.DeclareVectorInputPort(
            name="settled", size=1
        )
        self._regressor_index = self.DeclareAbstractParameter(
            Value[object](_Shared())
        )
        theta_index = self.DeclareDiscreteState(num_parameters)
        start_index = self.DeclareDiscreteState(
            BasicVector(np.array([math.inf]))
        )
        self._theta_index = int(theta_index)
        self._start_index = int(start_index)
        self._latched_index = int(self.DeclareDiscreteState(1))
        self.DeclareStateOutputPort(
            name="policy_parameters", state_index=theta_index
        )
        self.DeclareStateOutputPort(name="start_time", state_index=start_index)
        self.DeclarePeriodicDiscreteUpdateEvent(
            period_sec=config.update_period, offset_sec=0.0, update=self._update
        )

    get_task_parameter_input_port = input_port("τ (d,).")
    get_settled_input_port = input_port(
        "Above 0.5 once τ can be relied on (1,)."
    )
    get_policy_parameters_output_port = output_port("θ (F,), rad/s².")
    get_start_time_output_port = output_port(
        "When the movement starts (1,), s."
    )

    def set_regressor(self, context: Context, regressor: Regressor) -> None:
        """Makes `regressor` the skill of this context, and waits anew.

        Raises:
            InputError: if it cannot predict.
        """
        require(
            callable(getattr(regressor, "predict", None)),
            "regressor",
            type(regressor).__name__,
            "an object with a method predict",
        )
        context.get_mutable_abstract_parameter(self._regressor_index).set_value(
            _Shared(regressor)
        )
        self.reset(context)

    def set_policy_parameters(
        self, context: Context, theta: ArrayLike, start_time: float
    ) -> None:
        """Plays θ (F,) at `start_time`, s, whatever is seen.

        Args:
            theta: Policy parameters (F,).

        Raises:
            InputError: if θ has another size or a value is not finite.
        """
        parameters = self._checked_theta("theta", theta)
        require_range("start_time", float(start_time))
        self._set_state(context, parameters, float(start_time), True)

    def reset(self, context: Context) -> None:
        """Forgets the prediction: the next time it settles, it predicts."""
        self._set_state(context, np.zeros(self._size), math.inf, False)

    def is_latched(self, context: Context) -> bool:
        """Whether θ and the start time are settled."""
        latched = context.get_discrete_state(self._latched_index).value()
        return bool(latched[0] > 0.5)

    def _set_state(
        self,
        context: Context,
        theta: np.ndarray,
        start_time: float,
        latched: bool,
    ) -> None:
        context.SetDiscreteState(self._theta_index, theta)
        context.SetDiscreteState(self._start_index, np.array([start_time]))
        context.SetDiscreteState(
            self._latched_index, np.array([float(latched)])
        )

    def _checked_theta(self, field: str, theta: ArrayLike) -> np.ndarray:
        return require_array(field, theta, (self._size,))

    def _update(self, context: Context, values: DiscreteValues) -> None:
        if context.get_discrete_state(self._latched_index).value()[0] > 0.5:
            return
        settled: Any = self._settled_input.Eval(context)
        if not settled[0] > 0.5:
            return
        parameter: Any = context.get_abstract_parameter(self._regressor_index)
        regressor = parameter.get_value().held
        if regressor is None:
            raise InputError(
                f"{self.get_name() or 'policy'}: the gaze has settled, but "
                "there is no skill to predict with; set_regressor or "
                "set_policy_parameters first"
            )
        tau: Any = self._task_input.Eval(context)
        require_array("task_parameter", tau)
        theta = np.asarray(regressor.predict(tau[None, :]))
        theta = self._checked_theta("predicted theta", theta.reshape(-1))
        start_time = context.get_time() + self._delay
        values.set_value(self._theta_index, theta)
        values.set_value(self._start_index, np.array([start_time]))
        values.set_value(self._latched_index, np.ones(1))

    @staticmethod
    def AddToBuilder(
        *,
        builder: DiagramBuilder,
        num_parameters: int,
        num_task_parameters: int = 2,
        config: SkillPolicyConfig | None = None,
        name: str = "skill_policy",
    ) -> "SkillPolicy":
        """Adds a SkillPolicy of that name to the builder and returns it.

        Args:
            num_parameters: Number of policy parameters, F.
            num_task_parameters: Number of task parameters.
        """
        system = SkillPolicy(
            num_parameters,
            num_task_parameters=num_task_parameters,
            config=config,
        )
        return builder.AddNamedSystem(name, system)
