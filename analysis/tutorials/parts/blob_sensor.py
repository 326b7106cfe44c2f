"""BlobSensor alone: finds a colored disc in any ImageRgba8U."""

import cv2
from pydrake.common.value import Value
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.primitives import ConstantValueSource
from pydrake.systems.sensors import ImageRgba8U

from drake_affetto.perception import BlobConfig, BlobSensor

image = ImageRgba8U(320, 240)
image.mutable_data[:] = [120, 110, 100, 255]
cv2.circle(image.mutable_data, (80, 180), 12, (220, 30, 60, 255), -1)

builder = DiagramBuilder()
source = builder.AddSystem(ConstantValueSource(Value(image)))
sensor = BlobSensor.AddToBuilder(
    builder=builder,
    color_image=source.get_output_port(),
    config=BlobConfig(color=[0.86, 0.12, 0.24]),
)
context = sensor.GetMyContextFromRoot(builder.Build().CreateDefaultContext())
print("x, y, found:", sensor.get_blob_output_port().Eval(context).round(4))
