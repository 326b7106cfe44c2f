"""In the rendered images nothing hides the marker, over the workspace."""

import itertools

import cv2
import numpy as np
from pydrake.geometry import (
    ClippingRange,
    ColorRenderCamera,
    LightParameter,
    MakeRenderEngineVtk,
    RenderCameraCore,
    RenderEngineVtkParams,
)
from pydrake.math import RigidTransform
from pydrake.multibody.plant import AddMultibodyPlant, MultibodyPlantConfig
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.sensors import CameraInfo
import pytest

from drake_affetto.experiments.workspace import WorkspaceConfig
from drake_affetto.geometry.optics import (
    PinholeCamera,
    disc_outline,
    points_in_frame,
    polygon_area,
    reflect_points,
)
from drake_affetto.scene import world

CONFIG = WorkspaceConfig()
VIEW = PinholeCamera.from_fov(CONFIG.width, CONFIG.height, CONFIG.fov_y)
# Corners and middle of what the workspace leaves with a centimeter to spare.
PLACES = [*itertools.product([0.195, 0.333], [-0.195, 0.002]), (0.26, -0.1)]


def project(X_WC, p_W):
    return VIEW.project(points_in_frame(X_WC, p_W))


def disc(center, radius):
    return disc_outline(center, [0.0, 0.0, 1.0], radius)


class Camera:
    """Renders the eye camera's view, straight or by a virtual camera."""

    def __init__(self):
        builder = DiagramBuilder()
        self.plant, self.scene_graph = AddMultibodyPlant(
            MultibodyPlantConfig(time_step=0.001), builder
        )
        world.add_world(self.plant, world.WorldConfig())
        self.plant.Finalize()
        lamp = LightParameter(
            type="directional", frame="world", direction=[0, 0, -1]
        )
        for name in ("direct", "mirror"):
            self.scene_graph.AddRenderer(
                name, MakeRenderEngineVtk(RenderEngineVtkParams(lights=[lamp]))
            )
        self.diagram = builder.Build()
        self.root = self.diagram.CreateDefaultContext()
        self.context = self.plant.GetMyMutableContextFromRoot(self.root)
        w, h, f = VIEW.width, VIEW.height, VIEW.focal_x
        self.core = CameraInfo(w, h, f, f, w / 2, h / 2)

    def _query(self):
        return self.scene_graph.get_query_output_port().Eval(
            self.scene_graph.GetMyContextFromRoot(self.root)
        )

    def _camera(self, renderer):
        depth = ClippingRange(0.03, 5.0)
        core = RenderCameraCore(renderer, self.core, depth, RigidTransform())
        return ColorRenderCamera(core)

    def marker_area(self, renderer, X_WC):
        """Pixels of the marker's color."""
        image = self._query().RenderColorImage(
            self._camera(renderer), self.scene_graph.world_frame_id(), X_WC
        )
        hue, saturation, value = cv2.split(
            cv2.cvtColor(image.data[..., :3].copy(), cv2.COLOR_RGB2HSV)
        )
        green = (np.abs(hue.astype(int) - 60) < 10) & (saturation > 150)
        return np.sum(green & (value > 30))

    def labels(self, X_WC):
        image = self._query().RenderLabelImage(
            self._camera("direct"), self.scene_graph.world_frame_id(), X_WC
        )
        return image.data[..., 0]

    def pose(self, frame):
        found = self.plant.GetFrameByName(frame).CalcPoseInWorld(self.context)
        return found.GetAsMatrix4()


@pytest.fixture(scope="module")
def camera():
    return Camera()


@pytest.fixture
def reset(camera):
    camera.diagram.SetDefaultContext(camera.root)


@pytest.mark.parametrize("xy", PLACES)
def test_the_marker_is_seen_whole_once_centered(camera, reset, xy):
    plant, context = camera.plant, camera.context
    world.set_drum_position(plant, context, xy)
    marker = world.marker_position(plant, context)
    rim = disc(marker, world.marker_radius(plant, context))
    for yaw in np.linspace(-0.5, 0.5, 401):
        world.set_posture(plant, context, {CONFIG.yaw_joint: yaw})
        X_WC = camera.pose("eye_camera")
        if project(X_WC, marker[None])[0, 0] >= VIEW.width / 2:
            break
    area = polygon_area(project(X_WC, rim))
    seen = camera.marker_area("direct", RigidTransform(X_WC))
    assert seen == pytest.approx(area, rel=0.03)
    mirror = plant.GetModelInstanceByName("mirror")
    labels = set(np.unique(camera.labels(RigidTransform(X_WC))))
    assert labels.isdisjoint(int(i) for i in plant.GetBodyIndices(mirror))


@pytest.mark.parametrize("xy", PLACES)
def test_enough_of_the_marker_is_seen_before_to_turn_to_it(camera, reset, xy):
    plant, context = camera.plant, camera.context
    world.set_drum_position(plant, context, xy)
    X_WC = camera.pose("eye_camera")
    marker = world.marker_position(plant, context)
    area = polygon_area(
        project(X_WC, disc(marker, world.marker_radius(plant, context)))
    )
    seen = camera.marker_area("direct", RigidTransform(X_WC))
    assert seen > 0.5 * area


@pytest.mark.parametrize("xy", PLACES)
def test_the_marker_is_seen_whole_in_the_mirror(camera, reset, xy):
    plant, context = camera.plant, camera.context
    world.set_drum_position(plant, context, xy)
    world.set_posture(plant, context, CONFIG.mirror_posture)
    X_WC, X_WM = camera.pose("eye_camera"), camera.pose("mirror")
    marker = world.marker_position(plant, context)
    rim = reflect_points(
        X_WM, disc(marker, world.marker_radius(plant, context))
    )
    area = polygon_area(project(X_WC, rim))
    # The virtual camera: its image is the mirror's, flipped left to right.
    origin = reflect_points(X_WM, X_WC[:3, 3])
    tips = reflect_points(X_WM, X_WC[:3, 3] + X_WC[:3, :3].T)
    axes = (tips - origin).T * [-1, 1, 1]
    X_WV = np.eye(4)
    X_WV[:3, :3], X_WV[:3, 3] = axes, origin
    seen = camera.marker_area("mirror", RigidTransform(X_WV))
    assert area >= 100
    # The rim's pixels blend with the skin.
    assert seen == pytest.approx(area, rel=0.12)


def test_the_mirror_fills_most_of_the_view(camera, reset):
    plant, context = camera.plant, camera.context
    world.set_posture(plant, context, CONFIG.mirror_posture)
    labels = camera.labels(RigidTransform(camera.pose("eye_camera")))
    panel = plant.GetBodyByName("panel").index()
    assert np.mean(labels == int(panel)) > 0.7
    drum = plant.GetModelInstanceByName("drum")
    seen = set(np.unique(labels))
    assert seen.isdisjoint(int(i) for i in plant.GetBodyIndices(drum))
