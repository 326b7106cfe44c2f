"""Shows the world in a browser, with a slider for each joint and the drum."""

import time

import numpy as np
from pydrake.geometry import (
    Meshcat,
    MeshcatVisualizer,
    MeshcatVisualizerParams,
    Role,
)
from pydrake.multibody.meshcat import JointSliders
from pydrake.multibody.plant import AddMultibodyPlant, MultibodyPlantConfig
from pydrake.systems.framework import DiagramBuilder
from pydrake.visualization import AddFrameTriadIllustration

from drake_affetto.common.errors import require_range
from drake_affetto.scene import world
from drake_affetto.scene.parts import find_frame

# Where robot, drum and mirror are in view, and what is in the middle, m.
CAMERA_POSITION = (0.95, -0.75, 0.50)
CAMERA_TARGET = (0.16, 0.02, 0.10)

_STOP = "Stop"
_DRUM = ("drum x [m]", "drum y [m]")
_FRAMES = (
    "affetto::eye_camera",
    "affetto::right_palm",
    "mirror::mirror",
    "drum::head_center",
)


def set_default_camera_pose(meshcat: Meshcat) -> None:
    """Puts the browser's camera where robot, drum and mirror are in view.

    Args:
        meshcat: The browser's view.
    """
    meshcat.SetCameraPose(CAMERA_POSITION, CAMERA_TARGET)


def view_model(
    config: world.WorldConfig,
    *,
    meshcat: Meshcat | None = None,
    loop_once: bool = False,
    time_limit: float | None = None,
    frames: bool = False,
) -> dict[str, float]:
    """Shows the models of `config` until told to stop.

    Nothing moves by itself: the sliders set the robot's posture and the
    drum's place. Collision shapes are there, too, hidden under `collision`.

    Args:
        meshcat: the browser's server; a new one by default.
        loop_once: returns after showing the world once.
        time_limit: returns after that many seconds; never by default.
        frames: draws the frames of camera, palm, mirror and drum head.

    Returns:
        The posture that the sliders were left at, joint -> angle [rad].

    Raises:
        InputError: for a configuration that does not fit.
    """
    if time_limit is not None:
        require_range("time limit", time_limit, 0.0)
    builder = DiagramBuilder()
    plant, scene_graph = AddMultibodyPlant(
        MultibodyPlantConfig(time_step=0.0), builder
    )
    world.add_world(plant, config)
    plant.Finalize()
    if frames:
        for name in _FRAMES:
            frame = find_frame(plant, name)
            AddFrameTriadIllustration(
                scene_graph=scene_graph, frame=frame, length=0.06, radius=0.001
            )
    meshcat = meshcat or Meshcat()
    print(f"The world is at {meshcat.web_url()}", flush=True)
    for role, prefix, shown in (
        (Role.kIllustration, "visual", True),
        (Role.kProximity, "collision", False),
    ):
        MeshcatVisualizer.AddToBuilder(
            builder,
            scene_graph,
            meshcat,
            MeshcatVisualizerParams(
                role=role, prefix=prefix, visible_by_default=shown
            ),
        )
    sliders = builder.AddSystem(JointSliders(meshcat, plant, step=0.01))
    diagram = builder.Build()
    root = diagram.CreateDefaultContext()
    context = plant.GetMyMutableContextFromRoot(root)
    low, high = world.drum_limits(plant, context)
    place = world.get_drum_position(plant, context)
    for name, a, b, value in zip(_DRUM, low, high, place, strict=True):
        meshcat.AddSlider(name, min=a, max=b, step=0.005, value=value)
    meshcat.AddButton(_STOP, "Escape")
    set_default_camera_pose(meshcat)
    positions = sliders.get_output_port()
    end = np.inf if time_limit is None else time.monotonic() + time_limit
    try:
        while True:
            q = positions.Eval(sliders.GetMyContextFromRoot(root))
            plant.SetPositions(context, q)
            xy = [meshcat.GetSliderValue(name) for name in _DRUM]
            world.set_drum_position(plant, context, np.clip(xy, low, high))
            diagram.ForcedPublish(root)
            stopped = meshcat.GetButtonClicks(_STOP) > 0
            if stopped or loop_once or time.monotonic() >= end:
                return world.get_posture(plant, context)
            time.sleep(1 / 32)
    finally:
        sliders.Delete()
        for name in _DRUM:
            meshcat.DeleteSlider(name)
        meshcat.DeleteButton(_STOP)
