"""Renders the picture in the README: Affetto at its drum, with the mirror.

python analysis/figures/picture.py [--out docs/affetto.png]
"""

import argparse
from pathlib import Path

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
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.multibody.plant import AddMultibodyPlant, MultibodyPlantConfig
from pydrake.systems.framework import Context, Diagram, DiagramBuilder
from pydrake.systems.sensors import CameraInfo

from drake_affetto.geometry.optics import reflect_camera
from drake_affetto.scene import world

# Rendered twice as large and scaled down: smooth edges.
_WIDTH, _HEIGHT, _FINER = 960, 640, 2
_FOV_Y = np.radians(34)
_EYE, _TARGET = [0.69, -0.96, 0.44], [0.225, 0.045, 0.160]
_POSTURE = {
    "waist_yaw": 0.05,
    "neck_yaw": -0.20,
    "neck_pitch": 0.30,
    "neck_roll": 0.10,
    "left_elbow_flexion": 0.5,
    "right_shoulder_abduction": 0.22,
    "right_shoulder_flexion": 0.50,
    "right_elbow_rotation": -0.20,
    "right_elbow_flexion": 1.95,
}
_DRUM = [0.245, -0.06]


def _directional(direction, intensity: float) -> LightParameter:
    return LightParameter(
        type="directional",
        frame="world",
        direction=direction,
        intensity=intensity,
    )


def _passes() -> list[RenderEngineVtkParams]:
    """A key light that throws shadows, and soft light that throws none.

    All of an engine's lights throw shadows, or none; so there are two images,
    whose light adds up.
    """
    key = LightParameter(
        type="spot",
        frame="world",
        position=[1.3, -1.1, 1.7],
        direction=[-1.10, 1.05, -1.60],
        cone_angle=38,
        intensity=0.70,
    )
    soft = [
        _directional([-0.6, 0.8, -0.25], 0.38),
        _directional([-0.9, 0.0, 0.0], 0.22),
        _directional([0.7, 0.7, -0.2], 0.16),
        _directional([0.1, -0.9, -0.5], 0.18),
        _directional([0.0, 0.0, -1.0], 0.12),
        _directional([-0.2, 0.2, 1.0], 0.16),
    ]
    background = [0.86, 0.88, 0.90]
    return [
        RenderEngineVtkParams(
            default_clear_color=background,
            cast_shadows=True,
            shadow_map_size=4096,
            lights=[key],
        ),
        RenderEngineVtkParams(default_clear_color=[0, 0, 0], lights=soft),
    ]


def _look_at(eye, target) -> RigidTransform:
    z = np.asarray(target, dtype=float) - eye
    z /= np.linalg.norm(z)
    x = np.cross(z, [0, 0, 1])
    x /= np.linalg.norm(x)
    R = RotationMatrix(np.stack([x, np.cross(z, x), z], axis=1))
    return RigidTransform(R, eye)


def _scene(params: RenderEngineVtkParams) -> tuple[Diagram, Context]:
    builder = DiagramBuilder()
    plant, scene_graph = AddMultibodyPlant(
        MultibodyPlantConfig(time_step=1e-3), builder
    )
    world.add_world(plant, world.WorldConfig())
    plant.Finalize()
    for name in ("outside", "mirror"):
        scene_graph.AddRenderer(name, MakeRenderEngineVtk(params))
    diagram = builder.Build()
    context = diagram.CreateDefaultContext()
    plant_context = plant.GetMyMutableContextFromRoot(context)
    world.set_posture(plant, plant_context, _POSTURE)
    world.set_drum_position(plant, plant_context, _DRUM)
    return diagram, context


def _render(diagram: Diagram, context: Context) -> np.ndarray:
    """The scene in RGB, with what the mirror shows, as float."""
    plant = diagram.GetSubsystemByName("plant")
    scene_graph = diagram.GetSubsystemByName("scene_graph")
    query = scene_graph.get_query_output_port().Eval(
        scene_graph.GetMyContextFromRoot(context)
    )
    w, h = _WIDTH * _FINER, _HEIGHT * _FINER
    focal = CameraInfo(w, h, _FOV_Y).focal_x()
    info = CameraInfo(w, h, focal, focal, w / 2, h / 2)

    def camera(renderer: str) -> ColorRenderCamera:
        depth = ClippingRange(0.05, 10.0)
        core = RenderCameraCore(renderer, info, depth, RigidTransform())
        return ColorRenderCamera(core)

    world_id = scene_graph.world_frame_id()

    def shoot(renderer: str, X_WR: RigidTransform) -> np.ndarray:
        image = query.RenderColorImage(camera(renderer), world_id, X_WR)
        return image.data[..., :3].astype(float)

    X_WC = _look_at(_EYE, _TARGET)
    mirror = plant.GetFrameByName("mirror")
    X_WM = mirror.CalcPoseInWorld(plant.GetMyContextFromRoot(context))
    X_WV = reflect_camera(X_WC.GetAsMatrix4(), X_WM.GetAsMatrix4())
    image = shoot("outside", X_WC)
    labels = query.RenderLabelImage(camera("outside"), world_id, X_WC)
    glass = labels.data[..., 0] == int(mirror.body().index())
    reflected = shoot("mirror", RigidTransform(X_WV))[:, ::-1]
    # Real glass swallows a little of the light.
    image[glass] = 0.93 * reflected[glass]
    return image


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    root = Path(__file__).resolve().parents[2]
    parser.add_argument("--out", type=Path, default=root / "docs/affetto.png")
    args = parser.parse_args()

    light = sum(_render(*_scene(params)) for params in _passes())
    picture = np.clip(light, 0, 255).astype(np.uint8)
    small = cv2.resize(picture, (_WIDTH, _HEIGHT), interpolation=cv2.INTER_AREA)
    args.out.parent.mkdir(parents=True, exist_ok=True)
    bgr = cv2.cvtColor(small, cv2.COLOR_RGB2BGR)
    cv2.imwrite(str(args.out), bgr, [cv2.IMWRITE_PNG_COMPRESSION, 9])
    print(f"{args.out}: {args.out.stat().st_size / 1000:.0f} kB")


if __name__ == "__main__":
    main()
