"""Physics of valves, chambers and friction, against closed forms."""

import math
from xml.etree import ElementTree

from hypothesis import given, settings
from hypothesis import strategies as st
import numpy as np
import pytest

from drake_affetto.common.resources import models_dir
from drake_affetto.pneumatics.chamber import (
    REGULATOR_MODE,
    Row,
    chamber_step,
    friction_step,
    opening_fraction,
)
from drake_affetto.pneumatics.flow import (
    GAS_CONSTANT,
    REFERENCE_DENSITY,
    REFERENCE_TEMPERATURE,
)
from drake_affetto.pneumatics.parameters import (
    chamber_volumes,
    closed_stiffness,
    load_parameters,
)
from support.actuator_bench import (
    ATMOSPHERE,
    Q_LOWER,
    Q_UPPER,
    SUPPLY,
    Actuators,
    closed,
    make_parameters,
)

T0 = REFERENCE_TEMPERATURE


def tank(p, *, n, C_fill=0.0, C_out=0.0, V=1e-3, h=0.001, T=0.5, b=0.3):
    """Pressures of a tank of constant volume at 0, h, 2h, ..., T."""
    mass = p * V / (GAS_CONSTANT * T0)
    pressures = [p]
    for _ in range(round(T / h)):
        p, mass, _ = chamber_step(
            p, mass, V, V, h, C_fill, C_out, b, n, SUPPLY, ATMOSPHERE, T0
        )
        pressures.append(p)
    return np.array(pressures), mass


@pytest.mark.parametrize("h", [0.0005, 0.001, 0.002])
@pytest.mark.parametrize("n", [1.0, 1.4])
def test_blow_down_of_a_tank_follows_the_choked_solution(n, h):
    # Choked while p > p_atm/b: from 16 bar down to 3.4 bar.
    C, V, start, T = 1e-8, 1e-3, 16e5, 0.4
    # The time in which the first flow would carry all the air away.
    tau = V / (GAS_CONSTANT * T0 * C * REFERENCE_DENSITY)
    t = np.arange(0.0, T + 0.5 * h, h)
    if n == 1.0:
        exact = start * np.exp(-t / tau)
    else:
        exact = start * (1 + 0.5 * (n - 1) * t / tau) ** (-2 * n / (n - 1))
    simulated, _ = tank(start, n=n, C_out=C, V=V, h=h, T=T)
    assert exact[-1] < 0.75 * start
    assert exact[-1] > ATMOSPHERE / 0.3
    np.testing.assert_allclose(simulated, exact, rtol=1e-3)


def test_adiabatic_blow_down_cools_the_air_as_expansion_does():
    simulated, mass = tank(16e5, n=1.4, C_out=1e-8, T=0.4)
    temperature = simulated[-1] * 1e-3 / (mass * GAS_CONSTANT)
    expected = T0 * (simulated[-1] / 16e5) ** (0.4 / 1.4)
    assert temperature < 0.95 * T0
    assert temperature == pytest.approx(expected, rel=1e-3)


def test_isothermal_air_stays_at_ambient_temperature():
    simulated, mass = tank(2e5, n=1.0, C_fill=1e-8, C_out=0.3e-8, T=1.0)
    assert simulated[-1] * 1e-3 / (mass * GAS_CONSTANT) == pytest.approx(T0)


@settings(max_examples=60, deadline=None)
@given(
    C=st.floats(1e-10, 1e-4),
    V=st.floats(1e-6, 1e-3),
    n=st.floats(1.0, 1.4),
    h=st.sampled_from([0.0005, 0.001, 0.002]),
    start=st.floats(2e4, 1e6),
)
def test_filling_ends_at_the_supply_and_never_passes_it(C, V, n, h, start):
    # From above, too: air flows back into the supply then.
    p, _ = tank(start, n=n, C_fill=C, V=V, h=h, T=0.2)
    side = np.sign(SUPPLY - start)
    assert np.all(side * (SUPPLY - p) >= -1e-6 * SUPPLY)
    assert np.all(side * np.diff(p) >= -1e-6 * SUPPLY)
    if C / V > 1e-3:
        assert p[-1] == pytest.approx(SUPPLY, rel=1e-3)


@settings(max_examples=60, deadline=None)
@given(
    C=st.floats(1e-10, 1e-4),
    share=st.floats(0.0, 10.0),
    start=st.floats(2e4, 1e6),
    n=st.floats(1.0, 1.4),
)
def test_any_valve_is_stable_at_two_milliseconds(C, share, start, n):
    p, mass = tank(start, n=n, C_fill=C, C_out=share * C, V=5e-6, h=0.002)
    low, high = min(start, ATMOSPHERE), max(start, SUPPLY)
    assert np.all((p >= low * (1 - 1e-6)) & (p <= high * (1 + 1e-6)))
    assert mass > 0.0
    # It has settled: no oscillation about the balance of the flows.
    if C / 5e-6 > 1e-2:
        assert np.ptp(p[-50:]) < 1e-3 * p[-1]


@pytest.mark.parametrize("rate", [0.01, 1.0, 100.0])
@pytest.mark.parametrize("n", [1.0, 1.2, 1.4])
def test_closed_chambers_follow_the_polytropic_law(n, rate):
    array = closed(make_parameters(exponent=n))
    actuators = Actuators(array, [4e5, 5e5])
    invariant = None
    # Whatever the speed: the law holds at the angle that was read.
    for t in np.arange(0.0, 1.0, 0.001):
        q = 0.9 * math.sin(rate * t)
        p = actuators.step(0.0, q, 0.9 * rate * math.cos(rate * t))
        volumes = np.concatenate(chamber_volumes(array, [q]))
        now = p * volumes**n
        invariant = now if invariant is None else invariant
        np.testing.assert_allclose(now, invariant, rtol=1e-9)


def test_look_ahead_gives_the_pressure_at_the_end_of_the_step():
    array = closed(make_parameters())
    actuators = Actuators(array, 5e5, look_ahead=1.0)
    h, w = 0.001, 2 * math.pi * 2.0
    worst = 0.0
    invariant = None
    for k in range(500):
        t = k * h
        p = actuators.step(
            0.0, 0.5 * math.sin(w * t), 0.5 * w * math.cos(w * t)
        )
        after = [0.5 * math.sin(w * (t + h))]
        now = p * np.concatenate(chamber_volumes(array, after)) ** 1.2
        invariant = now if k == 1 else invariant
        if k > 1:
            worst = max(worst, float(np.max(np.abs(now / invariant - 1.0))))
    assert worst < 1e-4


@pytest.mark.parametrize("n", [1.0, 1.4])
def test_closed_cylinder_is_the_spring_of_the_textbook(n):
    array = closed(make_parameters(exponent=n, area_ratio=0.85))
    start = np.array([4e5, 5e5])
    torques = []
    for q in (-1e-4, 1e-4):
        actuators = Actuators(array, start)
        actuators.step(0.0, 0.0)
        actuators.step(0.0, q)
        torques.append(actuators.torque[0])
    stiffness = -(torques[1] - torques[0]) / 2e-4
    # n p A²/V of both chambers, in rotation.
    K = np.array([5e-6, 0.85 * 5e-6])
    V = 12e-6 + K * (Q_UPPER - Q_LOWER) / 2
    assert stiffness == pytest.approx(np.sum(n * start * K**2 / V), rel=1e-5)
    expected = closed_stiffness(array, [0.0], start)[0]
    assert stiffness == pytest.approx(expected, rel=1e-5)


@settings(max_examples=12, deadline=None)
@given(
    amplitudes=st.lists(st.floats(-0.3, 0.3), min_size=3, max_size=3),
    p_a=st.floats(1.2e5, 6.5e5),
    p_b=st.floats(1.2e5, 6.5e5),
    n=st.floats(1.0, 1.4),
)
def test_a_closed_chamber_gives_back_what_it_got(amplitudes, p_a, p_b, n):
    # Work on the joint over a closed path of angles, by the midpoint rule
    # that belongs to torques given at the ends.
    array = closed(make_parameters(exponent=n, area_ratio=0.9))
    actuators = Actuators(array, [p_a, p_b])
    t = np.linspace(0.0, 1.0, 1001)
    q = sum(
        a * np.sin(2 * np.pi * (k + 1) * t) for k, a in enumerate(amplitudes)
    )
    torque = []
    for angle in q:
        actuators.step(0.0, angle)
        torque.append(actuators.torque[0])
    torque = np.array(torque)
    work = np.sum(0.5 * (torque[1:] + torque[:-1]) * np.diff(q))
    exchanged = np.sum(np.abs(np.diff(q)) * np.max(np.abs(torque)))
    assert abs(work) <= 3e-5 * exchanged + 1e-12
    assert torque[-1] == pytest.approx(torque[0], rel=1e-9, abs=1e-9)


@settings(max_examples=8, deadline=None)
@given(seed=st.integers(0, 2**32 - 1), phase=st.floats(0, 6.28))
def test_work_out_never_exceeds_the_air_put_in(seed, phase):
    # First law of the isothermal joint: the work it gives over a closed cycle
    # of its whole state is at most the exergy of the air that went through.
    random = np.random.default_rng(seed)
    array = make_parameters(exponent=1.0, valve_lag=0.0)
    array[Row.C_LEAK] = 0.0
    array[Row.UNDERLAP] = 0.0
    actuators = Actuators(array, 3e5)
    h = actuators.h
    command = np.repeat(random.uniform(-1, 1, 10), 30)
    work = exergy = 0.0
    q_last, torque_last = None, None
    for cycle in range(12):
        for k, u in enumerate(command):
            angle = 0.6 * math.sin(2 * math.pi * k / command.size + phase)
            actuators.step(u, angle)
            if cycle >= 10:
                if q_last is not None:
                    mean = 0.5 * (actuators.torque[0] + torque_last)
                    work += mean * (angle - q_last)
                filled = np.maximum(actuators.mass_flow, 0.0).sum() * h
                RT = GAS_CONSTANT * T0
                exergy += filled * RT * math.log(SUPPLY / ATMOSPHERE)
            q_last, torque_last = angle, actuators.torque[0]
    assert work <= exergy + 1e-9


def test_refinement_of_the_step_is_second_order():
    def final(h):
        p = tank(1.5e5, n=1.3, C_fill=2e-9, C_out=0.7e-9, V=2e-5, h=h, T=0.064)
        return p[0][-1]

    exact = final(0.00025 / 8)
    errors = [abs(final(h) - exact) for h in (0.004, 0.002, 0.001)]
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    assert np.all(orders > 1.7)


def test_refinement_with_a_moving_piston_is_second_order():
    def final(h):
        # Half-opened valve without lag, the joint on a smooth path.
        array = make_parameters(valve_lag=0.0)
        actuators = Actuators(array, 3e5, h=h)
        steps = round(0.2 / h)
        for k in range(steps + 1):
            p = actuators.step(0.5, 0.4 * math.sin(10 * k * h))
            if k == 0:
                # The first step flows at the starting angle: undo its time.
                p0 = p
        return p[0] + 0.0 * p0[0]

    # The run is one step longer than 0.2 s: first order by construction,
    # unless that is taken out by extrapolation.
    f = {h: final(h) for h in (0.002, 0.001, 0.0005, 0.00025)}
    once = [2 * f[h / 2] - f[h] for h in (0.002, 0.001, 0.0005)]
    assert abs(once[2] - once[1]) < 0.4 * abs(once[1] - once[0])


def test_valve_lag_and_dead_time():
    array = closed(make_parameters(valve_lag=0.02, dead_time=0.0105))
    actuators = Actuators(array, 3e5)
    spool = []
    for _ in range(100):
        actuators.step(1.0, 0.0)
        spool.append(actuators.memory[4])
    t = 0.001 * np.arange(1, 101)
    # Half of the dead time's last millisecond is interpolated.
    late = np.clip(t - 0.0105, 0.0, None)
    np.testing.assert_allclose(spool, 1 - np.exp(-late / 0.02), atol=1e-3)


@given(
    stroke=st.floats(-1.0, 1.0),
    underlap=st.floats(-0.5, 0.5),
)
def test_edges_open_by_the_underlap_and_fully_at_full_stroke(stroke, underlap):
    opening = opening_fraction(stroke, underlap)
    assert 0.0 <= opening <= 1.0
    assert opening_fraction(1.0, underlap) == 1.0
    assert (opening > 0.0) == (stroke + underlap > 0.0)


@settings(max_examples=20, deadline=None)
@given(seed=st.integers(0, 2**32 - 1))
def test_antagonists_are_symmetric(seed):
    random = np.random.default_rng(seed)
    array = make_parameters(coulomb_torque=0.05, breakaway_torque=0.07)
    there = Actuators(array, [3e5, 4e5])
    back = Actuators(array, [4e5, 3e5])
    q, v = 0.2, 0.0
    for _ in range(50):
        u = random.uniform(-1, 1)
        v += 0.3 * random.uniform(-1, 1)
        q += 0.001 * v
        p = there.step(u, q, v)
        mirrored = back.step(-u, -q, -v)
        np.testing.assert_allclose(p, mirrored[::-1], rtol=1e-12)
        assert there.torque[0] == pytest.approx(-back.torque[0], abs=1e-12)


@settings(max_examples=50, deadline=None)
@given(
    seed=st.integers(0, 2**32 - 1),
    coulomb=st.floats(0.0, 1.0),
    extra=st.floats(0.0, 1.0),
    scale=st.floats(0.01, 20.0),
)
def test_friction_never_drives(seed, coulomb, extra, scale):
    # Over any motion the work taken is at least what the bristles hold.
    random = np.random.default_rng(seed)
    stiffness, damping, h = 75.0, 0.15, 0.001
    z = work = 0.0
    smooth = 0.0
    for _ in range(400):
        smooth += 0.2 * (scale * random.standard_normal() - smooth)
        limit = coulomb + extra * math.exp(-((smooth / 0.05) ** 2))
        z, torque = friction_step(
            z, h * smooth, smooth, limit, stiffness, damping
        )
        assert abs(torque) <= limit * (1 + 1e-12) + 1e-300
        work += torque * smooth * h
        assert work >= 0.5 * stiffness * z**2 - 1e-12


def run_joint(actuators, inertia, seconds, *, q=0.0, v=0.0, force=0.0):
    """A free joint under its actuator and a force, as the plant steps it."""
    angles, speeds = [], []
    for k in range(round(seconds / actuators.h)):
        applied = force(k * actuators.h) if callable(force) else force
        v += actuators.h / inertia * (actuators.torque[0] + applied)
        q += actuators.h * v
        actuators.step(0.0, q, v)
        angles.append(q)
        speeds.append(v)
    return np.array(angles), np.array(speeds)


def friction_joint(h=0.001, **fields):
    array = closed(
        make_parameters(
            torque_constant=1e-12,
            coulomb_torque=0.1,
            breakaway_torque=0.15,
            **fields,
        )
    )
    return Actuators(array, 4e5, h=h)


@pytest.mark.parametrize("h", [0.001, 0.002])
@pytest.mark.parametrize("inertia", [1e-3, 1e-2, 0.1])
def test_friction_holds_a_joint_without_creep_until_it_breaks_away(inertia, h):
    # Pushed to and fro below the breakaway torque it goes nowhere.
    # With no viscous damping at all, the hardest case.
    angles, _ = run_joint(
        friction_joint(h), inertia, 4.0, force=lambda t: 0.12 * math.sin(5 * t)
    )
    assert np.max(np.abs(angles)) < 0.004
    later = angles[len(angles) // 2 :]
    assert abs(np.mean(later)) < 2e-4 + 0.1 * np.max(np.abs(angles))
    # Above it, it goes.
    angles, _ = run_joint(friction_joint(h), inertia, 4.0, force=0.16)
    assert angles[-1] > 0.05


@pytest.mark.parametrize("inertia", [1e-3, 1e-2, 0.1])
def test_friction_brings_a_moving_joint_to_rest(inertia):
    angles, speeds = run_joint(friction_joint(), inertia, 12.0, v=0.3)
    assert abs(speeds[-1]) < 1e-4
    assert np.ptp(angles[-1000:]) < 1e-5


def test_sliding_friction_takes_what_coulomb_says():
    angles, speeds = run_joint(friction_joint(), 0.1, 1.0, v=3.0)
    stopped = speeds[500] - speeds[0]
    assert stopped == pytest.approx(-0.1 / 0.1 * 0.5, rel=1e-2)
    assert angles[-1] > 0.0


def test_friction_after_a_rest_wears_off_with_travel():
    array = closed(
        make_parameters(
            coulomb_torque=0.1,
            breakaway_torque=0.1,
            dwell_torque=0.2,
            dwell_travel=1.5,
            torque_constant=1e-12,
        )
    )
    actuators = Actuators(array, 4e5)
    q, found = 0.0, []
    for _ in range(3000):
        q += 0.001
        actuators.step(0.0, q, 1.0)
        found.append(-actuators.torque[0])
    travel = 0.001 * np.arange(1, 3001)
    expected = 0.1 + 0.2 * np.exp(-travel / 1.5)
    np.testing.assert_allclose(found[50:], expected[50:], rtol=1e-2)


# Pressures of the robot's joints, mean of eleven runs and seven joints that
# stood still: kPa gauge at milliseconds after the command.
FILL = {67: 6, 100: 34, 133: 102, 167: 202, 200: 309, 233: 368, 267: 395}
FILL[300] = 401
EMPTY = {67: 560, 100: 546, 133: 523, 167: 492, 200: 464, 233: 444}
EMPTY |= {267: 429, 333: 411, 400: 403, 467: 400}
# The first run alone, free of the blur by the start's jitter.
SINGLE = {67: 5, 100: 45, 133: 130, 167: 270, 200: 352, 233: 394, 267: 401}


def regulated_step(actuator, start, dead_time, side):
    """Pressure [kPa gauge] of a chamber at 0, 1, ... ms; command 400 kPa."""
    parameters = load_parameters()
    name = next(
        name
        for name, joint in parameters.joints.items()
        # What a joint has of its own belongs to its own range.
        if joint.actuator == actuator and not joint.override
    )
    array = parameters.for_joints([name], [0.0], [1.5])
    return step_at_lower_stop(array, 0.0, start, dead_time)[:, side, 0]


def step_at_lower_stop(array, q, start, dead_time):
    """Pressures [kPa gauge] of joints at q, (501, 2, n); command 400 kPa."""
    array = array.copy()
    array[Row.DEAD_TIME] = dead_time
    n = array.shape[1]
    actuators = Actuators(array, ATMOSPHERE + 1e3 * start, mode=REGULATOR_MODE)
    pressure = [np.array(actuators.pressure)]
    for _ in range(500):
        pressure.append(np.array(actuators.step(ATMOSPHERE + 400e3, q)))
    return 1e-3 * (np.reshape(pressure, (-1, 2, n)) - ATMOSPHERE)


@pytest.mark.parametrize("actuator", ["waist", "shoulder", "rotation", "wrist"])
def test_regulated_steps_are_the_robots(actuator):
    # The dead time differs from run to run: 92 ms, standard deviation 23 ms.
    delays = 0.092 + 0.023 * np.array([-1.35, -0.67, 0.0, 0.67, 1.35])
    for table, start, side in ((FILL, 2.0, 0), (EMPTY, 560.0, 1)):
        mean = np.mean(
            [regulated_step(actuator, start, d, side) for d in delays], axis=0
        )
        for time, measured in table.items():
            assert mean[time] == pytest.approx(measured, abs=15.0)


def test_the_mean_of_the_robots_joints_steps_as_the_table():
    """The joints with their own ranges, at their lower stops as in the logs."""
    joints = robot_joints()
    names = [name for name in joints if not name.startswith("right_")]
    lower, upper = np.array([joints[name] for name in names]).T
    array = load_parameters().for_joints(names, lower, upper)
    delays = 0.092 + 0.023 * np.array([-1.35, -0.67, 0.0, 0.67, 1.35])
    for table, start, side in ((FILL, 2.0, 0), (EMPTY, 560.0, 1)):
        mean = np.mean(
            [step_at_lower_stop(array, lower, start, d) for d in delays],
            axis=0,
        )
        for time, measured in table.items():
            assert mean[time, side].mean() == pytest.approx(measured, abs=12.0)
            # Each of them, also those whose range is short.
            np.testing.assert_allclose(
                mean[time, side], measured, rtol=0.0, atol=15.0
            )


def robot_joints():
    """Limits [rad] of the robot's joints by name."""
    tree = ElementTree.parse(models_dir() / "sdf" / "affetto.sdf")
    return {
        joint.get("name"): [
            float(joint.findtext(f"axis/limit/{side}"))
            for side in ("lower", "upper")
        ]
        for joint in tree.iter("joint")
        if joint.get("type") == "revolute"
    }


def test_a_single_regulated_step_is_the_robots_but_for_its_dead_time():
    worst = min(
        max(
            abs(regulated_step("rotation", 2.0, d, 0)[t] - p)
            for t, p in SINGLE.items()
        )
        for d in np.arange(0.074, 0.084, 0.002)
    )
    assert worst < 15.0
