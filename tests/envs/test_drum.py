"""One movement an episode, in the direct view and in the mirror."""

import importlib.util
import warnings

import gymnasium
from gymnasium.utils.env_checker import check_env
import numpy as np
import pytest

from drake_affetto.common.errors import InputError
from drake_affetto.envs.drum import DrumEnv
from drake_affetto.experiments import trials
from drake_affetto.sound.config import load_sound_config

NAMES = ["Affetto/Drum-v0", "Affetto/DrumMirror-v0"]
FEW = {"lessons": 4, "directions": 2}
HIT = load_sound_config().hit_impulse


@pytest.mark.parametrize("name", NAMES)
def test_gymnasium_has_nothing_to_say(name):
    assert name in gymnasium.registry
    env = gymnasium.make(name, **FEW).unwrapped
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        # `render` is tested here: it would open a browser's server.
        check_env(env, skip_render_check=True)


@pytest.mark.parametrize("name", [*NAMES, "Affetto/Strike-v0"])
def test_stable_baselines_has_nothing_to_say(name):
    if importlib.util.find_spec("stable_baselines3") is None:
        pytest.skip("stable-baselines3 is not installed: it needs torch")
    from stable_baselines3.common.env_checker import check_env

    more = {} if "Strike" in name else FEW
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        check_env(gymnasium.make(name, **more).unwrapped)


def episode(env, action, **how):
    observation, _ = env.reset(**how)
    return observation, *env.step(np.asarray(action, np.float32))


def test_seeds_reproduce_whatever_was_before():
    env, other = DrumEnv(**FEW), DrumEnv(**FEW)
    first = episode(env, [0.3, -0.2], seed=5)
    assert first[3:5] == (True, False)
    assert np.any(episode(env, [0.0, 0.0])[0] != first[0])
    for again in (
        episode(env, [0.3, -0.2], seed=5),
        episode(other, [0.3, -0.2], seed=5),
    ):
        np.testing.assert_array_equal(again[0], first[0])
        assert again[2] == first[2]
        assert again[5]["impulse"] == first[5]["impulse"]


def test_a_taught_movement_is_heard_and_no_movement_is_not():
    env = DrumEnv(**FEW)
    xy = [0.235, -0.09]
    taught = trials.runner("drumming").teach(np.array(xy), 1).theta
    for theta, success in ((taught, True), (0.0 * taught, False)):
        env.movements.mean = theta
        *_, reward, _, _, info = episode(
            env, [0.0, 0.0], seed=1, options={"xy": xy}
        )
        assert info["success"] == success
        assert (reward > 0.15) == success
        # By the contact, of which the reward knows nothing.
        assert (info["impulse"] > HIT) == success


def test_all_of_theta_is_an_option():
    env = DrumEnv(lessons=4, directions=None)
    assert env.action_space.shape == env.movements.mean.shape == (120,)


def test_render_shows_the_hand_at_the_drum():
    env = DrumEnv(**FEW, render_mode="rgb_array")
    env.reset(seed=1, options={"xy": [0.235, -0.09]})
    before = env.render()
    assert before.shape == (360, 480, 3)
    assert before.dtype == np.uint8
    env.step(np.zeros(2, np.float32))
    after = env.render()
    moved = np.abs(after.astype(int) - before).max(axis=2) > 30
    # The arm and the leaning body, not the room.
    assert 0.01 < moved.mean() < 0.3
    assert DrumEnv(**FEW).render() is None


@pytest.mark.parametrize(
    ("how", "said"),
    [
        ({"scenario": "druming"}, "no scenario 'druming'"),
        ({"render_mode": "ansi"}, "render_mode is 'ansi'"),
        ({"lessons": 4, "directions": 4}, "directions is 4"),
    ],
)
def test_arguments_that_do_not_fit_are_told(how, said):
    with pytest.raises(InputError, match=said):
        DrumEnv(**how)


def test_actions_and_options_that_do_not_fit_are_told():
    env = DrumEnv(**FEW)
    with pytest.raises(InputError, match=r"call reset\(\)"):
        env.step(np.zeros(2))
    env.reset(seed=0)
    with pytest.raises(InputError, match="shape"):
        env.step(np.zeros(3))
    with pytest.raises(InputError, match=r"action\[0\] is nan"):
        env.step(np.array([np.nan, 0.0]))
    with pytest.raises(InputError, match="options is"):
        env.reset(options={"place": 1})
    with pytest.raises(InputError, match="xy"):
        env.reset(options={"xy": [np.nan, 0.0]})
