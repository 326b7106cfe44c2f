"""Commands that come late, or never."""

import numpy as np
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.primitives import (
    ConstantVectorSource,
    LogVectorOutput,
    TrajectorySource,
)
from pydrake.trajectories import PiecewisePolynomial
import pytest

from drake_affetto.common.errors import InputError
from drake_affetto.faults.command_link import CommandLink

T = 0.005


def carried(lost, delay, end=0.2):
    """Times, and the command t (K,) as it comes through, with its stamp."""
    builder = DiagramBuilder()
    line = PiecewisePolynomial.FirstOrderHold([0.0, 10.0], [[0.0, 10.0]])
    command = builder.AddSystem(TrajectorySource(line))
    ticks = builder.AddSystem(ConstantVectorSource([lost, delay]))
    link = CommandLink.AddToBuilder(
        builder=builder,
        command=command.get_output_port(),
        ticks=ticks.get_output_port(),
        period=T,
        lag=0.001,
    )
    logs = [
        LogVectorOutput(port, builder, publish_period=T)
        for port in (
            link.get_carried_command_output_port(),
            link.get_tick_time_output_port(),
        )
    ]
    diagram = builder.Build()
    simulator = Simulator(diagram)
    simulator.AdvanceTo(end)
    found = [log.FindLog(simulator.get_context()) for log in logs]
    return found[0].sample_times(), *(each.data()[0] for each in found)


def test_without_faults_a_tick_sees_the_command_of_the_one_before():
    t, command, stamp = carried(0.0, 0.0)
    np.testing.assert_allclose(command[2:], t[2:] - T + 0.001, atol=1e-12)
    np.testing.assert_allclose(stamp, command, atol=1e-12)


def test_late_commands_come_in_order():
    t, command, stamp = carried(0.0, 0.03)
    late = command[10:]
    np.testing.assert_allclose(t[10:] - late, 0.034, atol=T + 1e-9)
    assert np.all(np.diff(command) >= 0.0)
    np.testing.assert_allclose(stamp, command, atol=1e-12)


def test_lost_commands_never_come():
    _, command, stamp = carried(1.0, 0.0)
    assert not command.any()
    assert not stamp.any()


def test_what_does_not_fit_is_named():
    with pytest.raises(InputError, match="lag is 0.01"):
        CommandLink(2, T, 0.01)
