"""Faults as a scenario lists them: what is taken, and what is refused."""

import pytest

from drake_affetto.common.errors import InputError
from drake_affetto.faults.config import KINDS, Fault

JOINTS = ["waist_yaw", "right_elbow_flexion"]


def fitting(kind):
    place = KINDS[kind].place
    return Fault(
        kind=kind,
        size=KINDS[kind].low,
        joint="waist_yaw" if place in ("joint", "chamber") else "",
        channel="b" if place == "chamber" else "",
    )


@pytest.mark.parametrize("kind", KINDS)
def test_every_kind_of_fault_can_be_listed(kind):
    fitting(kind).check("faults[0]", JOINTS)


@pytest.mark.parametrize(
    ("fields", "message"),
    [
        ({"kind": "gremlin"}, "kind is 'gremlin', expected one of joint_stuck"),
        ({"joint": "tail"}, "joint is 'tail', expected one of the active"),
        ({"joint": ""}, "joint is '', expected one of the active joints"),
        ({"size": -0.1}, r"size \(rad\) is -0.1, expected a number from 0"),
        ({"size": float("nan")}, r"size \(rad\) is nan"),
        ({"onset": -1.0}, "onset is -1.0, expected a number from 0"),
        ({"length": 0.0}, "length is 0.0"),
        ({"channel": "a"}, "channel is 'a', expected none"),
        ({"since": "birth"}, "since is 'birth'"),
        (
            {"kind": "valve_stuck_closed", "size": 1.0},
            "channel is '', expected chamber 'a' or 'b'",
        ),
        ({"kind": "valve_stuck_closed", "size": 2.0}, "size is 2.0"),
        (
            {"kind": "supply_lost", "size": 1.0},
            "joint is 'waist_yaw', expected none",
        ),
    ],
)
def test_what_cannot_be_is_told_in_one_line(fields, message):
    given = {"kind": "joint_offset", "size": 0.1, "joint": "waist_yaw"}
    with pytest.raises(InputError, match=message) as caught:
        Fault(**given | fields).check("s.faults[3]", JOINTS)
    assert str(caught.value).startswith("s.faults[3].")
    assert "\n" not in str(caught.value)


def test_an_onset_after_the_trial_is_allowed():
    Fault(kind="supply_lost", onset=1e4).check("faults[0]", JOINTS)


def test_a_fault_of_the_movement_waits_for_it():
    fault = Fault(kind="supply_lost", onset=0.5, length=1.0, since="movement")
    assert fault.span(2.0, 7.0) == (7.5, 8.5)
    assert fault.span(2.0, float("inf"))[0] == float("inf")
    # Before a trial begins there are no faults.
    assert fault.span(float("inf"), 7.0)[0] == float("inf")
