"""Drawing over images at the pixel coordinates of the original."""

import numpy as np

from drake_affetto.perception.blob import BlobCalibration
from drake_affetto.perception.drawing import BLOB, Canvas

GRAY = np.full((40, 60, 4), 90, dtype=np.uint8)


def changed(canvas):
    """Pixel coordinates, in the original, of all that was drawn."""
    v, u = np.nonzero(np.any(canvas.image != 90, axis=2))
    return (np.stack([u, v], -1) + 0.5) / canvas.scale - 0.5


def test_the_image_is_enlarged_and_not_changed():
    before = GRAY.copy()
    canvas = Canvas(GRAY, scale=4)
    canvas.cross(np.array([20.0, 10.0]), BLOB)
    assert canvas.image.shape == (160, 240, 3)
    np.testing.assert_array_equal(GRAY, before)


def test_a_cross_is_where_its_pixel_is():
    for uv in ([20.0, 10.0], [31.5, 22.25]):
        canvas = Canvas(GRAY, scale=4)
        canvas.cross(np.array(uv), BLOB, size=5.0)
        np.testing.assert_allclose(changed(canvas).mean(0), uv, atol=0.2)


def test_lines_break_where_there_is_nothing():
    canvas = Canvas(GRAY)
    canvas.polyline([[5, 5], [np.nan, 5], [50, 5], [50, 30]], BLOB)
    points = changed(canvas)
    assert points[:, 0].min() > 45


def test_a_calibration_box_is_drawn_at_its_pixels():
    canvas = Canvas(GRAY)
    canvas.calibration(BlobCalibration(10.0, 40.0, 8.0, 30.0), lines=2)
    # Enough off the corners, where words are.
    row = canvas.image[57:63].astype(int)
    bluish = np.any(row[:, :, 2] > row[:, :, 0] + 60, axis=0)
    u = (np.flatnonzero(bluish) + 0.5) / 3 - 0.5
    np.testing.assert_allclose([u.min(), u.max()], [10.0, 40.0], atol=0.7)
    assert np.sum(bluish) < 8


def test_a_lost_blob_is_told_in_words():
    lost, found = Canvas(GRAY), Canvas(GRAY)
    lost.blob(np.zeros(4))
    found.blob(np.array([30.0, 20.0, 50.0, 1.0]))
    assert changed(lost)[:, 1].max() < 16
    np.testing.assert_allclose(changed(found).mean(0), [30, 20], atol=0.3)
