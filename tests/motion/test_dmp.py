"""The movement primitive against independent integration and real motion."""

import copy
from pathlib import Path
import pickle

from hypothesis import given
from hypothesis import strategies as st
import numpy as np
from numpy.testing import assert_allclose
import pytest
from scipy.integrate import solve_ivp

from drake_affetto.common.errors import InputError
from drake_affetto.motion import Dmp, DmpConfig

LOG = (
    Path(__file__).parents[2].parent
    / "shared/data/affetto-logs/kinesthetic_000.csv"
)


def random_movement(n_joints=3, n_basis=15, seed=0):
    random = np.random.default_rng(seed)
    theta = 20.0 * random.normal(size=n_joints * n_basis)
    return theta, random.normal(size=n_joints)


def forcing(theta, x, n_basis, width):
    """Eq. 2, written down again, a joint at a time."""
    values = []
    for weights in theta.reshape(-1, n_basis):
        total, norm = 0.0, 0.0
        for k in range(n_basis):
            center = 1.0 - k / (n_basis - 1)
            psi = np.exp(
                -((x - center) ** 2) * (n_basis - 1) ** 2 / (2 * width**2)
            )
            total += weights[k] * psi
            norm += psi
        values.append(total / norm)
    return np.array(values)


@pytest.mark.parametrize("damping", [None, 4.0, 50.0])
def test_rollout_obeys_the_differential_equation(damping):
    config = DmpConfig(n_basis=6, duration=1.5, damping=damping)
    theta, start = random_movement(2, 6)
    goal, velocity = start + [0.5, -1.0], np.array([0.3, -2.0])
    damped = 20.0 if damping is None else damping

    def right_side(t, z):
        q, v = z[:2], z[2:]
        f = forcing(theta, 1.0 - t / 1.5, 6, config.width)
        return np.concatenate([v, 100.0 * (goal - q) - damped * v + f])

    known = solve_ivp(
        right_side,
        (0.0, 1.5),
        np.concatenate([start, velocity]),
        t_eval=np.linspace(0.0, 1.5, 76),
        method="DOP853",
        rtol=1e-10,
        atol=1e-11,
        max_step=0.05,
    )
    found = Dmp(config).rollout(
        theta, start, 0.02, goal=goal, velocity=velocity
    )
    assert_allclose(found.t, known.t, atol=1e-12)
    assert_allclose(found.q, known.y[:2].T, atol=1e-8)
    assert_allclose(found.q_dot, known.y[2:].T, atol=1e-7)
    slopes = [
        right_side(t, z)[2:] for t, z in zip(known.t, known.y.T, strict=True)
    ]
    assert_allclose(found.q_ddot, slopes, atol=1e-5)


@pytest.mark.parametrize("damping", [None, 4.0, 50.0])
@pytest.mark.parametrize("duration", [3.0, 2.2])
def test_steps_agree_with_the_rollout(damping, duration):
    dmp = Dmp(DmpConfig(damping=damping))
    theta, start = random_movement()
    goal = start + 0.3
    whole = dmp.rollout(
        theta, start, goal=goal, duration=duration, length=duration + 1.0
    )
    phase, q, q_dot = 1.0, start, np.zeros(3)
    for i in range(1, len(whole.t)):
        phase, q, q_dot = dmp.step(
            phase, q, q_dot, theta, goal, 0.005, duration
        )
        assert_allclose(q, whole.q[i], atol=1e-10)
        assert_allclose(q_dot, whole.q_dot[i], atol=1e-9)
    assert phase == 0.0


def test_a_step_may_begin_at_any_phase():
    dmp = Dmp()
    theta, start = random_movement()
    fine = dmp.rollout(theta, start, 0.001)
    # 0.0123 s in is on no grid of 5 ms steps.
    dense = dmp.rollout(theta, start, 0.0001)
    phase = 1.0 - 0.0123 / 3.0
    phase, q, _ = dmp.step(
        phase, dense.q[123], dense.q_dot[123], theta, start, 0.0057
    )
    assert_allclose(q, fine.q[18], atol=1e-10)
    assert phase == pytest.approx(1.0 - 0.018 / 3.0)


@given(
    n_joints=st.integers(1, 9),
    n_basis=st.integers(2, 30),
    parts=st.integers(2, 40),
    seed=st.integers(0, 1000),
)
def test_samples_do_not_depend_on_their_distance(
    n_joints, n_basis, parts, seed
):
    dmp = Dmp(DmpConfig(n_basis=n_basis, duration=1.0))
    theta, start = random_movement(n_joints, n_basis, seed)
    coarse = dmp.rollout(theta, start, 1.0 / parts)
    fine = dmp.rollout(theta, start, 1.0 / (3 * parts))
    assert coarse.q.shape == (parts + 1, n_joints)
    assert_allclose(coarse.q, fine.q[::3], atol=1e-9)
    assert_allclose(coarse.q_ddot, fine.q_ddot[::3], atol=1e-6)


@pytest.mark.parametrize("dt", [0.3, 0.07, 0.0333])
def test_a_movement_may_end_within_a_step(dt):
    dmp = Dmp(DmpConfig(duration=1.0))
    theta, start = random_movement()
    theta[14::15] = 100.0  # of great force until the very end
    coarse = dmp.rollout(theta, start, dt, length=1.5)
    fine = dmp.rollout(theta, start, dt / 100, length=1.5)
    assert_allclose(coarse.q, fine.q[::100][: len(coarse.q)], atol=1e-7)


def test_joints_follow_one_another_in_theta():
    dmp = Dmp()
    theta, start = random_movement(4)
    together = dmp.rollout(theta, start).q
    for j in range(4):
        alone = dmp.rollout(theta[15 * j : 15 * j + 15], start[j : j + 1]).q
        assert_allclose(together[:, j], alone[:, 0], atol=1e-12)


def test_early_weights_act_early():
    theta = np.zeros(15)
    theta[0] = 1.0
    early = Dmp().rollout(theta, [0.0]).q[:, 0]
    late = Dmp().rollout(theta[::-1], [0.0]).q[:, 0]
    assert early.argmax() < 0.2 * len(early)
    assert late.argmax() > 0.9 * len(late)


def test_duration_stretches_time_and_nothing_else():
    dmp = Dmp()
    theta, start = random_movement()
    goal = start - 0.4
    normal = dmp.rollout(theta, start, 0.01, goal=goal, length=4.0)
    slow = dmp.rollout(theta, start, 0.02, goal=goal, duration=6.0, length=8.0)
    assert_allclose(slow.q, normal.q, atol=1e-10)
    assert_allclose(2.0 * slow.q_dot, normal.q_dot, atol=1e-9)


def test_the_arm_returns_to_where_it_started():
    theta, start = random_movement()
    end = Dmp().rollout(theta, start, length=6.0)
    assert_allclose(end.q[-1], start, atol=1e-8)
    assert_allclose(end.q_dot[-1], 0.0, atol=1e-7)


@pytest.mark.parametrize("method", ["trajectory", "forcing"])
def test_encode_finds_the_movement_again(method):
    dmp = Dmp(DmpConfig(method=method, smoothing=0.005))
    random = np.random.default_rng(3)
    # Neighboring weights alike, as those of a hand's movement are.
    theta = np.interp(
        np.arange(15), np.arange(0, 15, 4), 20 * random.normal(size=4)
    )
    theta = np.concatenate([theta, -0.5 * theta])
    start = np.array([0.2, -0.4])
    seen = dmp.rollout(theta, start, 0.002, duration=2.4)
    found = dmp.encode(seen.t, seen.q)
    again = dmp.rollout(found, start, 0.002, duration=2.4)
    # The forcing sets in at once, which smoothing blurs.
    bound = {"trajectory": 1e-4, "forcing": 4e-3}[method]
    assert np.abs(again.q - seen.q).max() < bound


def test_encode_with_given_goal_and_velocity():
    dmp = Dmp(DmpConfig(ridge=1e-9))
    theta, start = random_movement(2)
    goal, velocity = start + [1.0, -0.5], np.array([0.7, -1.5])
    seen = dmp.rollout(theta, start, goal=goal, velocity=velocity)
    found = dmp.encode(seen.t, seen.q, goal=goal, velocity=velocity)
    assert_allclose(found, theta, atol=0.05)


@pytest.mark.parametrize("method", ["trajectory", "forcing"])
def test_several_demonstrations_become_one(method):
    dmp = Dmp(DmpConfig(method=method))
    theta, start = random_movement(2)
    seen = dmp.rollout(theta, start)
    random = np.random.default_rng(0)
    noisy = [seen.q + 0.02 * random.normal(size=seen.q.shape) for _ in range(8)]
    for q in noisy:
        q[0] = start
    one = dmp.encode(seen.t, noisy[0])
    all_of_them = dmp.encode([seen.t] * 8, noisy)
    # Linear least squares: that of all is that of their mean.
    mean = dmp.encode(seen.t, np.mean(noisy, axis=0))
    assert_allclose(all_of_them, mean, rtol=1e-6, atol=1e-6)

    def error(found):
        return np.std(dmp.rollout(found, start).q - seen.q)

    assert error(all_of_them) < error(one)


def test_demonstrations_of_different_lengths_and_places():
    dmp = Dmp(DmpConfig(ridge=1e-9))
    theta, start = random_movement(2)
    parts = [
        dmp.rollout(theta, start, 0.004, duration=2.0),
        dmp.rollout(theta, start + 1.0, 0.01, duration=4.0),
    ]
    found = dmp.encode([p.t for p in parts], [p.q for p in parts])
    assert_allclose(found, theta, atol=0.05)


def test_times_need_not_be_even():
    dmp = Dmp(DmpConfig(ridge=1e-9))
    theta, start = random_movement(2)
    dense = dmp.rollout(theta, start, 0.001)
    kept = np.unique(np.random.default_rng(1).choice(3001, 500, replace=False))
    kept[0], kept[-1] = 0, 3000
    found = dmp.encode(dense.t[kept] + 17.0, dense.q[kept])
    again = dmp.rollout(found, start, 0.001)
    assert np.abs(again.q - dense.q).max() < 1e-4


def test_forcing_is_not_learned_from_what_follows_the_end():
    theta, start = random_movement(1)
    for method in ("trajectory", "forcing"):
        dmp = Dmp(DmpConfig(method=method))
        seen = dmp.rollout(theta, start, length=5.0)
        found = dmp.encode(seen.t, seen.q, duration=3.0)
        again = dmp.rollout(found, start, length=5.0)
        assert np.abs(again.q - seen.q).max() < 0.05


def test_real_demonstration():
    """3 s windows of a person's guidance, from every second sample.

    The joints are in percent of their range, and the angle sensors' noise is
    0.05 to 0.3 %. These windows are not those on which the defaults were
    chosen.
    """
    if not LOG.is_file():
        pytest.skip("the robot's logs are not here")
    log = np.genfromtxt(LOG, delimiter=",", names=True)
    q = np.stack([log[f"rq{j}"] for j in range(1, 6)], axis=1)
    dmp = Dmp()
    squares = []
    for begin in range(150, 210, 15):
        window = slice(begin, begin + 91)
        t, seen = log["t"][window] - log["t"][begin], q[window]
        theta = dmp.encode(t[::2], seen[::2])
        again = dmp.rollout(theta, seen[0], t[-1] / 90, duration=t[-1])
        squares.append((again.q[1::2] - seen[1::2]) ** 2)
    assert np.ptp(q, axis=0).min() > 10.0
    assert np.sqrt(np.mean(squares)) < 0.45


def test_basis_is_a_partition():
    dmp = Dmp(DmpConfig(n_basis=7))
    # Far outside too, where every Gaussian has long underflowed.
    phases = np.array([-50.0, 0.0, 0.31, 1.0, 80.0])
    psi = dmp.basis(phases)
    assert psi.shape == (5, 7)
    assert_allclose(psi.sum(axis=1), 1.0)
    assert_allclose(dmp.basis(dmp.centers).argmax(axis=1), np.arange(7))


def test_centers_are_a_copy():
    dmp = Dmp()
    dmp.centers[:] = 5.0
    assert dmp.centers[0] == 1.0


def test_the_same_answer_from_memory():
    dmp = Dmp()
    theta, start = random_movement()
    first = dmp.rollout(theta, start)
    first.q[:] = np.nan
    second = dmp.rollout(theta, start)
    assert np.isfinite(second.q).all()
    for k in range(40):
        dmp.rollout(theta, start, 0.01 + 0.001 * k)
    assert_allclose(dmp.rollout(theta, start).q, second.q)


BAD = [
    (lambda d: d.rollout(np.zeros(14), [0.0]), "theta"),
    (lambda d: d.rollout(np.zeros((15, 1)), [0.0]), "theta"),
    (lambda d: d.rollout(np.full(15, np.nan), [0.0]), "theta"),
    (lambda d: d.rollout(np.zeros(15), [0.0, 1.0]), "q0"),
    (lambda d: d.rollout(np.zeros(15), [np.inf]), "q0"),
    (lambda d: d.rollout(np.zeros(15), [0.0], 0.0), "dt"),
    (lambda d: d.rollout(np.zeros(15), [0.0], length=-1.0), "length"),
    (lambda d: d.rollout(np.zeros(15), [0.0], duration=0.0), "duration"),
    (lambda d: d.rollout(np.zeros(15), [0.0], goal=[0, 0]), "goal"),
    (lambda d: d.step(1.5, [0], [0], np.zeros(15), [0], 0.01), "phase"),
    (lambda d: d.encode([0, 1, 2], np.zeros((3, 1))), "t"),
    (lambda d: d.encode([0, 2, 1, 3], np.zeros((4, 1))), "t"),
    (lambda d: d.encode(np.arange(4), np.zeros(4)), "q"),
    (lambda d: d.encode(np.arange(4), np.full((4, 1), np.nan)), "q"),
    (lambda d: d.encode([np.arange(4)] * 2, [np.zeros((4, 1))]), "number"),
    (
        lambda d: d.encode(
            [np.arange(4)] * 2, [np.zeros((4, 1)), np.zeros((4, 2))]
        ),
        "joints",
    ),
]


@pytest.mark.parametrize(("call", "named"), BAD)
def test_bad_input_is_named(call, named):
    with pytest.raises(InputError, match=named):
        call(Dmp())


def test_undetermined_parameters_are_told():
    dmp = Dmp(DmpConfig(ridge=0.0))
    with pytest.raises(InputError, match="ridge"):
        dmp.encode(np.arange(5.0), np.zeros((5, 1)))


def test_a_pickled_dmp_leaves_its_grids_behind():
    dmp = Dmp()
    small = len(pickle.dumps(dmp))
    t = np.linspace(0.0, 3.0, 301)
    q = np.sin(t)[:, None]
    theta = dmp.encode(t, q)
    dmp.rollout(theta, q[0])
    assert len(pickle.dumps(dmp)) == small < 5000
    again = pickle.loads(pickle.dumps(dmp))
    np.testing.assert_array_equal(again.encode(t, q), theta)
    np.testing.assert_array_equal(copy.deepcopy(dmp).encode(t, q), theta)
