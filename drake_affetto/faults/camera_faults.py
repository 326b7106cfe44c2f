"""The systems between camera and blob: faults, and what an image is like."""

import dataclasses
from typing import Any

import numpy as np
from pydrake.common.value import Value
from pydrake.math import RigidTransform
from pydrake.multibody.tree import BodyIndex
from pydrake.systems.framework import (
    BasicVector,
    Context,
    DiagramBuilder,
    LeafSystem,
    OutputPort,
    State,
)
from pydrake.systems.sensors import ImageRgba8U

from drake_affetto.common.systems import input_port, output_port, weakly
from drake_affetto.common.typing import Array
from drake_affetto.faults.images import (
    STATISTICS,
    hide,
    image_statistics,
    outline_in_image,
    put_disc,
)
from drake_affetto.geometry.optics import Camera
from drake_affetto.perception.blob import BlobConfig
from drake_affetto.perception.mirror_camera import CameraSnapshot


@dataclasses.dataclass(frozen=True)
class _Kept:
    """The image at which a camera is frozen; None: it is not."""

    image: Any = None


class CameraFaults(LeafSystem):
    """The camera's image as it is handed on, and what it is like.

    .. pydrake_system::

        name: CameraFaults
        input_ports:
        - color_image
        - sight
        - body_poses
        - camera_faults
        output_ports:
        - faulty_image
        - statistics

    - color_image: ImageRgba8U of the camera.
    - sight: `CameraSnapshot` of the camera, for where it stands.
    - body_poses: the plant's port of that name: a fault knows what it hides.
    - camera_faults (5): see `schedule.CAMERA_SIZE`.
    - faulty_image: ImageRgba8U.
    - statistics (6): of that image, see `images.image_statistics`.

    A frozen camera repeats the last image that was taken as it froze: abstract
    state, set at the camera's rate while it is frozen. Otherwise nothing is
    rendered unless an output is evaluated.
    """

    def __init__(
        self,
        camera: Camera,
        blob: BlobConfig,
        marker_radius: float,
        marker: tuple[BodyIndex, RigidTransform],
        corners: Array,
        rate: float,
    ):
        """Declares ports and state.

        Args:
            camera: Geometry of the image.
            blob: How the drum's marker looks.
            marker_radius: Its radius, m.
            marker: Body that carries it, and its pose in that body.
            corners: Where a second marker may lie: corners of the drum's
                region (m, 2), m.
            rate: Images per second.
        """
        super().__init__()
        self._camera = camera
        self._blob = blob
        self._radius = float(marker_radius)
        self._body, self._X_BM = int(marker[0]), marker[1]
        self._corners = np.array(corners, dtype=float)
        self._image_port = self.DeclareAbstractInputPort(
            "color_image", Value(ImageRgba8U())
        )
        self._sight_port = self.DeclareAbstractInputPort(
            "sight", Value(CameraSnapshot(np.eye(4)))
        )
        self._poses_port = self.DeclareAbstractInputPort(
            "body_poses", Value([RigidTransform()])
        )
        self._faults_port = self.DeclareVectorInputPort("camera_faults", 5)
        self._frozen_index = self.DeclareAbstractState(Value[object](_Kept()))
        self.DeclarePeriodicUnrestrictedUpdateEvent(
            1.0 / rate, 0.0, self._freeze
        )
        inputs = {self.all_input_ports_ticket(), self.xa_ticket()}
        self.DeclareAbstractOutputPort(
            "faulty_image",
            Value(ImageRgba8U(camera.width, camera.height, 255)).Clone,
            weakly(self._calc_image),
            inputs,
        )
        self.DeclareVectorOutputPort(
            "statistics", STATISTICS, self._calc_statistics, inputs
        )

    @staticmethod
    def AddToBuilder(
        *,
        builder: DiagramBuilder,
        color_image: OutputPort,
        sight: OutputPort,
        body_poses: OutputPort,
        camera_faults: OutputPort,
        system: "CameraFaults",
        name: str = "camera_faults",
    ) -> "CameraFaults":
        """Adds the system, wired to the camera and its faults.

        Args:
            color_image: The camera's image.
            sight: The camera's snapshot of its geometry.
            body_poses: Poses of the plant's bodies.
            camera_faults: The fault source's output of that name.
            system: The system that is added.
        """
        builder.AddNamedSystem(name, system)
        for port, target in (
            (color_image, "color_image"),
            (sight, "sight"),
            (body_poses, "body_poses"),
            (camera_faults, "camera_faults"),
        ):
            builder.Connect(port, system.GetInputPort(target))
        return system

    get_color_image_input_port = input_port("The camera's image.")
    get_sight_input_port = input_port("Where the camera is.")
    get_body_poses_input_port = input_port("The plant's body poses.")
    get_camera_faults_input_port = input_port("What is wrong (5).")
    get_faulty_image_output_port = output_port("The image that is handed on.")
    get_statistics_output_port = output_port("What that image is like (6).")

    def _kept(self, state: Any) -> Any:
        return state.get_value().image

    def _freeze(self, context: Context, state: State) -> None:
        frozen = self.EvalVectorInput(
            context, self._faults_port.get_index()
        ).value()[0]
        kept = self._kept(context.get_abstract_state(self._frozen_index))
        if bool(frozen) == (kept is not None):
            return
        value = state.get_mutable_abstract_state(self._frozen_index)
        value.set_value(
            _Kept(np.array(self._look(context))) if frozen else _Kept()
        )

    def _look(self, context: Context) -> Any:
        """The image (h, w, 4), with what stands before the camera."""
        image: Any = self._image_port.Eval(context)
        faults: Any = self._faults_port.Eval(context)
        _, share, angle, radius, place = faults
        if share == 0.0 and radius == 0.0:
            return image.data
        sight: Any = self._sight_port.Eval(context)
        poses: Any = self._poses_port.Eval(context)
        marker = (poses[self._body] @ self._X_BM).translation()
        changed = np.array(image.data)
        if radius > 0.0:
            outline = outline_in_image(
                self._camera,
                sight.X_WC,
                self._second_place(marker, place),
                radius * self._radius,
            )
            if outline is not None:
                put_disc(changed, outline, self._blob.color)
        if share > 0.0:
            outline = outline_in_image(
                self._camera, sight.X_WC, marker, self._radius
            )
            if outline is not None:
                hide(changed, outline, share, angle)
        return changed

    def _second_place(self, marker: Array, place: float) -> Array:
        """Where the second marker lies (3,), m: in the region, off the drum."""
        middle = self._corners.mean(axis=0)
        spread = middle + 0.7 * (self._corners - middle)
        away = np.linalg.norm(spread - marker[:2], axis=1)
        far = spread[np.argsort(-away)[: max(1, len(spread) // 2)]]
        return np.append(far[int(place * len(far)) % len(far)], marker[2])

    def _calc_image(self, context: Any, output: Any) -> None:
        kept = self._kept(context.get_abstract_state(self._frozen_index))
        data = self._look(context) if kept is None else kept
        output.get_mutable_value().mutable_data[:] = data

    def _calc_statistics(self, context: Context, output: BasicVector) -> None:
        image: Any = self.get_faulty_image_output_port().Eval(context)
        output.SetFromVector(image_statistics(image.data, self._blob))
