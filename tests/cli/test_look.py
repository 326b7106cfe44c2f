"""`affetto look`: pictures, a video and a calibration."""

import cv2
import numpy as np
import pytest

from drake_affetto.cli.main import main
from drake_affetto.station.scenario import load_scenario


@pytest.mark.parametrize("name", ["drumming", "mirror"])
def test_it_draws_what_the_camera_sees(name, tmp_path, capsys):
    assert main(["look", name, "--out", str(tmp_path)]) == 0
    words = capsys.readouterr().out
    assert ("in the mirror" in words) == (name == "mirror")
    assert "tau:" in words
    for picture in ("start.png", "look.png"):
        image = cv2.imread(str(tmp_path / picture))
        assert image.shape == (720, 960, 3)
        # The blob's circle is there.
        assert np.any(np.all(image == (255, 0, 255), axis=2))


def test_calibrate_prints_yaml(capsys, tmp_path):
    assert main(["look", "mirror", "--calibrate"]) == 0
    path = tmp_path / "own.yaml"
    path.write_text("extends: mirror\n" + capsys.readouterr().out)
    own = load_scenario(path)
    assert own.blob.calibration == load_scenario("mirror").blob.calibration


def test_a_drum_that_cannot_be_looked_at_is_refused(capsys, tmp_path):
    for place, words in (
        (["0.2", "0.35"], "cannot be centered"),
        (["2.0", "0.0"], "drum position"),
        (["0.2", "-9e2"], "drum position is [0.2, -900.0]"),
        (["0.2", "-inf"], "drum position[1] is -inf"),
        (["0.2", "-1_0"], "--drum"),
        (["1_0", "0"], "--drum: '1_0' is not a number"),
    ):
        options = ["--drum", *place, "--out", str(tmp_path / "new")]
        assert main(["look", *options]) == 2
        assert words in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == []
    assert main(["look", "nowhere"]) == 2


def test_a_video_shows_the_gaze_at_work(tmp_path):
    options = ["--video", "--out", str(tmp_path), "--drum", "0.24", "-0.09"]
    assert main(["look", "drumming", *options]) == 0
    video = cv2.VideoCapture(str(tmp_path / "gaze.mp4"))
    frames = 0
    while video.read()[0]:
        frames += 1
    assert frames > 20
