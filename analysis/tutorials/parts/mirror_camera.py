"""MirrorCamera outside the station: it sees the drum's marker twice."""

import cv2
import numpy as np
from pydrake.multibody.plant import AddMultibodyPlantSceneGraph
from pydrake.systems.framework import DiagramBuilder

from drake_affetto import perception as p
from drake_affetto import scene

builder = DiagramBuilder()
plant, graph = AddMultibodyPlantSceneGraph(builder, time_step=0.001)
scene.add_world(plant, scene.WorldConfig())
plant.Finalize()
# On any frame; here it looks along the world's y, and down.
eye = p.CameraConfig("world", [0.3, -0.6, 0.35], [-np.pi / 2 - 0.4, 0.0, 0.0])
glass = [p.MirrorConfig()]
camera = p.MirrorCamera.AddToBuilder(
    builder=builder, plant=plant, scene_graph=graph, config=eye, mirrors=glass
)
context = camera.GetMyContextFromRoot(builder.Build().CreateDefaultContext())
image = camera.get_color_image_output_port().Eval(context).data.astype(int)
green = (image[..., 1] > 2 * image[..., 0]) & (image[..., 1] > 80)
_, _, box, middle = cv2.connectedComponentsWithStats(green.astype(np.uint8))
print("green discs at", middle[1:][box[1:, 4] > 20].round(1).tolist())
