"""Dynamic Movement Primitives."""

from typing import TYPE_CHECKING

from drake_affetto.common.lazy import attach

if TYPE_CHECKING:
    from drake_affetto.motion.dmp import Dmp, Rollout
    from drake_affetto.motion.dmp_config import DmpConfig
    from drake_affetto.motion.dmp_source import DmpSource

__getattr__, __dir__, __all__ = attach(
    __name__,
    {
        "Dmp": "dmp",
        "DmpConfig": "dmp_config",
        "DmpSource": "dmp_source",
        "Rollout": "dmp",
    },
)
