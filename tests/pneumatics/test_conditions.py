"""What faults of valves, chambers and supply do to the air."""

import numpy as np
import pytest

from drake_affetto.pneumatics.conditions import (
    CONDITION_ROWS,
    REST,
    VENT,
    Condition,
)
from support.actuator_bench import (
    ATMOSPHERE,
    SUPPLY,
    Actuators,
    closed,
    make_parameters,
)


def well():
    conditions = np.zeros((CONDITION_ROWS, 2))
    conditions[Condition.LAG] = 1.0
    return conditions


def pressures(conditions, command=0.0, seconds=3.0, action=0):
    bench = Actuators(closed(make_parameters()), 3e5, h=0.0025)
    bench.conditions = None if conditions is None else conditions.ravel()
    bench.action = action
    course = [bench.step(command, 0.0) for _ in range(int(seconds / 0.0025))]
    return np.array(course)


def test_conditions_that_are_well_change_nothing():
    for command in (0.3, -1.0):
        assert np.array_equal(
            pressures(well(), command, 0.3), pressures(None, command, 0.3)
        )


def test_a_valve_that_is_stuck_does_not_hear_the_command():
    stuck = well()
    stuck[Condition.FORCED, 0] = 1.0
    stuck[Condition.SPOOL, 0] = 1.0
    found = pressures(stuck, command=-1.0)
    # Chamber a fills all the same; b does as it is told.
    assert found[-1] == pytest.approx([SUPPLY, SUPPLY], rel=1e-3)
    shut = well()
    shut[Condition.FORCED, 0] = 2.0
    found = pressures(shut, command=1.0)
    assert found[:, 0] == pytest.approx(3e5, rel=1e-9)
    assert found[-1, 1] == pytest.approx(ATMOSPHERE, rel=1e-2)


def test_a_sluggish_valve_is_late():
    slow = well()
    slow[Condition.LAG, 0] = 20.0
    usual, late = (pressures(c, 1.0, 0.3)[:, 0] for c in (None, slow))
    assert np.all(late[10:] < usual[10:])
    assert late[-1] > 3.5e5


def test_a_leak_empties_a_closed_chamber():
    leak = well()
    leak[Condition.LEAK, 1] = 1e-9
    found = pressures(leak)
    assert found[:, 0] == pytest.approx(3e5, rel=1e-9)
    assert np.all(np.diff(found[:, 1]) <= 0.0)
    assert found[-1, 1] < 1.2e5


def test_above_the_command_stands_the_supervisor():
    assert pressures(None, 1.0, action=VENT)[-1] == pytest.approx(
        [ATMOSPHERE] * 2, rel=1e-2
    )
    resting = pressures(None, 1.0, action=REST)
    assert resting == pytest.approx(3e5, rel=1e-6)
