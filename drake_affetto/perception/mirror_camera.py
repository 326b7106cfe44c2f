"""A camera that sees what is reflected in planar mirrors."""

import dataclasses
import math
from typing import Any

import cv2
import numpy as np
from pydrake.common.value import Value
from pydrake.geometry import (
    Box,
    ClippingRange,
    ColorRenderCamera,
    FrameId,
    LightParameter,
    MakeRenderEngineVtk,
    QueryObject,
    RenderCameraCore,
    RenderEngine,
    RenderEngineVtkParams,
    Rgba,
    Role,
    SceneGraph,
)
from pydrake.math import RigidTransform
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import Frame
from pydrake.systems.framework import (
    BasicVector,
    Context,
    DiagramBuilder,
    LeafSystem,
    ValueProducer,
)
from pydrake.systems.sensors import CameraInfo, ImageLabel16I, ImageRgba8U

from drake_affetto.common.errors import InputError
from drake_affetto.common.systems import input_port, output_port, weakly
from drake_affetto.geometry.optics import (
    FisheyeCamera,
    MirrorView,
    PinholeCamera,
    mirror_view,
    reflect_camera,
)
from drake_affetto.perception.camera_model import Mirror
from drake_affetto.perception.config import (
    CameraConfig,
    MirrorConfig,
    RenderConfig,
)
from drake_affetto.perception.imaging import (
    ImageEffects,
    NoiseBank,
    apply_effects,
    composite_mirror,
)
from drake_affetto.scene.parts import find_frame

DIRECT = "direct"
MIRROR = "mirror"


def add_renderers(scene_graph: SceneGraph, config: RenderConfig) -> None:
    """Adds the renderers `direct` and `mirror` to a SceneGraph.

    What must not be seen in the mirror pass (the panels, and things behind
    them) carries `<drake:accepting_renderer>direct
    </drake:accepting_renderer>` in its SDF.
    """
    for name in (DIRECT, MIRROR):
        if not scene_graph.HasRenderer(name):
            scene_graph.AddRenderer(name, make_renderer(config))


def make_renderer(config: RenderConfig) -> RenderEngine:
    """A renderer whose lights stand still in the world.

    A lamp on the camera would light the direct and the mirrored view
    differently.
    """
    params = RenderEngineVtkParams()
    params.default_clear_color = np.asarray(config.background, dtype=float)
    params.cast_shadows = config.cast_shadows
    params.lights = [
        LightParameter(
            type=light.type,
            frame="world",
            position=np.asarray(light.position, dtype=float),
            direction=np.asarray(light.direction, dtype=float),
            color=Rgba(light.color[0], light.color[1], light.color[2], 1.0),
            intensity=light.intensity,
            cone_angle=light.cone_angle,
        )
        for light in config.lights
    ]
    return MakeRenderEngineVtk(params)


@dataclasses.dataclass(frozen=True)
class CameraSnapshot:
    """What an image depends on, beside the scene.

    Attributes:
        X_WC: pose (4, 4) of the camera.
        camera_id: number of the geometry frame of the body that carries it.
        mirrors: the mirrors, where they are.
        effects: the sensor's disturbances.
        seed: of the sensor's noise.
    """

    X_WC: np.ndarray
    camera_id: int = -1
    mirrors: tuple[Mirror, ...] = ()
    effects: ImageEffects = dataclasses.field(default_factory=ImageEffects)
    seed: int = 0


class MirrorCamera(LeafSystem):
    """A color and label camera that sees reflections in planar mirrors.

    .. pydrake_system::

        name: MirrorCamera
        input_ports:
        - query_object
        output_ports:
        - color_image
        - label_image
        - body_pose_in_world
        - sight

    - query_object: the SceneGraph's query port.
    - color_image: ImageRgba8U. Calculated from the context whenever it is
      evaluated, as RgbdSensor does; nothing is rendered before.
    - label_image: ImageLabel16I of the true view: a mirror is its panel.
    - body_pose_in_world: RigidTransform X_WC.
    - sight: `CameraSnapshot`, where camera and mirrors are and what disturbs
      the image; for `AnalyticBlobSensor`. Evaluating it renders nothing.

    The engine has no reflections of the scene. A planar mirror is exact with
    a second, virtual camera: the true camera, reflected in the mirror's
    plane, rendered by the renderer `mirror` (which shows no panels), flipped
    left to right and pasted where the true view's label image shows the
    panel, so that what stands before the mirror hides it, and what hides
    something in the mirror's view hides it there. Only the rectangle of
    pixels that holds the mirror is rendered in the extra passes, and none is
    where geometry says that no mirror is in view. A mirror does not show
    other mirrors.

    The poses of camera and mirrors in their bodies are abstract parameters
    (`set_camera_pose_in_body`, `set_mirror_pose_in_body`); where the bodies
    are is asked of the query object at evaluation. The sensor's disturbances
    (`ImageEffects`) and the seed of its noise are numeric parameters.
    Noise depends on seed and time alone.
    """

    def __init__(
        self,
        plant: MultibodyPlant,
        config: CameraConfig,
        mirrors: list[MirrorConfig] | None = None,
    ) -> None:
        """Reads from the plant where camera and mirrors are fixed.

        Args:
            plant: a finalized plant, registered with a SceneGraph.
            config: the camera.
            mirrors: the mirrors that the camera can see.

        Raises:
            InputError: if a frame is not in the plant or a value not in
                range.
        """
        super().__init__()
        config.check("camera")
        mirrors = list(mirrors or [])
        for index, mirror in enumerate(mirrors):
            mirror.check(f"mirrors[{index}]")
        self._config = config
        self._mirrors = mirrors
        self._model = config.model()
        self._pinhole = self._model.pinhole()
        self._remap: tuple[np.ndarray, np.ndarray] | None = None
        if isinstance(self._model, FisheyeCamera):
            self._remap = self._model.remap_grid()
        self._noise_bank = NoiseBank()

        camera_frame = find_frame(plant, config.frame, "camera.frame")
        self._camera_id = _frame_id(plant, camera_frame)
        X_BC = camera_frame.GetFixedPoseInBodyFrame() @ RigidTransform(
            config.X_FC()
        )
        self.DeclareAbstractParameter(Value(X_BC))
        self._mirror_ids: list[FrameId] = []
        for index, mirror in enumerate(mirrors):
            field = f"mirrors[{index}].frame"
            frame = find_frame(plant, mirror.frame, field)
            self._mirror_ids.append(_frame_id(plant, frame))
            self.DeclareAbstractParameter(
                Value(frame.GetFixedPoseInBodyFrame())
            )
        effects = self.DeclareNumericParameter(
            BasicVector(config.effects.to_vector())
        )
        seed = self.DeclareNumericParameter(BasicVector(np.zeros(1)))
        self._effects_index, self._seed_index = int(effects), int(seed)

        self._query_port = self.DeclareAbstractInputPort(
            "query_object", Value(QueryObject())
        )
        scene = {
            self.input_port_ticket(self._query_port.get_index()),
            self.all_parameters_ticket(),
        }
        shape = (self._pinhole.height, self._pinhole.width, 3)
        view = self.DeclareCacheEntry(
            description="view",
            value_producer=ValueProducer(
                allocate=Value(np.zeros(shape, dtype=np.uint8)).Clone,
                calc=weakly(self._calc_view),
            ),
            prerequisites_of_calc=scene,
        )
        self._view_index = view.cache_index()
        width, height = config.width, config.height
        self.DeclareAbstractOutputPort(
            "color_image",
            Value(ImageRgba8U(width, height, 255)).Clone,
            weakly(self._calc_color_image),
            scene | {self.time_ticket()},
        )
        self.DeclareAbstractOutputPort(
            "label_image",
            Value(ImageLabel16I(width, height)).Clone,
            weakly(self._calc_label_image),
            scene,
        )
        self.DeclareAbstractOutputPort(
            "body_pose_in_world",
            Value(RigidTransform()).Clone,
            weakly(self._calc_pose),
            scene,
        )
        self.DeclareAbstractOutputPort(
            "sight",
            Value(CameraSnapshot(np.eye(4))).Clone,
            weakly(self._calc_sight),
            scene,
        )

    @staticmethod
    def AddToBuilder(
        *,
        builder: DiagramBuilder,
        plant: MultibodyPlant,
        scene_graph: SceneGraph,
        config: CameraConfig,
        mirrors: list[MirrorConfig] | None = None,
        render_config: RenderConfig | None = None,
        name: str = "camera",
    ) -> "MirrorCamera":
        """Adds a camera, and the renderers it needs, wired to the scene.

        Args:
            mirrors: Mirrors of the scene; none by default.
            render_config: Settings of the renderers.
        """
        add_renderers(scene_graph, render_config or RenderConfig())
        camera = MirrorCamera(plant, config, mirrors)
        builder.AddNamedSystem(name, camera)
        builder.Connect(
            scene_graph.get_query_output_port(),
            camera.get_query_object_input_port(),
        )
        return camera

    # Ports

    get_query_object_input_port = input_port("The SceneGraph's query port.")
    get_color_image_output_port = output_port(
        "What the camera sees (ImageRgba8U)."
    )
    get_label_image_output_port = output_port(
        "Labels of what it sees (ImageLabel16I)."
    )
    get_body_pose_in_world_output_port = output_port("X_WC (RigidTransform).")
    get_sight_output_port = output_port(
        "Poses and parameters (`CameraSnapshot`)."
    )

    # What a user may ask or set

    @property
    def config(self) -> CameraConfig:
        """The settings given at construction."""
        return self._config

    @property
    def camera_model(self) -> PinholeCamera | FisheyeCamera:
        """The geometry of the image that the ports give."""
        return self._model

    @property
    def camera_info(self) -> CameraInfo:
        """Drake's description of the camera (of its pinhole, if fisheye)."""
        return _camera_info(self._pinhole)

    def camera_pose(self, context: Context) -> RigidTransform:
        """X_WC in this system's context."""
        return RigidTransform(self._X_WC(context, self._query(context)))

    def mirrors(
        self, context: Context
    ) -> list[tuple[RigidTransform, float, float]]:
        """(X_WM, width, height) of each mirror; M's +z is the normal."""
        query = self._query(context)
        return [
            (
                RigidTransform(self._X_WM(context, query, index)),
                *self._size(context, query, index),
            )
            for index in range(len(self._mirrors))
        ]

    def set_effects(self, context: Context, effects: ImageEffects) -> None:
        """Sets exposure, white balance, noise and motion blur.

        Args:
            effects: What bends the image.
        """
        context.get_mutable_numeric_parameter(
            self._effects_index
        ).SetFromVector(effects.to_vector())

    def effects(self, context: Context) -> ImageEffects:
        """The disturbances in this context."""
        return ImageEffects.from_vector(
            context.get_numeric_parameter(self._effects_index).CopyToVector()
        )

    def seed(self, context: Context) -> int:
        """The seed of the sensor noise in this context."""
        return int(context.get_numeric_parameter(self._seed_index)[0])

    def set_seed(self, context: Context, seed: int) -> None:
        """Sets the seed of the sensor noise (an integer from 0 on)."""
        context.get_mutable_numeric_parameter(self._seed_index).SetFromVector(
            np.array([float(seed)])
        )

    def set_camera_pose_in_body(
        self, context: Context, X_BC: RigidTransform
    ) -> None:
        """Moves the camera on the body that carries it.

        Args:
            X_BC: Pose of the camera in the body's frame.
        """
        context.get_mutable_abstract_parameter(0).set_value(X_BC)

    def set_mirror_pose_in_body(
        self, context: Context, index: int, X_BM: RigidTransform
    ) -> None:
        """Moves a mirror's face on its body.

        Args:
            index: Number of the mirror.
            X_BM: Pose of its face in the body's frame.
        """
        context.get_mutable_abstract_parameter(1 + index).set_value(X_BM)

    # Calculations

    def _query(self, context: Context) -> QueryObject:
        query: Any = self._query_port.Eval(context)
        return query

    def _X_WC(self, context: Context, query: QueryObject) -> np.ndarray:
        X_WB = query.GetPoseInWorld(self._camera_id)
        parameter: Any = context.get_abstract_parameter(0)
        X_BC: RigidTransform = parameter.get_value()
        return (X_WB @ X_BC).GetAsMatrix4()

    def _X_WM(
        self, context: Context, query: QueryObject, index: int
    ) -> np.ndarray:
        X_WB = query.GetPoseInWorld(self._mirror_ids[index])
        parameter: Any = context.get_abstract_parameter(1 + index)
        X_BM: RigidTransform = parameter.get_value()
        return (X_WB @ X_BM).GetAsMatrix4()

    def _size(
        self, context: Context, query: Any, index: int
    ) -> tuple[float, float]:
        """Width and height [m] of a mirror's face."""
        config = self._mirrors[index]
        if config.width is not None and config.height is not None:
            return config.width, config.height
        parameter: Any = context.get_abstract_parameter(1 + index)
        size = _box_extents(
            query, self._mirror_ids[index], parameter.get_value()
        )
        if size is None:
            raise InputError(
                f"mirrors[{index}].width is not given, and the body of "
                f"{config.frame!r} has no visual box, or several"
            )
        return config.width or size[0], config.height or size[1]

    def _render(
        self,
        query: Any,
        renderer: str,
        camera: PinholeCamera,
        X_WC: np.ndarray,
        near: float | None = None,
        labels: bool = False,
    ) -> np.ndarray:
        """One pass: RGBA (h, w, 4) of uint8, or labels (h, w) of int16."""
        core = RenderCameraCore(
            renderer,
            _camera_info(camera),
            ClippingRange(near or self._config.near, self._config.far),
            RigidTransform(),
        )
        world = query.inspector().world_frame_id()
        pass_camera = ColorRenderCamera(core, False)
        X = RigidTransform(X_WC)
        if labels:
            return query.RenderLabelImage(pass_camera, world, X).data[:, :, 0]
        return query.RenderColorImage(pass_camera, world, X).data

    def _calc_view(self, context: Any, cache: Any) -> None:
        """The ideal pinhole image with its reflections, (h, w, 3)."""
        query = self._query(context)
        X_WC = self._X_WC(context, query)
        rendered = self._render(query, DIRECT, self._pinhole, X_WC)
        # Drops alpha; the copy is ours to draw the reflections into.
        image = cv2.cvtColor(rendered, cv2.COLOR_RGBA2RGB)
        for index, mirror in enumerate(self._mirrors):
            X_WM = self._X_WM(context, query, index)
            view = mirror_view(
                self._pinhole,
                X_WC,
                X_WM,
                *self._size(context, query, index),
                self._config.near,
                margin=math.ceil(3 * mirror.blur),
            )
            if view is not None:
                # The engine wants the principal point within its image.
                view = view.grown_to_hold(
                    self._pinhole.center_x, self._pinhole.center_y
                )
                self._draw_mirror(query, index, view, X_WC, X_WM, image)
        cache.set_value(image)

    def _draw_mirror(
        self,
        query: Any,
        index: int,
        view: MirrorView,
        X_WC: np.ndarray,
        X_WM: np.ndarray,
        image: np.ndarray,
    ) -> None:
        crop = self._pinhole.crop(view.left, view.top, view.width, view.height)
        labels = self._render(query, DIRECT, crop, X_WC, labels=True)
        mask = np.zeros(labels.shape, dtype=np.uint8)
        outline = (view.polygon - [view.left, view.top]) * 16
        cv2.fillConvexPoly(
            mask, np.rint(outline).astype(np.int32), 255, shift=4
        )
        mask[~np.isin(labels, _labels(query, self._mirror_ids[index]))] = 0
        if not mask.any():
            return  # Something hides the whole mirror.
        # What is nearer than the face is behind the mirror.
        near = max(self._config.near, view.depth)
        virtual = self._render(
            query, MIRROR, crop.flipped(), reflect_camera(X_WC, X_WM), near
        )
        reflection = cv2.cvtColor(cv2.flip(virtual, 1), cv2.COLOR_RGBA2RGB)
        part = image[
            view.top : view.top + view.height,
            view.left : view.left + view.width,
        ]
        mirror = self._mirrors[index]
        composite_mirror(part, reflection, mask, mirror.tint, mirror.blur)

    def _calc_color_image(self, context: Any, output: Any) -> None:
        image: Any = self.get_cache_entry(self._view_index).Eval(context)
        if self._remap is not None:
            image = cv2.remap(
                image,
                *self._remap,
                cv2.INTER_LINEAR,
                borderMode=cv2.BORDER_REPLICATE,
            )
        image = apply_effects(
            image,
            self.effects(context),
            self._noise_bank,
            self.seed(context),
            context.get_time(),
        )
        data = output.get_mutable_value().mutable_data
        data[:, :, :3] = image
        data[:, :, 3] = 255

    def _calc_label_image(self, context: Any, output: Any) -> None:
        query = self._query(context)
        X_WC = self._X_WC(context, query)
        labels = self._render(query, DIRECT, self._pinhole, X_WC, labels=True)
        if self._remap is not None:
            labels = cv2.remap(
                labels,
                *self._remap,
                cv2.INTER_NEAREST,
                borderMode=cv2.BORDER_REPLICATE,
            )
        output.get_mutable_value().mutable_data[:, :, 0] = labels

    def _calc_pose(self, context: Any, output: Any) -> None:
        output.set_value(self.camera_pose(context))

    def _calc_sight(self, context: Any, output: Any) -> None:
        query = self._query(context)
        output.set_value(
            CameraSnapshot(
                self._X_WC(context, query),
                self._camera_id.get_value(),
                tuple(
                    Mirror(
                        self._X_WM(context, query, index),
                        *self._size(context, query, index),
                    )
                    for index in range(len(self._mirrors))
                ),
                self.effects(context),
                self.seed(context),
            )
        )


def _frame_id(plant: MultibodyPlant, frame: Frame) -> FrameId:
    frame_id = plant.GetBodyFrameIdIfExists(frame.body().index())
    if frame_id is None:
        raise InputError(
            "the plant is not registered with a SceneGraph, so that "
            f"{frame.name()!r} cannot be seen"
        )
    return frame_id


def _box_extents(
    query: Any, frame_id: FrameId, X_BM: RigidTransform
) -> tuple[float, float] | None:
    """Extents along Mx and My of the one visual box of a body."""
    inspector = query.inspector()
    boxes = [
        geometry
        for geometry in inspector.GetGeometries(frame_id, Role.kPerception)
        if isinstance(inspector.GetShape(geometry), Box)
    ]
    if len(boxes) != 1:
        return None
    X_MG = X_BM.inverse() @ inspector.GetPoseInFrame(boxes[0])
    extents = (
        np.abs(X_MG.rotation().matrix()) @ inspector.GetShape(boxes[0]).size()
    )
    return float(extents[0]), float(extents[1])


def _labels(query: Any, frame_id: FrameId) -> list[int]:
    """The labels that the visible geometry of a body carries."""
    inspector = query.inspector()
    labels = set()
    for geometry in inspector.GetGeometries(frame_id, Role.kPerception):
        properties = inspector.GetPerceptionProperties(geometry)
        labels.add(int(properties.GetProperty("label", "id")))
    return sorted(labels)


def _camera_info(camera: PinholeCamera) -> CameraInfo:
    return CameraInfo(**dataclasses.asdict(camera))
