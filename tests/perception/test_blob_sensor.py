"""The blob sensor's ports."""

import numpy as np
from pydrake.common.value import Value
from pydrake.systems.framework import DiagramBuilder, LeafSystem
from pydrake.systems.primitives import ConstantValueSource
from pydrake.systems.sensors import ImageRgba8U
import pytest

from drake_affetto.common.errors import InputError
from drake_affetto.perception.blob import BlobCalibration, BlobConfig
from drake_affetto.perception.blob_sensor import BlobSensor

BACKGROUND, MARKER = (168, 117, 71), (13, 191, 38)
BOX = BlobCalibration(20.0, 120.0, 10.0, 110.0)


def picture(u=None, v=0, radius=6.0, size=(160, 120)):
    image = ImageRgba8U(*size)
    data = image.mutable_data
    data[:, :, :3] = BACKGROUND
    data[:, :, 3] = 255
    if u is not None:
        y, x = np.mgrid[: size[1], : size[0]]
        inside = (x - u) ** 2 + (y - v) ** 2 <= radius**2
        data[:, :, :3][inside] = MARKER
    return image


@pytest.fixture
def sensor():
    return BlobSensor(BlobConfig(calibration=BOX))


def test_blob_is_normalized_over_the_calibrated_box(sensor):
    context = sensor.CreateDefaultContext()
    port = sensor.get_color_image_input_port()
    port.FixValue(context, picture(70, 35))
    blob = sensor.get_blob_output_port().Eval(context)
    np.testing.assert_allclose(blob, [0.5, 0.25, 1.0], atol=1e-3)
    u, v, area, confidence = sensor.get_blob_pixels_output_port().Eval(context)
    np.testing.assert_allclose([u, v], [70, 35], atol=0.05)
    assert area == pytest.approx(np.pi * 36, rel=0.15)
    assert 0 < confidence <= 1
    # Outside of the box it says how far, and does not stick to the border.
    port.FixValue(context, picture(140, 60))
    assert sensor.get_blob_output_port().Eval(context)[0] == pytest.approx(
        1.2, abs=1e-3
    )


def test_lost_is_told_and_nothing_stale_is_held(sensor):
    context = sensor.CreateDefaultContext()
    port = sensor.get_color_image_input_port()
    port.FixValue(context, picture(30, 30))
    assert sensor.get_blob_output_port().Eval(context)[2] == 1
    port.FixValue(context, picture())
    np.testing.assert_array_equal(
        sensor.get_blob_output_port().Eval(context), [0.5, 0.5, 0.0]
    )
    np.testing.assert_array_equal(
        sensor.get_blob_pixels_output_port().Eval(context), 0.0
    )
    port.FixValue(context, picture(100, 90))
    assert sensor.get_blob_output_port().Eval(context)[2] == 1


def test_any_size_of_image_will_do(sensor):
    context = sensor.CreateDefaultContext()
    sensor.get_color_image_input_port().FixValue(
        context, picture(300, 200, size=(640, 480))
    )
    u, v = sensor.get_blob_pixels_output_port().Eval(context)[:2]
    np.testing.assert_allclose([u, v], [300, 200], atol=0.05)


def test_calibration_is_a_parameter_of_the_context(sensor):
    context, other = (sensor.CreateDefaultContext() for _ in range(2))
    for each in (context, other):
        sensor.get_color_image_input_port().FixValue(each, picture(70, 60))
    sensor.set_calibration(context, BlobCalibration(70, 170, 10, 110))
    assert sensor.get_blob_output_port().Eval(context)[0] == pytest.approx(
        0.0, abs=1e-3
    )
    assert sensor.get_blob_output_port().Eval(other)[0] == pytest.approx(
        0.5, abs=1e-3
    )
    assert sensor.calibration(other) == BOX
    with pytest.raises(InputError, match=r"calibration\.u_max"):
        sensor.set_calibration(context, BlobCalibration(5, 4, 0, 9))


class Source(LeafSystem):
    """An image; counts how often it is drawn."""

    def __init__(self):
        super().__init__()
        self.drawn = 0
        self.DeclareAbstractOutputPort(
            "image",
            Value(ImageRgba8U(160, 120)).Clone,
            self._calc,
            {self.time_ticket()},
        )

    def _calc(self, context, output):
        self.drawn += 1
        output.set_value(picture(50, 50))


def test_no_image_is_drawn_before_someone_asks_and_one_serves_both_ports():
    builder = DiagramBuilder()
    source = builder.AddSystem(Source())
    sensor = BlobSensor.AddToBuilder(
        builder=builder, color_image=source.get_output_port()
    )
    diagram = builder.Build()
    root = diagram.CreateDefaultContext()
    context = sensor.GetMyContextFromRoot(root)
    assert source.drawn == 0
    sensor.get_blob_output_port().Eval(context)
    sensor.get_blob_pixels_output_port().Eval(context)
    assert source.drawn == 1
    root.SetTime(1.0)
    assert source.drawn == 1
    sensor.get_blob_output_port().Eval(context)
    assert source.drawn == 2


def test_bad_settings_are_refused():
    with pytest.raises(InputError, match=r"blob\.hue_tolerance"):
        BlobSensor(BlobConfig(hue_tolerance=0.0))


def test_two_sensors_stand_in_one_diagram():
    builder = DiagramBuilder()
    for name in ("left_eye", "right_eye"):
        image = builder.AddNamedSystem(
            f"{name}_image", ConstantValueSource(Value(ImageRgba8U(32, 24)))
        )
        BlobSensor.AddToBuilder(
            builder=builder,
            color_image=image.get_output_port(),
            config=BlobConfig([1.0, 0.0, 0.0]),
            name=name,
        )
    diagram = builder.Build()
    assert diagram.HasSubsystemNamed("left_eye")
    assert diagram.HasSubsystemNamed("right_eye")
