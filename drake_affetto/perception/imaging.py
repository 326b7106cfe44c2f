"""What a real sensor does to an ideal image: exposure, color, blur, noise.

Images are uint8 arrays (height, width, 3) in RGB.
"""

import dataclasses
import math

import cv2
import numpy as np

from drake_affetto.common.typing import Array, Image

# The encoding that display images have, for gains that act on light.
_GAMMA = 2.2
# A bank of normal deviates, read from a random place for each image: drawing
# as many anew for each image would take longer than rendering it.
_BANK_SIZE = 1 << 20


@dataclasses.dataclass
class ImageEffects:
    """Disturbances of one image.

    Attributes:
        exposure: gain of the light in stops (factors of two).
        white_balance: gains of the light in red, green and blue.
        noise: standard deviation of a pixel's noise, in levels of 0 … 255.
        motion_blur: way (u, v) [pixels] that the image moves while exposed.
    """

    exposure: float = 0.0
    white_balance: list[float] = dataclasses.field(
        default_factory=lambda: [1.0, 1.0, 1.0]
    )
    noise: float = 0.0
    motion_blur: list[float] = dataclasses.field(
        default_factory=lambda: [0.0, 0.0]
    )

    def to_vector(self) -> Array:
        """The seven numbers (7,) that a context keeps as a parameter."""
        return np.array(
            [
                self.exposure,
                *self.white_balance,
                self.noise,
                *self.motion_blur,
            ],
            dtype=float,
        )

    @classmethod
    def from_vector(cls, vector: Array) -> "ImageEffects":
        """The inverse of `to_vector`.

        Args:
            vector: As `to_vector` gives it.
        """
        v = [float(number) for number in vector]
        return cls(v[0], v[1:4], v[4], v[5:7])


def gain_tables(exposure: float, white_balance: list[float]) -> Image:
    """Look-up tables (256, 3) of uint8 for a gain of the light."""
    light = (np.arange(256) / 255.0) ** _GAMMA
    gains = 2.0**exposure * np.asarray(white_balance, dtype=float)
    encoded = 255.0 * (light[:, None] * gains) ** (1.0 / _GAMMA)
    return np.clip(np.rint(encoded), 0, 255).astype(np.uint8)


def motion_blur_kernel(way: list[float]) -> Image | None:
    """Kernel of a straight blur along `way` (u, v) [pixels]; None if short."""
    length = math.hypot(*way)
    if length < 0.5:
        return None
    reach = math.ceil(0.5 * length) + 1
    size = 2 * reach + 1
    kernel = np.zeros((size, size), dtype=np.float32)
    # Points along the way, each shared among its four neighbors.
    for s in np.linspace(-0.5, 0.5, max(9, 4 * size)):
        u, v = reach + s * way[0], reach + s * way[1]
        i, j = math.floor(v), math.floor(u)
        a, b = v - i, u - j
        kernel[i, j] += (1 - a) * (1 - b)
        kernel[i, j + 1] += (1 - a) * b
        kernel[i + 1, j] += a * (1 - b)
        kernel[i + 1, j + 1] += a * b
    return kernel / kernel.sum()


class NoiseBank:
    """Reproducible pixel noise: the same (seed, time) gives the same noise."""

    def __init__(self) -> None:
        self._bank: Image | None = None

    def add(self, image: Image, sd: float, seed: int, time: float) -> Image:
        """A copy of `image` with normal noise of `sd` levels added."""
        if self._bank is None:
            rng = np.random.default_rng(20180521)
            self._bank = rng.standard_normal(_BANK_SIZE, dtype=np.float32)
        rng = np.random.default_rng([seed, round(time * 1e6)])
        size = image.size
        count = -(-size // (_BANK_SIZE // 4)) + 1
        pieces = []
        step = -(-size // count)
        for start in rng.integers(0, _BANK_SIZE - step, count):
            pieces.append(self._bank[start : start + step])
        noise = np.concatenate(pieces)[:size].reshape(image.shape)
        levels = np.rint(noise * np.float32(sd)).astype(np.int16)
        return cv2.add(image, levels, dtype=cv2.CV_8U)


def apply_effects(
    image: Image,
    effects: ImageEffects,
    noise_bank: NoiseBank | None = None,
    seed: int = 0,
    time: float = 0.0,
) -> Image:
    """The image that a sensor with these `effects` gives; may be `image`."""
    kernel = motion_blur_kernel(effects.motion_blur)
    if kernel is not None:
        image = cv2.filter2D(image, -1, kernel, borderType=cv2.BORDER_REPLICATE)
    if effects.exposure != 0.0 or any(g != 1.0 for g in effects.white_balance):
        tables = gain_tables(effects.exposure, effects.white_balance)
        image = cv2.LUT(image, tables.reshape(1, 256, 3))
    if effects.noise > 0.0:
        bank = noise_bank if noise_bank is not None else NoiseBank()
        image = bank.add(image, effects.noise, seed, time)
    return image


def composite_mirror(
    image: Image,
    reflection: Image,
    mask: Image,
    tint: list[float],
    blur: float,
) -> None:
    """Pastes a mirror's `reflection` where `mask` is nonzero, in place.

    Args:
        image: the part (h, w, 3) of the true view that holds the mirror.
        reflection: what the virtual camera sees there, already flipped.
        mask: uint8 (h, w), nonzero where the mirror's face is seen.
        tint: reflectance in red, green and blue.
        blur: standard deviation [pixels] of the reflection's blur; 0 for a
            perfect mirror.
    """
    if blur > 0.0:
        reflection = cv2.GaussianBlur(
            reflection, (0, 0), blur, borderType=cv2.BORDER_REPLICATE
        )
    if any(value != 1.0 for value in tint):
        tables = gain_tables(0.0, tint)
        reflection = cv2.LUT(reflection, tables.reshape(1, 256, 3))
    cv2.copyTo(reflection, mask, image)
