"""Dynamic Movement Primitives: how policy parameters become a movement.

A joint q follows a damped spring that pulls it to a goal g, and a forcing term
f that shapes the way there (Eq. 1 and 2 of Schulz et al. 2018):

    q̈ = k_S (g - q) - k_D q̇ + f(x),    f_j(x) = Σ_k θ_jk ψ_k(x),

    ψ_k(x) = exp(-V (x - C_k)²) / Σ_l exp(-V (x - C_l)²).

The phase x falls linearly from 1 to 0 over the duration of the movement. At
x = 0 the forcing term is switched off, so that q comes to rest at g. The
policy parameters θ hold K weights for each of n joints, F = n·K in all, joint
after joint. There is no room for g among them: unless told otherwise g is the
posture in which the movement starts, and to which the arm so returns.

The system is linear in θ and x is known in time. So a whole movement is one
matrix product, `Dmp.rollout`, once the response to each basis function has
been computed for a time grid; and learning θ from a demonstration,
`Dmp.encode`, is a linear least-squares problem. `Dmp.step` takes one exact step
at a time, as a controller needs it, and agrees with `rollout` to rounding.

A duration T other than the configured one, T_0, stretches time and nothing
else: with s = T / T_0 the equation reads s² q̈ = k_S (g - q) - s k_D q̇ + f.
"""

from collections import OrderedDict
from collections.abc import Callable, Sequence
import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike
from scipy.linalg import cho_solve
from scipy.signal import lfilter

from drake_affetto.common.errors import (
    require,
    require_array,
    require_range,
)
from drake_affetto.common.typing import Array
from drake_affetto.motion.dmp_config import DmpConfig
from drake_affetto.motion.encoding import (
    NODES,
    WEIGHTS,
    Design,
    factorize,
    pair_demonstrations,
    smoothing_operator,
)
from drake_affetto.motion.spring import spring_transition
from drake_affetto.motion.stepping import (
    NO_FORCING,
    NO_WEIGHTS,
    StepTable,
    advance_joints,
)

# How many time grids a Dmp remembers the responses of.
_REMEMBERED_GRIDS = 16


class Rollout(NamedTuple):
    """A movement: `t` (N,), `q`, `q_dot` and `q_ddot` (N, n), s and rad."""

    t: Array
    q: Array
    q_dot: Array
    q_ddot: Array


class _Cache:
    """Remembers the last few results of a function of hashable arguments."""

    def __init__(self) -> None:
        self._known: OrderedDict[Any, Any] = OrderedDict()

    def get(self, key: Any, compute: Callable[[], Any]) -> Any:
        if key in self._known:
            self._known.move_to_end(key)
            return self._known[key]
        value = self._known[key] = compute()
        if len(self._known) > _REMEMBERED_GRIDS:
            self._known.popitem(last=False)
        return value

    def __getstate__(self) -> dict[str, Any]:
        # What is remembered is computed again where it is needed: it may be
        # a thousand times what determines it.
        return {"_known": OrderedDict()}


class Dmp:
    """Dynamic Movement Primitives of any number of joints.

    Args:
        config: the constants; those of `DmpConfig` when None.

    Raises:
        InputError: if the configuration does not fit.
    """

    def __init__(self, config: DmpConfig | None = None) -> None:
        self._config = DmpConfig() if config is None else config
        self._config.check("dmp")
        config = self._config
        self._stiffness = float(config.stiffness)
        self._damping = (
            2.0 * math.sqrt(config.stiffness)
            if config.damping is None
            else float(config.damping)
        )
        # The movement runs from x = 1 to 0: so do the basis functions.
        self._centers = np.linspace(1.0, 0.0, config.n_basis)
        self._deviation = config.width / (config.n_basis - 1)
        self._sharpness = 0.5 / self._deviation**2
        # Apart, so that encoding many demonstrations drops no step table.
        self._tables = _Cache()
        self._responses = _Cache()
        self._designs = _Cache()

    @property
    def config(self) -> DmpConfig:
        """The constants that this Dmp was made from."""
        return self._config

    @property
    def n_basis(self) -> int:
        """K, how many policy parameters each joint has."""
        return self._config.n_basis

    @property
    def duration(self) -> float:
        """s, how long a movement takes unless told otherwise."""
        return self._config.duration

    @property
    def centers(self) -> Array:
        """(K,), the phases C_k on which the basis functions are centered."""
        return self._centers.copy()

    def basis(self, phase: ArrayLike) -> Array:
        """The basis functions ψ(x): `phase` (N,), from 1 to 0, to (N, K)."""
        phase = np.atleast_1d(require_array("phase", phase))
        exponent = (phase[:, None] - self._centers) ** 2
        # Subtracting the least leaves the quotient as it is, and keeps it a
        # number where every Gaussian has underflowed.
        exponent -= exponent.min(axis=1, keepdims=True)
        psi = np.exp(-self._sharpness * exponent)
        psi /= psi.sum(axis=1, keepdims=True)
        return psi

    def weights(self, theta: ArrayLike) -> Array:
        """`theta` (n·K,) as an array (n, K), a row for each joint.

        Raises:
            InputError: if its size is no multiple of K or it is not finite.
        """
        theta = _finite("theta", theta)
        require(
            theta.ndim == 1
            and theta.size > 0
            and theta.size % self.n_basis == 0,
            "theta.shape",
            theta.shape,
            f"(n * {self.n_basis},) for n joints",
        )
        return theta.reshape(-1, self.n_basis)

    def rollout(
        self,
        theta: ArrayLike,
        q0: ArrayLike,
        dt: float = 0.005,
        *,
        goal: ArrayLike | None = None,
        velocity: ArrayLike | None = None,
        duration: float | None = None,
        length: float | None = None,
    ) -> Rollout:
        """The movement that θ describes, at t = 0, dt, 2 dt, ...

        Exact at those instants, whatever dt. The responses to the basis
        functions are remembered, so a further rollout with the same dt,
        duration and length costs one matrix product.

        Args:
            theta: (n·K,), rad/s², the policy parameters.
            q0: (n,), rad, where the movement starts.
            dt: s, the distance of the instants.
            goal: (n,), rad, where it comes to rest; q0 when None.
            velocity: (n,), rad/s, with which it starts; 0 when None.
            duration: s, T; the configured one when None.
            length: s, how long to go on; the duration when None.

        Returns:
            t (N,), q (N, n), q̇ (N, n), q̈ (N, n). At the end of the duration q̈
            still has the forcing term in it; later it has not.

        Raises:
            InputError: if sizes do not agree or a value is not finite.
        """
        weights = self.weights(theta)
        start = self._posture("q0", q0, len(weights))
        goal = (
            start if goal is None else self._posture("goal", goal, start.size)
        )
        duration = self._duration(duration)
        require_range("dt", dt, 1e-6, 1e3)
        length = duration if length is None else length
        require_range("length", length, 0.0, 1e6)
        # A length of 3 s at 1 ms has 3001 instants, however 3 / 0.001 rounds.
        steps = math.floor(length / dt * (1.0 + 1e-12) + 1e-9)
        response = self._response(float(dt), steps, duration)
        # One product for q, q̇ and q̈ of all joints.
        moved = response.reshape(-1, self.n_basis) @ weights.T
        moved = moved.reshape(3, steps + 1, -1)
        t: Array = dt * np.arange(steps + 1, dtype=float)
        if goal is start and velocity is None:
            moved[0] += start
        else:
            velocity = (
                np.zeros_like(start)
                if velocity is None
                else self._posture("velocity", velocity, start.size)
            )
            homogeneous = self._homogeneous(t, duration)
            moved += homogeneous[:, :, 0, None] * (start - goal)
            moved += homogeneous[:, :, 1, None] * velocity
            moved[0] += goal
        return Rollout(t, moved[0], moved[1], moved[2])

    def step(
        self,
        phase: float,
        q: ArrayLike,
        q_dot: ArrayLike,
        theta: ArrayLike,
        goal: ArrayLike,
        dt: float,
        duration: float | None = None,
    ) -> tuple[float, Array, Array]:
        """One step of length dt; exact, so it agrees with `rollout`.

        Args:
            phase: x in [0, 1] at the beginning of the step.
            q: (n,), rad.
            q_dot: (n,), rad/s.
            theta: (n·K,), rad/s², the policy parameters.
            goal: (n,), rad.
            dt: s, length of the step.
            duration: s, T; the configured one when None.

        Returns:
            phase, q (n,) and q̇ (n,) at the end of the step.

        Raises:
            InputError: if sizes do not agree or a value is not finite.
        """
        weights = self.weights(theta)
        n = len(weights)
        state = np.array(
            [self._posture("q", q, n), self._posture("q_dot", q_dot, n)]
        )
        require_range("phase", phase, 0.0, 1.0)
        require_range("dt", dt, 1e-6, 1e3)
        duration = self._duration(duration)
        phase = self.advance(
            phase,
            state,
            weights,
            self._posture("goal", goal, n),
            self.step_table(float(dt), duration),
        )
        return phase, state[0], state[1]

    def step_table(self, dt: float, duration: float) -> StepTable:
        """What steps of length `dt` of a movement of `duration`, s, need.

        It is made once and then remembered.

        Raises:
            InputError: For a dt or a duration that cannot be.
        """

        def make() -> StepTable:
            require_range("dt", dt, 1e-6, 1e3)
            return self._make_table(dt, self._duration(duration))

        return self._tables.get((dt, duration), make)

    def advance(
        self,
        phase: float,
        state: Array,
        weights: Array | None,
        goal: Array,
        table: StepTable,
    ) -> float:
        """`step` without its checks, in place: for loops that run often.

        Args:
            phase: x in [0, 1].
            state: (2, n), [q; q̇], which is overwritten.
            weights: (n, K), θ as `weights` shapes it; None for no forcing.
            goal: (n,).
            table: of `step_table`.

        Returns:
            The phase at the end of the step.
        """
        if weights is not None and phase > 0.0:
            forcing = self._forcing(phase, table)
        else:
            forcing, weights = NO_FORCING, NO_WEIGHTS
        advance_joints(state, goal, table.transition, forcing, weights)
        phase -= table.phase_step
        # What is left after the last step of a whole number is rounding.
        return phase if phase > 1e-9 * table.phase_step else 0.0

    def encode(
        self,
        t: ArrayLike | Sequence[ArrayLike],
        q: ArrayLike | Sequence[ArrayLike],
        *,
        goal: ArrayLike | None = None,
        velocity: ArrayLike | None = None,
        duration: float | None = None,
    ) -> Array:
        """The policy parameters that reproduce one or several demonstrations.

        A demonstration's first sample is its start posture. Its length is the
        duration of the movement, unless `duration` is given.

        Args:
            t: (N,), s, increasing, not necessarily evenly; or a list of such
                arrays, one for each demonstration.
            q: (N, n), rad; or as many of them.
            goal: (n,), rad, common to all; each one's start when None.
            velocity: (n,), rad/s, at the start; 0 when None.
            duration: s, of the movement; each demonstration's when None.

        Returns:
            θ (n·K,), rad/s², the least-squares solution for all demonstrations
            together.

        Raises:
            InputError: if there are too few samples, sizes do not agree, time
                does not increase or a value is not finite.
        """
        demonstrations = pair_demonstrations(t, q)
        gram = np.zeros((self.n_basis, self.n_basis))
        moment: Any = 0.0
        samples = 0
        factor: Any = None
        for times, postures in demonstrations:
            self._check_demonstration(times, postures, duration)
            start = postures[0]
            n = start.size
            end = start if goal is None else self._posture("goal", goal, n)
            begin = (
                None
                if velocity is None
                else self._posture("velocity", velocity, n)
            )
            design = self._design(times - times[0], duration)
            target = postures - end
            if goal is not None:
                target = target - design.decay[:, 0, None] * (start - end)
            if begin is not None:
                target = target - design.decay[:, 1, None] * begin
            gram = gram + design.gram
            moment = moment + design.operator @ target
            samples += len(times)
            factor = design.factor
        if len(demonstrations) > 1:
            gram[np.diag_indices_from(gram)] += samples * self._config.ridge
            factor = factorize(gram)
        weights = cho_solve(factor, moment, check_finite=False)
        return np.ascontiguousarray(weights.T).reshape(-1)

    def _duration(self, duration: float | None) -> float:
        if duration is None:
            return self._config.duration
        require_range("duration", duration, 1e-3, 1e6)
        return float(duration)

    def _posture(self, field: str, value: ArrayLike, n: int) -> Array:
        value = _finite(field, value)
        require(value.shape == (n,), f"{field}.shape", value.shape, f"({n},)")
        return value

    def _check_demonstration(
        self, t: Array, q: Array, duration: float | None
    ) -> None:
        require(
            t.ndim == 1 and len(t) >= 4,
            "t.shape",
            t.shape,
            "(N,) with at least 4 instants",
        )
        require(
            q.ndim == 2 and len(q) == len(t) and q.shape[1] > 0,
            "q.shape",
            q.shape,
            f"({len(t)}, n), a posture for each instant",
        )
        require(
            bool(np.all(np.diff(t) > 0.0)), "t", "unordered", "increasing times"
        )
        if duration is not None:
            self._duration(duration)

    def _rates(self, duration: float) -> tuple[float, float, float]:
        """Stiffness, damping and forcing gain in a movement of `duration`."""
        stretch = duration / self._config.duration
        return (
            self._stiffness / stretch**2,
            self._damping / stretch,
            1.0 / stretch**2,
        )

    def _homogeneous(self, t: Array, duration: float) -> Array:
        """What is left of an initial [q - g, q̇] after t.

        Returns:
            (3, N, 2): position, velocity, acceleration; for each a column for
            an initial offset of 1 rad and one for an initial 1 rad/s.
        """
        stiffness, damping, _ = self._rates(duration)
        transition = spring_transition(t, stiffness, damping)
        acceleration = (
            -stiffness * transition[:, 0] - damping * transition[:, 1]
        )
        return np.stack([transition[:, 0], transition[:, 1], acceleration])

    def _forcing(self, phase: float, table: StepTable) -> Array:
        """(2, K), what the forcing adds in the step that begins at `phase`."""
        index = round((1.0 - phase) / table.phase_step)
        on_grid = abs(1.0 - index * table.phase_step - phase) < 1e-9
        if on_grid and index < len(table.forcing):
            return table.forcing[index]
        phases = np.array([phase])
        return self._forcing_terms(phases, table.dt, table.duration)[0]

    def _forcing_terms(
        self, phases: Array, dt: float, duration: float
    ) -> Array:
        """∫ exp(A (dt - s)) b ψ(x - s/T) ds over a step, up to x = 0.

        Args:
            phases: (P,), at the beginning of each step.
            dt: s, length of the steps.
            duration: s, T.

        Returns:
            (P, 2, K).
        """
        stiffness, damping, gain = self._rates(duration)
        # The rates at which the basis functions and the kernel change.
        fastest = 0.5 * damping + math.sqrt(abs(0.25 * damping**2 - stiffness))
        rate = max(4.0 / (self._deviation * duration), 2.0 * fastest)
        parts = math.ceil(dt * rate)
        nodes = (np.arange(parts)[:, None] + NODES).ravel() / parts
        weights = np.tile(WEIGHTS / parts, parts)
        # The step in which x reaches 0 is forced only until then.
        forced = np.minimum(dt, phases * duration)
        s = forced[:, None] * nodes
        kernel = spring_transition(dt - s, stiffness, damping)[..., 1]
        kernel *= (gain * forced[:, None] * weights)[..., None]
        psi = self.basis((phases[:, None] - s / duration).ravel())
        psi = psi.reshape(*s.shape, -1)
        return np.swapaxes(kernel, 1, 2) @ psi

    def _make_table(self, dt: float, duration: float) -> StepTable:
        stiffness, damping, _ = self._rates(duration)
        phase_step = dt / duration
        steps = math.ceil(1.0 / phase_step - 1e-9)
        phases: Array = 1.0 - phase_step * np.arange(steps, dtype=float)
        return StepTable(
            transition=spring_transition(np.array(dt), stiffness, damping),
            forcing=self._forcing_terms(phases, dt, duration),
            phase_step=phase_step,
            dt=dt,
            duration=duration,
        )

    def _response(self, dt: float, steps: int, duration: float) -> Array:
        """(3, N, K), q, q̇ and q̈ after rest, for each basis function alone."""
        return self._responses.get(
            (dt, steps, duration),
            lambda: self._make_response(dt, steps, duration),
        )

    def _make_response(self, dt: float, steps: int, duration: float) -> Array:
        stiffness, damping, gain = self._rates(duration)
        table = self.step_table(dt, duration)
        added = np.zeros((steps, 2, self.n_basis))
        forced = min(steps, len(table.forcing))
        added[:forced] = table.forcing[:forced]
        response = np.zeros((3, steps + 1, self.n_basis))
        if steps:
            # z[i+1] = A z[i] + u[i], an element at a time: by the theorem of
            # Cayley and Hamilton each obeys y[i+2] = tr A y[i+1] - det A y[i]
            # plus inputs, and that is a filter.
            a = table.transition
            characteristic = [1.0, -np.trace(a), np.linalg.det(a)]
            for own, other in ((0, 1), (1, 0)):
                inputs = added[:, own].copy()
                inputs[1:] -= a[other, other] * added[:-1, own]
                inputs[1:] += a[own, other] * added[:-1, other]
                response[own, 1:] = lfilter(
                    [1.0], characteristic, inputs, axis=0
                )
        phases = 1.0 - dt / duration * np.arange(steps + 1)
        inside = phases > -1e-9
        response[2] = -stiffness * response[0] - damping * response[1]
        response[2, inside] += gain * self.basis(phases[inside])
        return response

    def _design(self, t: Array, duration: float | None) -> "Design":
        """The least-squares problem of a demonstration sampled at t (N,)."""
        duration = float(t[-1]) if duration is None else float(duration)
        make = (
            self._make_trajectory_design
            if self._config.method == "trajectory"
            else self._make_forcing_design
        )
        return self._designs.get(
            (duration, t.tobytes()), lambda: make(t, duration)
        )

    def _make_trajectory_design(self, t: Array, duration: float) -> "Design":
        response = self._response_at(t, duration)
        # In units of the forcing term, in which a constant weight of 1 moves
        # the joint by 1 / k_S.
        response = response * self._stiffness
        return self._finish_design(
            response,
            self._stiffness * response.T,
            self._homogeneous(t, duration)[0],
        )

    def _make_forcing_design(self, t: Array, duration: float) -> "Design":
        config = self._config
        psi = self.basis(np.clip(1.0 - t / duration, 0.0, 1.0))
        # Past the end there is no forcing to learn from.
        psi[t > duration * (1.0 + 1e-9)] = 0.0
        stretch = duration / config.duration
        derivatives, fit = smoothing_operator(t, config.smoothing)
        forcing = (
            self._stiffness * derivatives[0]
            + stretch * self._damping * derivatives[1]
            + stretch**2 * derivatives[2]
        )
        return self._finish_design(
            psi, (psi.T @ forcing) @ fit, np.zeros((len(t), 2))
        )

    def _finish_design(
        self, design: Array, operator: Array, decay: Array
    ) -> "Design":
        gram = design.T @ design
        ridge = len(design) * self._config.ridge * np.eye(self.n_basis)
        return Design(operator, gram, decay, factorize(gram + ridge))

    def _response_at(self, t: Array, duration: float) -> Array:
        """(N, K), the positions of `_response` at any t >= 0."""
        steps = len(t) - 1
        dt = float(t[-1]) / steps
        if np.allclose(t, dt * np.arange(steps + 1), rtol=0.0, atol=1e-9):
            return self._make_response(dt, steps, duration)[0]
        # Cubic between close instants, from positions and velocities: below
        # 1e-9 of the movement.
        steps = math.ceil(t[-1] / (0.02 * self._deviation * duration))
        dt = float(t[-1]) / steps
        position, velocity, _ = self._make_response(dt, steps, duration)
        index = np.minimum((t / dt).astype(int), steps - 1)
        s = (t / dt - index)[:, None]
        return (
            (1.0 + 2.0 * s) * (1.0 - s) ** 2 * position[index]
            + s * (1.0 - s) ** 2 * dt * velocity[index]
            + s**2 * (3.0 - 2.0 * s) * position[index + 1]
            - s**2 * (1.0 - s) * dt * velocity[index + 1]
        )


def _finite(field: str, value: ArrayLike) -> Array:
    """`value` as an array of finite numbers; raises InputError by name."""
    # The sum of finite numbers of a sane size is finite, and is one call.
    if (
        isinstance(value, np.ndarray)
        and value.dtype == np.float64
        and math.isfinite(value.sum())
    ):
        return value
    return require_array(field, value)
