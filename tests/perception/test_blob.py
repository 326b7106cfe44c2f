"""Finding the marker in drawn images whose truth is known exactly."""

from hypothesis import given
from hypothesis import strategies as st
import numpy as np
import pytest

from drake_affetto.common.errors import InputError
from drake_affetto.perception.blob import (
    BlobCalibration,
    BlobConfig,
    calibrate,
    detect,
    find_candidates,
    marker_lab,
    segment,
)
from drake_affetto.perception.imaging import ImageEffects, apply_effects

MARKER = (13, 191, 38)
TABLE = (168, 117, 71)


def draw_disc(
    u, v, radius, *, shape=(240, 320), squeeze=1.0, color=MARKER, image=None
):
    """A disc (or ellipse) with edges covered in part, by supersampling."""
    if image is None:
        image = np.empty((*shape, 3), dtype=np.uint8)
        image[:] = TABLE
    n = 8
    offset = (np.arange(n) + 0.5) / n - 0.5
    y, x = np.mgrid[: image.shape[0], : image.shape[1]]
    cover = np.zeros(image.shape[:2])
    for dy in offset:
        for dx in offset:
            cover += (x + dx - u) ** 2 + ((y + dy - v) / squeeze) ** 2 <= (
                radius**2
            )
    cover = cover[:, :, None] / n**2
    mixed = cover * np.array(color) + (1 - cover) * image
    return np.rint(mixed).astype(np.uint8)


@pytest.mark.parametrize("detector", ["moments", "simple"])
@pytest.mark.parametrize("radius", [3.0, 6.0, 15.0])
def test_centroid_is_found_to_a_fraction_of_a_pixel(radius, detector):
    config = BlobConfig(detector=detector)
    rng = np.random.default_rng(3)
    errors = []
    for _ in range(8):
        u, v = rng.uniform([30, 30], [290, 210])
        blob = detect(draw_disc(u, v, radius, squeeze=0.7), config)
        assert blob is not None
        errors.append(np.hypot(blob.u - u, blob.v - v))
        if detector == "moments":
            expected = 0.7 * np.pi * radius**2
            assert blob.area == pytest.approx(expected, rel=0.08)
    assert max(errors) < (0.1 if detector == "moments" else 0.5)


def test_alpha_channel_is_ignored():
    image = draw_disc(100.3, 80.7, 8)
    rgba = np.dstack([image, np.full(image.shape[:2], 255, np.uint8)])
    assert detect(image, BlobConfig()) == detect(rgba, BlobConfig())


def test_no_marker_is_not_found():
    config = BlobConfig()
    rng = np.random.default_rng(0)
    # Images of any other colors: the marker's hue left out by construction.
    for _ in range(40):
        colors = rng.integers(0, 256, (6, 8, 3), dtype=np.uint8)
        _, chroma, hue = np.vectorize(
            lambda r, g, b: marker_lab([r / 255, g / 255, b / 255])
        )(*np.moveaxis(colors, 2, 0))
        apart = np.abs(
            (hue - marker_lab(config.color)[2] + np.pi) % (2 * np.pi) - np.pi
        )
        colors[(np.degrees(apart) < 30) & (chroma > 15)] = (128, 128, 128)
        image = np.kron(colors, np.ones((40, 40, 1), dtype=np.uint8))
        image = apply_effects(image, ImageEffects(noise=4.0), time=0.1)
        assert detect(image, config) is None


def test_shapes_that_are_no_disc_are_refused():
    image = np.empty((240, 320, 3), dtype=np.uint8)
    image[:] = TABLE
    line = image.copy()
    line[100:102, 50:250] = MARKER
    assert detect(line, BlobConfig()) is None
    ring = draw_disc(160, 120, 30)
    ring = draw_disc(160, 120, 22, image=ring, color=TABLE)
    assert detect(ring, BlobConfig()) is None
    speck = image.copy()
    speck[100:102, 50:52] = MARKER
    assert detect(speck, BlobConfig()) is None


def test_distractors_of_other_colors_and_shapes_do_not_matter():
    image = draw_disc(100.0, 80.0, 9, color=(200, 40, 30))
    image = draw_disc(220.0, 80.0, 20, color=(40, 60, 200), image=image)
    image = draw_disc(60.0, 180.0, 12, color=(230, 210, 40), image=image)
    image[200:204, 20:300] = MARKER
    image = draw_disc(250.25, 170.75, 8, image=image)
    blob = detect(image, BlobConfig())
    assert blob is not None
    assert np.hypot(blob.u - 250.25, blob.v - 170.75) < 0.1


@pytest.mark.parametrize(
    "effects",
    [
        ImageEffects(exposure=1.0),
        ImageEffects(exposure=-1.0),
        ImageEffects(white_balance=[1.25, 1.0, 0.7]),
        ImageEffects(white_balance=[0.8, 1.0, 1.25]),
        ImageEffects(noise=8.0),
        ImageEffects(motion_blur=[6.0, 2.0]),
    ],
    ids=["bright", "dark", "warm", "cool", "noise", "blur"],
)
def test_light_noise_and_blur_are_borne(effects):
    image = apply_effects(draw_disc(140.4, 90.2, 7), effects, time=1.0)
    blob = detect(image, BlobConfig())
    assert blob is not None
    assert np.hypot(blob.u - 140.4, blob.v - 90.2) < 0.35


def test_region_limits_the_search_and_keeps_coordinates():
    image = draw_disc(60.0, 60.0, 12)
    image = draw_disc(250.0, 180.0, 6, image=image)
    whole = detect(image, BlobConfig())
    assert whole is not None
    assert whole.u == pytest.approx(60.0, abs=0.1)
    right = detect(image, BlobConfig(region=[0.5, 0.5, 1.0, 1.0]))
    assert right is not None
    np.testing.assert_allclose([right.u, right.v], [250, 180], atol=0.1)


def test_coarse_gate_loses_nothing():
    """What the gate in Lab keeps lies in the rectangle of candidates."""
    import cv2

    rng = np.random.default_rng(5)
    config = BlobConfig()
    for _ in range(30):
        colors = rng.integers(0, 256, (12, 16, 3), dtype=np.uint8)
        image = np.kron(colors, np.ones((20, 20, 1), dtype=np.uint8))
        mask = segment(cv2.cvtColor(image, cv2.COLOR_RGB2Lab), config)
        box = find_candidates(image, config)
        v, u = np.nonzero(mask)
        if len(u) == 0:
            continue
        assert box is not None
        assert u.min() >= box[0]
        assert v.min() >= box[1]
        assert u.max() < box[2]
        assert v.max() < box[3]


def test_calibration_and_its_inverse():
    box = BlobCalibration(20.0, 220.0, 40.0, 140.0)
    xy = box.normalize([[20, 40], [220, 140], [120, 90]])
    np.testing.assert_allclose(xy, [[0, 0], [1, 1], [0.5, 0.5]])
    np.testing.assert_allclose(
        box.pixels(xy), [[20, 40], [220, 140], [120, 90]]
    )


def test_calibrate_holds_the_workspace_with_a_margin():
    uv = np.array([[50, 60], [150, 60], [100, 160], [np.nan, 3], [50, 160]])
    box = calibrate(uv, margin=0.1)
    np.testing.assert_allclose(box.to_vector(), [40, 160, 50, 170])
    direct = calibrate(uv, margin=0.1, image_width=320)
    np.testing.assert_allclose(direct.to_vector(), [-0.5, 319.5, 50, 170])


def test_bad_settings_are_named():
    with pytest.raises(InputError, match="seen at 1 of 2"):
        calibrate(np.array([[np.nan, 1.0], [2.0, 3.0]]))
    for config, field in (
        (BlobConfig(color=[0.5, 0.5, 0.5]), "color"),
        (BlobConfig(region=[0.5, 0.0, 0.4, 1.0]), "region"),
        (BlobConfig(detector="guess"), "detector"),
        (BlobConfig(min_area=-1), "min_area"),
        (BlobConfig(calibration=BlobCalibration(5, 5, 0, 9)), "u_max"),
    ):
        with pytest.raises(InputError, match=f"blob.*{field}"):
            config.check("blob")


@pytest.mark.parametrize("hidden", [0.15, 0.3])
@pytest.mark.parametrize("radius", [9.0, 20.0])
def test_a_marker_hidden_in_part_is_completed(hidden, radius):
    """A round thing before it; the middle found is that of the whole."""
    rng = np.random.default_rng(2)
    errors, cut = [], []
    for _ in range(8):
        u, v = rng.uniform([100, 80], [220, 160])
        image = draw_disc(u, v, radius, squeeze=0.8)
        angle = rng.uniform(0, 2 * np.pi)
        way = np.array([np.cos(angle), np.sin(angle)])
        # The cover's edge is so far from the middle that it hides that part.
        reach = radius * (1.0 - 2.0 * hidden) * (1.0 - 0.2 * way[1] ** 2)
        cover = np.array([u, v]) + way * (reach + 2.5 * radius)
        image = draw_disc(
            *cover, 2.5 * radius, image=image, color=(212, 164, 137)
        )
        whole = detect(image, BlobConfig())
        part = detect(image, BlobConfig(complete=False))
        assert whole is not None
        assert part is not None
        errors.append(np.hypot(whole.u - u, whole.v - v))
        cut.append(np.hypot(part.u - u, part.v - v))
        assert whole.confidence < 0.95
    assert np.median(errors) < 0.35 * np.median(cut)
    assert np.median(errors) < 0.08 * radius


def test_a_whole_marker_is_left_as_it_is():
    rng = np.random.default_rng(4)
    for noise in (0.0, 6.0):
        for _ in range(5):
            u, v = rng.uniform([60, 60], [260, 180])
            image = apply_effects(
                draw_disc(u, v, rng.uniform(5, 25), squeeze=0.6),
                ImageEffects(noise=noise),
            )
            assert detect(image, BlobConfig()) == detect(
                image, BlobConfig(complete=False)
            )


SKIN = (212, 164, 137)


def draw_bar(image, u, v, angle, width, color=SKIN):
    """A straight bar through (u, v), with edges covered in part."""
    n = 4
    offset = (np.arange(n) + 0.5) / n - 0.5
    y, x = np.mgrid[: image.shape[0], : image.shape[1]]
    cover = np.zeros(image.shape[:2])
    for dy in offset:
        for dx in offset:
            across = (x + dx - u) * np.sin(angle) - (y + dy - v) * np.cos(angle)
            cover += np.abs(across) <= width / 2
    cover = cover[:, :, None] / n**2
    return np.rint(cover * np.array(color) + (1 - cover) * image).astype(
        np.uint8
    )


def barred(radius, width, count, noise, seed=0):
    """Markers with a bar anywhere across them: (truth (2,), found)."""
    rng = np.random.default_rng(seed)
    for k in range(count):
        u, v = rng.uniform([70, 60], [130, 90])
        angle = rng.uniform(0, np.pi)
        aside = rng.uniform(-0.8, 0.8) * radius
        image = draw_disc(u, v, radius, squeeze=0.75, shape=(150, 200))
        image = draw_bar(
            image,
            u - aside * np.sin(angle),
            v + aside * np.cos(angle),
            angle,
            width,
        )
        image = apply_effects(image, ImageEffects(noise=noise), time=k)
        yield np.array([u, v]), detect(image, BlobConfig())


@pytest.mark.parametrize("noise", [0.0, 3.0])
@pytest.mark.parametrize("width", [2.0, 3.0, 5.0, 8.0, 12.0])
def test_parts_beside_a_bar_are_put_together(width, noise):
    """The marker at the size in which it is seen directly: all are found."""
    for truth, blob in barred(27.0, width, 25, noise):
        assert blob is not None
        assert np.hypot(blob.u - truth[0], blob.v - truth[1]) < 0.8


@pytest.mark.parametrize("width", [2.0, 3.0, 5.0, 8.0])
def test_a_smaller_one_is_put_together_or_not_found(width):
    lost = 0
    for truth, blob in barred(15.0, width, 40, 2.0):
        if blob is None:
            lost += 1
            continue
        assert np.hypot(blob.u - truth[0], blob.v - truth[1]) < 1.0
    assert lost <= 4


def test_a_stick_through_the_middle_does_not_move_it():
    for angle in np.linspace(0, np.pi, 9):
        image = draw_disc(160.3, 120.6, 27.0, squeeze=0.75)
        image = draw_bar(image, 160.3, 120.6, angle, 4.0)
        blob = detect(image, BlobConfig())
        assert blob is not None
        assert np.hypot(blob.u - 160.3, blob.v - 120.6) < 0.3


def test_two_markers_side_by_side_are_not_one():
    for gap in (3.0, 6.0, 12.0):
        image = draw_disc(130.0, 120.0, 14.0, squeeze=0.8)
        image = draw_disc(158.0 + gap, 120.0, 13.0, squeeze=0.8, image=image)
        blob = detect(image, BlobConfig())
        assert blob is not None
        assert np.hypot(blob.u - 130.0, blob.v - 120.0) < 0.2


def test_less_than_half_of_a_marker_is_not_found():
    rng = np.random.default_rng(1)
    for _ in range(20):
        angle = rng.uniform(0, 2 * np.pi)
        image = draw_disc(160.0, 120.0, 25.0, squeeze=0.8)
        # A wide cover whose edge is beyond the middle: 15 to 35 % are seen.
        aside = -rng.uniform(0.25, 0.5) * 20.0 + 100.0
        image = draw_bar(
            image,
            160.0 - aside * np.sin(angle),
            120.0 + aside * np.cos(angle),
            angle,
            200.0,
        )
        assert detect(image, BlobConfig()) is None
        # It is there, but hardly believed.
        seen = detect(image, BlobConfig(min_confidence=0.0))
        assert seen is not None
        assert seen.confidence < 0.35


@given(st.floats(0.0, 1.0))
def test_nothing_is_found_below_the_confidence_that_is_set(least):
    image = draw_disc(60.0, 40.0, 3.0, squeeze=0.6, shape=(80, 120))
    blob = detect(image, BlobConfig(min_confidence=0.0))
    assert blob is not None
    assert 0.2 < blob.confidence < 0.9
    found = detect(image, BlobConfig(min_confidence=least))
    assert found == (blob if blob.confidence >= least else None)


@pytest.mark.parametrize(
    "image",
    [
        np.zeros((40, 60), np.uint8),
        np.zeros((40, 60, 1), np.uint8),
        np.zeros((40, 60, 2), np.uint8),
        np.zeros((40, 60, 3), np.uint16),
        np.zeros((40, 60, 3), float),
        np.zeros((40, 60, 4), np.float32),
        np.zeros((2, 40, 60, 3), np.uint8),
        [[[0, 0, 0]]],
        None,
    ],
)
def test_what_is_no_color_image_of_8_bits_is_refused(image):
    with pytest.raises(InputError, match=r"^image is .*expected an array \(h"):
        detect(image, BlobConfig())


def test_an_image_may_be_read_only_and_a_view():
    image = draw_disc(100.3, 80.7, 8)
    view = np.broadcast_to(image[::-1][::-1], image.shape)
    assert detect(view, BlobConfig()) == detect(image, BlobConfig())
