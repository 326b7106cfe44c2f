"""Trials of the self-calibration in a world of geometry, in no time.

The movement is the task parameter itself: a stroke lands where it is aimed. As
on the robot, the true mirror is in the spec alone.
"""

import functools

import numpy as np

from drake_affetto.calibration.knowledge import RobotKnowledge
from drake_affetto.experiments.mirror_setup import MirrorSetup, pose_matrix
from drake_affetto.geometry.planes import normals
from drake_affetto.scene.world import FramePose
from support import mirror_robot

SCENARIO, DIRECT = "mirror", "drumming"
REACH = 0.05


@functools.cache
def setup() -> MirrorSetup:
    return MirrorSetup.of(SCENARIO, DIRECT)


@functools.cache
def truth() -> RobotKnowledge:
    return setup().true_knowledge()


def plane_of(pose: dict) -> np.ndarray:
    """The plane (3,) of a spec's mirror, told from the robot's eye."""
    eye = truth().eye_position
    X_WM = pose_matrix(FramePose(**pose))
    n = X_WM[:3, 2]
    plane = np.array([np.arctan2(n[1], n[0]), np.arcsin(n[2]), 0.0])
    plane[2] = (eye - X_WM[:3, 3]) @ normals(plane)
    return plane


class FakeMirrors:
    """Runs specs; notes them.

    Attributes:
        specs: Specs that were run.
        always: Mirror that all trials have, whatever their spec says; None
            for that of the spec.
        blind: Whether the hand never shows.
    """

    def __init__(self, always: dict | None = None, blind: bool = False):
        self.specs: list[dict] = []
        self.always, self.blind = always, blind

    def __call__(self, spec):
        self.specs.append(spec)
        run = getattr(self, "_" + spec["kind"])
        return run(spec, np.random.default_rng(spec["seed"]))

    def _mirror(self, spec) -> np.ndarray:
        return plane_of(self.always or spec["mirror"])

    def _hand_look(self, spec, rng):
        true = truth()
        readings = np.array(spec["posture"]) + 1e-3 * rng.normal(size=8)
        look = mirror_robot.sees_hand(
            true, self._mirror(spec), readings, rng, 0.4
        )
        pixel = None if self.blind else look.pixel
        result = {
            "readings": readings.tolist(),
            "pixel": None if pixel is None else pixel.tolist(),
            "area": 100.0,
        }
        return result, {}

    def _seen(self, spec, rng) -> dict:
        true = truth()
        if "mirror" not in spec:
            tau = true.optical_map().source.direct_task_parameters(
                np.array([spec["xy"]]), true.source_calibration
            )[0]
            return {"found": True, "tau": tau.tolist()}
        tau = mirror_robot.tau_of(true, self._mirror(spec), spec["xy"])
        tau = tau + 1e-3 * rng.normal(size=2)
        return {"found": True, "tau": tau.tolist()}

    def _look(self, spec, rng):
        return self._seen(spec, rng) | {"duration": 1.0}, {}

    def _ellipse_look(self, spec, rng):
        true = truth()
        look = mirror_robot.sees_ellipse(
            true, self._mirror(spec), spec["xy"], rng, 0.03
        )
        return self._seen(spec, rng) | {"moments": look.moments.tolist()}, {}

    def _demonstration(self, spec, rng):
        true = truth()
        tau = true.optical_map().source.direct_task_parameters(
            np.array([spec["xy"]]), true.source_calibration
        )[0]
        result = {
            "xy": spec["xy"],
            **self._seen(spec, rng),
            "attempts": 1,
            "success": True,
            "reward": 0.5,
            "max_pull": 12.0,
        }
        arrays = {
            "theta": np.resize(tau, 4),
            "q": np.zeros((3, 2)),
            "prototype": np.full((4, 5), 0.5),
        }
        return result, arrays

    def _strike(self, spec, rng):
        from drake_affetto.experiments.view_maps import places_of

        aimed = places_of(setup().direct, spec["theta"][None, :2])[0]
        miss = float(np.linalg.norm(aimed - spec["xy"]))
        hit = miss < REACH
        result = {
            "reward": 0.7 if hit else 0.0,
            "success": hit,
            "max_force": 4.0,
            "impulse": 1.0,
            "landing": miss,
            "graze": False,
        }
        return result, {"reward_over_time": np.zeros(3, dtype=np.float32)}
