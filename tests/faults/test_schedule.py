"""What the faults of a trial do at one time."""

import numpy as np
import pytest

from drake_affetto.faults.config import Fault
from drake_affetto.faults.schedule import SUPPLY_FALL, FaultSchedule
from drake_affetto.pneumatics.conditions import Condition
from drake_affetto.sensing.readings import ReadingFault

JOINTS = ("shoulder", "elbow")
NEVER = float("inf")
ZEROS = np.array([-1.0, -2.0])
EXHAUST = np.array([1e-10, 2e-10])


def schedule(*faults, seed=3):
    return FaultSchedule(faults, JOINTS, seed, begin=10.0)


def elbow(kind, size=1.0, channel="", **more):
    return Fault(kind=kind, size=size, joint="elbow", channel=channel, **more)


def test_nothing_is_wrong_before_and_after():
    faults = schedule(
        elbow("joint_offset", 0.3, onset=1.0, length=0.5),
        elbow("chamber_leak", 1.0, "a", onset=1.0, length=0.5),
        Fault(kind="ticks_late", size=0.1, onset=1.0, length=0.5),
        Fault(kind="camera_frozen", onset=1.0, length=0.5),
    )
    well = FaultSchedule((), JOINTS)
    for time, same in ((10.9, True), (11.2, False), (11.6, True)):
        for name, more in (
            ("readings", (5, ZEROS)),
            ("valves", (EXHAUST, 5e5)),
            ("ticks", (5,)),
            ("camera", ()),
        ):
            found = getattr(faults, name)(time, NEVER, *more)
            usual = getattr(well, name)(time, NEVER, *more)
            equal = [
                np.array_equal(a, b, equal_nan=True)
                for a, b in zip(
                    found if isinstance(found, tuple) else (found,),
                    usual if isinstance(usual, tuple) else (usual,),
                    strict=True,
                )
            ]
            assert all(equal) == same, name


def test_sensor_faults_are_of_their_channel_alone():
    faults = schedule(
        elbow("joint_offset", 0.25), elbow("pressure_stuck", channel="b")
    )
    found = faults.readings(10.0, NEVER, 0, ZEROS)
    # [q (2), p_a (2), p_b (2)]
    assert np.flatnonzero(found[ReadingFault.ADDED]).tolist() == [1]
    assert abs(found[ReadingFault.ADDED, 1]) == 0.25
    assert np.flatnonzero(found[ReadingFault.STUCK]).tolist() == [5]


@pytest.mark.parametrize("share", [0.1, 0.6])
def test_so_many_samples_are_lost(share):
    faults = schedule(elbow("joint_dropouts", share))
    forced = np.array(
        [
            faults.readings(10.0, NEVER, k, ZEROS)[ReadingFault.FORCED, 1]
            for k in range(600)
        ]
    )
    assert set(forced[np.isfinite(forced)]) == {-2.0}
    assert np.isfinite(forced).mean() == pytest.approx(share, abs=0.08)


def test_what_is_random_belongs_to_seed_and_sample():
    noise = elbow("joint_noise", 0.1)

    def at(tick, seed):
        return schedule(noise, seed=seed).readings(10.0, NEVER, tick, ZEROS)[
            ReadingFault.ADDED, 1
        ]

    assert at(4, 3) == at(4, 3)
    assert len({at(4, 3), at(5, 3), at(4, 8)}) == 3


def test_valves_and_chambers():
    faults = schedule(
        elbow("valve_stuck_open", 0.4, "a"),
        elbow("valve_sluggish", 5.0, "b"),
        elbow("chamber_leak", 0.5, "b"),
        Fault(kind="valve_stuck_closed", joint="shoulder", channel="b"),
    )
    found, supply = faults.valves(10.0, NEVER, EXHAUST, 5e5)
    assert found[Condition.FORCED].tolist() == [0.0, 1.0, 2.0, 0.0]
    assert found[Condition.SPOOL, 1] == 0.4
    assert found[Condition.LAG].tolist() == [1.0, 1.0, 1.0, 5.0]
    assert found[Condition.LEAK].tolist() == [0.0, 0.0, 0.0, 1e-10]
    assert supply == 0.0


def test_the_supply_falls_as_a_tank_does_and_comes_back():
    faults = schedule(Fault(kind="supply_sag", size=0.5, onset=1.0, length=2.0))
    times = np.linspace(10.0, 16.0, 200)
    lost = [-faults.valves(t, NEVER, EXHAUST, 4e5)[1] for t in times]
    assert max(lost) == pytest.approx(2e5, rel=1e-3)
    assert np.all(np.abs(np.diff(lost)) < 2e5 * 0.05 / SUPPLY_FALL)
    assert lost[0] == 0.0
    assert lost[-1] < 1e-3 * 2e5
    gone = schedule(Fault(kind="supply_lost"), Fault(kind="supply_lost"))
    assert gone.valves(20.0, NEVER, EXHAUST, 4e5)[1] == pytest.approx(-4e5)
