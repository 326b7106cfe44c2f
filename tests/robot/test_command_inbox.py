"""The last good command, silence, and who sends."""

import pytest

from drake_affetto.robot.command_inbox import CommandInbox
from drake_affetto.robot.wire import PacketCodec, RobotWire, WireJoint

CODEC = PacketCodec(RobotWire(joints=[WireJoint("one")]))


@pytest.fixture(params=[False, True], ids=["vents", "holds"])
def inbox(request):
    return CommandInbox(CODEC, timeout=1.0, holds=request.param)


def test_all_valves_vent_before_the_first_command(inbox):
    inbox.watch(1e6)
    assert list(inbox.levels) == [0, 0]
    assert inbox.notes == []


def test_the_last_good_command_is_kept(inbox):
    inbox.take(b"10 20", 1, 0.0)
    for packet in (b"", b"1 2 3", b"nan 1", b"256 0", b"\xff"):
        inbox.take(packet, 1, 0.1)
    assert list(inbox.levels) == [10, 20]
    assert (inbox.good, inbox.bad) == (1, 5)


def test_silence_holds_or_vents_and_is_said_once(inbox):
    inbox.take(b"10 20", 1, 0.0)
    inbox.watch(0.99)
    assert list(inbox.levels) == [10, 20]
    inbox.notes.clear()
    # What is no command does not break the silence.
    inbox.take(b"no", 1, 0.9)
    for now in (1.01, 5.0):
        inbox.watch(now)
    assert list(inbox.levels) == ([10, 20] if inbox.holds else [0, 0])
    assert sum("no command for 1 s" in note for note in inbox.notes) == 1
    inbox.take(b"30 40", 1, 6.0)
    inbox.watch(6.5)
    assert list(inbox.levels) == [30, 40]


def test_clients_one_after_the_other_are_not_two_at_once(inbox):
    inbox.take(b"1 1", "first", 0.0)
    inbox.take(b"2 2", "second", 0.1)
    inbox.take(b"1 1", "first", 3.0)
    assert inbox.clients == 3
    assert not any("at once" in note for note in inbox.notes)


def test_two_clients_at_once_are_told_once_and_the_last_packet_counts(inbox):
    for k in range(20):
        inbox.take(b"1 1", "first", 0.03 * k)
        inbox.take(b"2 2", "second", 0.03 * k + 0.01)
    assert sum("at once" in note for note in inbox.notes) == 1
    assert list(inbox.levels) == [2, 2]
    assert inbox.clients == 2
