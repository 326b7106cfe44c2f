"""`affetto teach`: what it tells."""

import io

import numpy as np
from rich.console import Console

from drake_affetto.cli.teach import print_outcomes
from drake_affetto.experiments.results import DemonstrationResult


def test_a_drum_that_is_not_seen_is_reported():
    buffer = io.StringIO()
    nothing = np.zeros(0)
    unseen = DemonstrationResult(
        *([0.2, 0.0], False, [0.0, 0.0], 0, False, 0.0, 0.0),
        *(nothing, nothing, nothing),
    )
    print_outcomes([unseen], Console(file=buffer, width=100))
    assert "drum not seen" in buffer.getvalue()
    print_outcomes([], Console(file=buffer, width=100))
