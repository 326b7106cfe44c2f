"""The renderer-free twin of the blob sensor against rendered images."""

import numpy as np
from pydrake.common.value import Value
import pytest

from drake_affetto.common.errors import InputError
from drake_affetto.perception.analytic_blob_sensor import AnalyticBlobSensor
from drake_affetto.perception.blob import BlobCalibration, BlobConfig
from drake_affetto.perception.blob_sensor import BlobSensor
from drake_affetto.perception.config import CameraConfig
from drake_affetto.perception.imaging import ImageEffects
from support import perception_scene as scene
from support.camera_world import World


@pytest.fixture(scope="module")
def twins():
    """The world of the mirror camera's tests with both sensors."""
    world = World()
    config = BlobConfig(
        scene.MARKER_COLOR, calibration=BlobCalibration(0.0, 200.0, 0.0, 100.0)
    )
    twin = AnalyticBlobSensor(
        world.plant,
        world.camera.config,
        config,
        radius=scene.MARKER_RADIUS,
        robot="robot",
    )
    return world, BlobSensor(config), twin


def both(world, sensor, twin):
    """(rendered, analytic) blob in pixels, and the twin's context."""
    rendered = sensor.CreateDefaultContext()
    sensor.get_color_image_input_port().FixValue(
        rendered, world.camera.get_color_image_output_port().Eval(world.context)
    )
    analytic = twin.CreateDefaultContext()
    query = world.scene_graph.get_query_output_port().Eval(
        world.scene_graph.GetMyContextFromRoot(world.root)
    )
    twin.get_query_object_input_port().FixValue(analytic, query)
    twin.get_sight_input_port().FixValue(
        analytic,
        Value(world.camera.get_sight_output_port().Eval(world.context)),
    )
    return (
        sensor.get_blob_pixels_output_port().Eval(rendered),
        twin.get_blob_pixels_output_port().Eval(analytic),
        analytic,
    )


def test_the_twin_sees_what_is_rendered(twins):
    world, sensor, twin = twins
    rng = np.random.default_rng(8)
    differences = []
    for _ in range(50):
        world.set(
            yaw=rng.uniform(-0.9, 0.4),
            drum=rng.uniform([0.22, -0.15], [0.34, 0.1]),
            rod=2.5,
        )
        rendered, analytic, _ = both(world, sensor, twin)
        if min(rendered[2], analytic[2]) < 50:
            # Hardly seen at the border, or not at all: by both.
            assert max(rendered[2], analytic[2]) < 120
            continue
        differences.append(
            [*(analytic - rendered)[:2], analytic[2] / rendered[2]]
        )
    differences = np.array(differences)
    assert len(differences) > 25
    assert np.median(np.hypot(*differences[:, :2].T)) < 0.2
    assert np.median(differences[:, 2]) == pytest.approx(1.0, abs=0.03)


def test_the_rod_hides_the_marker_from_both(twins):
    world, sensor, twin = twins
    world.set(yaw=0.0, drum=[0.3, 0.0], rod=0.0)
    rendered, analytic, _ = both(world, sensor, twin)
    assert max(rendered[2], analytic[2]) < 60
    world.set(rod=2.5)


def test_the_twins_ports(twins):
    world, sensor, twin = twins
    world.set(yaw=0.0, drum=[0.3, 0.0], rod=2.5)
    _, pixels, context = both(world, sensor, twin)
    x, y, found = twin.get_blob_output_port().Eval(context)
    np.testing.assert_allclose([x, y], pixels[:2] / [200, 100])
    assert found == 1
    # Turned away, nothing is found and nothing stale is held.
    world.set(yaw=2.5)
    _, pixels, context = both(world, sensor, twin)
    np.testing.assert_array_equal(pixels, 0)
    np.testing.assert_array_equal(
        twin.get_blob_output_port().Eval(context), [0.5, 0.5, 0]
    )
    world.set(yaw=0.0)


def test_what_the_twin_cannot_do_it_refuses(twins):
    world, sensor, twin = twins
    effects = world.camera.effects(world.context)
    world.camera.set_effects(world.context, ImageEffects(motion_blur=[4.0, 0]))
    with pytest.raises(InputError, match="motion_blur"):
        both(world, sensor, twin)
    world.camera.set_effects(world.context, effects)
    with pytest.raises(InputError, match="radius is -1"):
        AnalyticBlobSensor(world.plant, CameraConfig(frame="camera"), radius=-1)
    with pytest.raises(InputError, match="marker is 'bell::marker'"):
        AnalyticBlobSensor(
            world.plant,
            CameraConfig(frame="camera"),
            radius=0.03,
            marker="bell::marker",
        )
