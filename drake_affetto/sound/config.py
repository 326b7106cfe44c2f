"""All settings of the sound, as `models/sound.yaml` holds them."""

import dataclasses

from drake_affetto.common.errors import require_range
from drake_affetto.sound.reward import RewardConfig
from drake_affetto.sound.voice_config import VoiceConfig


@dataclasses.dataclass
class SoundConfig:
    """How the drum sounds and how its sound is judged.

    Attributes:
        voice: of drum, shell, table and valves.
        reward: Eqs. 9 and 10.
        hit_impulse: what a simulation calls a hit of the head, N s, to hold
            the reward against.
    """

    voice: VoiceConfig = dataclasses.field(default_factory=VoiceConfig)
    reward: RewardConfig = dataclasses.field(default_factory=RewardConfig)
    hit_impulse: float = 2e-3

    def check(self, where: str) -> None:
        """Raises InputError naming the field that does not fit."""
        self.voice.check(f"{where}.voice")
        self.reward.check(f"{where}.reward")
        require_range(f"{where}.hit_impulse", self.hit_impulse, 0.0, 10.0)


def load_sound_config(
    uri: str = "package://drake_affetto/sound.yaml",
) -> SoundConfig:
    """Reads and checks a sound file.

    Args:
        uri: The file, or its package:// URI.

    Raises:
        InputError: for a missing or malformed file, an unknown field or a
            value out of range.
    """
    # Drake's YAML reader, which the mathematics beside this do not need.
    from drake_affetto.common.yaml_config import load_config

    return load_config(SoundConfig, uri)
