"""What a sensor does to an image."""

import numpy as np
import pytest

from drake_affetto.perception.imaging import (
    ImageEffects,
    NoiseBank,
    apply_effects,
    composite_mirror,
    gain_tables,
    motion_blur_kernel,
)

GRAY = np.full((60, 80, 3), 120, dtype=np.uint8)


def test_no_effects_leave_the_image_alone():
    image = np.random.default_rng(0).integers(0, 256, (20, 30, 3), np.uint8)
    np.testing.assert_array_equal(apply_effects(image, ImageEffects()), image)


def test_effects_survive_the_way_through_a_vector():
    effects = ImageEffects(0.5, [1.1, 1.0, 0.8], 3.0, [2.0, -1.0])
    assert ImageEffects.from_vector(effects.to_vector()) == effects


def test_one_stop_doubles_the_light():
    tables = gain_tables(1.0, [1.0, 1.0, 1.0])
    light = (np.arange(256) / 255) ** 2.2
    after = (tables[:, 0] / 255) ** 2.2
    middle = slice(60, 180)
    np.testing.assert_allclose(
        after[middle], np.minimum(2 * light[middle], 1), atol=0.01
    )
    assert tables[255, 0] == 255


def test_white_balance_acts_on_each_color():
    out = apply_effects(GRAY, ImageEffects(white_balance=[1.3, 1.0, 0.7]))
    red, green, blue = out[0, 0].astype(int)
    assert red > green == 120 > blue


def test_noise_has_its_deviation_and_repeats_with_seed_and_time():
    bank = NoiseBank()
    first = bank.add(GRAY, 5.0, seed=1, time=0.2)
    np.testing.assert_array_equal(first, bank.add(GRAY, 5.0, 1, 0.2))
    np.testing.assert_array_equal(first, NoiseBank().add(GRAY, 5.0, 1, 0.2))
    noise = first.astype(float) - 120
    assert noise.std() == pytest.approx(5.0, rel=0.05)
    assert abs(noise.mean()) < 0.2
    for other in (bank.add(GRAY, 5.0, 2, 0.2), bank.add(GRAY, 5.0, 1, 0.3)):
        between = np.corrcoef(noise.ravel(), other.ravel().astype(float))
        assert abs(between[0, 1]) < 0.05


def test_noise_of_large_images_does_not_repeat_within_the_image():
    gray = np.full((480, 640, 3), 120, dtype=np.uint8)
    noise = NoiseBank().add(gray, 10.0, 0, 0.0).astype(float) - 120
    upper, lower = noise[:240].ravel(), noise[240:].ravel()
    assert abs(np.corrcoef(upper, lower)[0, 1]) < 0.02


@pytest.mark.parametrize("way", [(6.0, 0.0), (0.0, -4.0), (3.0, 5.0)])
def test_motion_blur_spreads_along_the_way_and_keeps_the_middle(way):
    kernel = motion_blur_kernel(list(way))
    assert kernel is not None
    assert kernel.sum() == pytest.approx(1.0, abs=1e-6)
    v, u = np.mgrid[: kernel.shape[0], : kernel.shape[1]]
    half = kernel.shape[0] // 2
    du, dv = u - half, v - half
    assert (kernel * du).sum() == pytest.approx(0, abs=1e-5)
    assert (kernel * dv).sum() == pytest.approx(0, abs=1e-5)
    along = (du * way[0] + dv * way[1]) / np.hypot(*way)
    across = (du * way[1] - dv * way[0]) / np.hypot(*way)
    # A uniform smear of length l has the variance l²/12.
    variance = np.hypot(*way) ** 2 / 12
    assert (kernel * along**2).sum() == pytest.approx(variance, rel=0.3)
    assert (kernel * across**2).sum() < 0.3


def test_no_motion_is_no_blur():
    assert motion_blur_kernel([0.0, 0.2]) is None


def test_composite_pastes_under_the_mask_only():
    image = GRAY.copy()
    reflection = np.full_like(GRAY, 200)
    mask = np.zeros(GRAY.shape[:2], dtype=np.uint8)
    mask[10:20, 30:50] = 255
    composite_mirror(image, reflection, mask, [1.0, 0.5, 1.0], 0.0)
    assert image[15, 40, 0] == 200
    assert image[15, 40, 1] == round(200 * 0.5 ** (1 / 2.2))
    image[10:20, 30:50] = 120
    np.testing.assert_array_equal(image, GRAY)


def test_blurred_reflection_stays_within_the_mask():
    image = GRAY.copy()
    reflection = GRAY.copy()
    reflection[:, 40:] = 240
    mask = np.zeros(GRAY.shape[:2], dtype=np.uint8)
    mask[:, 20:60] = 255
    composite_mirror(image, reflection, mask, [1.0, 1.0, 1.0], 2.0)
    assert 120 < image[30, 38, 0] < 240
    assert np.all(image[:, :20] == 120)
    assert np.all(image[:, 60:] == 120)
