"""Colors that all eyes can tell apart."""

import json
import re

import numpy as np
import pytest

from drake_affetto.report import wording
from drake_affetto.report.charts.conditions import (
    condition_charts,
    scenario_dots,
)
from drake_affetto.report.charts.transfer import (
    rewards_by_scheme,
    success_by_scheme,
)
from drake_affetto.report.style import DARK, LIGHT, SYMBOLS
from support import report_data
from support.report_page import compare, typed


def luminance(color):
    channels = [int(color[i : i + 2], 16) / 255 for i in (1, 3, 5)]
    linear = [
        c / 12.92 if c <= 0.04045 else ((c + 0.055) / 1.055) ** 2.4
        for c in channels
    ]
    return np.array(linear)


def contrast(first, second):
    """As the W3C's guidelines define it."""
    weights = np.array([0.2126, 0.7152, 0.0722])
    a, b = (float(weights @ luminance(c)) + 0.05 for c in (first, second))
    return max(a, b) / min(a, b)


@pytest.mark.parametrize("palette", [LIGHT, DARK])
def test_colors_stand_out_from_the_page(palette):
    for name in ("ink", "muted", "paper"):
        assert contrast(palette[name], palette["surface"]) >= 4.5, name
    for name in (*SYMBOLS, "other_scheme", "hit", "miss", "plus"):
        assert contrast(palette[name], palette["surface"]) >= 3.0, name
    for name in ("pale_plus", "pale_minus"):
        assert contrast(palette[name], palette["ink"]) >= 4.5, name


# Vienot, Brettel and Mollon (1999): linear RGB as red- and green-blind eyes
# have it.
BLIND = {
    "none": np.eye(3),
    "red": np.array(
        [[0.11238, 0.88762, 0], [0.11238, 0.88762, 0], [0.00401, -0.00401, 1]]
    ),
    "green": np.array(
        [[0.29275, 0.70725, 0], [0.29275, 0.70725, 0], [-0.02234, 0.02234, 1]]
    ),
}


def lab(linear):
    to_xyz = np.array(
        [
            [0.4124, 0.3576, 0.1805],
            [0.2126, 0.7152, 0.0722],
            [0.0193, 0.1192, 0.9505],
        ]
    )
    xyz = to_xyz @ linear / (to_xyz @ np.ones(3))
    x, y, z = np.cbrt(np.maximum(xyz, 0.0))
    return np.array([116 * y - 16, 500 * (x - y), 200 * (y - z)])


@pytest.mark.parametrize("palette", [LIGHT, DARK])
@pytest.mark.parametrize("eyes", BLIND)
def test_schemes_differ_for_all_eyes(palette, eyes):
    seen = {
        name: lab(BLIND[eyes] @ luminance(palette[name])) for name in SYMBOLS
    }
    names = list(seen)
    for i, a in enumerate(names):
        for b in names[i + 1 :]:
            distance = np.linalg.norm(seen[a] - seen[b])
            assert distance > 12.0, (a, b, distance)
    assert len(set(SYMBOLS.values())) == len(SYMBOLS)


def test_every_color_has_one_for_the_dark(whole):
    assert LIGHT.keys() == DARK.keys()
    assert len(set(LIGHT.values())) == len(LIGHT)
    made = whole.read_text(encoding="utf-8")
    text = re.search(r'id="figures">(.*?)</script>', made)[1]
    drawn = json.loads(text)
    assert len(drawn) >= 18
    for key, figure in drawn.items():
        used = set(re.findall(r"#[0-9a-fA-F]{3,8}\b", figure))
        assert used <= set(LIGHT.values()), key
        assert not re.search(r"rgb\(", figure), key


def test_schemes_keep_their_color():
    found = compare("transfer")
    for chart in (
        success_by_scheme(found),
        rewards_by_scheme(found),
        scenario_dots({"mirror": found}),
        *condition_charts(typed(report_data.conditions()).conditions),
    ):
        named = {t.name: t.marker.color for t in chart.figure.data if t.name}
        for name, color in named.items():
            (scheme,) = [
                k for k in wording.SCHEMES if wording.scheme(k) == name
            ]
            assert color == LIGHT[scheme], chart.key
