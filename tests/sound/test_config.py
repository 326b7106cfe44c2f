"""The file of the settings of voice and reward."""

import dataclasses

import pytest

from drake_affetto.common.errors import InputError
from drake_affetto.sound import config as sound_config
from drake_affetto.sound.reward import (
    RewardConfig,
)


def test_the_file_of_settings_holds_them_all():
    config = sound_config.load_sound_config()
    assert config == sound_config.SoundConfig()


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("reward: {bands: 0}", "reward.bands"),
        ("reward: {hop: 1.0}", "reward.hop"),
        ("reward: {high: 10.0}", "reward.high"),
        ("reward: {treshold: 0.2}", "treshold"),
        ("voice: {membrane: {radius: wide}}", "radius"),
        ("voice: {microphone_distance: -1.0}", "microphone_distance"),
        ("[1, 2]", "mapping"),
    ],
)
def test_settings_that_do_not_fit(tmp_path, text, message):
    path = tmp_path / "sound.yaml"
    path.write_text(text)
    with pytest.raises(InputError, match=message):
        sound_config.load_sound_config(str(path))


def test_a_part_of_the_settings_leaves_the_rest(tmp_path):
    path = tmp_path / "sound.yaml"
    path.write_text("voice: {membrane: {tension: 150.0}}")
    config = sound_config.load_sound_config(str(path))
    expected = sound_config.SoundConfig()
    expected.voice.membrane.tension = 150.0
    assert config == expected
    assert dataclasses.replace(config.reward) == RewardConfig()
