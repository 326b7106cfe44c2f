"""A camera in the test scene, and what geometry says it should see."""

import cv2
import numpy as np
from pydrake.geometry import (
    ClippingRange,
    ColorRenderCamera,
    DepthRange,
    DepthRenderCamera,
    RenderCameraCore,
)
from pydrake.math import RigidTransform
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.sensors import RgbdSensor

from drake_affetto.geometry import optics
from drake_affetto.perception.blob import BlobConfig, detect
from drake_affetto.perception.config import (
    CameraConfig,
    MirrorConfig,
)
from drake_affetto.perception.mirror_camera import MirrorCamera
from support import perception_scene as scene
from support.perception_scene import MARKER_COLOR


class World:
    """A camera in the test scene, with what the tests ask of it."""

    def __init__(self, n_mirrors=1, rgbd=False, **camera):
        builder = DiagramBuilder()
        self.plant, self.scene_graph = scene.add_scene(
            builder, n_mirrors=n_mirrors
        )
        camera.setdefault("fov_y", 1.3)
        self.camera = MirrorCamera.AddToBuilder(
            builder=builder,
            plant=self.plant,
            scene_graph=self.scene_graph,
            config=CameraConfig(frame="camera", **camera),
            mirrors=[
                MirrorConfig(f"mirror{i}::mirror", *scene.MIRROR_SIZE)
                for i in range(n_mirrors)
            ],
        )
        if rgbd:
            self.rgbd = self._add_rgbd(builder)
        self.diagram = builder.Build()
        self.root = self.diagram.CreateDefaultContext()
        self.context = self.camera.GetMyContextFromRoot(self.root)
        self.plant_context = self.plant.GetMyContextFromRoot(self.root)
        self.set(yaw=0.0, rod=2.5, drum=[0.3, 0.0])

    def _add_rgbd(self, builder):
        frame = self.plant.GetFrameByName("camera")
        core = RenderCameraCore(
            "direct",
            self.camera.camera_info,
            ClippingRange(0.05, 5.0),
            RigidTransform(),
        )
        rgbd = builder.AddSystem(
            RgbdSensor(
                self.plant.GetBodyFrameIdOrThrow(frame.body().index()),
                frame.GetFixedPoseInBodyFrame(),
                ColorRenderCamera(core, False),
                DepthRenderCamera(core, DepthRange(0.06, 4.0)),
            )
        )
        builder.Connect(
            self.scene_graph.get_query_output_port(),
            rgbd.query_object_input_port(),
        )
        return rgbd

    def set(self, *, yaw=None, rod=None, drum=None):
        if yaw is not None:
            self.plant.GetJointByName("yaw").set_angle(self.plant_context, yaw)
        if rod is not None:
            joint = self.plant.GetJointByName("rod_yaw")
            joint.set_angle(self.plant_context, rod)
        if drum is not None:
            self.plant.GetFrameByName("drum_placement").SetPoseInParentFrame(
                self.plant_context, RigidTransform([*drum, 0.0])
            )

    def image(self):
        port = self.camera.get_color_image_output_port()
        return port.Eval(self.context).data[:, :, :3].copy()

    def labels(self):
        port = self.camera.get_label_image_output_port()
        return port.Eval(self.context).data[:, :, 0].copy()

    def pose(self):
        return self.camera.camera_pose(self.context).GetAsMatrix4()

    def mirror(self, index=0):
        return self.camera.mirrors(self.context)[index][0].GetAsMatrix4()

    def marker(self, X_WM=None):
        """(centroid, area, outline) of the marker by geometry."""
        frame = self.plant.GetFrameByName("marker")
        X = frame.CalcPoseInWorld(self.plant_context)
        return optics.project_disc(
            self.camera.camera_model,
            self.pose(),
            X.translation(),
            X.rotation().matrix()[:, 2],
            scene.MARKER_RADIUS,
            X_WM,
        )

    def blob_near(self, image, outline):
        """The blob in the part of the image around an outline."""
        size = image.shape[1::-1]
        low, high = (outline.min(0) - 6) / size, (outline.max(0) + 7) / size
        region = np.clip([*low, *high], 0.0, 1.0)
        return detect(image, BlobConfig(MARKER_COLOR, region=region.tolist()))

    def mirrored_marker_is_whole(self, outline, X_WM, margin=2.0):
        view = optics.mirror_view(
            self.camera.camera_model, self.pose(), X_WM, *scene.MIRROR_SIZE
        )
        if view is None:
            return False
        polygon = view.polygon.astype(np.float32)
        return all(
            cv2.pointPolygonTest(polygon, (float(u), float(v)), True) > margin
            for u, v in outline
        )
