"""Mirrors as somebody sets them up, and robots that know themselves badly.

The true mirror of a repeat stands here and in the trials' specs. The robot's
side, `drake_affetto.calibration`, has no place to put it.
"""

import dataclasses

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

# So many mirrors are set up before it is given up.
_TRIES = 500


@dataclasses.dataclass(frozen=True)
class MirrorSetup:
    """Where one robot looks into a mirror, and what it is there.

    Attributes:
        mirrored: View with the mirror.
        direct: View in which the skill is learned.
    """

    mirrored: ViewDomain
    direct: ViewDomain

    @classmethod
    def of(cls, scenario: str, direct: str) -> "MirrorSetup":
        """Builds both views.

        Args:
            scenario: Scenario of the view with the mirror.
            direct: Scenario of the direct view.

        Raises:
            InputError: If a scenario does not look from a fixed yaw, or not
                directly.
        """
        setup = cls(ViewDomain.of(scenario), ViewDomain.of(direct))
        sight = setup.mirrored.sight
        if sight.fixed_yaw is None or not sight.mirrors:
            raise InputError(
                f"{scenario} has no mirror into which it looks from a fixed "
                "yaw: there is nothing to calibrate"
            )
        if setup.direct.sight.fixed_yaw is not None:
            raise InputError(f"{direct} does not look at the drum directly")
        return setup

    def true_knowledge(self) -> RobotKnowledge:
        """The robot's model of itself without any error."""
        mirrored, source = self.mirrored, self.direct
        station = mirrored.station
        names = tuple(station.joints.names)
        posture = station.start_posture.copy()
        yaw = names.index(station.scenario.yaw_joint)
        posture[yaw] = mirrored.sight.fixed_yaw
        camera = station.scenario.camera.frame.rpartition("::")[2]

        def eye_chain(view: ViewDomain):
            chain = world.serial_chain(view.station.plant, camera)
            X_FC = view.station.scenario.camera.X_FC()
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

    def nominal_pose(self) -> FramePose:
        """Where the scenario itself has the mirror."""
        station = self.mirrored.station
        context = station.plant.GetMyContextFromRoot(self.mirrored.context)
        return world.get_mirror_pose(station.plant, context)

    def seen_share(self, pose: FramePose) -> float:
        """Share of the drum's region that shows wholly in a mirror there."""
        sight = self.mirrored.sight
        known = sight.mirrors[0]
        mirror = Mirror(pose_matrix(pose), known.width, known.height)
        uv = sight.model.fixed_yaw_pixels(
            sight.positions, float(sight.fixed_yaw or 0.0), [mirror]
        )
        return float(np.isfinite(uv[:, 0]).mean())

    def draw_mirror(
        self, plan: SelfCalibrationPlan, rng: np.random.Generator
    ) -> FramePose:
        """A mirror that somebody sets up so that the region shows in it.

        Raises:
            InputError: If hardly any mirror of the plan shows it.
        """
        nominal = self.nominal_pose()
        for _ in range(_TRIES):
            turn = plan.rotation * rng.uniform(-1.0, 1.0, 2)
            shift = plan.translation * rng.uniform(-1.0, 1.0, 3)
            pose = FramePose(
                (np.array(nominal.translation) + shift).tolist(),
                (np.array(nominal.rotation) + [turn[0], 0.0, turn[1]]).tolist(),
            )
            if self.seen_share(pose) >= plan.least_seen:
                return pose
        raise InputError(
            f"of {_TRIES} mirrors turned by up to {plan.rotation:g} degrees "
            f"none shows {plan.least_seen:.0%} of the drum's region"
        )

    def turned(
        self,
        plan: SelfCalibrationPlan,
        pose: FramePose,
        rng: np.random.Generator,
    ) -> FramePose:
        """The mirror, turned about the vertical to the side that shows more."""
        sides = [
            FramePose(
                list(pose.translation),
                [*pose.rotation[:2], pose.rotation[2] + side * plan.turned_by],
            )
            for side in rng.permutation([-1.0, 1.0])
        ]
        return max(sides, key=self.seen_share)


def pose_matrix(pose: FramePose) -> Array:
    """X_WM (4, 4) of a mirror at this pose."""
    return pose.transform().GetAsMatrix4()


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
