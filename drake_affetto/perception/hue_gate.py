"""Which colors have the marker's hue: an angle in CIE Lab."""

import functools
import math

import cv2
import numpy as np

from drake_affetto.common.typing import Image


def marker_lab(color: list[float]) -> tuple[float, float, float]:
    """(lightness, chroma, hue [rad]) of a color, in OpenCV's 8-bit Lab."""
    rgb = np.array([[color]], dtype=float)
    pixel = np.rint(255 * rgb).astype(np.uint8)
    lab = cv2.cvtColor(pixel, cv2.COLOR_RGB2Lab)[0, 0].astype(float)
    a, b = lab[1] - 128.0, lab[2] - 128.0
    return float(lab[0]), math.hypot(a, b), math.atan2(b, a)


@functools.lru_cache(maxsize=32)
def gate(
    color: tuple[float, ...], hue_tolerance: float, chroma: float
) -> Image:
    """Table (256 · 256,) over (a, b): 255 where a color may be the marker."""
    _, marker_chroma, marker_hue = marker_lab(list(color))
    a, b = np.meshgrid(
        np.arange(256) - 128.0, np.arange(256) - 128.0, indexing="ij"
    )
    difference = np.arctan2(b, a) - marker_hue
    difference = np.abs((difference + np.pi) % (2 * np.pi) - np.pi)
    inside = (difference <= math.radians(hue_tolerance)) & (
        np.hypot(a, b) >= chroma * marker_chroma
    )
    return np.where(inside, 255, 0).astype(np.uint8).ravel()


@functools.lru_cache(maxsize=32)
def coarse_gate(
    color: tuple[float, ...], hue_tolerance: float, chroma: float
) -> tuple[tuple[Image, Image], ...]:
    """Boxes of OpenCV's HSV that hold all that passes the gate in Lab.

    HSV takes a quarter of the time of Lab; it says where Lab is worth it.
    """
    level = np.append(np.arange(0, 256, 6), 255).astype(np.uint8)
    rgb = np.stack(np.meshgrid(level, level, level), axis=-1).reshape(1, -1, 3)
    lab = cv2.cvtColor(rgb, cv2.COLOR_RGB2Lab)[0].astype(int)
    inside = gate(color, hue_tolerance, chroma)[256 * lab[:, 1] + lab[:, 2]]
    hsv = cv2.cvtColor(rgb, cv2.COLOR_RGB2HSV)[0][inside > 0].astype(int)
    pixel = np.rint(255 * np.array([[color]])).astype(np.uint8)
    middle = int(cv2.cvtColor(pixel, cv2.COLOR_RGB2HSV)[0, 0, 0])
    difference = (hsv[:, 0] - middle + 90) % 180 - 90
    low = middle + difference.min() - 2
    high = middle + difference.max() + 2
    saturation = max(0, hsv[:, 1].min() - 6)
    value = max(0, hsv[:, 2].min() - 6)
    ranges = [(max(low, 0), min(high, 179))]
    if low < 0:
        ranges.append((low + 180, 179))
    if high > 179:
        ranges.append((0, high - 180))
    return tuple(
        (
            np.array([a, saturation, value], dtype=float),
            np.array([b, 255, 255], dtype=float),
        )
        for a, b in ranges
    )
