"""The calibration of a view of the robot."""

import numpy as np
import pytest

from drake_affetto.common.errors import InputError
from drake_affetto.perception.plant_camera_model import calibrate_view
from support.trunk_camera import make


def test_calibration_holds_what_is_seen():
    sight = make()
    grid = np.stack(
        np.meshgrid(np.linspace(0.22, 0.3, 4), np.linspace(-0.05, 0.1, 4)), -1
    ).reshape(-1, 2)
    box = calibrate_view(sight, grid)
    tau = sight.direct_task_parameters(grid, box)
    assert box.u_min == -0.5
    assert box.u_max == 319.5
    assert tau[:, 0].min() == pytest.approx(0.05 / 1.1, abs=1e-6)
    assert tau[:, 0].max() == pytest.approx(1 - 0.05 / 1.1, abs=1e-6)
    fixed = calibrate_view(sight, grid, fixed_yaw=0.0)
    pixels = sight.fixed_yaw_pixels(grid, 0.0)
    seen = np.isfinite(pixels[:, 0])
    assert seen.sum() >= 3
    image = fixed.normalize(pixels[seen])
    assert image.min() > 0
    assert image.max() < 1
    with pytest.raises(InputError, match="seen at 0 of 16"):
        calibrate_view(sight, grid, fixed_yaw=3.0)
