"""Gymnasium environments: learn to drum with any learner.

`import drake_affetto.envs` registers

    Affetto/Drum-v0        one movement an episode; the drum is seen directly
    Affetto/DrumMirror-v0  the same, seen in the mirror
    Affetto/Strike-v0      joint targets at 20 Hz

They need gymnasium: `pip install 'drake_affetto[gym]'`.
"""

from typing import TYPE_CHECKING

from drake_affetto.common.errors import InputError
from drake_affetto.common.lazy import attach

if TYPE_CHECKING:
    from drake_affetto.envs.drum import DrumEnv
    from drake_affetto.envs.lessons import Lessons, load_lessons
    from drake_affetto.envs.movements import MovementSpace
    from drake_affetto.envs.strike import StrikeEnv

__getattr__, __dir__, __all__ = attach(
    __name__,
    {
        "DrumEnv": "drum",
        "Lessons": "lessons",
        "MovementSpace": "movements",
        "StrikeEnv": "strike",
        "load_lessons": "lessons",
    },
)

try:
    from gymnasium import register
except ImportError as error:
    raise InputError(
        "gymnasium is not installed: pip install 'drake_affetto[gym]'"
    ) from error

register("Affetto/Drum-v0", "drake_affetto.envs.drum:DrumEnv")
register(
    "Affetto/DrumMirror-v0",
    "drake_affetto.envs.drum:DrumEnv",
    kwargs={"scenario": "mirror"},
)
register("Affetto/Strike-v0", "drake_affetto.envs.strike:StrikeEnv")
