"""Joint targets at 20 Hz."""

import warnings

import gymnasium
from gymnasium.utils.env_checker import check_env
import numpy as np
import pytest

from drake_affetto.common.errors import InputError
from drake_affetto.envs.lessons import load_lessons
from drake_affetto.envs.strike import StrikeEnv

XY = {"options": {"xy": [0.235, -0.09]}}


@pytest.fixture(scope="module")
def env():
    return StrikeEnv()


@pytest.fixture(scope="module")
def shaped():
    return StrikeEnv(reward="shaped", lessons=4)


def follow(env, q):
    """Actions that put the targets where q (T, n) goes, as far as they may."""
    q = q[np.linspace(0, len(q) - 1, 61).round().astype(int)[1:]]
    low, high = env.unwrapped._low, env.unwrapped._high
    return np.clip(2.0 * (q - low) / (high - low) - 1.0, -1.0, 1.0)


def play(env, actions):
    done = [env.step(action) for action in actions]
    return np.array([each[1] for each in done]), done


def test_gymnasium_has_nothing_to_say():
    env = gymnasium.make("Affetto/Strike-v0").unwrapped
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        check_env(env, skip_render_check=True)


def test_a_demonstrated_movement_is_heard_at_the_end(env):
    q = load_lessons("drumming", 4).q[0]
    env.reset(seed=0)
    rewards, done = play(env, follow(env, q))
    assert [each[2] for each in done] == [False] * 59 + [True]
    assert not rewards[:-1].any()
    # Not that lesson's drum: what was heard is what is paid.
    assert done[-1][4]["success"] == (rewards[-1] > 0.15)
    with pytest.raises(InputError, match=r"call reset\(\)"):
        env.step(np.zeros(8))


def test_rest_is_not_heard_and_targets_are_followed(env):
    observation, _ = env.reset(seed=0, **XY)
    rest = observation[:8]
    still = follow(env, np.tile(rest, (61, 1)))
    rewards, done = play(env, still)
    assert rewards[-1] < 0.05
    np.testing.assert_allclose(done[-1][0][:8], rest, atol=0.03)
    assert done[-1][0][-1] == 1.0
    # The drum's place is seen, and nothing else tells it.
    other, _ = env.reset(seed=0, options={"xy": [0.3, -0.03]})
    assert np.abs(other[-3:-1] - observation[-3:-1]).min() > 0.1
    np.testing.assert_allclose(other[:32], observation[:32], atol=1e-6)


def test_targets_move_at_most_at_the_greatest_speed():
    env = StrikeEnv(fastest=0.5)
    env.reset(seed=0, **XY)
    before = env._runner.port("affetto.desired_state")[:8]
    env.step(np.ones(8, np.float32))
    after = env._runner.port("affetto.desired_state")
    assert (after[:8] - before).max() == pytest.approx(0.5 * 0.05)
    assert after[8:].max() == pytest.approx(0.5)


def test_seeds_reproduce(env):
    def run():
        env.reset(seed=3)
        env.action_space.seed(1)
        return play(env, [env.action_space.sample() for _ in range(60)])

    first, again = run(), run()
    np.testing.assert_array_equal(first[0], again[0])
    np.testing.assert_array_equal(first[1][-1][0], again[1][-1][0])


def test_what_shaping_pays_depends_on_the_beginning_alone(env, shaped):
    """The theorem's reason: potentials cancel along an episode."""
    actions = np.linspace(-0.3, 0.3, 60)[:, None] * np.ones(8)
    starts = []
    for each in (env, shaped):
        each.reset(seed=0, **XY)
        starts.append(each._potential())
    plain, _ = play(env, actions)
    more, _ = play(shaped, actions)
    assert starts[0] == 0.0
    assert np.abs(more[:-1]).max() > 1e-3
    assert more.sum() == pytest.approx(plain.sum() - starts[1])


def test_shaping_pays_for_what_was_taught(shaped):
    sums = []
    for actions in (
        lambda: follow(shaped, shaped._lesson),
        lambda: np.zeros((60, 8)),
    ):
        shaped.reset(seed=0, **XY)
        # Up to the stroke's middle, where lessons are farthest from rest.
        sums.append(play(shaped, actions()[:30])[0].sum())
    assert sums[0] > sums[1] + 0.1


def test_render_gives_a_picture():
    env = StrikeEnv(render_mode="rgb_array")
    env.reset(seed=0)
    picture = env.render()
    assert picture.shape == (360, 480, 3)
    assert picture.std() > 20


@pytest.mark.parametrize(
    ("how", "said"),
    [
        ({"reward": "dense"}, "reward is 'dense', expected 'sparse' or"),
        ({"fastest": 0.0}, "fastest is 0.0"),
        ({"render_mode": "ansi"}, "render_mode is 'ansi'"),
    ],
)
def test_arguments_that_do_not_fit_are_told(how, said):
    with pytest.raises(InputError, match=said):
        StrikeEnv(**how)


def test_actions_that_do_not_fit_are_told(env):
    env.reset(seed=0)
    with pytest.raises(InputError, match=r"shape \(7,\).*\(8,\)"):
        env.step(np.zeros(7))
    with pytest.raises(InputError, match=r"action\[2\] is nan"):
        env.step(np.where(np.arange(8) == 2, np.nan, 0.0))
