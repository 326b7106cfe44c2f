"""Faults and supervisor in the station, and in a scenario."""

import dataclasses

import numpy as np
from pydrake.systems.analysis import Simulator
import pytest

from drake_affetto.common.errors import InputError
from drake_affetto.faults.config import Fault
from drake_affetto.faults.images import HUE_AREA, MEAN
from drake_affetto.faults.supervisor import Verdict
from drake_affetto.station.content import content_of
from drake_affetto.station.scenario import load_scenario
from drake_affetto.station.station import AffettoStation

XY = [0.25, -0.1]


@pytest.fixture(scope="module")
def station():
    return AffettoStation(load_scenario("supervised"))


def begun(station, *faults, seed=4):
    """A simulator of the station at the beginning of a trial with faults."""
    simulator = Simulator(station, station.CreateDefaultContext())
    context = simulator.get_mutable_context()
    station.set_drum_position(context, XY)
    station.faults.begin(context, faults, seed, XY)
    return simulator, context


def run(station, *faults, end=0.5):
    simulator, context = begun(station, *faults)
    station.faults.watch(context, True)
    simulator.AdvanceTo(end)
    return context


def elbow(kind, size=1.0, channel="", onset=0.2):
    return Fault(
        kind=kind,
        size=size,
        joint="right_elbow_flexion",
        channel=channel,
        onset=onset,
    )


def test_without_faults_nothing_is_added():
    plain = AffettoStation(load_scenario("drumming"))
    names = {system.get_name() for system in plain.GetSystems()}
    assert plain.faults is None
    assert not names & {"fault_source", "supervisor", "command_link"}


def test_a_sound_robot_is_passed(station):
    context = run(station, end=0.6)
    assert station.faults.verdict(context) == Verdict()
    scores = station.faults.scores(context)
    assert 0.0 < scores.max() < 1.0


def test_readings_and_valves_are_what_the_faults_make_of_them(station):
    q, p = "affetto.estimated_state", "affetto.chamber_pressure"
    usual = run(station)
    off = run(station, elbow("joint_offset", 0.2))
    i = station.joints.names.index("right_elbow_flexion")

    def read(context, port):
        return station.GetOutputPort(port).Eval(context)

    # It is noticed before the controller moves the joint for it.
    true = "affetto.joint_state"
    assert abs(read(off, true)[i] - read(usual, true)[i]) < 0.02
    assert abs(read(off, q)[i] - read(off, true)[i]) == pytest.approx(
        0.2, abs=0.02
    )
    assert station.faults.verdict(off).reason == (
        "angle reading jumps (right_elbow_flexion)"
    )
    assert station.faults.verdict(off).time == pytest.approx(0.2, abs=0.011)
    lost = run(station, Fault(kind="supply_lost", onset=0.1), end=1.0)
    assert read(lost, p).max() < read(usual, p).max()
    leak = run(station, elbow("chamber_leak", 1.0, "a"))
    assert read(leak, p)[i] < read(usual, p)[i] - 10e3


def test_the_valves_rest_once_it_is_not_passed(station):
    action = station.faults.supervisor.get_valve_action_output_port()

    def told(context):
        return action.Eval(
            station.faults.supervisor.GetMyContextFromRoot(context)
        )[0]

    assert told(run(station)) == 0.0
    stuck = run(station, elbow("joint_stuck", onset=0.0), end=0.5)
    assert told(stuck) == station.scenario.supervisor.action
    assert "does not change" in station.faults.verdict(stuck).reason


@pytest.mark.parametrize(
    ("kind", "size"),
    [
        ("camera_dark", 4.0),
        ("marker_hidden", 0.7),
        ("second_marker", 2.0),
        ("camera_frozen", 1.0),
    ],
)
def test_images_are_what_the_faults_make_of_them(station, kind, size):
    def statistics(*faults, seed=4):
        simulator, context = begun(station, *faults, seed=seed)
        # The camera looks at the drum from here.
        posture = station.start_posture.copy()
        posture[station.joints.names.index("waist_yaw")] = -0.35
        station.set_posture(context, posture)
        station.faults.apply(context)
        simulator.AdvanceTo(0.01)
        port = station.faults.camera_faults.get_statistics_output_port()
        mine = station.faults.camera_faults.GetMyContextFromRoot(context)
        before = np.array(port.Eval(mine))
        simulator.AdvanceTo(0.11)
        return before, np.array(port.Eval(mine))

    usual, later = statistics()
    assert not np.array_equal(usual, later)
    found, again = statistics(Fault(kind=kind, size=size))
    assert usual[HUE_AREA] > 100.0
    if kind == "camera_frozen":
        assert np.array_equal(found, again)
    elif kind == "camera_dark":
        assert found[MEAN] < 0.5 * usual[MEAN]
    elif kind == "marker_hidden":
        assert found[HUE_AREA] < 0.6 * usual[HUE_AREA]
    else:
        # Where it lies is drawn: not always in view.
        more = [
            statistics(Fault(kind=kind, size=size), seed=seed)[0][HUE_AREA]
            for seed in range(4)
        ]
        assert max(more) > 1.5 * usual[HUE_AREA]


def test_the_scene_changes_and_is_put_right_again(station):
    moved = Fault(kind="drum_moved", size=0.05, onset=0.1)
    hand = Fault(kind="hand_lost", onset=0.1)
    simulator, context = begun(station, moved, hand)
    wiring = station.faults
    assert wiring.next_change(context, 1.0) == pytest.approx(0.1)
    assert wiring.next_change(context, 0.05) == 0.05
    simulator.AdvanceTo(0.1)
    wiring.apply(context)
    place = station.drum_position(context)
    assert np.linalg.norm(place - XY) == pytest.approx(0.05)
    assert wiring._filter is not None
    wiring.begin(context, (), 4, XY)
    assert wiring._filter is None


def scenario(**more):
    return dataclasses.replace(load_scenario("drumming"), **more)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (
            {"faults": [Fault(kind="joint_offset", joint="tail")]},
            r"s\.faults\[0\]\.joint is 'tail'",
        ),
        (
            {"faults": [elbow("joint_offset", -0.2)]},
            r"s\.faults\[0\]\.size \(rad\) is -0.2",
        ),
        (
            {"faults": [elbow("pressure_offset", 1e4, "c")]},
            r"s\.faults\[0\]\.channel is 'c', expected chamber 'a' or 'b'",
        ),
    ],
)
def test_a_fault_that_cannot_be_is_told_at_load(change, message):
    with pytest.raises(InputError, match=message):
        scenario(**change).check("s")


def test_faults_need_sensors_that_can_fail():
    usual = load_scenario("drumming")
    calm = dataclasses.replace(usual.variation, enabled=False)
    with pytest.raises(InputError, match=r"variation\.enabled is False"):
        scenario(faults=[elbow("joint_stuck")], variation=calm).check("s")


def test_only_faults_and_supervisor_change_a_scenarios_content():
    plain = content_of(scenario())[0]
    assert content_of(scenario(faults=[elbow("joint_stuck")]))[0] != plain
    supervised = load_scenario("supervised")
    assert content_of(supervised)[0] != plain
    off = dataclasses.replace(supervised.supervisor, enabled=False)
    again = dataclasses.replace(supervised, supervisor=off)
    assert content_of(again)[0] == plain
