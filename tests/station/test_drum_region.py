"""The drum's region: a box or a polygon, finite and with an area."""

from hypothesis import given
from hypothesis import strategies as st
import numpy as np
import pytest

from drake_affetto.common.errors import InputError
from drake_affetto.station.drum_region import DrumRegion

COORDINATES = st.floats(-1.0, 1.0)


@given(COORDINATES, COORDINATES, st.floats(0.02, 1.0), st.floats(0.02, 1.0))
def test_a_box_is_the_polygon_of_its_corners(x, y, width, height):
    box = DrumRegion(x=[x, x + width], y=[y, y + height])
    box.check("s")
    polygon = DrumRegion(polygon=box.corners.tolist())
    polygon.check("s")
    np.testing.assert_allclose(box.middle, [x + width / 2, y + height / 2])
    np.testing.assert_allclose(polygon.middle, box.middle, atol=1e-9)
    for region in (box, polygon):
        assert region.contains(box.middle)
        assert region.contains(box.corners).all()
        assert not region.contains(box.middle + [width, 0.0])


@pytest.mark.parametrize(
    ("values", "told"),
    [
        ({"x": [0.3, 0.2]}, r"s\.x is \[0\.3, 0\.2\], expected a lower"),
        ({"y": [0.2]}, r"s\.y is \[0\.2\]"),
        ({"x": [0.2, float("inf")]}, r"s\.x\[1\] is inf"),
        ({"y": [float("nan"), 0.2]}, r"s\.y\[0\] is nan"),
        ({"x": [-1e9, 0.2]}, r"s\.x\[0\] is -1000000000"),
        ({"polygon": [[0, 0], [1, 0]]}, r"s\.polygon is .*three corners"),
        ({"polygon": [[0, 0], [1, 0], [0]]}, r"s\.polygon\[2\]"),
        ({"polygon": [[0, 0], [1, 0], [float("nan"), 1]]}, r"s\.polygon\[2\]"),
        ({"polygon": [[0, 0], [1, 0], [1e308, 1]]}, r"s\.polygon\[2\]\[0\]"),
        ({"polygon": [[0, 0], [1, 1], [1, 0], [0, 1]]}, "three corners"),
        ({"polygon": [[0, 0], [1e-3, 0], [0, 1e-3]]}, "at least 1 cm²"),
    ],
)
def test_what_is_no_region_is_named(values, told):
    with pytest.raises(InputError, match=told):
        DrumRegion(**values).check("s")
