"""The study of faults, planned in a fake world."""

import pytest

from drake_affetto.common.errors import InputError
from drake_affetto.common.typed_json import to_plain
from drake_affetto.experiments.faults import run_faults
from drake_affetto.experiments.plans import FaultsPlan
from drake_affetto.experiments.results import read_study
from drake_affetto.runner.executor import TrialExecutor
from drake_affetto.runner.store import TrialStore
from support import fake_world

CATALOG = """
joints: [right_elbow_flexion]
faults:
- {kind: joint_offset, sizes: [0.2, 0.3, 1.0]}
- {kind: supply_lost}
"""


def in_fake_world(path, catalog, repeats=8):
    plan = FaultsPlan(
        repeats=repeats, demonstrations=5, catalog=str(catalog), seed=3
    )
    with (
        TrialStore(path) as store,
        TrialExecutor(fake_world.run, store, workers=0, quiet=True) as executor,
    ):
        return run_faults(executor, plan), executor.reused


@pytest.fixture
def catalog(tmp_path):
    file = tmp_path / "mine.yaml"
    file.write_text(CATALOG)
    return file


def test_what_happened_is_counted(tmp_path, catalog):
    results, _ = in_fake_world(tmp_path / "trials.sqlite", catalog)
    rows = {(row.kind, row.size): row for row in results.rows}
    other = rows["joint_offset", 0.2]
    # Heard, but not hit: a success only where nobody noticed.
    assert other.trials == other.false_success + other.detected == 8
    assert other.success == 0 < other.false_success
    silent = rows["joint_offset", 0.3]
    assert silent.harmed == 8
    assert silent.missed == 8 - silent.detected > 0
    sure = rows["joint_offset", 1.0]
    assert (sure.detected, sure.detection_time) == (8, 0.5)
    assert sure.reasons == {"angle reading jumps": 8}
    assert rows["supply_lost", None].unit == ""
    assert results.faulted == results.sound.trials == 32
    assert results.false_success == other.false_success
    assert results.missed == silent.missed
    assert results.false_alarms == results.sound.false_alarms == 0
    # One row at size 1, and the supply's.
    assert results.beyond_limit == 16
    assert results.sound.success.mean == 1.0
    plain = to_plain(results)
    assert read_study("faults", plain, "x: ") == results
    with pytest.raises(InputError, match="faulted is 7, expected 32"):
        read_study("faults", plain | {"faulted": 7}, "x: ")


def test_more_repeats_keep_the_trials_of_fewer(tmp_path, catalog):
    path = tmp_path / "trials.sqlite"
    first, _ = in_fake_world(path, catalog, repeats=2)
    again, reused = in_fake_world(path, catalog, repeats=2)
    assert again == first
    # The skill's demonstrations, and 2 * 4 pairs.
    assert reused >= 5 + 16
