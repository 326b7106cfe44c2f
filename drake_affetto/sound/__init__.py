"""The drum's sound by modal synthesis, and the reward of a recording."""

from typing import TYPE_CHECKING

from drake_affetto.common.lazy import attach

if TYPE_CHECKING:
    from drake_affetto.sound.config import SoundConfig, load_sound_config
    from drake_affetto.sound.microphone import DrumMicrophone
    from drake_affetto.sound.reward import (
        RewardConfig,
        cut_prototype,
        reward_over_time,
        similarity,
        spectrogram,
        tap_prototypes,
    )
    from drake_affetto.sound.voice import DrumVoice, microphone_noise
    from drake_affetto.sound.voice_config import VoiceConfig
    from drake_affetto.sound.wav import write_wav

__getattr__, __dir__, __all__ = attach(
    __name__,
    {
        "DrumMicrophone": "microphone",
        "DrumVoice": "voice",
        "RewardConfig": "reward",
        "SoundConfig": "config",
        "VoiceConfig": "voice_config",
        "cut_prototype": "reward",
        "load_sound_config": "config",
        "microphone_noise": "voice",
        "reward_over_time": "reward",
        "similarity": "reward",
        "spectrogram": "reward",
        "tap_prototypes": "reward",
        "write_wav": "wav",
    },
)
