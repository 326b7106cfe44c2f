"""Settings of the self-calibration."""

import pytest

from drake_affetto.calibration.config import (
    SelfCalibrationConfig,
    load_self_calibration,
)
from drake_affetto.common.errors import InputError


def test_the_package_has_settings_that_fit():
    config = load_self_calibration()
    assert config.knowledge.camera_angle > 0.0
    assert config.hand.blob.color != SelfCalibrationConfig().hand.blob.color


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("prior: {distance: -1}", r"prior\.distance is -1"),
        ("hand: {looks: 0}", r"hand\.looks is 0, expected"),
        ("hand: {space_low: [1, 2]}", r"hand\.space_low is .*3 numbers"),
        ("hand: {space_low: [0.5, 0, 0.1]}", r"hand\.space_high\[0\] is 0\.3"),
        ("hand: {aside: [9, 9]}", r"hand\.aside\[0\] is 9"),
        ("ellipse: {places: 0}", r"ellipse\.places is 0"),
        ("ear: {luck: 2}", r"ear\.luck is 2"),
        ("watch: {hit_when_wrong: 0.0}", r"watch\.hit_when_wrong is 0"),
        ("wach: {}", "wach"),
    ],
)
def test_what_does_not_fit_is_told(tmp_path, text, message):
    path = tmp_path / "mine.yaml"
    path.write_text(text + "\n")
    with pytest.raises(InputError, match=message):
        load_self_calibration(str(path))
