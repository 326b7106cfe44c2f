"""The drumming scene, for all tests of this folder."""

from support.drumming_scene import built_scene, scene

__all__ = ["built_scene", "scene"]
