"""Charts of the schemes of transfer."""

import numpy as np

from drake_affetto.report.charts.transfer import transfer_map
from support import report_data
from support.report_page import typed


def test_map_keeps_the_grid_together():
    grid = typed(report_data.mirror()).map
    before, after = transfer_map(grid)
    lines = [np.array(before.figure.data[k].x, dtype=float) for k in (0, 1)]
    assert [np.isnan(line).sum() for line in lines] == [11, 11]
    # Corner A is the grid's first point, on both sides.
    assert before.figure.data[2].x[0] == grid.input[0][0]
    assert after.figure.data[2].x[0] == grid.output[0][0]
    assert after.figure.data[3].y[2] == grid.taught_output[2][1]
