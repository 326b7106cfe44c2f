"""The catalog of faults that a study injects."""

import numpy as np
import pytest

from drake_affetto.common.errors import InputError
from drake_affetto.experiments.fault_catalog import load_catalog
from drake_affetto.faults.config import KINDS


def test_the_catalog_of_the_package_has_every_kind_of_fault():
    catalog = load_catalog()
    assert {sweep.kind for sweep in catalog.faults} == set(KINDS)
    for number, size in catalog.cells:
        sweep = catalog.faults[number]
        faults = [
            sweep.draw(size, catalog.joints, np.random.default_rng(seed))
            for seed in range(20)
        ]
        low, high = sweep.span
        assert all(low <= fault.onset <= high for fault in faults)
        assert {fault.size for fault in faults} == {size}
        of_joint = KINDS[sweep.kind].place in ("joint", "chamber")
        assert (len({fault.joint for fault in faults}) > 1) == of_joint


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("{joints: [a], faults: []}", r"faults is \[\]"),
        ("{joints: [], faults: [{kind: supply_lost}]}", r"joints is \[\]"),
        ("{joints: [a], faults: [{kind: x}]}", r"faults\[0\]\.kind is 'x'"),
        (
            "{joints: [a], faults: [{kind: supply_sag, sizes: [2.0]}]}",
            r"size \(share\) is 2.0",
        ),
        (
            "{joints: [a], faults: [{kind: supply_lost, span: [2, 1]}]}",
            r"faults\[0\]\.span is",
        ),
    ],
)
def test_what_does_not_fit_is_named(tmp_path, text, message):
    file = tmp_path / "mine.yaml"
    file.write_text(text)
    with pytest.raises(InputError, match=message):
        load_catalog(str(file))
