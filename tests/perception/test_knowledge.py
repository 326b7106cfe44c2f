"""How wrong a camera is known."""

import numpy as np
import pytest

from drake_affetto.common.errors import InputError
from drake_affetto.experiments.view_maps import ViewDomain
from drake_affetto.perception.knowledge import CalibrationError, believed


@pytest.fixture(scope="module")
def model():
    return ViewDomain.of("drumming").sight.model


def _turn(X):
    return np.arccos((np.trace(X[:3, :3]) - 1.0) / 2.0)


def test_a_camera_is_as_wrong_as_is_said(model):
    error = CalibrationError(
        focal=0.01, angle=0.02, position=0.005, height=0.003
    )
    (wrong,) = believed((model,), error, np.random.default_rng(0))
    assert abs(wrong.camera.focal_x / model.camera.focal_x - 1) == (
        pytest.approx(0.01)
    )
    assert abs(wrong.marker_height - model.marker_height) == (
        pytest.approx(0.003)
    )
    X = np.linalg.inv(model.X_AC) @ wrong.X_AC
    assert _turn(X) == pytest.approx(0.02, rel=0.02)
    assert np.linalg.norm(X[:3, 3]) == pytest.approx(0.005)


def test_the_camera_is_one_and_the_neck_errs_in_each_view(model):
    views = (model, model)
    rng = np.random.default_rng
    one, other = believed(views, CalibrationError(0.01, 0.02, 0.005), rng(1))
    np.testing.assert_array_equal(one.X_AC, other.X_AC)
    assert one.camera.focal_x == other.camera.focal_x
    one, other = believed(views, CalibrationError(neck=0.004), rng(1))
    apart = _turn(np.linalg.inv(one.X_AC) @ other.X_AC)
    assert 1e-4 < apart <= 0.0081


def test_no_error_leaves_it_as_it_is(model):
    (same,) = believed((model,), CalibrationError(), np.random.default_rng(3))
    np.testing.assert_allclose(same.X_AC, model.X_AC, atol=1e-12)
    assert same.camera.focal_x == model.camera.focal_x


@pytest.mark.parametrize("name", ["focal", "angle", "position", "height"])
def test_an_error_that_cannot_be_is_named(name):
    with pytest.raises(InputError, match=rf"errors\.{name} is -1"):
        CalibrationError(**{name: -1.0}).check("errors")
