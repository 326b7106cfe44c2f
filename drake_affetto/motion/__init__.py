"""Dynamic Movement Primitives."""

from drake_affetto.motion.dmp import Dmp, DmpConfig, Rollout

__all__ = ["Dmp", "DmpConfig", "Rollout"]
