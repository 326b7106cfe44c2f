"""The system that finds the marker by geometry instead of by an image."""

import dataclasses
from typing import Any

import numpy as np
from pydrake.common.value import Value
from pydrake.geometry import FrameId, QueryObject, Role
from pydrake.multibody.plant import MultibodyPlant
from pydrake.systems.framework import (
    Context,
    DiagramBuilder,
    OutputPort,
)

from drake_affetto.common.errors import InputError, require
from drake_affetto.common.systems import connect, input_port
from drake_affetto.geometry.optics import project_disc
from drake_affetto.perception.analytic import (
    Occluders,
    completed,
    measured_blob,
    too_little_seen,
    visible_marker,
)
from drake_affetto.perception.blob import Blob, BlobConfig
from drake_affetto.perception.blob_sensor import BlobReporter
from drake_affetto.perception.config import CameraConfig
from drake_affetto.perception.mirror_camera import (
    CameraSnapshot,
    MirrorCamera,
)
from drake_affetto.scene.parts import find_frame


class AnalyticBlobSensor(BlobReporter):
    """A twin of `MirrorCamera` and `BlobSensor` that renders nothing.

    .. pydrake_system::

        name: AnalyticBlobSensor
        input_ports:
        - query_object
        - sight
        output_ports:
        - blob
        - blob_pixels

    - query_object: the SceneGraph's query port; where marker and robot are.
    - sight: `CameraSnapshot` of a `MirrorCamera`; its parameters (poses, noise,
      seed) hold here too.
    - blob (3), blob_pixels (4): as of `BlobSensor`.

    The marker's outline is projected, cut by mirror and image, and the robot's
    parts, as ellipsoids, take away what they hide; see `analytic` for the
    errors that are added. Exposure and color of the light do not matter to
    it; motion blur it cannot do, and says so.
    """

    def __init__(
        self,
        plant: MultibodyPlant,
        camera: CameraConfig,
        config: BlobConfig | None = None,
        *,
        radius: float,
        marker: str = "drum::marker",
        robot: str = "affetto",
    ) -> None:
        """Reads from the plant where the marker is.

        Args:
            plant: a finalized plant, registered with a SceneGraph.
            camera: the camera's settings.
            config: the blob sensor's settings.
            radius: the marker's radius [m].
            marker: the frame in the middle of the marker, z its normal.
            robot: the model whose parts may hide the marker.

        Raises:
            InputError: if a frame is not in the plant or a value not in
                range.
        """
        super().__init__(config)
        camera.check("camera")
        require(radius > 0.0, "radius", radius, "more than 0")
        self._camera = camera
        self._model = camera.model()
        self._radius = radius
        frame = find_frame(plant, marker, "marker")
        self._marker_id = _frame_id(plant, frame.body().index())
        self._X_BD = frame.GetFixedPoseInBodyFrame()
        self._robot_ids: list[FrameId] = []
        if plant.HasModelInstanceNamed(robot):
            instance = plant.GetModelInstanceByName(robot)
            self._robot_ids = [
                _frame_id(plant, index)
                for index in plant.GetBodyIndices(instance)
            ]
        self._query_port = self.DeclareAbstractInputPort(
            "query_object", Value(QueryObject())
        )
        self._sight_port = self.DeclareAbstractInputPort(
            "sight", Value(CameraSnapshot(np.eye(4)))
        )
        self._declare_outputs(
            {
                self.input_port_ticket(self._query_port.get_index()),
                self.input_port_ticket(self._sight_port.get_index()),
                self.time_ticket(),
            }
        )
        # Shapes of the robot in their bodies, read at the first evaluation:
        # they are the same in all contexts.
        self._shapes: _Shapes | None = None

    @staticmethod
    def AddToBuilder(
        *,
        builder: DiagramBuilder,
        plant: MultibodyPlant,
        query_object: OutputPort,
        camera: MirrorCamera,
        config: BlobConfig | None = None,
        radius: float,
        name: str = "blob_sensor",
    ) -> "AnalyticBlobSensor":
        """Adds a sensor in the place of a BlobSensor, under its name.

        Args:
            query_object: Output of the scene graph.
            camera: The camera whose place is taken.
            radius: Radius of the marker, m.
        """
        sensor = AnalyticBlobSensor(plant, camera.config, config, radius=radius)
        builder.AddNamedSystem(name, sensor)
        builder.Connect(query_object, sensor.get_query_object_input_port())
        connect(builder, camera, sensor, "sight")
        return sensor

    get_query_object_input_port = input_port("The SceneGraph's query port.")
    get_sight_input_port = input_port("`CameraSnapshot` of a `MirrorCamera`.")

    def _find(self, context: Context) -> Blob | None:
        query: Any = self._query_port.Eval(context)
        sight: Any = self._sight_port.Eval(context)
        if any(sight.effects.motion_blur):
            raise InputError(
                "camera.effects.motion_blur is "
                f"{sight.effects.motion_blur!r}, expected [0, 0] with the "
                "analytic camera, which cannot do it"
            )
        X_WD = query.GetPoseInWorld(self._marker_id) @ self._X_BD
        occluders = self._hiders(query, sight.camera_id)
        X_WD = X_WD.GetAsMatrix4()
        seen = [
            visible_marker(
                self._model,
                sight.X_WC,
                X_WD,
                self._radius,
                mirror,
                occluders,
                self._camera.near,
            )
            for mirror in (None, *sight.mirrors)
        ]
        index = max(range(len(seen)), key=lambda i: seen[i][0])
        area, centroid = seen[index]
        if not area > 0.0 or not self._in_region(centroid):
            return None
        if self._config.complete:
            whole, whole_area, _ = project_disc(
                self._model,
                sight.X_WC,
                X_WD[:3, 3],
                X_WD[:3, 2],
                self._radius,
                None if index == 0 else sight.mirrors[index - 1].X_WM,
            )
            if too_little_seen(area, whole_area):
                return None
            centroid = completed(area, centroid, whole_area, whole, sight.seed)
        image_area = self._model.width * self._model.height
        return measured_blob(
            area,
            centroid,
            self._config.min_area,
            self._config.max_area * image_area,
            sight.effects.noise,
            sight.seed,
            context.get_time(),
        )

    def _in_region(self, uv: np.ndarray) -> bool:
        size = np.array([self._model.width, self._model.height])
        part = (uv + 0.5) / size
        left, upper, right, lower = self._config.region
        return bool(left <= part[0] <= right and upper <= part[1] <= lower)

    def _hiders(self, query: Any, camera_id: int) -> Occluders | None:
        """The robot's visible parts, each as the ellipsoid in its box."""
        if self._shapes is None:
            self._shapes = self._read_shapes(query.inspector())
        shapes = self._shapes
        if len(shapes.radii) == 0:
            return None
        X_WF = np.array(
            [query.GetPoseInWorld(f).GetAsMatrix4() for f in self._robot_ids]
        )
        on_camera = np.array(
            [f.get_value() == camera_id for f in self._robot_ids]
        )
        return Occluders(
            X_WF[shapes.frame] @ shapes.X_FE,
            shapes.radii,
            on_camera[shapes.frame],
        )

    def _read_shapes(self, inspector: Any) -> "_Shapes":
        frame, X_FE, radii = [], [], []
        for index, frame_id in enumerate(self._robot_ids):
            for geometry in inspector.GetGeometries(frame_id, Role.kPerception):
                box = inspector.GetObbInGeometryFrame(geometry)
                if box is None:
                    continue
                X_FG = inspector.GetPoseInFrame(geometry)
                frame.append(index)
                X_FE.append((X_FG @ box.pose()).GetAsMatrix4())
                radii.append(np.maximum(box.half_width(), 1e-6))
        return _Shapes(
            np.array(frame, dtype=int),
            np.array(X_FE).reshape(-1, 4, 4),
            np.array(radii).reshape(-1, 3),
        )


@dataclasses.dataclass(frozen=True)
class _Shapes:
    """Ellipsoids in the frames of the robot's bodies.

    Attributes:
        frame: (k,) index of the body each is part of.
        X_FE: (k, 4, 4) poses.
        radii: (k, 3) half lengths [m].
    """

    frame: np.ndarray
    X_FE: np.ndarray
    radii: np.ndarray


def _frame_id(plant: MultibodyPlant, body_index: Any) -> FrameId:
    frame_id = plant.GetBodyFrameIdIfExists(body_index)
    if frame_id is None:
        raise InputError("the plant is not registered with a SceneGraph")
    return frame_id
