"""Mirrors as somebody sets them up, and robots that know themselves badly.

The true mirror of a repeat stands here and in the trials' specs. The robot's
side, `drake_affetto.calibration`, has no place to put it.
"""

import dataclasses
import functools

import numpy as np

from drake_affetto.calibration.knowledge import RobotKnowledge
from drake_affetto.calibration.plane import PlaneEstimate
from drake_affetto.common.errors import InputError
from drake_affetto.common.typing import Array
from drake_affetto.experiments.plans import SelfCalibrationPlan
from drake_affetto.experiments.view_maps import ViewDomain
from drake_affetto.geometry.planes import normals, plane_parameters
from drake_affetto.perception.camera_model import Mirror
from drake_affetto.scene import world
from drake_affetto.scene.world import FramePose
from drake_affetto.station.content import Content, scenario_content

# So many mirrors are set up before it is given up.
_TRIES = 500


def _view(scenario: str) -> ViewDomain:
    """The view of a scenario as its files are now."""
    return _view_of(scenario, scenario_content(scenario))


# Each keeps a station: of the direct view and the one before the mirror.
@functools.lru_cache(maxsize=2)
def _view_of(scenario: str, _: Content) -> ViewDomain:
    return ViewDomain.of(scenario)


def true_knowledge(scenario: str, direct: str) -> RobotKnowledge:
    """The robot's model of itself without any error.

    Args:
        scenario: Scenario of the view with the mirror.
        direct: Scenario of the direct view.

    Raises:
        InputError: If a scenario does not look from a fixed yaw, or not
            directly.
    """
    mirrored, source = _view(scenario), _view(direct)
    if mirrored.sight.fixed_yaw is None or not mirrored.sight.mirrors:
        raise InputError(
            f"{scenario} has no mirror into which it looks from a fixed yaw: "
            "there is nothing to calibrate"
        )
    if source.sight.fixed_yaw is not None:
        raise InputError(f"{direct} does not look at the drum directly")
    station = mirrored.station
    names = tuple(station.joints.names)
    posture = station.start_posture.copy()
    posture[names.index(station.scenario.yaw_joint)] = mirrored.sight.fixed_yaw
    camera = station.scenario.camera.frame.rpartition("::")[2]
    X_FC = station.scenario.camera.X_FC()

    def eye_chain(view: ViewDomain):
        chain = world.serial_chain(view.station.plant, camera)
        return dataclasses.replace(chain, X_JT=chain.X_JT @ X_FC)

    return RobotKnowledge(
        joints=names,
        camera=mirrored.sight.model.camera.pinhole(),
        eye_chain=eye_chain(mirrored),
        hand_chain=world.serial_chain(station.plant, "hand_marker"),
        yaw_joint=station.scenario.yaw_joint,
        posture=posture,
        calibration=mirrored.calibration,
        source_chain=eye_chain(source),
        source_posture=source.station.start_posture.copy(),
        source_calibration=source.calibration,
        marker_height=mirrored.sight.model.marker_height,
        marker_radius=mirrored.sight.model.marker_radius,
        zeros=np.zeros(len(names)),
    )


def pose_matrix(pose: FramePose) -> Array:
    """X_WM (4, 4) of a mirror at this pose."""
    return pose.transform().GetAsMatrix4()


def nominal_pose(scenario: str) -> FramePose:
    """Where the scenario itself has the mirror."""
    station = _view(scenario).station
    context = station.plant.GetMyContextFromRoot(_view(scenario).context)
    return world.get_mirror_pose(station.plant, context)


def seen_share(scenario: str, pose: FramePose) -> float:
    """Share of the drum's region that shows wholly in a mirror there."""
    sight = _view(scenario).sight
    known = sight.mirrors[0]
    mirror = Mirror(pose_matrix(pose), known.width, known.height)
    uv = sight.model.fixed_yaw_pixels(
        sight.positions, float(sight.fixed_yaw or 0.0), [mirror]
    )
    return float(np.isfinite(uv[:, 0]).mean())


def draw_mirror(
    plan: SelfCalibrationPlan, rng: np.random.Generator
) -> FramePose:
    """A mirror that somebody sets up so that the drum's region shows in it.

    Raises:
        InputError: If hardly any mirror of the plan shows it.
    """
    nominal = nominal_pose(plan.scenario)
    for _ in range(_TRIES):
        turn = plan.rotation * rng.uniform(-1.0, 1.0, 2)
        shift = plan.translation * rng.uniform(-1.0, 1.0, 3)
        pose = FramePose(
            (np.array(nominal.translation) + shift).tolist(),
            (np.array(nominal.rotation) + [turn[0], 0.0, turn[1]]).tolist(),
        )
        if seen_share(plan.scenario, pose) >= plan.least_seen:
            return pose
    raise InputError(
        f"of {_TRIES} mirrors turned by up to {plan.rotation:g} degrees none "
        f"shows {plan.least_seen:.0%} of the drum's region"
    )


def turned(
    plan: SelfCalibrationPlan, pose: FramePose, rng: np.random.Generator
) -> FramePose:
    """The mirror, turned about the vertical to the side that shows more."""
    sides = [
        FramePose(
            list(pose.translation),
            [*pose.rotation[:2], pose.rotation[2] + side * plan.turned_by],
        )
        for side in rng.permutation([-1.0, 1.0])
    ]
    return max(sides, key=lambda each: seen_share(plan.scenario, each))


@dataclasses.dataclass(frozen=True)
class PlaneJudgement:
    """How right a believed plane is.

    Attributes:
        angle: Of the believed from the true normal, rad.
        offset: How far the middle of the glass is off the believed plane, m.
        covered: Whether the stated region of 95 % holds the truth.
    """

    angle: float
    offset: float
    covered: bool


def judge_plane(estimate: PlaneEstimate, pose: FramePose) -> PlaneJudgement:
    """Holds a believed plane against the true mirror."""
    X_WM = pose_matrix(pose)
    n = normals(estimate.parameters)
    off = (X_WM[:3, 3] - estimate.reference) @ n + estimate.parameters[2]
    return PlaneJudgement(
        float(np.arccos(np.clip(n @ X_WM[:3, 2], -1.0, 1.0))),
        float(abs(off)),
        estimate.covers(plane_parameters(X_WM, estimate.reference)),
    )
