"""The drum's voice, and how a recording becomes a reward."""

from drake_affetto.sound.config import SoundConfig, load_sound_config
from drake_affetto.sound.reward import (
    RewardConfig,
    cut_prototype,
    reward,
    similarity,
    spectrogram,
    tap_prototypes,
)
from drake_affetto.sound.voice import DrumVoice, VoiceConfig, write_wav

__all__ = [
    "DrumVoice",
    "RewardConfig",
    "SoundConfig",
    "VoiceConfig",
    "cut_prototype",
    "load_sound_config",
    "reward",
    "similarity",
    "spectrogram",
    "tap_prototypes",
    "write_wav",
]
