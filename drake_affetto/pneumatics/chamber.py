"""One time step of all joints' valves, chambers and friction, compiled.

A joint is driven by a cylinder (or vane) with two chambers. Chamber a pushes
the joint angle q up, chamber b down:

    V_a = V0_a + K_a (q - q_lower),   V_b = V0_b + K_b (q_upper - q),
    τ = K_a (p_a - p_atm) - K_b (p_b - p_atm) - τ_friction,

with the same K [m³/rad = N m/Pa] in volume and torque, so that a closed
chamber is a conservative spring. The gas follows

    dp/dt = n/V (R T_in ṁ_in - R T ṁ_out - p dV/dt),   dm/dt = ṁ_in - ṁ_out,

where air comes in at the temperature of the supply and leaves at that of the
chamber, T = p V/(m R). For n = 1 this is the isothermal and for n = 1.4 the
adiabatic chamber; the values between stand for heat passing the walls.

How a step is taken (why it is stable for any valve, at any step):

- volume: p is multiplied by (V_old/V_new)^n, half of it before and half after
  the flow (Strang splitting), which is exact with the valves shut;
- flow: a Rosenbrock step with the exact exponential of the scalar Jacobian
  (second order, exact for choked exhaust). dp/dt falls with p, so the true
  pressure never crosses the balance of its flows: a step that would is
  replaced by a safeguarded implicit Euler step, which does not either;
- valve: the lag's exact response to a command held over the step, after the
  dead time (interpolated in the line's memory);
- the torque is that of the joint angle which the plant's next step starts
  from, so that torque and motion exchange energy as in symplectic Euler.

Friction is elastic-plastic: bristles of stiffness σ0 with damping σ1 hold the
joint (a true stick phase, without creep) until the torque reaches

    F(q̇) = F_c + (F_s - F_c) exp(-(q̇/v_s)²) + λ F_d,

beyond which they slip. What they give back is only what they stored: friction
never drives. (Dupont et al., IEEE Trans. Automatic Control 47(5), 2002.) F_d
is what a seal has more after a long rest: λ falls from 1 with the traveled
angle s, dλ = -λ ds/s_d, and returns at rest, dλ = (1 - λ) dt/t_d. The viscous
part is not here: it is the joint's damping in the robot's SDF, which the
plant integrates implicitly.
"""

import enum
import math

import numba
import numpy as np
from numpy.typing import NDArray

from drake_affetto.pneumatics.conditions import NO_ACTION, VENT, Condition
from drake_affetto.pneumatics.flow import (
    GAS_CONSTANT,
    REFERENCE_DENSITY,
    REFERENCE_TEMPERATURE,
    flow_function,
)


class Row(enum.IntEnum):
    """The rows of the parameter array, one column for each joint.

    SI units. `Q_LOWER`, `Q_UPPER`: rad. `K_A`, `K_B`: N m/Pa = m³/rad. `V_A`,
    `V_B`: dead volume (with the line), m³. `C_FILL`, `C_EXHAUST`, `C_LEAK`:
    m³/(s Pa). `UNDERLAP`: opening of both edges at rest, as a fraction of the
    full stroke; a negative one is a dead band. `REGULATOR_GAIN`: 1/Pa.
    `STIFFNESS`, `DAMPING`: of the bristles, N m/rad and N m s/rad.
    `DWELL_TORQUE`, `DWELL_TRAVEL`, `DWELL_RECOVERY`: F_d, s_d and t_d, N m,
    rad and s; no recovery where t_d is 0.
    """

    Q_LOWER = 0
    Q_UPPER = 1
    K_A = 2
    K_B = 3
    V_A = 4
    V_B = 5
    C_FILL = 6
    C_EXHAUST = 7
    C_LEAK = 8
    CRITICAL_RATIO = 9
    UNDERLAP = 10
    VALVE_LAG = 11
    DEAD_TIME = 12
    REGULATOR_GAIN = 13
    COULOMB = 14
    BREAKAWAY = 15
    STRIBECK_VELOCITY = 16
    STIFFNESS = 17
    DAMPING = 18
    DWELL_TORQUE = 19
    DWELL_TRAVEL = 20
    DWELL_RECOVERY = 21
    SUPPLY = 22
    ATMOSPHERE = 23
    TEMPERATURE = 24
    EXPONENT = 25


ROWS = len(Row)

FLOW_MODE = 0
"""The command is a valve opening v⁺ in [-1, 1] a joint; v⁻ = -v⁺."""
REGULATOR_MODE = 1
"""The command is a pressure set-point for each chamber, Pa absolute."""

# Plain integers: a compiled function folds these, not an enum's members.
_Q_LOWER = int(Row.Q_LOWER)
_Q_UPPER = int(Row.Q_UPPER)
_K_A = int(Row.K_A)
_K_B = int(Row.K_B)
_V_A = int(Row.V_A)
_V_B = int(Row.V_B)
_C_FILL = int(Row.C_FILL)
_C_EXHAUST = int(Row.C_EXHAUST)
_C_LEAK = int(Row.C_LEAK)
_CRITICAL_RATIO = int(Row.CRITICAL_RATIO)
_UNDERLAP = int(Row.UNDERLAP)
_VALVE_LAG = int(Row.VALVE_LAG)
_DEAD_TIME = int(Row.DEAD_TIME)
_REGULATOR_GAIN = int(Row.REGULATOR_GAIN)
_COULOMB = int(Row.COULOMB)
_BREAKAWAY = int(Row.BREAKAWAY)
_STRIBECK_VELOCITY = int(Row.STRIBECK_VELOCITY)
_STIFFNESS = int(Row.STIFFNESS)
_DAMPING = int(Row.DAMPING)
_DWELL_TORQUE = int(Row.DWELL_TORQUE)
_DWELL_TRAVEL = int(Row.DWELL_TRAVEL)
_DWELL_RECOVERY = int(Row.DWELL_RECOVERY)
_SUPPLY = int(Row.SUPPLY)
_ATMOSPHERE = int(Row.ATMOSPHERE)
_TEMPERATURE = int(Row.TEMPERATURE)
_EXPONENT = int(Row.EXPONENT)
_SPOOL = int(Condition.SPOOL)
_LAG = int(Condition.LAG)
_LEAK = int(Condition.LEAK)

_HEAD = 2
"""Leading entries of the memory: whether it is filled, the line's head."""
MASS_OFFSET = _HEAD
"""Where in the memory the air's masses [kg] begin, 2 a joint."""
DWELL_OFFSET_PER_JOINT = 7
"""The dwells of friction begin at MASS_OFFSET + this times n."""


def memory_size(n: int, time_step: float, dead_time: float) -> int:
    """Size of the memory vector of `n` joints for the longest dead time, s.

    It holds [filled, head, mass (2n), spool (2n), angle (n), velocity (n),
    bristle (n), dwell (n), line (slots x 2n)].
    """
    return _HEAD + 8 * n + line_slots(time_step, dead_time) * 2 * n


def line_slots(time_step: float, dead_time: float) -> int:
    """How many past commands the line's memory must hold."""
    return math.ceil(dead_time / time_step - 1e-9) + 2


@numba.njit(cache=True, inline="always")
def opening_fraction(stroke: float, underlap: float) -> float:
    """Opened fraction of a valve edge whose spool is at `stroke` in [-1, 1].

    With an underlap u the edge opens at a stroke of -u, with a dead band (u
    negative) at -u > 0; fully open at 1 in both cases.
    """
    fraction = (stroke + underlap) / (1.0 + underlap)
    return min(max(fraction, 0.0), 1.0)


@numba.njit(cache=True)
def chamber_flows(
    p, T, supply, atmosphere, T_supply, c_fill, c_out, b
) -> tuple[float, float, float, float]:
    """Flow rates in and out [kg/s] and their derivatives by p, kg/(s Pa).

    Each is positive along its path (supply to chamber, chamber to atmosphere)
    and negative where the pressures turn it round.
    """
    mdot_in = 0.0
    slope_in = 0.0
    if c_fill > 0.0:
        if p <= supply:
            s = c_fill * REFERENCE_DENSITY
            s *= math.sqrt(REFERENCE_TEMPERATURE / T_supply)
            phi, dphi = flow_function(p / supply, b)
            mdot_in = s * supply * phi
            slope_in = s * dphi
        else:
            s = c_fill * REFERENCE_DENSITY
            s *= math.sqrt(REFERENCE_TEMPERATURE / T)
            r = supply / p
            phi, dphi = flow_function(r, b)
            mdot_in = -s * p * phi
            slope_in = -s * (phi - r * dphi)
    mdot_out = 0.0
    slope_out = 0.0
    if c_out > 0.0:
        if p >= atmosphere:
            s = c_out * REFERENCE_DENSITY
            s *= math.sqrt(REFERENCE_TEMPERATURE / T)
            r = atmosphere / p
            phi, dphi = flow_function(r, b)
            mdot_out = s * p * phi
            slope_out = s * (phi - r * dphi)
        else:
            s = c_out * REFERENCE_DENSITY
            s *= math.sqrt(REFERENCE_TEMPERATURE / T_supply)
            phi, dphi = flow_function(p / atmosphere, b)
            mdot_out = -s * atmosphere * phi
            slope_out = -s * dphi
    return mdot_in, mdot_out, slope_in, slope_out


@numba.njit(cache=True)
def _pressure_rate(
    p, T, gain, supply, atmosphere, T_supply, c_fill, c_out, b
) -> tuple[float, float]:
    """dp/dt at constant volume and its derivative; gain = n R/V."""
    mdot_in, mdot_out, slope_in, slope_out = chamber_flows(
        p, T, supply, atmosphere, T_supply, c_fill, c_out, b
    )
    T_in = T_supply if mdot_in >= 0.0 else T
    T_out = T if mdot_out >= 0.0 else T_supply
    rate = gain * (T_in * mdot_in - T_out * mdot_out)
    slope = gain * (T_in * slope_in - T_out * slope_out)
    return rate, slope


@numba.njit(cache=True)
def _implicit_pressure(
    p, p_far, h, T, gain, supply, atmosphere, T_supply, c_fill, c_out, b
) -> float:
    """Implicit Euler step, its root bracketed by `p` and `p_far`."""
    low = min(p, p_far)
    high = max(p, p_far)
    x = 0.5 * (low + high)
    last = high - low
    for _ in range(100):
        rate, slope = _pressure_rate(
            x, T, gain, supply, atmosphere, T_supply, c_fill, c_out, b
        )
        residual = x - p - h * rate
        if residual > 0.0:
            high = x
        else:
            low = x
        x_next = x - residual / (1.0 - h * slope)
        # Newton alone can go to and fro between the two sides of a kink.
        if not low < x_next < high or abs(x_next - x) > 0.5 * last:
            x_next = 0.5 * (low + high)
        last = abs(x_next - x)
        x = x_next
        if last < 1e-6:
            break
    return x


@numba.njit(cache=True)
def _flow_pressure(
    p, h, T, gain, supply, atmosphere, T_supply, c_fill, c_out, b
) -> float:
    """Pressure after flowing for `h` at constant volume and temperature."""
    rate, slope = _pressure_rate(
        p, T, gain, supply, atmosphere, T_supply, c_fill, c_out, b
    )
    z = h * slope
    if z > -1e-8:
        p_new = p + h * rate
    else:
        p_new = p + rate * (math.expm1(z) / slope)
    p_new = max(p_new, 1.0)
    rate_new, _ = _pressure_rate(
        p_new, T, gain, supply, atmosphere, T_supply, c_fill, c_out, b
    )
    if rate * rate_new < 0.0:
        p_new = _implicit_pressure(
            p, p_new, h, T, gain, supply, atmosphere, T_supply, c_fill, c_out, b
        )
    return p_new


@numba.njit(cache=True)
def chamber_step(
    p, m, V_old, V_new, h, c_fill, c_out, b, n, supply, atmosphere, T_supply
) -> tuple[float, float, float]:
    """One chamber over one step.

    Args:
        p: pressure, Pa absolute.
        m: mass of the air in it, kg.
        V_old: volume at the step's start, m³.
        V_new: volume at its end, m³.
        h: step, s.
        c_fill: sonic conductance towards the supply, m³/(s Pa).
        c_out: sonic conductance towards the atmosphere (exhaust and leak).
        b: critical pressure ratio of both.
        n: polytropic exponent.
        supply: supply pressure, Pa absolute.
        atmosphere: atmospheric pressure, Pa absolute.
        T_supply: temperature of supply and atmosphere, K.

    Returns:
        Pressure and mass at the end, and the mean mass flow rate into the
        chamber through the valve and leak, kg/s.
    """
    half = 1.0
    if V_old != V_new:
        half = math.exp(0.5 * n * math.log(V_old / V_new))
    p *= half
    if c_fill == 0.0 and c_out == 0.0:
        return p * half, m, 0.0

    V = 0.5 * (V_old + V_new)
    gain = n * GAS_CONSTANT / V
    T = p * V / (m * GAS_CONSTANT)
    T = min(max(T, 100.0), 1000.0)
    p_new = _flow_pressure(
        p, h, T, gain, supply, atmosphere, T_supply, c_fill, c_out, b
    )
    mdot_in = 0.0
    mdot_out = 0.0
    for repeat in range(2):
        # The flows of mid-step, scaled to account for the whole change of p.
        p_mid = 0.5 * (p + p_new)
        mdot_in, mdot_out, _, _ = chamber_flows(
            p_mid, T, supply, atmosphere, T_supply, c_fill, c_out, b
        )
        T_in = T_supply if mdot_in >= 0.0 else T
        T_out = T if mdot_out >= 0.0 else T_supply
        power_in = T_in * mdot_in
        power_out = T_out * mdot_out
        missing = (p_new - p) / (gain * h) - (power_in - power_out)
        total = abs(power_in) + abs(power_out)
        if total > 0.0:
            share = abs(power_in) / total
            mdot_in += missing * share / T_in
            mdot_out -= missing * (1.0 - share) / T_out
        if repeat == 1 or n == 1.0:
            break
        # Second pass at the temperature of mid-step: second order in it too.
        m_new = m + h * (mdot_in - mdot_out)
        if m_new <= 0.0:
            break
        T_end = p_new * V / (m_new * GAS_CONSTANT)
        T_end = min(max(T_end, 100.0), 1000.0)
        if abs(T_end - T) < 1e-4 * T:
            break
        T = 0.5 * (T + T_end)
        p_new = _flow_pressure(
            p, h, T, gain, supply, atmosphere, T_supply, c_fill, c_out, b
        )
    mdot = mdot_in - mdot_out
    m_new = m + h * mdot
    if h * (abs(mdot_in) + abs(mdot_out)) > 0.2 * m:
        # So much air passes in one step that its balance, a difference of
        # large numbers, says little. Temperature stays between what expansion
        # of the old air and filling with the new one can make of it.
        ratio = (p_new / p) ** ((n - 1.0) / n)
        T_old = p * V / (m * GAS_CONSTANT)
        T_low = min(T_old, T_supply) * min(ratio, 1.0)
        T_high = max(T_old * max(ratio, 1.0), n * T_supply)
        most = p_new * V / (T_low * GAS_CONSTANT)
        least = p_new * V / (T_high * GAS_CONSTANT)
        m_new = min(max(m_new, least), most)
    m = m_new
    p = p_new * half
    return p, m, mdot


@numba.njit(cache=True, inline="always")
def stribeck_torque(
    velocity: float, coulomb: float, breakaway: float, width: float
) -> float:
    """Greatest torque that friction can take at `velocity`, N m."""
    x = velocity / width
    return coulomb + (breakaway - coulomb) * math.exp(-x * x)


@numba.njit(cache=True)
def friction_step(
    z, angle_change, velocity, limit, stiffness, damping
) -> tuple[float, float]:
    """Deflection of the bristles [rad] and friction torque [N m] after a step.

    The torque opposes motion: it is to be subtracted from the drive's.
    """
    if stiffness <= 0.0 or limit <= 0.0:
        return 0.0, 0.0
    z_limit = limit / stiffness
    z_trial = z + angle_change
    z_new = min(max(z_trial, -z_limit), z_limit)
    torque = stiffness * z_new
    if z_new == z_trial:
        torque += damping * velocity
        torque = min(max(torque, -limit), limit)
    return z_new, torque


@numba.njit(cache=True)
def joint_volume(q, i, parameters) -> tuple[float, float]:
    """Volumes of both chambers of joint `i` [m³], never below 5 % of V0."""
    V_a = parameters[_V_A, i]
    V_b = parameters[_V_B, i]
    volume_a = V_a + parameters[_K_A, i] * (q - parameters[_Q_LOWER, i])
    volume_b = V_b + parameters[_K_B, i] * (parameters[_Q_UPPER, i] - q)
    return max(volume_a, 0.05 * V_a), max(volume_b, 0.05 * V_b)


@numba.njit(cache=True)
def step_joints(
    h: float,
    mode: int,
    look_ahead: float,
    parameters: NDArray[np.float64],
    command: NDArray[np.float64],
    joint_state: NDArray[np.float64],
    pressure: NDArray[np.float64],
    torque: NDArray[np.float64],
    mass_flow: NDArray[np.float64],
    memory: NDArray[np.float64],
    supply_change: float = 0.0,
    action: int = NO_ACTION,
    conditions: NDArray[np.float64] | None = None,
) -> None:
    """Advances `n` joints by `h`, in place.

    Args:
        h: time step, s.
        mode: `FLOW_MODE` or `REGULATOR_MODE`.
        look_ahead: steps by which `joint_state` is to be extrapolated, to the
            angle at which the torque will act: 0 where it is that angle.
        parameters: (ROWS, n), see `Row`, or the same as one row, (ROWS · n).
        command: (n) openings, or (2n) pressures [p_a; p_b] in Pa absolute.
        joint_state: (2n) [q; q̇] at the step's start, rad and rad/s.
        pressure: (2n) [p_a; p_b], Pa absolute; advanced.
        torque: (n) N m; set to the torque at the step's end.
        mass_flow: (2n) kg/s into each chamber; set to the step's mean.
        memory: see `memory_size`; advanced. Where its first entry is 0 it is
            filled first: valves at rest, ambient temperature, friction at 0.
        supply_change: what the supply has above its parameter now, Pa.
        action: `NO_ACTION`, `VENT` or `REST`.
        conditions: (CONDITION_ROWS · 2n), see `conditions`; None:
            all is well.
    """
    # Here and not in Python, where even this counts a thousand times a second.
    parameters = parameters.reshape(ROWS, parameters.size // ROWS)
    n = parameters.shape[1]
    mass = memory[_HEAD : _HEAD + 2 * n]
    spool = memory[_HEAD + 2 * n : _HEAD + 4 * n]
    angle = memory[_HEAD + 4 * n : _HEAD + 5 * n]
    speed = memory[_HEAD + 5 * n : _HEAD + 6 * n]
    bristle = memory[_HEAD + 6 * n : _HEAD + 7 * n]
    dwell = memory[_HEAD + 7 * n : _HEAD + 8 * n]
    line = memory[_HEAD + 8 * n :]
    slots = line.size // (2 * n)

    if memory[0] == 0.0:
        memory[0] = 1.0
        memory[1] = 0.0
        for i in range(n):
            angle[i] = joint_state[i]
            speed[i] = joint_state[n + i]
            bristle[i] = 0.0
            dwell[i] = 1.0
            V_a, V_b = joint_volume(angle[i], i, parameters)
            RT = GAS_CONSTANT * parameters[_TEMPERATURE, i]
            mass[i] = pressure[i] * V_a / RT
            mass[n + i] = pressure[n + i] * V_b / RT
            for c in (i, n + i):
                spool[c] = 0.0
                rest = pressure[c] if mode == REGULATOR_MODE else 0.0
                for k in range(slots):
                    line[k * 2 * n + c] = rest

    head = int(memory[1]) + 1
    if head >= slots:
        head = 0
    memory[1] = head

    for i in range(n):
        q = joint_state[i]
        v = joint_state[n + i]
        # Half of the last change of velocity: between the plant's Euler step
        # (which would want all of it) and a smooth motion from outside.
        v_next = v + 0.5 * look_ahead * (v - speed[i])
        q_next = q + look_ahead * h * v_next
        V_old_a, V_old_b = joint_volume(angle[i], i, parameters)
        V_new_a, V_new_b = joint_volume(q_next, i, parameters)

        lag = parameters[_VALVE_LAG, i]
        decay = math.exp(-h / lag) if lag > 0.0 else 0.0
        delay = parameters[_DEAD_TIME, i] / h
        back = int(delay)
        weight = delay - back
        if back > slots - 2:
            back = slots - 2
            weight = 1.0
        first = (head - back) % slots
        second = (head - back - 1) % slots
        underlap = parameters[_UNDERLAP, i]

        for side in range(2):
            c = i + side * n
            if mode == REGULATOR_MODE:
                line[head * 2 * n + c] = command[c]
            elif side == 0:
                line[head * 2 * n + c] = command[i]
            else:
                line[head * 2 * n + c] = -command[i]
            target = (1.0 - weight) * line[first * 2 * n + c]
            target += weight * line[second * 2 * n + c]
            if mode == REGULATOR_MODE:
                target = parameters[_REGULATOR_GAIN, i] * (target - pressure[c])
            if action != NO_ACTION:
                target = -1.0 if action == VENT else 0.0
            target = min(max(target, -1.0), 1.0)
            forced = 0.0
            leak = parameters[_C_LEAK, i]
            if conditions is not None:
                forced = conditions[c]
                leak += conditions[_LEAK * 2 * n + c]
                lag = parameters[_VALVE_LAG, i] * conditions[_LAG * 2 * n + c]
                decay = math.exp(-h / lag) if lag > 0.0 else 0.0
                if forced == 1.0:
                    target = conditions[_SPOOL * 2 * n + c]
                    spool[c] = target
            # The lag's mean over the step, which is what the air sees.
            offset = spool[c] - target
            stroke = target
            if lag > 0.0:
                stroke += offset * (1.0 - decay) * lag / h
            spool[c] = target + offset * decay

            c_fill = parameters[_C_FILL, i] * opening_fraction(stroke, underlap)
            c_out = parameters[_C_EXHAUST, i] * opening_fraction(
                -stroke, underlap
            )
            if forced == 2.0:
                c_fill = 0.0
                c_out = 0.0
            c_out += leak
            if side == 0:
                V_old = V_old_a
                V_new = V_new_a
            else:
                V_old = V_old_b
                V_new = V_new_b
            pressure[c], mass[c], mass_flow[c] = chamber_step(
                pressure[c],
                mass[c],
                V_old,
                V_new,
                h,
                c_fill,
                c_out,
                parameters[_CRITICAL_RATIO, i],
                parameters[_EXPONENT, i],
                parameters[_SUPPLY, i] + supply_change,
                parameters[_ATMOSPHERE, i],
                parameters[_TEMPERATURE, i],
            )

        change = q_next - angle[i]
        limit = stribeck_torque(
            v_next,
            parameters[_COULOMB, i],
            parameters[_BREAKAWAY, i],
            parameters[_STRIBECK_VELOCITY, i],
        )
        if parameters[_DWELL_TORQUE, i] > 0.0:
            # Fade and recovery both by their exact exponentials.
            dwell[i] *= math.exp(-abs(change) / parameters[_DWELL_TRAVEL, i])
            if parameters[_DWELL_RECOVERY, i] > 0.0:
                back_to_rest = -math.expm1(-h / parameters[_DWELL_RECOVERY, i])
                dwell[i] += (1.0 - dwell[i]) * back_to_rest
            limit += parameters[_DWELL_TORQUE, i] * dwell[i]
        bristle[i], friction = friction_step(
            bristle[i],
            change,
            v_next,
            limit,
            parameters[_STIFFNESS, i],
            parameters[_DAMPING, i],
        )
        atmosphere = parameters[_ATMOSPHERE, i]
        torque[i] = (
            parameters[_K_A, i] * (pressure[i] - atmosphere)
            - parameters[_K_B, i] * (pressure[n + i] - atmosphere)
            - friction
        )
        angle[i] = q_next
        speed[i] = v
