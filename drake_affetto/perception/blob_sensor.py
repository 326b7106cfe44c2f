"""The system that finds the marker in the camera's image."""

import dataclasses
from typing import Any

import numpy as np
from pydrake.common.value import Value
from pydrake.systems.framework import (
    BasicVector,
    Context,
    DiagramBuilder,
    LeafSystem,
    OutputPort,
    ValueProducer,
)
from pydrake.systems.sensors import ImageRgba8U

from drake_affetto.common.systems import input_port, output_port, weakly
from drake_affetto.perception.blob import (
    Blob,
    BlobCalibration,
    BlobConfig,
    detect,
)

# What x_img and y_img are when there is no marker. `found` tells.
LOST = 0.5


class BlobReporter(LeafSystem):
    """What sensors of the marker have in common: ports and calibration.

    A subclass declares its input ports, then calls `_declare_outputs`, and
    says in `_find` what it sees.
    """

    def __init__(self, config: BlobConfig | None) -> None:
        super().__init__()
        self._config = config or BlobConfig()
        self._config.check("blob")
        calibration = self.DeclareNumericParameter(
            BasicVector(self._config.calibration.to_vector())
        )
        self._calibration_index = int(calibration)

    def _declare_outputs(self, prerequisites: set) -> None:
        """Declares the outputs, which depend on `prerequisites`."""
        pixels = self.DeclareCacheEntry(
            description="blob in pixels",
            value_producer=ValueProducer(
                allocate=Value(np.zeros(4)).Clone,
                calc=weakly(self._calc_detection),
            ),
            prerequisites_of_calc=prerequisites,
        )
        self._pixels_index = pixels.cache_index()
        self.DeclareVectorOutputPort(
            "blob",
            3,
            self._calc_blob,
            prerequisites | {self.all_parameters_ticket()},
        )
        self.DeclareVectorOutputPort(
            "blob_pixels", 4, self._calc_pixels, prerequisites
        )

    def _find(self, context: Context) -> Blob | None:
        """The marker, if it is seen."""
        raise NotImplementedError

    get_blob_output_port = output_port("x_img, y_img, found (3).")
    get_blob_pixels_output_port = output_port(
        "u, v, px, area, px², and confidence (4)."
    )

    @property
    def config(self) -> BlobConfig:
        """The settings given at construction."""
        return self._config

    def calibration(self, context: Context) -> BlobCalibration:
        """The calibration in this context."""
        box = context.get_numeric_parameter(self._calibration_index)
        return BlobCalibration(*(float(v) for v in box.CopyToVector()))

    def set_calibration(
        self, context: Context, calibration: BlobCalibration
    ) -> None:
        """Sets the box of pixels that is mapped to [0, 1]."""
        calibration.check("calibration")
        context.get_mutable_numeric_parameter(
            self._calibration_index
        ).SetFromVector(calibration.to_vector())

    def _calc_detection(self, context: Any, cache: Any) -> None:
        blob = self._find(context)
        cache.set_value(
            np.zeros(4)
            if blob is None or blob.confidence < self._config.min_confidence
            else np.array(dataclasses.astuple(blob), dtype=float)
        )

    def _calc_blob(self, context: Context, output: BasicVector) -> None:
        pixels: Any = self.get_cache_entry(self._pixels_index).Eval(context)
        if pixels[2] <= 0.0:
            output.SetFromVector(np.array([LOST, LOST, 0.0]))
            return
        x, y = self.calibration(context).normalize(pixels[:2])
        output.SetFromVector(np.array([x, y, 1.0]))

    def _calc_pixels(self, context: Context, output: BasicVector) -> None:
        pixels: Any = self.get_cache_entry(self._pixels_index).Eval(context)
        output.SetFromVector(pixels)


class BlobSensor(BlobReporter):
    """Finds the marker in an image.

    .. pydrake_system::

        name: BlobSensor
        input_ports:
        - color_image
        output_ports:
        - blob
        - blob_pixels

    - color_image: ImageRgba8U.
    - blob (3): x_img, y_img, found. The first two run from 0 to 1 over the
      calibrated box, y downwards, and beyond outside of it. found is 1, or 0
      where no marker is seen; x_img and y_img are then 0.5 and mean nothing.
    - blob_pixels (4): u, v [pixels], area [pixels²], confidence in [0, 1]; all
      0 where no marker is seen.

    Nothing is kept from one image to the next, and no image is asked for
    (so that none is rendered) until an output is evaluated. The calibration
    is a numeric parameter (`set_calibration`).
    """

    def __init__(self, config: BlobConfig | None = None) -> None:
        super().__init__(config)
        self._image_port = self.DeclareAbstractInputPort(
            "color_image", Value(ImageRgba8U())
        )
        self._declare_outputs(
            {self.input_port_ticket(self._image_port.get_index())}
        )

    @staticmethod
    def AddToBuilder(
        *,
        builder: DiagramBuilder,
        color_image: OutputPort,
        config: BlobConfig | None = None,
        name: str = "blob_sensor",
    ) -> "BlobSensor":
        """Adds a sensor that looks at `color_image`."""
        sensor = BlobSensor(config)
        builder.AddNamedSystem(name, sensor)
        builder.Connect(color_image, sensor.get_color_image_input_port())
        return sensor

    get_color_image_input_port = input_port("The image (ImageRgba8U).")

    def _find(self, context: Context) -> Blob | None:
        image: Any = self._image_port.Eval(context)
        return detect(image.data, self._config)
