"""What stands before a camera, and what an image is like."""

import numpy as np
import pytest

from drake_affetto.faults.images import (
    CONTRAST,
    DIGEST,
    HUE_AREA,
    MEAN,
    SATURATED,
    SHARPNESS,
    hide,
    image_statistics,
    outline_in_image,
    put_disc,
)
from drake_affetto.geometry.optics import PinholeCamera
from drake_affetto.perception.blob import BlobConfig, detect
from drake_affetto.perception.imaging import ImageEffects, apply_effects

BLOB = BlobConfig()
CAMERA = PinholeCamera.from_fov(320, 240, 0.8)
# Looking straight down from one meter.
DOWN = np.diag([1.0, -1.0, -1.0, 1.0])
DOWN[2, 3] = 1.0


def scene(center=(0.02, 0.01), radius=0.03):
    image = np.full((240, 320, 3), 120, dtype=np.uint8)
    outline = outline_in_image(CAMERA, DOWN, np.array([*center, 0.0]), radius)
    put_disc(image, outline, BLOB.color)
    return image, outline


def test_a_disc_is_found_where_it_was_put():
    image, outline = scene()
    blob = detect(image, BLOB)
    middle = CAMERA.project(np.array([[0.02, -0.01, 1.0]]))[0]
    assert (blob.u, blob.v) == pytest.approx(tuple(middle), abs=0.3)
    hue = image_statistics(image, BLOB)[HUE_AREA]
    assert hue == pytest.approx(blob.area, rel=0.05)
    assert np.ptp(outline[:, 0]) == pytest.approx(17.0, abs=0.3)


def test_a_disc_behind_or_beside_is_not_in_view():
    for center in ((0.0, 0.0, 2.0), (9.0, 0.0, 0.0)):
        assert outline_in_image(CAMERA, DOWN, np.array(center), 0.03) is None


@pytest.mark.parametrize("share", [0.25, 0.5, 0.75])
def test_so_much_of_the_marker_is_hidden(share):
    image, outline = scene()
    whole = image_statistics(image, BLOB)[HUE_AREA]
    hide(image, outline, share, 0.7)
    left = image_statistics(image, BLOB)[HUE_AREA] / whole
    # Of a disc, beyond a chord.
    half = np.arccos(2.0 * share - 1.0)
    expected = (half - np.sin(half) * np.cos(half)) / np.pi
    assert left == pytest.approx(expected, abs=0.06)


def test_statistics_tell_what_is_wrong():
    rng = np.random.default_rng(0)
    image = rng.integers(30, 220, (60, 80, 3), dtype=np.uint8)
    image = image.repeat(4, axis=0).repeat(4, axis=1)
    usual = image_statistics(image, BLOB)

    def changed(**effects):
        return image_statistics(
            apply_effects(image, ImageEffects(**effects)), BLOB
        )

    dark = changed(exposure=-5.0)
    assert dark[MEAN] < 0.4 * usual[MEAN]
    assert dark[CONTRAST] < 0.4 * usual[CONTRAST]
    assert changed(exposure=3.0)[SATURATED] > 0.5 > usual[SATURATED]
    blurred = changed(motion_blur=[20.0, 5.0])
    assert blurred[SHARPNESS] < 0.5 * usual[SHARPNESS]


def test_only_equal_images_have_one_digest():
    image, _ = scene()
    noisy = [
        apply_effects(image, ImageEffects(noise=2.0), seed=1, time=t)
        for t in (0.0, 0.1, 0.1)
    ]
    digests = [image_statistics(each, BLOB)[DIGEST] for each in noisy]
    assert digests[0] != digests[1] == digests[2]
