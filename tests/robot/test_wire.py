"""Packets: scales, signs, order, and what is no packet."""

import dataclasses

from hypothesis import given, strategies
import numpy as np
import pytest

from drake_affetto.common.errors import InputError
from drake_affetto.robot.controller import load_robot_controller
from drake_affetto.robot.wire import (
    PacketCodec,
    PacketError,
    RobotWire,
    WireJoint,
    load_wire,
)

WIRE = load_wire()
CODEC = PacketCodec(WIRE)
N = len(WIRE.joints)
GOOD = " ".join(["7"] * 2 * N).encode()


def pressures(low, high):
    numbers = strategies.floats(low, high)
    return strategies.lists(numbers, min_size=2 * N, max_size=2 * N)


def test_the_wire_has_the_robots_joints_and_ranges():
    controller = load_robot_controller()
    assert WIRE.names == [joint.name for joint in controller.joints]
    for ours, theirs in zip(WIRE.joints, controller.joints, strict=True):
        assert abs(ours.at_100 - ours.at_0) == theirs.range_degrees


def test_a_command_is_a_set_point_of_each_chamber():
    packet = CODEC.write_command(np.full(2 * N, 101.3e3 + 400e3))
    assert packet == b" ".join([b"170"] * 2 * N)
    # 255 is 600 kPa gauge; joint by joint, chamber a before b.
    levels = ["0", "0"] * N
    levels[10:12] = ["255", "51"]
    got = CODEC.read_command(" ".join(levels).encode()) - 101.3e3
    wanted = np.zeros(2 * N)
    wanted[5], wanted[N + 5] = 600e3, 120e3
    np.testing.assert_allclose(got, wanted, atol=1e-6)


@given(pressures(101.3e3, 701.3e3))
def test_a_set_point_comes_back_to_half_a_command(values):
    pressure = np.array(values)
    got = CODEC.read_command(CODEC.write_command(pressure))
    assert np.max(np.abs(got - pressure)) <= 0.5 * 600e3 / 255 + 1e-6


@given(pressures(101.3e3, 701.3e3), strategies.floats(0.0, 1.0))
def test_what_the_sensors_read_comes_back(values, share):
    lower = np.radians([j.at_0 for j in WIRE.joints])
    upper = np.radians([j.at_100 for j in WIRE.joints])
    q, pressure = lower + share * (upper - lower), np.array(values)
    got_q, got_p = CODEC.read_sensors(CODEC.write_sensors(q, pressure))
    assert np.all(np.abs(got_q - q) <= 0.000501 * (upper - lower))
    assert np.max(np.abs(got_p - pressure)) <= 50.01


def test_sensors_are_told_in_percent_and_gauge_pressure():
    joint = WireJoint("one", at_0=-30.0, at_100=120.0, offset_b=2.0)
    codec = PacketCodec(RobotWire(joints=[joint]))
    packet = codec.write_sensors(
        np.radians([45.0]), np.array([101.3e3, 501.3e3])
    )
    assert packet == b"50.0 0.0 402.0"
    # Beyond its range a sensor stays at its end.
    assert codec.write_sensors(
        np.radians([130.0]), np.array([101.3e3, 501.3e3])
    ).startswith(b"100.0 ")


def test_a_joint_may_count_the_other_way():
    """Percent and chambers are mirrored together, and so is nothing else."""
    straight = WireJoint("one", at_0=0.0, at_100=100.0)
    turned = WireJoint("one", at_0=100.0, at_100=0.0)
    one, other = (
        PacketCodec(RobotWire(joints=[joint])) for joint in (straight, turned)
    )
    q, pressure = np.radians([30.0]), np.array([201.3e3, 501.3e3])
    assert one.write_sensors(q, pressure) == b"30.0 100.0 400.0"
    assert other.write_sensors(q, pressure) == b"70.0 400.0 100.0"
    assert one.write_command(pressure) == b"42 170"
    assert other.write_command(pressure) == b"170 42"
    for codec in (one, other):
        q_back, p_back = codec.read_sensors(codec.write_sensors(q, pressure))
        np.testing.assert_allclose(q_back, q)
        np.testing.assert_allclose(p_back, pressure)


def changed(word, at=3):
    words = GOOD.split()
    words[at] = word
    return b" ".join(words)


NO_COMMANDS = [
    b"",
    b" ",
    b"a" * 40,
    changed(b"x"),
    changed(b"NaN"),
    changed(b"inf"),
    changed(b"1e400"),
    changed(b"1e2"),
    changed(b"7.0"),
    changed(b"-1"),
    changed(b"256"),
    changed(b"9" * 500),
    changed(b"1_0"),
    changed(b"+7"),
    changed(b"--7"),
    changed("٣".encode()),
    changed(b"\xff\xfe"),
    GOOD.rsplit(b" ", 1)[0],
    GOOD + b" 7",
    GOOD.replace(b" ", b","),
    b"7 " * 32768,
    bytes(range(256)) * 4,
    b"__import__('os')",
]


@pytest.mark.parametrize("packet", NO_COMMANDS)
def test_what_is_no_command_is_refused(packet):
    with pytest.raises(PacketError):
        CODEC.read_command(packet)
    assert CODEC.read_levels(GOOD) == [7] * 2 * N


@given(strategies.binary(max_size=200))
def test_any_bytes_are_a_command_or_refused(packet):
    try:
        levels = CODEC.read_levels(packet)
    except PacketError:
        return
    assert len(levels) == 2 * N


def test_commands_beyond_the_range_are_clipped_where_the_wire_says_so():
    codec = PacketCodec(dataclasses.replace(WIRE, out_of_range="clip"))
    assert codec.read_levels(changed(b"-12", 0))[0] == 0
    assert codec.read_levels(changed(b"301", 0))[0] == 255


@pytest.mark.parametrize("word", [b"nan", b"inf", b"140", b"-9", b"1_0", b"x"])
def test_impossible_sensors_are_refused(word):
    packet = CODEC.write_sensors(np.zeros(N), np.full(2 * N, 101.3e3)).split()
    packet[3] = word
    with pytest.raises(PacketError):
        CODEC.read_sensors(b" ".join(packet))
    packet[3] = b"50"
    packet[4] = b"1500" if word == b"nan" else word.replace(b"140", b"-80")
    if word != b"-9":
        with pytest.raises(PacketError):
            CODEC.read_sensors(b" ".join(packet))


def test_a_set_point_that_is_no_number_is_not_sent():
    with pytest.raises(PacketError):
        CODEC.write_command(np.full(2 * N, np.nan))


def test_all_22_joints_fit_in_a_packet():
    wire = load_wire("package://drake_affetto/robot_wire_22.yaml")
    codec = PacketCodec(wire)
    q = np.radians([joint.at_100 for joint in wire.joints])
    packet = codec.write_sensors(q, np.full(44, 701.3e3))
    assert len(packet.split()) == 66
    assert len(packet) <= 1024
    assert len(set(wire.names)) == 22
    assert wire.names[:N] == WIRE.names


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("on_silence: wait", "on_silence is 'wait'"),
        ("out_of_range: drop", "out_of_range is 'drop'"),
        ("command_timeout: 0", "command_timeout is 0"),
        ("command_high: -5", "lower and a greater"),
        ("joints: [{name: a, at_0: 5, at_100: 5}]", "at_100 is 5"),
        ("joints: [{name: a, zero: 5}]", "zero"),
    ],
)
def test_what_is_wrong_with_a_wire_is_named(tmp_path, text, words):
    path = tmp_path / "wire.yaml"
    path.write_text(text + "\n")
    with pytest.raises(InputError, match=words):
        load_wire(path)


def test_active_joints_are_those_of_the_wire_in_their_order():
    with pytest.raises(InputError, match="expected those of"):
        load_wire(joint_names=WIRE.names[::-1])
