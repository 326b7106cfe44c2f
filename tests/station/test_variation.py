"""The switch of the variation, and its file."""

import pytest

from drake_affetto.common.errors import InputError
from drake_affetto.station.variation import VariationConfig


def test_file_of_the_package_is_read():
    sensors = VariationConfig().load().sensors
    assert sensors.angle_resolution == 0.001
    assert all(
        0.0005 <= noise <= 0.0031
        for noise in (sensors.angle_noise, *sensors.joint_noise.values())
    )


def test_overlay_that_does_not_fit_is_named(tmp_path):
    path = tmp_path / "mine.yaml"
    path.write_text("sensors: {pressure_noise: -1.0}\n")
    with pytest.raises(InputError, match=r"sensors\.pressure_noise is -1"):
        VariationConfig(overlays=[str(path)]).check("scenario.variation")
